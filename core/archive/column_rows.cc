#include "core/archive/column_rows.h"

#include "core/archive/row_bytes.h"

namespace dynmesh {
namespace {

absl::string_view AsBytes(absl::Span<const uint8_t> row) {
  return absl::string_view(reinterpret_cast<const char*>(row.data()), row.size());
}

absl::Span<const uint8_t> AsRow(absl::string_view bytes) {
  return absl::MakeConstSpan(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
}

}  // namespace

void ColumnRowWriter::Write(Slot slot) {
  const auto row = column_.Row(slot);
  const uint64_t is_set = row != column_.default_row();
  rows_.Varint(uint64_t{slot - next_} << 1 | is_set);
  const Stamp stamp = column_.stamps().At(slot);
  WriteDifference(stamp, last_stamp_, rows_);
  if (is_set) rows_.Bytes(AsBytes(row));
  next_ = slot + 1;
  last_stamp_ = stamp;
  ++num_rows_;
}

void ColumnRowWriter::AppendTo(size_t column_index, ByteWriter& out) const {
  out.Varint(column_index);
  out.Varint(num_rows_);
  out.Varint(rows_.size());
  out.Bytes(rows_.bytes());
}

bool ReadColumnSection(ByteReader& in, ColumnSection& section) {
  section.column = in.Varint();
  section.num_rows = in.Varint();
  section.bytes = in.Bytes(in.Varint());
  return in.ok() && section.num_rows <= section.bytes.size();
}

bool ColumnRowReader::Read(Slot end, ColumnRow& row) {
  const uint64_t code = in_.Varint();
  if (next_ >= end || code >> 1 >= end - next_) return false;
  row.slot = static_cast<Slot>(next_ + (code >> 1));
  if (!ReadDifference(in_, last_stamp_, row.stamp) || row.stamp < 1 || row.stamp > kMaxStamp) return false;
  row.row = code & 1 ? AsRow(in_.Bytes(column_.spec().row_bytes())) : column_.default_row();
  next_ = uint64_t{row.slot} + 1;
  last_stamp_ = row.stamp;
  return in_.ok() && CheckFinite(column_.spec(), row.row).ok();
}

}  // namespace dynmesh
