#include "core/mesh/relations.h"

namespace dynmesh {

void GetNeighbors(const Mesh& mesh, Relation relation, Slot slot, RowBlock& block, std::vector<Slot>& row) {
  const auto assign = [&](Slot, absl::Span<const Slot> found) { row.assign(found.begin(), found.end()); };
  internal::ForEachRow(mesh, relation, {&slot, 1}, block, assign);
}

void AppendNeighbors(const Mesh& mesh, Relation relation, Slot slot, std::vector<Slot>& out) {
  ForEachRow(mesh, relation, {&slot, 1},
             [&](Slot, absl::Span<const Slot> row) { out.insert(out.end(), row.begin(), row.end()); });
}

CsrTable Neighbors(const Mesh& mesh, Relation relation, absl::Span<const Slot> slots) {
  CsrTable table;
  table.offsets.reserve(slots.size() + 1);
  ForEachRow(mesh, relation, slots, [&](Slot, absl::Span<const Slot> row) {
    table.ids.insert(table.ids.end(), row.begin(), row.end());
    table.offsets.push_back(table.ids.size());
  });
  return table;
}

}  // namespace dynmesh
