#ifndef DYNMESH_CORE_MESH_ATTRIBUTES_H_
#define DYNMESH_CORE_MESH_ATTRIBUTES_H_

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "core/mesh/attribute_spec.h"
#include "core/mesh/ids.h"
#include "core/mesh/stamps.h"

namespace dynmesh {

/// One column: a row of `components` scalars for every slot of its kind, little-endian as in memory.
///
/// A row that was never set, or whose slot got a new occupant, is the default row. Rows are held in pages, so
/// that one row at a far slot costs one page.
class AttributeColumn {
 public:
  /// `born`: revision at which the column was added. REQUIRES: CheckAttributeSpec(spec).ok().
  explicit AttributeColumn(AttributeSpec spec, Stamp born = 0);

  const AttributeSpec& spec() const { return spec_; }
  Stamp born() const { return born_; }

  /// The row at `slot`; for slots beyond what was ever set the default row.
  absl::Span<const uint8_t> Row(Slot slot) const;

  /// That of the spec, zeros where it has none.
  absl::Span<const uint8_t> default_row() const { return default_row_; }

  /// Copies `row` to `slot`. REQUIRES: row.size() == spec().row_bytes().
  void SetRow(Slot slot, absl::Span<const uint8_t> row, Stamp stamp);

  /// Puts back a row and its stamp, as if SetRow had never been called.
  void RestoreRow(Slot slot, absl::Span<const uint8_t> row, Stamp stamp);

  /// Bytes that setting these rows would add to memory_bytes(): whole pages. Cost: sorts the pages.
  size_t BytesToSet(absl::Span<const Slot> slots) const;

  const StampColumn& stamps() const { return stamps_; }
  size_t memory_bytes() const;

 private:
  void CopyRow(Slot slot, absl::Span<const uint8_t> row);
  std::vector<uint8_t> PageOfDefaults() const;

  AttributeSpec spec_;
  Stamp born_;
  std::vector<std::vector<uint8_t>>
      pages_;  ///< rows of StampColumn::kPageSlots slots each; empty: all defaults
  std::vector<uint8_t> default_row_;
  StampColumn stamps_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_ATTRIBUTES_H_
