#include "server/session/session_errors.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"

namespace dynmesh {

absl::Status OutOfMemory() {
  return MakeError(absl::StatusCode::kResourceExhausted, reason::kLimitExceeded,
                   "the server is out of memory", {{"limit", "memory"}});
}

absl::Status ShuttingDown() {
  return MakeError(absl::StatusCode::kUnavailable, reason::kShuttingDown, "the server is shutting down");
}

absl::Status CallCancelled() { return absl::CancelledError("the call was cancelled"); }

absl::Status DeadlinePassed() { return absl::DeadlineExceededError("the call's deadline passed"); }

absl::Status RevisionInFuture(int64_t requested, int64_t actual) {
  return MakeError(absl::StatusCode::kOutOfRange, reason::kRevisionInFuture,
                   absl::StrCat("revision ", requested, " is in the future: the session is at ", actual),
                   {{"requested", absl::StrCat(requested)}, {"actual", absl::StrCat(actual)}});
}

absl::Status RevisionGone(int64_t requested, int64_t oldest) {
  return MakeError(absl::StatusCode::kOutOfRange, reason::kRevisionGone,
                   absl::StrCat("revision ", requested, " is kept no more: the oldest one is ", oldest),
                   {{"requested", absl::StrCat(requested)}, {"oldest", absl::StrCat(oldest)}});
}

absl::Status NoHistory(absl::string_view session) {
  return FailedPrecondition(
      reason::kNoHistory,
      absl::StrCat("session ", session, " is not kept on disk, so only what it is now can be had"),
      {{"session", std::string(session)}});
}

absl::Status SnapshotNotFound(absl::string_view name) {
  return MakeError(absl::StatusCode::kNotFound, reason::kSnapshotNotFound,
                   absl::StrCat("there is no snapshot ", name), {{"snapshot", std::string(name)}});
}

absl::Status BadSnapshotName() {
  return InvalidArgument(
      reason::kBadSnapshotName,
      "a snapshot's name has 1-64 characters of [A-Za-z0-9_.-] and starts with a letter or a digit",
      {{"field", "name"}});
}

absl::Status SnapshotExists(absl::string_view name) {
  return MakeError(absl::StatusCode::kAlreadyExists, reason::kSnapshotExists,
                   absl::StrCat("there is a snapshot ", name, " already"), {{"snapshot", std::string(name)}});
}

absl::Status RevisionMismatch(int64_t expected, int64_t actual) {
  return MakeError(absl::StatusCode::kAborted, reason::kRevisionMismatch,
                   absl::StrCat("the session is at revision ", actual, ", not ", expected),
                   {{"expected", absl::StrCat(expected)}, {"actual", absl::StrCat(actual)}});
}

absl::Status NothingToUndo(uint64_t requested, uint64_t available) {
  return FailedPrecondition(
      reason::kNothingToUndo,
      absl::StrCat(available, " batches can be undone, and ", requested, " were asked for"),
      {{"requested", absl::StrCat(requested)}, {"available", absl::StrCat(available)}});
}

absl::Status NothingToRedo(uint64_t requested, uint64_t available) {
  return FailedPrecondition(
      reason::kNothingToRedo,
      absl::StrCat(available, " batches can be redone, and ", requested, " were asked for"),
      {{"requested", absl::StrCat(requested)}, {"available", absl::StrCat(available)}});
}

absl::Status SessionNotFound(absl::string_view name) {
  return MakeError(absl::StatusCode::kNotFound, reason::kSessionNotFound,
                   absl::StrCat("there is no session ", name), {{"session", std::string(name)}});
}

absl::Status SessionDeleted(absl::string_view name) {
  return MakeError(absl::StatusCode::kNotFound, reason::kSessionDeleted,
                   absl::StrCat("session ", name, " has been deleted"), {{"session", std::string(name)}});
}

absl::Status SessionRecreated(absl::string_view name, absl::string_view expected, absl::string_view actual) {
  return MakeError(
      absl::StatusCode::kAborted, reason::kSessionRecreated,
      absl::StrCat("session ", name, " was deleted, and another one has its name"),
      {{"session", std::string(name)}, {"expected", std::string(expected)}, {"actual", std::string(actual)}});
}

absl::Status ImportIdle(absl::Duration timeout) {
  return MakeError(
      absl::StatusCode::kDeadlineExceeded, reason::kImportIdle,
      absl::StrCat("nothing of the import or restore arrived for ", absl::FormatDuration(timeout)),
      {{"limit", "import_idle_timeout"}});
}

absl::Status BackupIdle(absl::Duration timeout) {
  return MakeError(absl::StatusCode::kDeadlineExceeded, reason::kImportIdle,
                   absl::StrCat("nothing of the backup was read for ", absl::FormatDuration(timeout)),
                   {{"limit", "import_idle_timeout"}});
}

absl::Status SessionDamaged(absl::string_view name) {
  return MakeError(absl::StatusCode::kDataLoss, reason::kInternal,
                   absl::StrCat("an edit of session ", name,
                                " failed half way; a durable session is whole again after a restart of the "
                                "daemon, any other is to be deleted"),
                   {{"session", std::string(name)}});
}

absl::Status SessionLoading(absl::string_view name) {
  return MakeError(absl::StatusCode::kUnavailable, reason::kSessionLoading,
                   absl::StrCat("session ", name, " is being loaded"), {{"session", std::string(name)}});
}

absl::Status NoStore() {
  return FailedPrecondition(reason::kNoStore, "the daemon has no data directory to keep sessions in",
                            {{"field", "durability"}});
}

absl::Status SessionNotEmpty(absl::string_view name, int64_t revision) {
  return FailedPrecondition(
      reason::kSessionNotEmpty,
      absl::StrCat("session ", name, " is at revision ", revision, ", and only a new one can be filled"),
      {{"session", std::string(name)}, {"revision", absl::StrCat(revision)}});
}

absl::Status EtagMismatch(absl::string_view name, absl::string_view etag) {
  return MakeError(absl::StatusCode::kAborted, reason::kEtagMismatch,
                   absl::StrCat("session ", name, " has changed since that etag was given"),
                   {{"session", std::string(name)}, {"etag", std::string(etag)}});
}

absl::Status BadPageToken() {
  return InvalidArgument(reason::kBadPageToken, "page_token is none that this server gave",
                         {{"field", "page_token"}});
}

absl::Status BadField(absl::string_view field, absl::string_view message) {
  return InvalidArgument(reason::kBadArgument, message, {{"field", std::string(field)}});
}

}  // namespace dynmesh
