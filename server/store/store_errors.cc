#include "server/store/store_errors.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"

namespace dynmesh {

absl::Status StoreDamaged(absl::string_view what) {
  return MakeError(absl::StatusCode::kDataLoss, reason::kStoreDamaged,
                   absl::StrCat("the store is damaged: ", what));
}

absl::Status InSession(const absl::Status& status, absl::string_view session) {
  const std::string reason = ErrorReason(status);
  if (reason != reason::kStoreDamaged && reason != reason::kStoreFailed) return status;
  return MakeError(status.code(), reason, absl::StrCat("session ", session, ": ", status.message()),
                   {{"session", std::string(session)}});
}

absl::Status StoreFull(absl::string_view cause) {
  return MakeError(absl::StatusCode::kResourceExhausted, reason::kStoreFull,
                   absl::StrCat("the store's disk is full: ", cause));
}

absl::Status StoreFailed(absl::string_view cause) {
  return MakeError(absl::StatusCode::kUnavailable, reason::kStoreFailed,
                   absl::StrCat("the store failed: ", cause));
}

absl::Status StoreReadOnly(const absl::Status& first) {
  const bool full = ErrorReason(first) == reason::kStoreFull;
  return MakeError(full ? first.code() : absl::StatusCode::kFailedPrecondition,
                   full ? reason::kStoreFull : reason::kStoreFailed,
                   absl::StrCat("the store is read-only until it is opened again, since a write failed: ",
                                first.message()),
                   {{"cause", std::string(first.message())}});
}

absl::Status StoreFormatNewer(uint64_t found, uint64_t supported) {
  return FailedPrecondition(
      reason::kStoreFormatNewer,
      absl::StrCat("the store is of format ", found, ", and this build knows formats up to ", supported,
                   ": use the build that wrote it, or a later one"),
      {{"found", absl::StrCat(found)}, {"supported", absl::StrCat(supported)}});
}

absl::Status StoreFormatOlder(uint64_t found, uint64_t supported) {
  return FailedPrecondition(
      reason::kStoreFormatOlder,
      absl::StrCat("the store is of format ", found, ", which was never released; this build knows format ",
                   supported, ": begin with an empty directory"),
      {{"found", absl::StrCat(found)}, {"supported", absl::StrCat(supported)}});
}

absl::Status StoreInUse(absl::string_view directory, absl::string_view pid) {
  return FailedPrecondition(
      reason::kStoreInUse,
      absl::StrCat("the store in ", directory, " is in use by process ", pid.empty() ? "(unknown)" : pid),
      {{"pid", std::string(pid)}});
}

absl::Status StoreTrimmed(int64_t requested, int64_t oldest) {
  return MakeError(absl::StatusCode::kOutOfRange, reason::kStoreTrimmed,
                   absl::StrCat("records after revision ", requested, " were asked for, and those up to ",
                                oldest, " are gone"),
                   {{"requested", absl::StrCat(requested)}, {"oldest", absl::StrCat(oldest)}});
}

absl::Status Fenced(absl::string_view session) {
  return MakeError(absl::StatusCode::kAborted, reason::kFenced,
                   absl::StrCat("session ", session, " has another owner now"),
                   {{"session", std::string(session)}});
}

absl::Status CheckpointOpen(absl::string_view session) {
  return FailedPrecondition(reason::kCheckpointOpen,
                            absl::StrCat("a checkpoint of session ", session, " is being made"),
                            {{"session", std::string(session)}});
}

absl::Status CheckpointNotFound(uint64_t number) {
  return MakeError(absl::StatusCode::kNotFound, reason::kCheckpointNotFound,
                   absl::StrCat("there is no checkpoint ", number, " to be had"),
                   {{"checkpoint", absl::StrCat(number)}});
}

absl::Status BadRevision(int64_t revision, absl::string_view what) {
  return InvalidArgument(reason::kBadArgument, absl::StrCat("revision ", revision, " must be ", what),
                         {{"revision", absl::StrCat(revision)}});
}

absl::Status StoredSessionNotFound(absl::string_view name) {
  return MakeError(absl::StatusCode::kNotFound, reason::kSessionNotFound,
                   absl::StrCat("there is no session ", name), {{"session", std::string(name)}});
}

absl::Status StoredSessionExists(absl::string_view name) {
  return MakeError(absl::StatusCode::kAlreadyExists, reason::kSessionExists,
                   absl::StrCat("there is a session ", name), {{"session", std::string(name)}});
}

absl::Status StoredSessionDeleted(absl::string_view name) {
  return MakeError(absl::StatusCode::kNotFound, reason::kSessionDeleted,
                   absl::StrCat("session ", name, " has been deleted"), {{"session", std::string(name)}});
}

}  // namespace dynmesh
