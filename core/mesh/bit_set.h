#ifndef DYNMESH_CORE_MESH_BIT_SET_H_
#define DYNMESH_CORE_MESH_BIT_SET_H_

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "core/mesh/ids.h"

namespace dynmesh {

/// A growing set of slots with a summary bit for each 64, so that listing a sparse set skips 4096 slots
/// at a time.
///
/// Cost: Test, Set, Clear O(1); Next and ForEach O(members + universe / 4096).
/// Thread safety: that of std::vector.
class BitSet {
 public:
  bool Test(Slot slot) const {
    const size_t word = slot / 64;
    return word < words_.size() && (words_[word] >> (slot % 64) & 1);
  }

  /// Whether all slots of [begin, end) are members. Cost: (end - begin) / 64.
  bool TestAll(Slot begin, Slot end) const {
    if (begin >= end) return true;
    if ((end - 1) / 64 >= words_.size()) return false;
    for (size_t word = begin / 64; word <= (end - 1) / 64; ++word) {
      const Slot base = word * 64;
      uint64_t wanted = ~uint64_t{0};
      if (base < begin) wanted &= ~uint64_t{0} << (begin - base);
      if (end - base < 64) wanted &= (uint64_t{1} << (end - base)) - 1;
      if ((words_[word] & wanted) != wanted) return false;
    }
    return true;
  }

  void Set(Slot slot) {
    const size_t word = slot / 64;
    if (word >= words_.size()) Grow(word);
    const uint64_t bit = uint64_t{1} << (slot % 64);
    count_ += (words_[word] & bit) == 0;
    words_[word] |= bit;
    summary_[word / 64] |= uint64_t{1} << (word % 64);
  }

  void Clear(Slot slot) {
    const size_t word = slot / 64;
    if (word >= words_.size()) return;
    const uint64_t bit = uint64_t{1} << (slot % 64);
    count_ -= (words_[word] & bit) != 0;
    words_[word] &= ~bit;
    if (words_[word] == 0) summary_[word / 64] &= ~(uint64_t{1} << (word % 64));
  }

  /// Makes it {0, ..., count - 1}.
  void Fill(Slot count) {
    const auto fill = [](size_t bits, std::vector<uint64_t>& words) {
      words.assign((bits + 63) / 64, ~uint64_t{0});
      if (bits % 64 != 0) words.back() = (uint64_t{1} << (bits % 64)) - 1;
    };
    fill(count, words_);
    fill(words_.size(), summary_);
    count_ = count;
  }

  void Assign(Slot slot, bool member) { member ? Set(slot) : Clear(slot); }

  /// The smallest member >= slot, or kNoSlot.
  Slot Next(Slot slot) const {
    size_t word = slot / 64;
    if (word >= words_.size()) return kNoSlot;
    if (const uint64_t rest = words_[word] >> (slot % 64); rest != 0) return slot + std::countr_zero(rest);
    word = NextWord(word + 1);
    return word == kNone ? kNoSlot : word * 64 + std::countr_zero(words_[word]);
  }

  /// Calls fn(slot) for each member, ascending. `fn` must not change the set.
  template <typename Fn>
  void ForEach(Fn fn) const {
    for (size_t word = NextWord(0); word != kNone; word = NextWord(word + 1)) {
      for (uint64_t bits = words_[word]; bits != 0; bits &= bits - 1) {
        fn(static_cast<Slot>(word * 64 + std::countr_zero(bits)));
      }
    }
  }

  /// Calls fn(begin, end) for runs of members that follow each other, ascending, at most 64 each.
  template <typename Fn>
  void ForEachRun(Fn fn) const {
    for (size_t word = NextWord(0); word != kNone; word = NextWord(word + 1)) {
      const Slot base = word * 64;
      for (uint64_t bits = words_[word]; bits != 0;) {
        const int begin = std::countr_zero(bits);
        const int end = begin + std::countr_one(bits >> begin);
        fn(base + begin, base + end);
        if (end == 64) break;
        bits = bits >> end << end;
      }
    }
  }

  /// Writes the smallest members >= slot, at most `max_members` of them, to `out`; returns how many. The next
  /// call may go on at the last one + 1. Cost: as Next, but a word at a time.
  size_t Collect(Slot slot, Slot* out, size_t max_members) const {
    size_t count = 0;
    size_t word = slot / 64;
    uint64_t bits = word < words_.size() ? words_[word] >> (slot % 64) << (slot % 64) : 0;
    while (count < max_members) {
      if (bits == 0) {
        word = NextWord(word + 1);
        if (word == kNone) break;
        bits = words_[word];
      }
      const Slot base = word * 64;
      if (bits == ~uint64_t{0} && count + 64 <= max_members) {
        for (Slot i = 0; i < 64; ++i) out[count + i] = base + i;
        count += 64;
        bits = 0;
        continue;
      }
      for (; bits != 0 && count < max_members; bits &= bits - 1) out[count++] = base + std::countr_zero(bits);
    }
    return count;
  }

  /// Makes `members` all members, ascending. Cost: the members, and a step for each 64 slots near them.
  void ListMembers(std::vector<Slot>& members) const {
    members.resize(count_ + 8);  // each step writes eight, of which it keeps some
    Slot* out = members.data();
    for (size_t word = NextWord(0); word != kNone; word = NextWord(word + 1)) {
      const uint64_t bits = words_[word];
      for (int byte = 0; byte < 8; ++byte) {  // all of them: where a word ends cannot be foreseen
        const unsigned present = bits >> (8 * byte) & 255;
        const Slot base = word * 64 + 8 * byte;
        EightSlots places;
        std::memcpy(&places, kPlaces[present].data(), sizeof(places));
        places += base;
        std::memcpy(out, &places, sizeof(places));
        out += kSizes[present];
      }
    }
    members.resize(count_);
  }

  uint32_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  size_t memory_bytes() const { return (words_.size() + summary_.size()) * sizeof(uint64_t); }

 private:
  static constexpr size_t kNone = ~size_t{0};

  /// Where the bits of a byte are set; then zeros.
  using Places = std::array<Slot, 8>;
  static constexpr std::array<Places, 256> MakePlaces() {
    std::array<Places, 256> all{};
    for (int byte = 0; byte < 256; ++byte) {
      int count = 0;
      for (Slot bit = 0; bit < 8; ++bit) {
        if (byte >> bit & 1) all[byte][count++] = bit;
      }
    }
    return all;
  }
  static constexpr std::array<uint8_t, 256> MakeSizes() {
    std::array<uint8_t, 256> sizes{};
    for (int byte = 0; byte < 256; ++byte) sizes[byte] = std::popcount(static_cast<unsigned>(byte));
    return sizes;
  }
  static const std::array<Places, 256> kPlaces;
  static const std::array<uint8_t, 256> kSizes;

  using EightSlots = Slot __attribute__((vector_size(8 * sizeof(Slot))));

  [[gnu::noinline]] void Grow(size_t word) {
    words_.resize(word + 1);
    summary_.resize(word / 64 + 1);
  }

  /// The first non-zero word at or after `word`, or kNone.
  size_t NextWord(size_t word) const {
    size_t index = word / 64;
    if (index >= summary_.size()) return kNone;
    uint64_t bits = summary_[index] >> (word % 64) << (word % 64);
    while (bits == 0) {
      if (++index == summary_.size()) return kNone;
      bits = summary_[index];
    }
    return index * 64 + std::countr_zero(bits);
  }

  std::vector<uint64_t> words_;
  std::vector<uint64_t> summary_;
  uint32_t count_ = 0;
};

inline constexpr std::array<BitSet::Places, 256> BitSet::kPlaces = BitSet::MakePlaces();
inline constexpr std::array<uint8_t, 256> BitSet::kSizes = BitSet::MakeSizes();

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_BIT_SET_H_
