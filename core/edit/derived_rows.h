#ifndef DYNMESH_CORE_EDIT_DERIVED_ROWS_H_
#define DYNMESH_CORE_EDIT_DERIVED_ROWS_H_

#include <cstdint>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/edit/patch.h"
#include "core/edit/polygon.h"
#include "core/edit/row_writer.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Attributes of the edges and faces at a patch's cuts and mergers, which end with the elements that need
/// them, for those that follow from them:
///
///     cut a-b at m          the halves of the edge take its row, the parts of a face at it that face's
///     `gone` becomes `kept` an edge or face of `gone` passes its row on to the one with `kept`; where that
///                           was there already, the policy chooses, and it has all the weight
///
/// Nothing is looked for where the mesh has no column of edges or of faces.
class DerivedRows {
 public:
  /// Keeps what is to be passed on. `new_vertices`: ids of those of the patch.
  /// REQUIRES: these are placed, and no element is replaced yet. Cost: linear in the stars, times look-ups.
  DerivedRows(const Mesh& mesh, const Patch& patch, absl::Span<const VertexId> new_vertices);

  /// Passes it on to those that are there now. REQUIRES: the elements are replaced. Errors: those of
  /// RowWriter.
  absl::Status PassOn(RowWriter& writer) const;

 private:
  struct Row {
    uint32_t heir;
    int column;
    size_t begin;  ///< in pool_
  };

  void Keep(const Patch::Cut& cut, VertexId middle);
  void Keep(const Patch::Merger& merger);
  void Keep(EntityId parent, const Polygon& heir);
  Slot Find(const Polygon& heir) const;

  const Mesh& mesh_;
  const absl::InlinedVector<int, 4> edge_columns_, face_columns_;
  std::vector<Polygon> heirs_;
  std::vector<Row> rows_;
  RowPool pool_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_DERIVED_ROWS_H_
