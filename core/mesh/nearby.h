#ifndef DYNMESH_CORE_MESH_NEARBY_H_
#define DYNMESH_CORE_MESH_NEARBY_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/container/flat_hash_map.h"
#include "absl/container/inlined_vector.h"
#include "core/mesh/cell_parts.h"
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
  static constexpr size_t kFew = 192;  ///< the parts of nearly all stars, and of what takes their place
  static constexpr size_t kPlaces = 512;

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

  /// Adds a face of the mesh; a duplicate is left out. Whether it was not there yet.
  bool Gather(FaceId f) {
    const uint64_t key = KeyOf(mesh_.Vertices(f));
    const bool known = faces_.Find(key, [f](Slot other) { return other == f.slot(); }) != nullptr;
    if (known || mesh_.IsDuplicate(f)) return false;
    faces_.Add({key, f.slot(), false});
    return true;
  }
  /// Adds its edges. Cells find theirs by their faces, and do not need that.
  void GatherEdges(FaceId f) {
    for (EdgeId e : mesh_.Edges(f)) {
      const uint64_t key = KeyOf(mesh_.Vertices(e)[0], mesh_.Vertices(e)[1]);
      if (edges_.Find(key, Any) == nullptr && !mesh_.IsDuplicate(e)) edges_.Add({key, e.slot(), false});
    }
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

  /// The face with these vertices, if it is known here.
  FaceMatch FindFace(VertexSpan vertices) const { return FindFace(vertices, KeyOf(vertices)); }

  /// Edges and faces of a new cell; those that are neither known here nor in the mesh stay invalid.
  void FindParts(const ElementTemplate& shape, VertexSpan cell, CellParts& parts) {
    FindFaces(shape, cell, parts);
    uint32_t new_edges = 0;  // a bit for each
    for (int e = 0; e < shape.num_edges; ++e) {
      if (parts.edges[e].valid()) continue;
      const LocalEdge& ends = shape.edges[e];
      const EdgeMatch match = FindEdge(cell[ends.vertices[0]], cell[ends.vertices[1]]);
      parts.edges[e] = match.edge;
      new_edges |= uint32_t{match.is_new} << e;
    }
    parts.all_looked_for = true;
    for (int i = 0; i < shape.num_faces; ++i) {
      if (!parts.faces[i].face.valid()) parts.faces[i] = FindFarFace(shape.faces[i], cell, parts, new_edges);
    }
  }

 private:
  static bool Any(Slot) { return true; }

  static uint64_t KeyOf(VertexId a, VertexId b) {
    return uint64_t{std::min(a, b).slot()} << 32 | std::max(a, b).slot();
  }

  /// Equal cycles have equal sums of terms: hardly any others do.
  static uint64_t KeyOf(VertexSpan vertices) {
    uint64_t key = 0;
    for (VertexId v : vertices) key += TermOf(v);
    return key;
  }
  static uint64_t TermOf(VertexId v) {
    const uint64_t term = (v.slot() + uint64_t{1}) * 0x9e3779b97f4a7c15u;
    return (term ^ term >> 32) * 0xd6e8feb86659fd93u;
  }

  FaceMatch FindFace(VertexSpan vertices, uint64_t key) const {
    absl::optional<FaceCode> code;
    const auto* known = faces_.Find(key, [&](Slot slot) {
      code = MatchFace(mesh_.Vertices(FaceId(slot)), vertices);
      return code.has_value();
    });
    return known != nullptr ? FaceMatch{FaceId(known->slot), *code} : FaceMatch();
  }

  /// The faces of a new cell that are known here, and their edges.
  void FindFaces(const ElementTemplate& shape, VertexSpan cell, CellParts& parts) const {
    std::array<uint64_t, kMaxElementVertices> terms;
    for (size_t k = 0; k < cell.size(); ++k) terms[k] = TermOf(cell[k]);
    for (int i = 0; i < shape.num_faces; ++i) {
      uint64_t key = 0;
      for (int k = 0; k < shape.faces[i].size; ++k) key += terms[shape.faces[i].vertices[k]];
      parts.faces[i] = FindFace(FaceVertices(shape.faces[i], cell).span(), key);
      if (parts.faces[i].face.valid()) parts.TakeEdges(shape, i, mesh_.Edges(parts.faces[i].face));
    }
  }

  /// A face that is not known here, and so has no new edge, if the mesh has it.
  FaceMatch FindFarFace(const LocalFace& face, VertexSpan cell, const CellParts& parts,
                        uint32_t new_edges) const {
    FaceEdges edges;
    for (int k = 0; k < face.size; ++k) {
      if (new_edges >> face.edges[k] & 1) return {};
      edges[k] = parts.edges[face.edges[k]];
    }
    return mesh_.FindFaceAround(mesh_.LeastUsed(absl::MakeConstSpan(edges.data(), face.size)),
                                FaceVertices(face, cell).span());
  }

  const Mesh& mesh_;
  NearTable edges_;  ///< by their ends, lower first
  NearTable faces_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_NEARBY_H_
