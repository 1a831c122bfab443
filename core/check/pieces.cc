#include "core/check/pieces.h"

#include <algorithm>
#include <numeric>

namespace dynmesh {
namespace {

constexpr uint32_t kTurnBit = 0x80000000u;

constexpr uint32_t Pack(uint32_t item, uint32_t turn) { return item | turn << 31; }
constexpr uint32_t ItemOf(uint32_t link) { return link & ~kTurnBit; }
constexpr uint32_t TurnOf(uint32_t link) { return link >> 31; }

}  // namespace

Pieces::Pieces(size_t n) : links_(n), num_pieces_(n) { std::iota(links_.begin(), links_.end(), 0); }

Pieces::Root Pieces::Follow(uint32_t item) {
  Root root{item, 0};
  while (ItemOf(links_[root.item]) != root.item) {
    root.turn ^= TurnOf(links_[root.item]);
    root.item = ItemOf(links_[root.item]);
  }
  // The way there is short next time.
  for (uint32_t turn = root.turn; item != root.item;) {
    const uint32_t link = links_[item];
    links_[item] = Pack(root.item, turn);
    turn ^= TurnOf(link);
    item = ItemOf(link);
  }
  return root;
}

bool Pieces::Join(uint32_t a, uint32_t b, Turn turn) {
  const Root first = Follow(a), second = Follow(b);
  const uint32_t between = first.turn ^ second.turn ^ static_cast<uint32_t>(turn);
  if (first.item == second.item) return between == 0;
  const auto [low, high] = std::minmax(first.item, second.item);
  links_[high] = Pack(low, between);
  --num_pieces_;
  return true;
}

size_t GroupedSlots::CountPieces() const {
  std::vector<Slot> distinct = slots_;
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  const auto index = [&](size_t i) -> uint32_t {
    return std::lower_bound(distinct.begin(), distinct.end(), slots_[i]) - distinct.begin();
  };
  Pieces pieces(distinct.size());
  for (size_t g = 0; g < starts_.size(); ++g) {
    const size_t end = g + 1 < starts_.size() ? starts_[g + 1] : slots_.size();
    for (size_t i = starts_[g] + 1; i < end; ++i) pieces.Join(index(i - 1), index(i));
  }
  return pieces.num_pieces();
}

}  // namespace dynmesh
