#ifndef DYNMESH_CORE_ARCHIVE_PART_H_
#define DYNMESH_CORE_ARCHIVE_PART_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/codec/bytes.h"
#include "core/mesh/error.h"
#include "core/mesh/ids.h"

/// The outer form of heads, pages and records, and how they fail. See FORMAT.md.
namespace dynmesh {

/// The newest format that this build reads, and the one that it writes.
inline constexpr int kArchiveFormat = 1;

/// What a part is. The values are stored on disk: never renumber.
enum class ArchivePart : uint8_t { kHead = 'H', kPage = 'P', kRecord = 'R' };

/// Magic, kind of part and format.
void BeginPart(ArchivePart part, ByteWriter& out);

/// The whole part: its bytes so far, and their hash.
std::string SealPart(ByteWriter out);

/// What stands between the begin of a part and its seal; borrows `bytes`.
/// Errors: FAILED_PRECONDITION ARCHIVE_FORMAT_NEWER; DATA_LOSS ARCHIVE_DAMAGED.
absl::StatusOr<absl::string_view> OpenPart(ArchivePart part, absl::string_view bytes);

/// DATA_LOSS ARCHIVE_DAMAGED: `what` is a full sentence about an archive.
absl::Status ArchiveDamaged(absl::string_view what, ErrorMetadata metadata = {});

/// The same, naming an entity: "face 7 " + `what`.
absl::Status EntityDamaged(EntityId id, absl::string_view what);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ARCHIVE_PART_H_
