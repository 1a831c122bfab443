#ifndef DYNMESH_CORE_CODEC_ZSTD_FRAME_H_
#define DYNMESH_CORE_CODEC_ZSTD_FRAME_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

/// The only place that calls zstd. Throws std::bad_alloc when memory runs out.
namespace dynmesh {

/// `bytes` as one zstd frame that says its content size.
std::string CompressFrame(absl::string_view bytes);

/// The same, with a new block wherever a part of `part_bytes` ends, so that no two parts share statistics.
/// REQUIRES: bytes.size() is a multiple of part_bytes.
std::string CompressFrameInParts(absl::string_view bytes, size_t part_bytes);

/// What `frame` claims that its content has; more than 2^63 if it claims nothing.
uint64_t FrameContentBytes(absl::string_view frame);

/// The content of `frame`, which must be exactly one frame that claims between min_bytes and max_bytes.
/// Errors: DATA_LOSS CORRUPT_PAYLOAD. Cost: memory of at most max_bytes.
absl::StatusOr<std::string> DecompressFrame(absl::string_view frame, uint64_t min_bytes, uint64_t max_bytes);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_ZSTD_FRAME_H_
