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
  const size_t page = slot / StampColumn::kPageSlots;
  if (page >= pages_.size() || pages_[page].empty()) return zeros_;
  return absl::MakeConstSpan(pages_[page])
      .subspan(slot % StampColumn::kPageSlots * zeros_.size(), zeros_.size());
}

void AttributeColumn::SetRow(Slot slot, absl::Span<const uint8_t> row, Stamp stamp) {
  CopyRow(slot, row);
  stamps_.Touch(slot, stamp);
}

void AttributeColumn::RestoreRow(Slot slot, absl::Span<const uint8_t> row, Stamp stamp) {
  CopyRow(slot, row);
  stamps_.Restore(slot, stamp);
}

size_t AttributeColumn::memory_bytes() const {
  size_t bytes = stamps_.memory_bytes() + pages_.size() * sizeof(pages_[0]);
  for (const auto& page : pages_) bytes += page.size();
  return bytes;
}

size_t AttributeColumn::BytesToSet(absl::Span<const Slot> slots) const {
  std::vector<Slot> missing;
  Slot end = 0;
  for (Slot slot : slots) {
    const Slot page = slot / StampColumn::kPageSlots;
    if (page >= pages_.size() || pages_[page].empty()) missing.push_back(page);
    end = std::max(end, slot + 1);
  }
  std::sort(missing.begin(), missing.end());
  const size_t num_missing = std::unique(missing.begin(), missing.end()) - missing.begin();
  const size_t stamps =
      (size_t{end} + StampColumn::kPageSlots - 1) / StampColumn::kPageSlots * StampColumn::kPageSlots;
  const size_t new_stamps = stamps > stamps_.size() ? stamps - stamps_.size() : 0;
  return num_missing * StampColumn::kPageSlots * zeros_.size() + new_stamps * sizeof(Stamp);
}

void AttributeColumn::CopyRow(Slot slot, absl::Span<const uint8_t> row) {
  assert(row.size() == zeros_.size());
  const size_t page = slot / StampColumn::kPageSlots;
  if (page >= pages_.size()) pages_.resize(page + 1);
  if (pages_[page].empty()) pages_[page].resize(StampColumn::kPageSlots * row.size());
  std::copy(row.begin(), row.end(), pages_[page].begin() + slot % StampColumn::kPageSlots * row.size());
}

}  // namespace dynmesh
