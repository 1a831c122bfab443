#ifndef DYNMESH_CORE_CODEC_DRACO_GATE_H_
#define DYNMESH_CORE_CODEC_DRACO_GATE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

/// Streams of symbols as Draco point clouds. Draco trusts its input and its caller; this gate does not:
/// a blob is only decoded after all of its bytes before the entropy-coded ones turned out to be what
/// DracoEncode writes for that many symbols.
namespace dynmesh {

/// Draco takes memory and time in proportion to the largest symbol, so there is a largest one.
inline constexpr uint32_t kDracoSymbolLimit = 1u << 17;

/// `symbols` as a sequential point cloud of one GENERIC int32 attribute, in order; symbol s is stored as the
/// int32 whose zigzag code is s, because Draco codes the zigzag of what it is given.
/// REQUIRES: all symbols < kDracoSymbolLimit.
/// Errors: INTERNAL where Draco refuses, throws, or writes another header than expected; n = 0 included.
absl::StatusOr<std::string> DracoEncode(absl::Span<const uint32_t> symbols);

/// Appends the `count` symbols of the blob at the front of `bytes` to `symbols`, and takes it off.
/// Errors: DATA_LOSS CORRUPT_PAYLOAD. Throws std::bad_alloc only.
/// Cost: about 16 bytes of memory a symbol while it runs, and 8 MB for tables.
absl::Status DracoDecode(absl::string_view& bytes, size_t count, std::vector<uint32_t>& symbols);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_DRACO_GATE_H_
