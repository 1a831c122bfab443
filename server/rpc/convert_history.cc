#include "server/rpc/convert_history.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/rpc/convert.h"
#include "server/rpc/convert_sessions.h"

namespace dynmesh {
namespace {

v1::RevisionKind FromCall(LoggedCall call) {
  switch (call) {
    case LoggedCall::kEdit:
      return v1::REVISION_KIND_EDIT;
    case LoggedCall::kUndo:
      return v1::REVISION_KIND_UNDO;
    case LoggedCall::kRedo:
      return v1::REVISION_KIND_REDO;
    case LoggedCall::kRepair:
      return v1::REVISION_KIND_REPAIR;
    case LoggedCall::kAdaptation:
      return v1::REVISION_KIND_ADAPTATION;
    case LoggedCall::kImport:
      return v1::REVISION_KIND_IMPORT;
    case LoggedCall::kRestore:
      return v1::REVISION_KIND_RESTORATION;
    case LoggedCall::kCreation:
      return v1::REVISION_KIND_CREATION;
  }
  return v1::REVISION_KIND_UNSPECIFIED;
}

}  // namespace

HistoryOptions ToHistoryOptions(const v1::RestoreSessionRequest& request) {
  HistoryOptions options;
  if (request.has_if_revision()) options.if_revision = request.if_revision();
  options.request_id = request.request_id();
  options.validate_only = request.validate_only();
  options.note = ToNote(request.note());
  return options;
}

v1::Revision FromRevisionInfo(const RevisionInfo& info) {
  v1::Revision message;
  message.set_revision(info.revision);
  message.set_kind(FromCall(info.call));
  *message.mutable_note() = FromNote(info.note);
  *message.mutable_commit_time() = FromTime(info.commit_time);
  message.set_size_bytes(info.bytes);
  message.set_request_id(info.request_id);
  return message;
}

v1::Snapshot FromSnapshot(const Snapshot& snapshot) {
  v1::Snapshot message;
  message.set_name(snapshot.name);
  message.set_revision(snapshot.revision);
  *message.mutable_create_time() = FromTime(snapshot.create_time);
  *message.mutable_note() = FromNote(snapshot.note);
  return message;
}

void FromRestoration(const HistoryResult& result, v1::RestoreSessionResponse* response) {
  response->set_revision(result.revision);
  response->set_target_revision(result.target_revision);
  *response->mutable_checksum() = FromChecksum(result.checksum);
  *response->mutable_counts() = FromCounts(ToKindCounts(result.counts));
  response->set_undoable_batches(result.undoable_batches);
  response->set_redoable_batches(result.redoable_batches);
}

std::string ToRevisionToken(int64_t last) { return ToPageToken(absl::StrCat(last)); }

absl::StatusOr<int64_t> FromRevisionToken(const std::string& token) {
  DYNMESH_ASSIGN_OR_RETURN(const std::string last, FromPageToken(token));
  int64_t revision = 0;
  if (last.empty() || (absl::SimpleAtoi(last, &revision) && revision > 0)) return revision;
  return BadPageToken();
}

}  // namespace dynmesh
