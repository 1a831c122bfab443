#ifndef DYNMESH_CORE_CODEC_CODEC_H_
#define DYNMESH_CORE_CODEC_CODEC_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/delta/delta.h"

/// The wire form of deltas: FORMAT.md beside this file is its byte-exact description.
namespace dynmesh {

/// How sections of integers are packed. The values travel on the wire: never renumber.
enum class Codec : uint8_t {
  kUnspecified = 0,  ///< on encoding: the smallest of the others, section by section
  kRaw = 1,          ///< fixed-width little-endian arrays
  kZstd = 2,         ///< varint symbols through zstd
  kDraco = 3,        ///< symbols through Draco sequential point clouds
};

/// Grid for quantised positions: cell k of an axis stands for origin + k * step. Fixed for a session, so
/// that a vertex that did not move decodes to the same bits in every message.
struct QuantizationGrid {
  Point origin = {0, 0, 0};
  double step = 0;  ///< 0: positions are not quantised
  int bits = 0;     ///< 1-30; grid indices outside [0, 2^bits) are clamped
};

/// The cubic grid of `bits` bits an axis over the box [low, high]. A box of one point gets step 1.
/// REQUIRES: 1 <= bits <= 30; the box and its extent are finite.
QuantizationGrid MakeGrid(const Point& low, const Point& high, int bits);

struct EncodeOptions {
  Codec codec = Codec::kUnspecified;
  QuantizationGrid grid;  ///< step 0: positions are lossless float64
};

/// Sizes in bytes of what went into a message, for statistics. Topology is elements and removals, geometry
/// the slots and positions of upserted vertices; header, seal and padding are none of these.
struct EncodeStats {
  uint64_t raw_topology_bytes = 0;   ///< as fixed-width arrays (4 B a slot, 4 B a corner, 1 B a type)
  uint64_t raw_geometry_bytes = 0;   ///< as fixed-width arrays (4 B a slot, 24 B a position)
  uint64_t topology_bytes = 0;       ///< as encoded, with their entries in the section table
  uint64_t geometry_bytes = 0;
  uint64_t attribute_bytes = 0;
};

/// `delta` as bytes. Falls back from Draco to zstd where Draco cannot (n = 0, exceptions), so encoding a
/// valid delta never fails but for memory.
/// REQUIRES: CheckDelta(delta).ok(). Errors: INVALID_ARGUMENT for a grid that is not valid,
/// RESOURCE_EXHAUSTED when memory ran out.
absl::StatusOr<std::string> EncodeDelta(const Delta& delta, const EncodeOptions& options,
                                        EncodeStats* stats = nullptr);

struct DecodeLimits {
  uint64_t max_elements = uint64_t{1} << 28;  ///< per message, upserts and removals, of each kind
  uint64_t max_payload_bytes = uint64_t{1} << 32;
};

/// What a message says, after every check that does not need the receiver's copy.
///
/// Memory is bounded by a fixed multiple of bytes.size(), whatever the bytes claim (FORMAT.md, "Weight");
/// messages of meshes take some ten times their size.
/// Errors: DATA_LOSS CORRUPT_PAYLOAD (damaged or hostile bytes), UNIMPLEMENTED UNSUPPORTED_FORMAT (newer
/// version), RESOURCE_EXHAUSTED (beyond `limits`).
absl::StatusOr<Delta> DecodeDelta(absl::string_view bytes, const DecodeLimits& limits = {});

/// What the envelope says without decoding the sections: cheap, for statistics and tools.
struct DeltaHeader {
  int64_t from_revision = 0;
  int64_t to_revision = 0;
  bool consistent = false;
  int position_bits = 0;  ///< 0: lossless
  Checksum checksum;
};
absl::StatusOr<DeltaHeader> PeekDelta(absl::string_view bytes);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_CODEC_H_
