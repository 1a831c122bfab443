#include "core/mesh/attributes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

bool IsNameByte(char c) { return absl::ascii_isalnum(c) || c == '_' || c == '.' || c == '-'; }

bool IsName(absl::string_view name) {
  return !name.empty() && name.size() <= kMaxAttributeNameBytes &&
         std::all_of(name.begin(), name.end(), IsNameByte);
}

bool IsFiniteAt(absl::Span<const uint8_t> values, size_t offset) {
  double value;
  std::memcpy(&value, values.data() + offset, sizeof(value));
  return std::isfinite(value);
}

absl::Status BadSpec(const AttributeSpec& spec, absl::string_view message) {
  return InvalidArgument(reason::kBadArgument, message, {{"attribute", spec.name}});
}

}  // namespace

absl::Status CheckAttributeSpec(const AttributeSpec& spec) {
  if (!IsName(spec.name)) {
    return InvalidArgument(reason::kBadArgument, "an attribute's name is 1-64 bytes of [A-Za-z0-9_.-]");
  }
  if (static_cast<int>(spec.kind) >= kNumEntityKinds) {
    return BadSpec(spec, "an attribute is of an entity kind");
  }
  if (ScalarBytes(spec.type) == 0) return BadSpec(spec, "an attribute is of type float64 or int32");
  if (spec.components < 1 || spec.components > kMaxAttributeComponents) {
    return BadSpec(spec, absl::StrCat("an attribute has 1-16 components, not ", spec.components));
  }
  return absl::OkStatus();
}

absl::Status CheckFinite(const AttributeSpec& spec, absl::Span<const uint8_t> values) {
  if (spec.type != AttributeType::kFloat64) return absl::OkStatus();
  assert(values.size() % spec.row_bytes() == 0);
  for (size_t offset = 0; offset < values.size(); offset += sizeof(double)) {
    if (IsFiniteAt(values, offset)) continue;
    const std::string row = absl::StrCat(offset / spec.row_bytes());
    return InvalidArgument(reason::kNonFinite,
                           absl::StrCat("row ", row, " of attribute ", spec.name, " is not finite"),
                           {{"attribute", spec.name}, {"index", row}});
  }
  return absl::OkStatus();
}

absl::Span<const uint8_t> AttributeColumn::Row(Slot slot) const {
  const size_t width = spec_.row_bytes();
  const size_t begin = slot * width;
  if (begin >= rows_.size()) return zeros_;
  return absl::MakeConstSpan(rows_).subspan(begin, width);
}

void AttributeColumn::SetRow(Slot slot, absl::Span<const uint8_t> row, Stamp stamp) {
  assert(row.size() == zeros_.size());
  GrowTo(slot);
  std::copy(row.begin(), row.end(), rows_.begin() + slot * row.size());
  stamps_.Touch(slot, stamp);
}

void AttributeColumn::RestoreRow(Slot slot, absl::Span<const uint8_t> row, Stamp stamp) {
  assert(row.size() == zeros_.size());
  GrowTo(slot);
  std::copy(row.begin(), row.end(), rows_.begin() + slot * row.size());
  stamps_.Restore(slot, stamp);
}

size_t AttributeColumn::memory_bytes() const {
  return rows_.capacity() + zeros_.capacity() + stamps_.memory_bytes();
}

void AttributeColumn::GrowTo(Slot slot) {
  const size_t needed = (slot + size_t{1}) * spec_.row_bytes();
  if (rows_.size() < needed) rows_.resize(needed);
}

}  // namespace dynmesh
