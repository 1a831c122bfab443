#ifndef DYNMESH_CORE_MESH_ERROR_H_
#define DYNMESH_CORE_MESH_ERROR_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/optional.h"
#include "absl/types/span.h"
#include "core/mesh/ids.h"

/// Errors of dynmesh: an absl::Status whose payload names a stable reason and what offended.
///
/// Callers match on the reason, never on the text. The RPC layer sends the payload as
/// google.rpc.ErrorInfo{reason, domain "dynmesh", metadata}; Python raises it as attributes.
namespace dynmesh {

/// Reasons, one for each way in which a request can be refused. The strings are part of the API.
namespace reason {
inline constexpr char kEntityRemoved[] = "ENTITY_REMOVED";  // id is gone, or another was born there
inline constexpr char kUnknownEntity[] = "UNKNOWN_ENTITY";  // slot was never used
inline constexpr char kNotAnElement[] = "NOT_AN_ELEMENT";   // derived entity where an element is asked
inline constexpr char kVertexInUse[] = "VERTEX_IN_USE";     // vertex still has incident edges
inline constexpr char kDuplicateElement[] = "DUPLICATE_ELEMENT";
inline constexpr char kNonFinite[] = "NON_FINITE_VALUE";  // NaN or infinite
inline constexpr char kInexactValue[] = "INEXACT_VALUE";  // the column's type cannot hold it
inline constexpr char kBadArrayLength[] = "BAD_ARRAY_LENGTH";
inline constexpr char kBadElementType[] = "BAD_ELEMENT_TYPE";
inline constexpr char kBadEntityKind[] = "BAD_ENTITY_KIND";
inline constexpr char kBadArgument[] = "BAD_ARGUMENT";
inline constexpr char kUnknownAttribute[] = "UNKNOWN_ATTRIBUTE";
inline constexpr char kAttributeExists[] = "ATTRIBUTE_EXISTS";
inline constexpr char kLimitExceeded[] = "LIMIT_EXCEEDED";  // metadata: limit, value, requested
inline constexpr char kRevisionMismatch[] = "REVISION_MISMATCH";
inline constexpr char kConflict[] = "CONFLICT";              // somebody else changed what the batch touches
inline constexpr char kNothingToUndo[] = "NOTHING_TO_UNDO";  // so many batches cannot be undone
inline constexpr char kNothingToRedo[] = "NOTHING_TO_REDO";
inline constexpr char kRevisionInFuture[] = "REVISION_IN_FUTURE";
inline constexpr char kRevisionGone[] = "REVISION_GONE";  // it is kept no more
inline constexpr char kNoHistory[] = "NO_HISTORY";        // the session is not kept on disk
inline constexpr char kSnapshotNotFound[] = "SNAPSHOT_NOT_FOUND";
inline constexpr char kBadSnapshotName[] = "BAD_SNAPSHOT_NAME";
inline constexpr char kSnapshotExists[] = "SNAPSHOT_EXISTS";
inline constexpr char kRequestIdReused[] = "REQUEST_ID_REUSED";  // same id, other content
inline constexpr char kSessionNotFound[] = "SESSION_NOT_FOUND";
inline constexpr char kSessionExists[] = "SESSION_EXISTS";
inline constexpr char kSessionNotEmpty[] = "SESSION_NOT_EMPTY";
inline constexpr char kSessionLoading[] = "SESSION_LOADING";  // its content is being read or first written
inline constexpr char kNoStore[] = "NO_STORE";                // durability without a data directory
inline constexpr char kSessionDeleted[] = "SESSION_DELETED";  // deleted while the call ran
inline constexpr char kSessionRecreated[] = "SESSION_RECREATED";  // another session has the name now
inline constexpr char kEtagMismatch[] = "ETAG_MISMATCH";
inline constexpr char kBadSessionName[] = "BAD_SESSION_NAME";
inline constexpr char kBadPageToken[] = "BAD_PAGE_TOKEN";
inline constexpr char kCountMismatch[] = "COUNT_MISMATCH";  // sent other than announced
inline constexpr char kImportIdle[] = "IMPORT_IDLE";        // nothing arrived, or was read, for too long
inline constexpr char kShuttingDown[] = "SHUTTING_DOWN";
inline constexpr char kCorruptPayload[] = "CORRUPT_PAYLOAD";
inline constexpr char kUnsupportedFormat[] = "UNSUPPORTED_FORMAT";
inline constexpr char kArchiveDamaged[] = "ARCHIVE_DAMAGED";  // metadata: kind, page or ids, where known
inline constexpr char kArchiveFormatNewer[] = "ARCHIVE_FORMAT_NEWER";
inline constexpr char kBackupDamaged[] = "BACKUP_DAMAGED";           // metadata: part, byte
inline constexpr char kBackupFormatNewer[] = "BACKUP_FORMAT_NEWER";  // metadata: found, supported
inline constexpr char kChecksumMismatch[] = "CHECKSUM_MISMATCH";
inline constexpr char kCheckFailed[] = "CHECK_FAILED";  // metadata: check, kind, ids, value, threshold, count
inline constexpr char kInternal[] = "INTERNAL";

// Why an edit operator refuses; the table of operators in core/edit says which gives which.
inline constexpr char kLinkCondition[] = "LINK_CONDITION";  // parts would merge that are none of the edge's
inline constexpr char kBoundary[] = "BOUNDARY";  // only possible inside, or would close the boundary
inline constexpr char kNonManifoldEdge[] = "NON_MANIFOLD_EDGE";
inline constexpr char kNonManifoldFace[] = "NON_MANIFOLD_FACE";
inline constexpr char kNonManifoldVertex[] = "NON_MANIFOLD_VERTEX";  // more than one fan of elements
inline constexpr char kNotSimplex[] = "NOT_SIMPLEX";  // only defined for triangles and tetrahedra
inline constexpr char kDegenerateElement[] = "DEGENERATE_ELEMENT";  // an element there names a vertex twice
inline constexpr char kElementInTheWay[] = "ELEMENT_IN_THE_WAY";  // a wire or dangling face would have to go
inline constexpr char kEdgeExists[] = "EDGE_EXISTS";              // the edge that it would make is there
inline constexpr char kFaceExists[] = "FACE_EXISTS";
inline constexpr char kInconsistentOrientation[] = "INCONSISTENT_ORIENTATION";  // neighbours turn differently
inline constexpr char kTooManyElements[] = "TOO_MANY_ELEMENTS";                 // at the edge
inline constexpr char kWouldInvert[] = "WOULD_INVERT";
inline constexpr char kWouldDegrade[] = "WOULD_DEGRADE";  // quality would fall below what was asked for
inline constexpr char kWouldChangeTopology[] = "WOULD_CHANGE_TOPOLOGY";
}  // namespace reason

/// What offended: ordered key-value pairs, e.g. {"kind","cell"}, {"ids","4,7"}, {"index","12"}.
using ErrorMetadata = std::vector<std::pair<std::string, std::string>>;

struct ErrorDetail {
  std::string reason;
  ErrorMetadata metadata;

  /// Value of `key`, empty when absent.
  absl::string_view Find(absl::string_view key) const;
};

/// A status with a reason. `message` is a full sentence for humans without a full stop.
absl::Status MakeError(absl::StatusCode code, absl::string_view reason, absl::string_view message,
                       ErrorMetadata metadata = {});

/// Shorthands for the commonest codes.
absl::Status InvalidArgument(absl::string_view reason, absl::string_view message,
                             ErrorMetadata metadata = {});
absl::Status FailedPrecondition(absl::string_view reason, absl::string_view message,
                                ErrorMetadata metadata = {});

/// NOT_FOUND, ENTITY_REMOVED or UNKNOWN_ENTITY: `id` is not live.
absl::Status EntityNotFound(absl::string_view reason, EntityId id);

/// RESOURCE_EXHAUSTED naming the limit, its value and what was asked for.
absl::Status LimitExceeded(absl::string_view limit, uint64_t value, uint64_t requested);

/// The same status with one more pair of metadata; unchanged if `status` has no detail or has the key.
absl::Status WithMetadata(const absl::Status& status, absl::string_view key, absl::string_view value);

/// The detail of a status made by MakeError; nullopt for any other.
absl::optional<ErrorDetail> GetErrorDetail(const absl::Status& status);

/// Shorthand for tests and switches: the reason, or "" when there is none.
std::string ErrorReason(const absl::Status& status);

/// "3,5,8": ids for metadata, at most 16, then ",...".
std::string JoinSlots(absl::Span<const Slot> slots);

}  // namespace dynmesh

/// Returns from the enclosing function unless `expr` is OK.
#define DYNMESH_RETURN_IF_ERROR(expr)                                   \
  do {                                                                  \
    if (absl::Status dynmesh_status_ = (expr); !dynmesh_status_.ok()) { \
      return dynmesh_status_;                                           \
    }                                                                   \
  } while (false)

#define DYNMESH_CONCAT_INNER_(a, b) a##b
#define DYNMESH_CONCAT_(a, b) DYNMESH_CONCAT_INNER_(a, b)
#define DYNMESH_ASSIGN_OR_RETURN_IMPL_(result, lhs, expr) \
  auto result = (expr);                                   \
  if (!result.ok()) return std::move(result).status();    \
  lhs = *std::move(result)

/// `DYNMESH_ASSIGN_OR_RETURN(auto x, F())`: x is the value of F(), or its error is returned.
#define DYNMESH_ASSIGN_OR_RETURN(lhs, expr) \
  DYNMESH_ASSIGN_OR_RETURN_IMPL_(DYNMESH_CONCAT_(dynmesh_statusor_, __LINE__), lhs, expr)

#endif  // DYNMESH_CORE_MESH_ERROR_H_
