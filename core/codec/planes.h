#ifndef DYNMESH_CORE_CODEC_PLANES_H_
#define DYNMESH_CORE_CODEC_PLANES_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/codec/codec.h"
#include "core/codec/envelope.h"
#include "core/mesh/attributes.h"

/// Columns of numbers, kept to the bit: differences from row to row, byte by byte of equal weight, zstd.
namespace dynmesh {

/// Rows of `components` scalars each, little-endian.
struct RowShape {
  AttributeType type = AttributeType::kFloat64;
  int components = 1;

  size_t row_bytes() const { return static_cast<size_t>(ScalarBytes(type)) * components; }
};

/// `rows` as byte planes through zstd, or as they are where that is not smaller or `codec` is kRaw.
/// REQUIRES: rows.size() is a multiple of shape.row_bytes(). Throws std::bad_alloc when memory runs out.
Packed PackRows(absl::Span<const uint8_t> rows, const RowShape& shape, Codec codec);

/// The bytes of `section`, exactly section.count of them.
/// Errors: DATA_LOSS CORRUPT_PAYLOAD, also when the count is not a multiple of the row's bytes.
/// Cost: memory of twice section.count, which ReadMessage bounds.
absl::StatusOr<std::vector<uint8_t>> UnpackRows(const Section& section, const RowShape& shape);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_PLANES_H_
