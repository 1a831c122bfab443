#include "core/mesh/inverse_rows.h"

#include <array>

#include "core/mesh/row_block.h"

namespace dynmesh {
namespace {

constexpr uint32_t kFew = 1000;

/// Calls fn(upper, row of lower entities) for every upper entity, ascending.
template <typename Fn>
void ForEachRowBelow(const Mesh& mesh, Relation relation, Fn fn) {
  std::array<Slot, RowBlock::kMaxRows> part;
  RowBlock block;
  for (Slot next = 0;;) {
    const size_t count = mesh.slots(relation.to).live().Collect(next, part.data(), part.size());
    if (count == 0) return;
    block.Gather(mesh, {relation.to, relation.from}, absl::MakeConstSpan(part.data(), count));
    for (size_t i = 0; i < count; ++i) fn(part[i], block.Row(i));
    next = part[count - 1] + 1;
  }
}

}  // namespace

bool InverseRows::Pays(const Mesh& mesh, Relation relation) {
  const bool upward = relation.to > relation.from && relation.to >= EntityKind::kFace;
  const bool listed = Dimension(relation.to) == Dimension(relation.from) + 1;  // the mesh has these lists
  const uint64_t most = uint64_t{mesh.NumLive(relation.to)} * kMaxElementEdges;
  return upward && !listed && mesh.NumLive(relation.to) >= kFew && most < kNoSlot;
}

InverseRows::InverseRows(const Mesh& mesh, Relation relation) {
  const Slot limit = mesh.slots(relation.from).limit();
  begin_.resize(size_t{limit} + 1);
  ForEachRowBelow(mesh, relation, [&](Slot, absl::Span<const Slot> row) {
    for (Slot lower : row) ++begin_[lower + 1];
  });
  for (Slot slot = 0; slot < limit; ++slot) begin_[slot + 1] += begin_[slot];
  ids_ = std::make_unique_for_overwrite<Slot[]>(begin_[limit]);
  end_.assign(begin_.begin(), begin_.end() - 1);
  const bool plain = mesh.IsPlain();
  ForEachRowBelow(mesh, relation, [&](Slot upper, absl::Span<const Slot> row) {
    for (Slot lower : row) {
      uint32_t& end = end_[lower];
      // A degenerate element names what lies below it twice, one time after the other.
      if (!plain && end != begin_[lower] && ids_[end - 1] == upper) continue;
      ids_[end++] = upper;
    }
  });
}

}  // namespace dynmesh
