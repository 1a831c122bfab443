#ifndef DYNMESH_SERVER_SESSION_DURABILITY_LOG_RECORD_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_LOG_RECORD_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/session/durability/revision_note.h"

namespace dynmesh {

/// The kind of call that made a revision: it says what its answer is. Stored: never renumber.
enum class LoggedCall : uint8_t {
  kEdit = 1,
  kUndo = 2,
  kRepair = 3,
  kAdaptation = 4,
  kRedo = 5,
  kRestore = 6,  ///< to an earlier revision
  kImport = 7,
  kCreation = 8,  ///< of a session that began with a mesh
};

/// The request that made a revision, and what it was answered; for retries.
struct LoggedRequest {
  LoggedCall call = LoggedCall::kEdit;
  std::string request_id = {};  ///< empty: nobody asks again
  uint64_t fingerprint = 0;
  std::string answer = {};  ///< answer_codec.h; empty without a request_id
  RevisionNote note = {};
};

/// What a session's store keeps of one revision:
///
///     format (varint, 1)   time of the commit (int64, us since 1970)   call (u8)
///     length (varint) and bytes of the request id   fingerprint (u64)
///     length (varint) and bytes of the answer       of the note's author and message the same
///     the batch (core/archive/record.h), to the end
///
/// Fixed-width fields are little-endian. The store seals it.
struct LogRecord {
  absl::Time commit_time;
  LoggedRequest request;
  absl::string_view batch;  ///< borrowed
};

std::string EncodeLogRecord(const LogRecord& record);

/// Errors: FAILED_PRECONDITION STORE_FORMAT_NEWER; DATA_LOSS STORE_DAMAGED.
absl::StatusOr<LogRecord> DecodeLogRecord(absl::string_view bytes);

/// Where a session came from if not from edits: the revision that no record tells of, because a checkpoint is
/// all there is of it.
struct Origin {
  int64_t revision = 0;
  uint64_t bytes = 0;  ///< of the checkpoint's pages
  absl::Time commit_time;
  LoggedRequest request;
};

/// The value of a session's store that holds its Origin.
inline constexpr char kOriginName[] = "origin";

/// Revision (int64), bytes (u64), and a LogRecord without a batch.
std::string EncodeOrigin(const Origin& origin);
/// Errors: as DecodeLogRecord.
absl::StatusOr<Origin> DecodeOrigin(absl::string_view bytes);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_LOG_RECORD_H_
