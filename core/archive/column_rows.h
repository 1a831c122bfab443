#ifndef DYNMESH_CORE_ARCHIVE_COLUMN_ROWS_H_
#define DYNMESH_CORE_ARCHIVE_COLUMN_ROWS_H_

#include <cstdint>

#include "absl/types/span.h"
#include "core/codec/bytes.h"
#include "core/mesh/attributes.h"

namespace dynmesh {

/// What an attribute column holds at one slot, and since when.
struct ColumnRow {
  Slot slot = 0;
  Stamp stamp = 0;
  absl::Span<const uint8_t> row;
};

/// Collects rows of one column, ascending, and writes them with their number and size, so that a reader can
/// pass over a column that it does not know. See "Rows of columns" in FORMAT.md.
class ColumnRowWriter {
 public:
  /// Slots are told from `begin` on, stamps against `revision`.
  ColumnRowWriter(const AttributeColumn& column, Slot begin, int64_t revision)
      : column_(column), next_(begin), last_stamp_(static_cast<Stamp>(revision)) {}

  void Write(Slot slot);
  bool empty() const { return num_rows_ == 0; }
  void AppendTo(size_t column_index, ByteWriter& out) const;

 private:
  const AttributeColumn& column_;
  Slot next_;
  Stamp last_stamp_;
  uint64_t num_rows_ = 0;
  ByteWriter rows_;
};

/// What AppendTo wrote, not yet looked into; borrows the bytes.
struct ColumnSection {
  uint64_t column = 0;
  uint64_t num_rows = 0;
  absl::string_view bytes;
};

/// False if the bytes are no section, or one of fewer bytes than rows.
bool ReadColumnSection(ByteReader& in, ColumnSection& section);

/// Reads the rows of a section.
class ColumnRowReader {
 public:
  ColumnRowReader(const AttributeColumn& column, Slot begin, int64_t revision, absl::string_view bytes)
      : column_(column), next_(begin), last_stamp_(static_cast<Stamp>(revision)), in_(bytes) {}

  /// The next row, which borrows the bytes. False if it is none: it lies at `end` or beyond, its stamp is
  /// none, its numbers are not finite.
  bool Read(Slot end, ColumnRow& row);
  /// Whether all was read.
  bool done() const { return in_.done(); }

 private:
  const AttributeColumn& column_;
  uint64_t next_;
  Stamp last_stamp_;
  ByteReader in_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ARCHIVE_COLUMN_ROWS_H_
