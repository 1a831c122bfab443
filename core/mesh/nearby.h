#ifndef DYNMESH_CORE_MESH_NEARBY_H_
#define DYNMESH_CORE_MESH_NEARBY_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/mesh/mesh.h"

namespace dynmesh {

/// A hash table of slots for some dozens of entities, which needs no allocation then. Nothing is taken out.
template <typename Key>
class NearTable {
 public:
  struct Entry {
    Key key;
    Slot slot;
    bool is_new;  ///< made since the table is
  };

  NearTable() = default;
  NearTable(const NearTable&) = delete;

  /// The first entry of this key that `matches(slot)`, or nullptr.
  template <typename Matches>
  const Entry* Find(Key key, Matches matches) const {
    for (size_t at = PlaceOf(key); places_[at] != 0; at = (at + 1) & mask_) {
      const Entry& entry = entries_[places_[at] - 1];
      if (entry.key == key && matches(entry.slot)) return &entry;
    }
    return nullptr;
  }

  void Add(const Entry& entry) {
    if (2 * (count_ + 1) > mask_) Grow();
    entries_[count_++] = entry;
    Put(count_);
  }

 private:
  static constexpr size_t kInlined = 128;

  size_t PlaceOf(Key key) const { return (uint64_t{key} * 0x9e3779b97f4a7c15u >> 32) & mask_; }

  /// Files the number-th entry; 0 is an empty place.
  void Put(uint32_t number) {
    size_t at = PlaceOf(entries_[number - 1].key);
    while (places_[at] != 0) at = (at + 1) & mask_;
    places_[at] = number;
  }

  void Grow() {
    std::vector<Entry> entries(mask_ + 1);
    std::copy_n(entries_, count_, entries.begin());
    more_entries_ = std::move(entries);
    more_places_.assign(2 * (mask_ + 1), 0);
    entries_ = more_entries_.data();
    places_ = more_places_.data();
    mask_ = more_places_.size() - 1;
    for (uint32_t number = 1; number <= count_; ++number) Put(number);
  }

  std::array<uint32_t, kInlined> first_places_ = {};
  std::array<Entry, kInlined / 2> first_entries_;
  std::vector<uint32_t> more_places_;  ///< instead of the first ones, once those are too few
  std::vector<Entry> more_entries_;
  uint32_t* places_ = first_places_.data();
  Entry* entries_ = first_entries_.data();
  size_t mask_ = kInlined - 1;
  uint32_t count_ = 0;
};

/// Edges and faces near elements that are replaced: nearly all that the new ones use are among them, or are
/// new themselves, and need not be looked for in the mesh.
///
/// Knows primary edges and faces only, as the mesh's own look-up does. REQUIRES: none of them ends or is made
/// meanwhile but what it is told of.
class Mesh::Nearby {
 public:
  explicit Nearby(const Mesh& mesh) : mesh_(mesh) {}

  /// Adds an entity of the mesh with what is below it; a duplicate is left out. Whether it was not there yet.
  bool Gather(FaceId f) {
    const auto vertices = mesh_.Vertices(f);
    const uint32_t key = SieveOf(vertices);
    const bool known = faces_.Find(key, [f](Slot other) { return other == f.slot(); }) != nullptr;
    if (known || mesh_.IsDuplicate(f)) return false;
    faces_.Add({key, f.slot(), false});
    for (EdgeId e : mesh_.Edges(f)) Gather(e);
    return true;
  }
  bool Gather(EdgeId e) {
    const uint64_t key = KeyOf(mesh_.Vertices(e)[0], mesh_.Vertices(e)[1]);
    if (edges_.Find(key, Any) != nullptr || mesh_.IsDuplicate(e)) return false;
    edges_.Add({key, e.slot(), false});
    return true;
  }

  /// Adds what was just made.
  void AddNew(FaceId f) { faces_.Add({SieveOf(mesh_.Vertices(f)), f.slot(), true}); }
  void AddNew(EdgeId e) { edges_.Add({KeyOf(mesh_.Vertices(e)[0], mesh_.Vertices(e)[1]), e.slot(), true}); }

  struct EdgeMatch {
    EdgeId edge;         ///< as Mesh::FindEdge says
    bool is_new = true;  ///< all its faces are known here; also where there is none
  };
  EdgeMatch FindEdge(VertexId a, VertexId b) {
    if (const auto* entry = edges_.Find(KeyOf(a, b), Any)) return {EdgeId(entry->slot), entry->is_new};
    const EdgeId e = mesh_.FindEdge(a, b);
    if (e.valid()) edges_.Add({KeyOf(a, b), e.slot(), false});
    return {e, !e.valid()};
  }

  /// The face with these vertices. `edges` are its edges, `is_new` whether one of them is.
  FaceMatch FindFace(VertexSpan vertices, absl::Span<const EdgeId> edges, bool is_new) const {
    absl::optional<FaceCode> code;
    const auto* known = faces_.Find(SieveOf(vertices), [&](Slot slot) {
      code = MatchFace(mesh_.Vertices(FaceId(slot)), vertices);
      return code.has_value();
    });
    if (known != nullptr) return {FaceId(known->slot), *code};
    return is_new ? FaceMatch() : mesh_.FindFaceAround(mesh_.LeastUsed(edges), vertices);
  }

 private:
  static bool Any(Slot) { return true; }

  static uint64_t KeyOf(VertexId a, VertexId b) {
    return uint64_t{std::min(a, b).slot()} << 32 | std::max(a, b).slot();
  }

  /// Equal cycles have equal exclusive-ors: few others pass.
  static uint32_t SieveOf(VertexSpan vertices) {
    uint32_t sieve = 0;
    for (VertexId v : vertices) sieve ^= v.slot();
    return sieve;
  }

  const Mesh& mesh_;
  NearTable<uint64_t> edges_;  ///< by their ends, lower first
  NearTable<uint32_t> faces_;  ///< by their sieves
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_NEARBY_H_
