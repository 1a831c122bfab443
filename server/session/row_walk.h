#ifndef DYNMESH_SERVER_SESSION_ROW_WALK_H_
#define DYNMESH_SERVER_SESSION_ROW_WALK_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/bit_set.h"
#include "core/mesh/relations.h"
#include "server/session/query_budget.h"

namespace dynmesh {

/// Rows of neighbours whose cost is known before it arises.
///
/// A row may take far more steps than it has entries: of an edge with 100,000 dangling faces each is asked
/// for its cells, and there are none. So the lengths of the lists on the way are added up and charged first.
/// A short row is then gathered by GetNeighbors; a long one here, list by list, with the neighbours marked in
/// a bit set: so it can stop on the way and needs no memory for those that it meets twice. Thread safety:
/// that of std::vector.
class RowWalk {
 public:
  static constexpr uint64_t kLongRow = uint64_t{1} << 16;

  /// `long_row`: from how many steps on a row is long; tests lower it.
  RowWalk(const Mesh& mesh, Relation relation, QueryBudget& budget, uint64_t long_row = kLongRow)
      : mesh_(mesh), relation_(relation), budget_(budget), long_row_(long_row) {}

  /// Puts into `row` what AppendNeighbors appends. REQUIRES: `slot` is live.
  /// Errors: those of QueryBudget::ChargeSteps.
  absl::Status Walk(Slot slot, std::vector<Slot>& row);

 private:
  uint64_t CountSteps(Slot slot) const;
  uint64_t CountFaces(VertexId v) const;
  uint64_t CountCells(CellId c) const;
  absl::Status WalkLong(Slot slot, std::vector<Slot>& row);
  absl::Status MarkAround(VertexId v);
  absl::Status MarkAround(EdgeId e);
  absl::Status MarkAround(FaceId f);
  absl::Status MarkAround(CellId c);
  template <typename Id>
  absl::Status Mark(absl::Span<const Id> ids);

  const Mesh& mesh_;
  const Relation relation_;
  QueryBudget& budget_;
  const uint64_t long_row_;
  BitSet marked_;  ///< empty between rows
  RowBlock block_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_ROW_WALK_H_
