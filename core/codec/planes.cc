#include "core/codec/planes.h"

#include <cassert>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>

#include "core/codec/bytes.h"
#include "core/codec/symbols.h"
#include "core/codec/zstd_frame.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

constexpr size_t kMinPartBytes = 256;  // shorter planes share zstd's statistics, as its tables cost more

// The unsigned word that ascends with a scalar's value, so that near values have small differences:
// floating-point numbers by sign and bits, integers as their bits.
template <typename Scalar>
struct Words {
  static constexpr bool kIsFloat = std::is_floating_point_v<Scalar>;
  using Word = std::conditional_t<sizeof(Scalar) == 8, uint64_t,
                                  std::conditional_t<sizeof(Scalar) == 4, uint32_t, uint8_t>>;
  static constexpr Word kSign = static_cast<Word>(Word{1} << (8 * sizeof(Word) - 1));

  static Word Order(Word bits) {
    if constexpr (!kIsFloat) return bits;
    return bits & kSign ? static_cast<Word>(~bits) : bits | kSign;
  }
  static Word Unorder(Word key) {
    if constexpr (!kIsFloat) return key;
    return key & kSign ? key & static_cast<Word>(~kSign) : static_cast<Word>(~key);
  }
};

// One component of `num_rows` rows: where it begins in the first row, and the stride between rows.
template <typename Byte>
struct Column {
  Byte* begin;
  size_t stride;
  size_t num_rows;
};

template <typename Scalar>
void SplitColumn(const Column<const uint8_t>& column, char* planes) {
  using Word = typename Words<Scalar>::Word;
  Word previous = 0;
  for (size_t row = 0; row < column.num_rows; ++row) {
    Word word;
    std::memcpy(&word, column.begin + row * column.stride, sizeof(word));
    const Word key = Words<Scalar>::Order(word);
    const Word code = ZigZag<Word>(static_cast<Word>(key - std::exchange(previous, key)));
    for (size_t b = 0; b < sizeof(Word); ++b) {
      planes[b * column.num_rows + row] = static_cast<char>(code >> (8 * b));
    }
  }
}

template <typename Scalar>
void JoinColumn(const char* planes, const Column<uint8_t>& column) {
  using Word = typename Words<Scalar>::Word;
  Word key = 0;
  for (size_t row = 0; row < column.num_rows; ++row) {
    Word code = 0;
    for (size_t b = 0; b < sizeof(Word); ++b) {
      const auto byte = static_cast<uint8_t>(planes[b * column.num_rows + row]);
      code = static_cast<Word>(code | static_cast<Word>(byte) << (8 * b));
    }
    key = static_cast<Word>(key + UnZigZag<Word>(code));
    const Word word = Words<Scalar>::Unorder(key);
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
    WithScalar(shape.type, [&](auto scalar) { SplitColumn<decltype(scalar)>(column, out); });
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
    WithScalar(shape.type, [&](auto scalar) { JoinColumn<decltype(scalar)>(in, column); });
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
