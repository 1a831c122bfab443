#ifndef DYNMESH_SERVER_RPC_CONVERT_EDITS_H_
#define DYNMESH_SERVER_RPC_CONVERT_EDITS_H_

#include <vector>

#include "absl/status/statusor.h"
#include "core/edit/transaction.h"
#include "dynmesh/v1/edits.pb.h"
#include "server/session/session.h"

namespace dynmesh {

/// Errors: INVALID_ARGUMENT with metadata "edit", the index of the edit; RESOURCE_EXHAUSTED LIMIT_EXCEEDED
/// (max_batch_edits).
absl::StatusOr<std::vector<Edit>> ToEdits(const v1::ApplyEditsRequest& request, const Limits& limits);

/// Errors: INVALID_ARGUMENT BAD_ARGUMENT.
absl::StatusOr<ApplyOptions> ToApplyOptions(const v1::ApplyEditsRequest& request);
HistoryOptions ToHistoryOptions(const v1::UndoEditsRequest& request);
HistoryOptions ToHistoryOptions(const v1::RedoEditsRequest& request);

void FromBatchResult(const BatchResult& result, v1::ApplyEditsResponse* response);

void FromHistoryResult(const HistoryResult& result, v1::UndoEditsResponse* response);
void FromHistoryResult(const HistoryResult& result, v1::RedoEditsResponse* response);

/// `status` in band. REQUIRES: !status.ok().
void FromError(const absl::Status& status, v1::EditError* error);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_EDITS_H_
