#include "core/codec/planes.h"

#include <cassert>
#include <cstring>
#include <string>
#include <utility>

#include "core/codec/bytes.h"
#include "core/codec/symbols.h"
#include "core/codec/zstd_frame.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

constexpr size_t kMinPartBytes = 256;  // shorter planes share zstd's statistics, as its tables cost more

// Bits of a float64 as an integer that ascends with its value, so that near values have small differences.
constexpr uint64_t kSign = uint64_t{1} << 63;
uint64_t Order(uint64_t bits) { return bits & kSign ? ~bits : bits | kSign; }
uint64_t Unorder(uint64_t key) { return key & kSign ? key & ~kSign : ~key; }
uint32_t Order(uint32_t bits) { return bits; }
uint32_t Unorder(uint32_t key) { return key; }

// One component of `num_rows` rows: where it begins in the first row, and the stride between rows.
template <typename Byte>
struct Column {
  Byte* begin;
  size_t stride;
  size_t num_rows;
};

template <typename Word>
void SplitColumn(const Column<const uint8_t>& column, char* planes) {
  Word previous = 0;
  for (size_t row = 0; row < column.num_rows; ++row) {
    Word word;
    std::memcpy(&word, column.begin + row * column.stride, sizeof(word));
    const Word key = Order(word);
    const Word code = ZigZag<Word>(key - std::exchange(previous, key));
    for (size_t b = 0; b < sizeof(Word); ++b) {
      planes[b * column.num_rows + row] = static_cast<char>(code >> (8 * b));
    }
  }
}

template <typename Word>
void JoinColumn(const char* planes, const Column<uint8_t>& column) {
  Word key = 0;
  for (size_t row = 0; row < column.num_rows; ++row) {
    Word code = 0;
    for (size_t b = 0; b < sizeof(Word); ++b) {
      code |= static_cast<Word>(static_cast<uint8_t>(planes[b * column.num_rows + row])) << (8 * b);
    }
    key += UnZigZag(code);
    const Word word = Unorder(key);
    std::memcpy(column.begin + row * column.stride, &word, sizeof(word));
  }
}

std::string SplitPlanes(absl::Span<const uint8_t> rows, const RowShape& shape) {
  std::string planes(rows.size(), '\0');
  const size_t width = ScalarBytes(shape.type);
  const size_t num_rows = rows.size() / shape.row_bytes();
  for (int c = 0; c < shape.components; ++c) {
    const Column<const uint8_t> column{rows.data() + c * width, shape.row_bytes(), num_rows};
    char* out = planes.data() + c * width * num_rows;
    width == 8 ? SplitColumn<uint64_t>(column, out) : SplitColumn<uint32_t>(column, out);
  }
  return planes;
}

std::vector<uint8_t> JoinPlanes(absl::string_view planes, const RowShape& shape) {
  std::vector<uint8_t> rows(planes.size());
  const size_t width = ScalarBytes(shape.type);
  const size_t num_rows = rows.size() / shape.row_bytes();
  for (int c = 0; c < shape.components; ++c) {
    const Column<uint8_t> column{rows.data() + c * width, shape.row_bytes(), num_rows};
    const char* in = planes.data() + c * width * num_rows;
    width == 8 ? JoinColumn<uint64_t>(in, column) : JoinColumn<uint32_t>(in, column);
  }
  return rows;
}

}  // namespace

Packed PackRows(absl::Span<const uint8_t> rows, const RowShape& shape, Codec codec) {
  assert(rows.size() % shape.row_bytes() == 0);
  Packed raw{Packing::kRaw, rows.size(), std::string(rows.begin(), rows.end())};
  if (codec == Codec::kRaw || rows.empty()) return raw;
  const std::string planes = SplitPlanes(rows, shape);
  const size_t plane_bytes = rows.size() / shape.row_bytes();
  const size_t part_bytes = plane_bytes < kMinPartBytes ? planes.size() : plane_bytes;
  std::string frame = CompressFrameInParts(planes, part_bytes);
  if (frame.size() >= raw.bytes.size()) return raw;
  return {Packing::kZstd, rows.size(), std::move(frame)};
}

absl::StatusOr<std::vector<uint8_t>> UnpackRows(const Section& section, const RowShape& shape) {
  if (section.count % shape.row_bytes() != 0) return CorruptPayload("a section does not hold whole rows");
  if (section.packing == Packing::kRaw) {
    if (section.bytes.size() != section.count) return CorruptPayload("a raw section is not of its length");
    return std::vector<uint8_t>(section.bytes.begin(), section.bytes.end());
  }
  if (section.packing != Packing::kZstd) return CorruptPayload("rows are packed in an unknown way");
  DYNMESH_ASSIGN_OR_RETURN(const std::string planes,
                           DecompressFrame(section.bytes, section.count, section.count));
  return JoinPlanes(planes, shape);
}

}  // namespace dynmesh
