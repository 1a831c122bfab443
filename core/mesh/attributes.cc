#include "core/mesh/attributes.h"

#include <algorithm>
#include <cassert>

namespace dynmesh {
AttributeColumn::AttributeColumn(AttributeSpec spec, Stamp born)
    : spec_(std::move(spec)), born_(born), default_row_(spec_.default_row) {
  default_row_.resize(spec_.row_bytes());
}

absl::Span<const uint8_t> AttributeColumn::Row(Slot slot) const {
  const size_t page = slot / StampColumn::kPageSlots;
  if (page >= pages_.size() || pages_[page].empty()) return default_row_;
  return absl::MakeConstSpan(pages_[page])
      .subspan(slot % StampColumn::kPageSlots * default_row_.size(), default_row_.size());
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
  return num_missing * StampColumn::kPageSlots * default_row_.size() + new_stamps * sizeof(Stamp);
}

void AttributeColumn::CopyRow(Slot slot, absl::Span<const uint8_t> row) {
  assert(row.size() == default_row_.size());
  const size_t page = slot / StampColumn::kPageSlots;
  if (page >= pages_.size()) pages_.resize(page + 1);
  if (pages_[page].empty()) pages_[page] = PageOfDefaults();
  std::copy(row.begin(), row.end(), pages_[page].begin() + slot % StampColumn::kPageSlots * row.size());
}

std::vector<uint8_t> AttributeColumn::PageOfDefaults() const {
  std::vector<uint8_t> page(StampColumn::kPageSlots * default_row_.size());
  if (spec_.has_zero_default()) return page;
  for (size_t offset = 0; offset < page.size(); offset += default_row_.size()) {
    std::copy(default_row_.begin(), default_row_.end(), page.begin() + offset);
  }
  return page;
}

}  // namespace dynmesh
