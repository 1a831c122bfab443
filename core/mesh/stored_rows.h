#ifndef DYNMESH_CORE_MESH_STORED_ROWS_H_
#define DYNMESH_CORE_MESH_STORED_ROWS_H_

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include "absl/types/span.h"
#include "core/mesh/bit_set.h"
#include "core/mesh/ids.h"
#include "core/mesh/pooled_lists.h"

namespace dynmesh {

/// A relation kept as a table: for each slot its neighbours, ascending, each once.
///
/// A row that would grow beyond kMaxRow is given up: it is *open*, and its readers work it out on demand. So
/// a hub of a million neighbours costs its editors nothing, and a face of n cells no n^2 entries. Cost:
/// Insert and Erase linear in the row. Thread safety: that of std::vector.
class StoredRows {
 public:
  static constexpr uint32_t kMaxRow = 512;
  static constexpr uint64_t kMaxEntries = PooledLists<Slot>::kMaxEntries;

  /// Whether `count` entries more have room within the 32-bit limits.
  bool HasRoom(uint32_t count) const { return rows_.HasRoom(count); }

  bool IsOpen(Slot slot) const { return !open_.empty() && open_.Test(slot); }

  /// REQUIRES: !IsOpen(slot).
  absl::Span<const Slot> Row(Slot slot) const { return rows_.Of(slot); }

  /// Adds `neighbor` unless it is there.
  void Insert(Slot slot, Slot neighbor) {
    if (IsOpen(slot)) return;
    const auto row = rows_.Of(slot);
    const uint32_t at = std::lower_bound(row.begin(), row.end(), neighbor) - row.begin();
    if (at < row.size() && row[at] == neighbor) return;
    if (row.size() == kMaxRow) return Open(slot);
    rows_.PushBack(slot, neighbor, kFirstRoom);
    const auto longer = rows_.MutableOf(slot);
    std::move_backward(longer.begin() + at, longer.end() - 1, longer.end());
    longer[at] = neighbor;
  }

  /// Removes `neighbor` if it is there.
  void Erase(Slot slot, Slot neighbor) {
    if (IsOpen(slot)) return;
    const auto row = rows_.Of(slot);
    const uint32_t at = std::lower_bound(row.begin(), row.end(), neighbor) - row.begin();
    if (at == row.size() || row[at] != neighbor) return;
    const auto entries = rows_.MutableOf(slot);
    std::move(entries.begin() + at + 1, entries.end(), entries.begin() + at);
    rows_.PopBack(slot);
  }

  /// Gives the row up.
  void Open(Slot slot) {
    rows_.Clear(slot);
    open_.Set(slot);
  }

  /// Makes the row empty and stored, for a new occupant of the slot.
  void Reset(Slot slot) {
    rows_.Clear(slot);
    if (!open_.empty()) open_.Clear(slot);
  }

  /// For filling an empty table: room for rows 0, 1, ..., then the entries of each row, ascending.
  void Layout(absl::Span<const uint32_t> lengths) { rows_.Layout(lengths); }
  void Append(Slot slot, Slot neighbor) { rows_.Append(slot, neighbor); }

  size_t memory_bytes() const { return rows_.memory_bytes() + open_.memory_bytes(); }

 private:
  static constexpr uint32_t kFirstRoom = 4;

  PooledLists<Slot> rows_;
  BitSet open_;
};

/// The relation cell->edges as a table of fixed rows.
class CellEdgeRows {
 public:
  absl::Span<const Slot> Row(Slot c) const {
    return absl::MakeConstSpan(&edges_[size_t{c} * stride_], lengths_.empty() ? stride_ : lengths_[c]);
  }

  /// Entries of each row; 0 while they differ, or there are none.
  size_t stride() const { return lengths_.empty() ? stride_ : 0; }
  const Slot* data() const { return edges_.data(); }

  void Put(Slot c, absl::Span<const Slot> edges) {
    if (edges.size() != stride_) PrepareFor(edges.size());
    if (size_t{c} * stride_ >= edges_.size()) edges_.resize((size_t{c} + 1) * stride_, kNoSlot);
    std::copy(edges.begin(), edges.end(), edges_.begin() + size_t{c} * stride_);
    if (lengths_.empty()) return;
    if (c >= lengths_.size()) lengths_.resize(size_t{c} + 1);
    lengths_[c] = edges.size();
  }

  void Reserve(size_t cells, size_t edges_of_cell) { edges_.reserve(cells * edges_of_cell); }
  size_t memory_bytes() const { return edges_.size() * sizeof(Slot) + lengths_.size(); }

 private:
  /// The first cell sets the stride; one of another type makes rows as long as the longest, with lengths
  /// beside.
  void PrepareFor(size_t length) {
    if (stride_ == 0) {
      stride_ = length;
      return;
    }
    const size_t num_rows = edges_.size() / stride_;
    if (lengths_.empty()) lengths_.assign(num_rows, stride_);
    if (length < stride_) return;
    std::vector<Slot> wide(num_rows * length, kNoSlot);
    for (size_t row = 0; row < num_rows; ++row)
      std::copy_n(&edges_[row * stride_], stride_, &wide[row * length]);
    edges_ = std::move(wide);
    stride_ = length;
  }

  size_t stride_ = 0;
  std::vector<Slot> edges_;
  std::vector<uint8_t> lengths_;  ///< empty while all rows are stride_ long
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_STORED_ROWS_H_
