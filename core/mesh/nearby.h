#ifndef DYNMESH_CORE_MESH_NEARBY_H_
#define DYNMESH_CORE_MESH_NEARBY_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/container/flat_hash_map.h"
#include "absl/container/inlined_vector.h"
#include "core/mesh/checksum.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// A hash table of slots, which needs no allocation for some dozens of them. Nothing is taken out.
class NearTable {
 public:
  struct Entry {
    uint64_t key;
    Slot slot;
    bool is_new;  ///< made since the table is
  };

  NearTable() = default;
  NearTable(const NearTable&) = delete;

  /// The first entry of this key that `matches(slot)`, or nullptr.
  template <typename Matches>
  const Entry* Find(uint64_t key, Matches matches) const {
    if (many_ != nullptr) return FindAmongMany(key, matches);
    for (size_t at = PlaceOf(key); places_[at] != 0; at = (at + 1) % kPlaces) {
      const Entry& entry = entries_[places_[at] - 1];
      if (entry.key == key && matches(entry.slot)) return &entry;
    }
    return nullptr;
  }

  void Add(const Entry& entry) {
    if (count_ == kFew) BeginMany();
    if (many_ != nullptr) {
      (*many_)[entry.key].push_back(entry);
      return;
    }
    entries_[count_++] = entry;
    size_t at = PlaceOf(entry.key);
    while (places_[at] != 0) at = (at + 1) % kPlaces;
    places_[at] = count_;
  }

 private:
  static constexpr size_t kFew = 64;
  static constexpr size_t kPlaces = 2 * kFew;

  static size_t PlaceOf(uint64_t key) { return (key * 0x9e3779b97f4a7c15u >> 32) % kPlaces; }

  template <typename Matches>
  const Entry* FindAmongMany(uint64_t key, Matches matches) const {
    const auto it = many_->find(key);
    if (it == many_->end()) return nullptr;
    for (const Entry& entry : it->second) {
      if (matches(entry.slot)) return &entry;
    }
    return nullptr;
  }

  [[gnu::noinline]] void BeginMany() {
    many_ = std::make_unique<Many>();
    for (const Entry& entry : entries_) (*many_)[entry.key].push_back(entry);
    count_ = kFew + 1;
  }

  /// Seeded, so that nobody can choose slots that all fall into one place.
  using Many = absl::flat_hash_map<uint64_t, absl::InlinedVector<Entry, 1>>;

  std::array<uint8_t, kPlaces> places_ = {};  ///< numbers of entries, from 1
  std::array<Entry, kFew> entries_;
  uint32_t count_ = 0;
  std::unique_ptr<Many> many_;  ///< all of them, once those are more than few
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
    const uint64_t key = KeyOf(vertices);
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
  void AddNew(FaceId f) { faces_.Add({KeyOf(mesh_.Vertices(f)), f.slot(), true}); }
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
    const auto* known = faces_.Find(KeyOf(vertices), [&](Slot slot) {
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

  /// Equal cycles have equal sums: hardly any others do.
  static uint64_t KeyOf(VertexSpan vertices) {
    uint64_t key = 0;
    for (VertexId v : vertices) key += Checksum::Mix(v.slot());
    return key;
  }

  const Mesh& mesh_;
  NearTable edges_;  ///< by their ends, lower first
  NearTable faces_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_NEARBY_H_
