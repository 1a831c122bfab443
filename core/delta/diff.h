#ifndef DYNMESH_CORE_DELTA_DIFF_H_
#define DYNMESH_CORE_DELTA_DIFF_H_

#include <array>
#include <cstdint>
#include <vector>

#include "core/delta/delta.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// What changed in `mesh` after revision `from`, as after-images read off the stamps.
///
/// Law: a copy at `from` (or at any state between, or a fuzzy mix of those) with this applied equals `mesh`.
/// REQUIRES: 0 <= from <= mesh.revision(), no batch open. Cost: pages touched since, plus the answer.
Delta Diff(const Mesh& mesh, int64_t from);

/// Diff(mesh, start) for a copy that has `base` for certain and parts of Diff(mesh, base) made since `start`: closes
/// the walk that DiffPart began. REQUIRES: base <= start.
Delta ClosingDiff(const Mesh& mesh, int64_t start, int64_t base);

/// A place in the walk over all slots that DiffPart makes: first vertices, then elements by dimension, then
/// attributes.
struct DiffCursor {
  int stage = 0;      ///< 0-3: kinds of entities; 4: attributes; 5: done
  int column = 0;     ///< of stage 4
  Slot next = 0;      ///< first slot not yet visited
  bool done() const { return stage > 4; }
};

/// The next part of Diff(mesh, from), of at most about `max_items` slots, with consistent = false; moves
/// `cursor` on. The mesh may change between parts: when the cursor is done, ClosingDiff(mesh, start, from), with
/// `start` the revision that the mesh had before the first part, makes the copy exact.
Delta DiffPart(const Mesh& mesh, int64_t from, size_t max_items, DiffCursor& cursor);

/// About how many slots Diff(mesh, from) would hold, at most; counts whole pages. Cost: pages.
size_t DiffSizeBound(const Mesh& mesh, int64_t from);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_DELTA_DIFF_H_
