#ifndef DYNMESH_CORE_MESH_ATTRIBUTES_H_
#define DYNMESH_CORE_MESH_ATTRIBUTES_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/mesh/ids.h"
#include "core/mesh/stamps.h"

namespace dynmesh {

/// Scalar type of an attribute column. The values travel on the wire: never renumber.
enum class AttributeType : uint8_t { kUnspecified = 0, kFloat64 = 1, kInt32 = 2 };

/// Bytes of one scalar: 8 or 4; 0 for kUnspecified.
constexpr int ScalarBytes(AttributeType type) {
  return type == AttributeType::kFloat64 ? 8 : type == AttributeType::kInt32 ? 4 : 0;
}

inline constexpr int kMaxAttributeComponents = 16;
inline constexpr int kMaxAttributeNameBytes = 64;
inline constexpr int kMaxAttributeColumns = 64;

/// What a column is: fixed when it is added.
struct AttributeSpec {
  std::string name;  ///< 1-64 bytes of [A-Za-z0-9_.-]
  EntityKind kind = EntityKind::kVertex;
  AttributeType type = AttributeType::kFloat64;
  int components = 1;  ///< 1-16

  int row_bytes() const { return ScalarBytes(type) * components; }
  friend bool operator==(const AttributeSpec&, const AttributeSpec&) = default;
};

/// INVALID_ARGUMENT if name, type or components are outside what AttributeSpec says.
absl::Status CheckAttributeSpec(const AttributeSpec& spec);

/// INVALID_ARGUMENT NON_FINITE_VALUE naming the first row of `values` that holds NaN or an infinity.
/// REQUIRES: values.size() is a multiple of spec.row_bytes().
absl::Status CheckFinite(const AttributeSpec& spec, absl::Span<const uint8_t> values);

/// One column: a row of `components` scalars for every slot of its kind, little-endian as in memory.
///
/// A row that was never set, or whose slot got a new occupant, is all zeros. Rows are held in pages, so that
/// one row at a far slot costs one page.
class AttributeColumn {
 public:
  /// `born`: revision at which the column was added.
  explicit AttributeColumn(AttributeSpec spec, Stamp born = 0) : spec_(std::move(spec)), born_(born) {}

  const AttributeSpec& spec() const { return spec_; }
  Stamp born() const { return born_; }

  /// The row at `slot`; for slots beyond what was ever set a row of zeros.
  absl::Span<const uint8_t> Row(Slot slot) const;

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

  AttributeSpec spec_;
  Stamp born_;
  std::vector<std::vector<uint8_t>> pages_;  ///< rows of StampColumn::kPageSlots slots each; empty: all zeros
  std::vector<uint8_t> zeros_ = std::vector<uint8_t>(spec_.row_bytes());
  StampColumn stamps_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_ATTRIBUTES_H_
