#ifndef DYNMESH_CORE_MESH_RELATIONS_H_
#define DYNMESH_CORE_MESH_RELATIONS_H_

#include <cstdint>
#include <vector>

#include "absl/types/span.h"
#include "core/mesh/mesh.h"

/// The 16 neighbour relations V/E/F/C -> V/E/F/C (paper, section 4).
///
/// From a higher dimension to a lower one: template order (edges: stored order), an entry for each local
/// vertex, edge or face, so degenerate elements repeat. Otherwise *incident* (lower to higher) or *adjacent*
/// (same dimension) entities, ascending, each once, never the entity itself. Adjacent: vertices through an
/// edge, edges through a vertex, faces through an edge, cells through a face.
namespace dynmesh {

struct Relation {
  EntityKind from;
  EntityKind to;
};

/// Rows of neighbours, as compressed sparse rows: row i is ids[offsets[i] .. offsets[i + 1]).
struct CsrTable {
  std::vector<uint32_t> offsets = {0};
  std::vector<Slot> ids;

  size_t num_rows() const { return offsets.size() - 1; }
  absl::Span<const Slot> Row(size_t i) const {
    return absl::MakeConstSpan(ids).subspan(offsets[i], offsets[i + 1] - offsets[i]);
  }
};

/// Appends the neighbours of `slot` to `out`. REQUIRES: `slot` is live in `mesh`.
void AppendNeighbors(const Mesh& mesh, Relation relation, Slot slot, std::vector<Slot>& out);

/// A row for each of `slots`. REQUIRES: all are live, and the answer has fewer than 2^32 entries.
CsrTable Neighbors(const Mesh& mesh, Relation relation, absl::Span<const Slot> slots);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_RELATIONS_H_
