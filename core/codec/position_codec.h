#ifndef DYNMESH_CORE_CODEC_POSITION_CODEC_H_
#define DYNMESH_CORE_CODEC_POSITION_CODEC_H_

#include <vector>

#include "absl/status/statusor.h"
#include "core/codec/codec.h"
#include "core/codec/envelope.h"
#include "core/mesh/checksum.h"

/// Positions of vertices: to the bit, or as indices into a grid that is fixed for the session.
namespace dynmesh {

/// Adds the sections of `positions`; quantised where options.grid.step > 0.
/// Throws std::bad_alloc when memory runs out.
void EncodePositions(const std::vector<Point>& positions, const EncodeOptions& options,
                     MessageWriter& writer);

/// Takes the sections of `count` positions. Quantised ones are exactly origin + index * step.
/// Errors: DATA_LOSS CORRUPT_PAYLOAD.
absl::StatusOr<std::vector<Point>> DecodePositions(size_t count, const QuantizationGrid& grid,
                                                   SectionReader& sections);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_POSITION_CODEC_H_
