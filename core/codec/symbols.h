#ifndef DYNMESH_CORE_CODEC_SYMBOLS_H_
#define DYNMESH_CORE_CODEC_SYMBOLS_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/codec/codec.h"
#include "core/codec/envelope.h"
#include "core/mesh/ids.h"

/// Streams of uint32 symbols: what slots, corners and grid indices become before they are packed.
namespace dynmesh {

/// `symbols` packed as `codec` asks. kUnspecified tries varints, zstd and, from 500 symbols on, Draco, and
/// keeps the smallest; kZstd and kDraco fall back to plain varints where they would make it larger or
/// cannot pack at all. Throws std::bad_alloc when memory runs out.
Packed PackSymbols(absl::Span<const uint32_t> symbols, Codec codec);

/// `symbols` as an array that needs no arithmetic to read, through zstd where that is smaller and `codec` is
/// not kRaw.
Packed PackArray(absl::Span<const uint32_t> symbols, Codec codec);

/// The symbols of `section`, exactly section.count of them, however they were packed.
/// Errors: DATA_LOSS CORRUPT_PAYLOAD. Cost: memory in proportion to section.count, which ReadMessage bounds.
absl::StatusOr<std::vector<uint32_t>> UnpackSymbols(const Section& section);

/// Ascending slots as symbols: the first slot, then for each next one the number of slots left out between.
Packed PackSlots(absl::Span<const Slot> slots, Codec codec);
absl::StatusOr<std::vector<Slot>> UnpackSlots(const Section& section);

/// The bijection of signed on unsigned integers that keeps small ones small: 0, -1, 1, -2, ...
template <typename Unsigned>
constexpr Unsigned ZigZag(Unsigned difference) {
  return static_cast<Unsigned>((difference << 1) ^
                               (Unsigned{0} - (difference >> (8 * sizeof(Unsigned) - 1))));
}
template <typename Unsigned>
constexpr Unsigned UnZigZag(Unsigned symbol) {
  return static_cast<Unsigned>((symbol >> 1) ^ (Unsigned{0} - (symbol & 1)));
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_SYMBOLS_H_
