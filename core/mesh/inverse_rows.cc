#include "core/mesh/inverse_rows.h"

#include "core/mesh/relations.h"

namespace dynmesh {
namespace {

constexpr uint32_t kFewestRows = 1000;
constexpr Relation kVertexFaces = {EntityKind::kVertex, EntityKind::kFace};
constexpr uint64_t kMaxEntries = uint64_t{1} << 31;

template <typename Fn>
void ForEachLive(const Mesh& mesh, EntityKind kind, Fn fn) {
  mesh.slots(kind).live().ForEach(fn);
}

/// Calls fn(neighbor, slot) for every entry `neighbor` of every row `slot` of vertex->vertices,
/// vertex->faces, vertex->cells or edge->cells, neighbours ascending; perhaps more than once, and for slot =
/// neighbor.
template <typename Fn>
void ForEachEntry(const Mesh& mesh, Relation relation, Fn fn) {
  if (relation.to != relation.from) {
    return ForEachRow(mesh, {relation.to, relation.from}, [&](Slot upper, absl::Span<const Slot> row) {
      for (Slot lower : row) fn(upper, lower);
    });
  }
  ForEachRow(mesh, {EntityKind::kVertex, EntityKind::kEdge}, [&](Slot w, absl::Span<const Slot> edges) {
    for (Slot e : edges) {
      const auto ends = mesh.Vertices(EdgeId(e));
      fn(w, ends[0].slot() ^ ends[1].slot() ^ w);
    }
  });
}

/// No fewer than the entries of each row.
std::vector<uint32_t> RowBounds(const Mesh& mesh, Relation relation) {
  std::vector<uint32_t> bounds(mesh.slots(relation.from).limit());
  if (relation.to == EntityKind::kVertex) {
    ForEachLive(mesh, EntityKind::kVertex,
                [&](Slot v) { bounds[v] = mesh.IncidentEdges(VertexId(v)).size(); });
  } else if (relation == kVertexFaces && mesh.IsPlain()) {  // two edges of each face meet at a vertex of it
    ForEachRow(mesh, {EntityKind::kEdge, EntityKind::kVertex}, [&](Slot e, absl::Span<const Slot> ends) {
      const uint32_t faces = mesh.IncidentFaces(EdgeId(e)).size();
      for (Slot v : ends) bounds[v] += faces;
    });
    for (uint32_t& bound : bounds) bound /= 2;
  } else {
    ForEachEntry(mesh, relation, [&](Slot, Slot slot) { ++bounds[slot]; });
  }
  return bounds;
}

}  // namespace

bool InverseRows::Pays(const Mesh& mesh, Relation relation) {
  const bool listed =
      Dimension(relation.to) == Dimension(relation.from) + 1;  // the mesh has these rows as lists
  const bool upward = relation.to > relation.from && !listed;
  const bool vertices = relation.from == EntityKind::kVertex && relation.to == EntityKind::kVertex;
  const EntityKind walked = vertices ? EntityKind::kEdge : relation.to;
  const uint64_t most = uint64_t{mesh.NumLive(walked)} * kMaxElementEdges;
  return (upward || vertices) && mesh.NumLive(relation.from) >= kFewestRows && most < kMaxEntries;
}

InverseRows::InverseRows(const Mesh& mesh, Relation relation) {
  const std::vector<uint32_t> bounds = RowBounds(mesh, relation);
  begin_.resize(bounds.size());
  uint32_t entries = 0;
  for (size_t slot = 0; slot < bounds.size(); ++slot) {
    begin_[slot] = entries;
    entries += bounds[slot];
  }
  ids_ = std::make_unique_for_overwrite<Slot[]>(entries);
  end_ = begin_;
  if (relation.from == relation.to) {
    ForEachEntry(mesh, relation, [&](Slot neighbor, Slot slot) {
      if (neighbor != slot) Enter(end_[slot], begin_[slot], neighbor);
    });
  } else if (mesh.IsPlain()) {  // an element names nothing twice
    ForEachEntry(mesh, relation, [&](Slot neighbor, Slot slot) { ids_[end_[slot]++] = neighbor; });
  } else {
    ForEachEntry(mesh, relation,
                 [&](Slot neighbor, Slot slot) { Enter(end_[slot], begin_[slot], neighbor); });
  }
}

}  // namespace dynmesh
