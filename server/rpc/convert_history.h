#ifndef DYNMESH_SERVER_RPC_CONVERT_HISTORY_H_
#define DYNMESH_SERVER_RPC_CONVERT_HISTORY_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "dynmesh/v1/history.pb.h"
#include "server/session/revisions.h"
#include "server/session/session.h"

namespace dynmesh {

HistoryOptions ToHistoryOptions(const v1::RestoreSessionRequest& request);

v1::Revision FromRevisionInfo(const RevisionInfo& info);
v1::Snapshot FromSnapshot(const Snapshot& snapshot);
void FromRestoration(const HistoryResult& result, v1::RestoreSessionResponse* response);

/// The last revision of a page of them.
std::string ToRevisionToken(int64_t last);
/// Errors: INVALID_ARGUMENT BAD_PAGE_TOKEN. 0 for an empty token.
absl::StatusOr<int64_t> FromRevisionToken(const std::string& token);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_HISTORY_H_
