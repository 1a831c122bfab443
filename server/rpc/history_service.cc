#include "server/rpc/history_service.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "dynmesh/v1/history.grpc.pb.h"
#include "server/rpc/convert.h"
#include "server/rpc/convert_history.h"
#include "server/rpc/convert_sessions.h"
#include "server/rpc/unary.h"
#include "server/session/budget.h"
#include "server/session/fork.h"
#include "server/session/revisions.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

// A page ends early when its revisions hold this much.
constexpr size_t kMaxListBytes = size_t{1} << 20;

/// Room for a copy of the session's mesh. Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_backup_bytes).
absl::StatusOr<Lease> RoomForCopy(const ServiceContext& services, Session& session) {
  Lease room(services.registry.backup_budget());
  DYNMESH_ASSIGN_OR_RETURN(const uint64_t bytes, session.ReadAs<uint64_t>([](const SessionView& view) {
    return absl::StatusOr<uint64_t>(view.mesh.memory_bytes());
  }));
  DYNMESH_RETURN_IF_ERROR(room.Grow(bytes));
  return room;
}

absl::Status Answer(Session& session, const v1::ListRevisionsRequest& request,
                    v1::ListRevisionsResponse* response) {
  DYNMESH_ASSIGN_OR_RETURN(const int page_size, ToPageSize(request.page_size()));
  DYNMESH_ASSIGN_OR_RETURN(const int64_t before, FromRevisionToken(request.page_token()));
  DYNMESH_RETURN_IF_ERROR(AwaitLoaded(session));
  DYNMESH_ASSIGN_OR_RETURN(const RevisionList list, ListRevisions(session, before, page_size));
  size_t bytes = 0;
  int64_t last = list.oldest;
  for (const RevisionInfo& info : list.revisions) {
    if (bytes > kMaxListBytes) break;
    *response->add_revisions() = FromRevisionInfo(info);
    bytes += response->revisions().rbegin()->ByteSizeLong();
    last = info.revision;
  }
  if (last > list.oldest) response->set_next_page_token(ToRevisionToken(last));
  response->set_oldest_revision(list.oldest);
  response->set_revision(list.last);
  return absl::OkStatus();
}

absl::Status CheckTargetRevision(int64_t revision) {
  return revision >= 0 ? absl::OkStatus() : BadField("revision", "the revision is negative");
}

/// What is to be gone back to, in words: also when the snapshot is there no more, a retry says the same.
std::string TargetOf(const v1::RestoreSessionRequest& request) {
  return request.has_snapshot() ? absl::StrCat("snapshot ", request.snapshot())
                                : absl::StrCat("revision ", request.target_revision());
}

absl::StatusOr<int64_t> TargetRevisionOf(Session& session, const v1::RestoreSessionRequest& request) {
  if (request.has_snapshot()) return FindSnapshotRevision(session, request.snapshot());
  DYNMESH_RETURN_IF_ERROR(CheckTargetRevision(request.target_revision()));
  return request.target_revision();
}

absl::Status Answer(const ServiceContext& services, Session& session,
                    const v1::RestoreSessionRequest& request, const StopSignal& stop,
                    v1::RestoreSessionResponse* response) {
  if (request.target_case() == v1::RestoreSessionRequest::TARGET_NOT_SET) {
    return BadField("target", "neither target_revision nor snapshot says what to go back to");
  }
  HistoryOptions options = ToHistoryOptions(request);
  options.target = TargetOf(request);
  DYNMESH_RETURN_IF_ERROR(CheckNote(options.note));
  DYNMESH_RETURN_IF_ERROR(AwaitLoaded(session));
  DYNMESH_ASSIGN_OR_RETURN(auto result, session.FindRestoration(options));
  if (result == nullptr) {
    DYNMESH_ASSIGN_OR_RETURN(const int64_t target, TargetRevisionOf(session, request));
    DYNMESH_ASSIGN_OR_RETURN(const Lease room, RoomForCopy(services, session));
    DYNMESH_ASSIGN_OR_RETURN(result, GoBackTo(session, target, options, stop));
  }
  FromRestoration(*result, response);
  return absl::OkStatus();
}

absl::Status Answer(const ServiceContext& services, Session& source, const v1::ForkSessionRequest& request,
                    v1::ForkSessionResponse* response) {
  ForkOptions options{request.name(), request.request_id()};
  options.note = ToNote(request.note());
  options.snapshot = request.snapshot();
  DYNMESH_ASSIGN_OR_RETURN(options.durability, ToDurability(request.durability()));
  if (request.has_source_revision()) {
    DYNMESH_RETURN_IF_ERROR(CheckTargetRevision(request.source_revision()));
    options.revision = request.source_revision();
  }
  if (request.has_snapshot() && options.snapshot.empty()) return BadSnapshotName();
  DYNMESH_RETURN_IF_ERROR(AwaitLoaded(source));
  DYNMESH_ASSIGN_OR_RETURN(const Lease room, RoomForCopy(services, source));
  DYNMESH_ASSIGN_OR_RETURN(const SessionInfo info, Fork(services.registry, source, options));
  *response->mutable_session() = FromSessionInfo(info);
  response->set_revision(info.revision);
  return absl::OkStatus();
}

absl::Status Answer(Session& session, const v1::CreateSnapshotRequest& request,
                    v1::CreateSnapshotResponse* response) {
  DYNMESH_RETURN_IF_ERROR(AwaitLoaded(session));
  DYNMESH_ASSIGN_OR_RETURN(
      const Snapshot snapshot,
      CreateSnapshot(session, request.name(), request.revision(), ToNote(request.note())));
  *response->mutable_snapshot() = FromSnapshot(snapshot);
  response->set_revision(session.revision());
  return absl::OkStatus();
}

absl::Status Answer(Session& session, const v1::ListSnapshotsRequest&, v1::ListSnapshotsResponse* response) {
  DYNMESH_RETURN_IF_ERROR(AwaitLoaded(session));
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Snapshot> snapshots, ListSnapshots(session));
  for (const Snapshot& snapshot : snapshots) *response->add_snapshots() = FromSnapshot(snapshot);
  response->set_revision(session.revision());
  return absl::OkStatus();
}

absl::Status Answer(Session& session, const v1::DeleteSnapshotRequest& request,
                    v1::DeleteSnapshotResponse* response) {
  DYNMESH_RETURN_IF_ERROR(AwaitLoaded(session));
  DYNMESH_RETURN_IF_ERROR(DeleteSnapshot(session, request.name()));
  response->set_revision(session.revision());
  return absl::OkStatus();
}

class HistoryService final : public v1::HistoryService::CallbackService {
 public:
  explicit HistoryService(const ServiceContext& services) : services_(services) {}

  grpc::ServerUnaryReactor* ListRevisions(grpc::CallbackServerContext* context,
                                          const v1::ListRevisionsRequest* request,
                                          v1::ListRevisionsResponse* response) override {
    return Run({"ListRevisions", context, services_}, request, response);
  }

  grpc::ServerUnaryReactor* RestoreSession(grpc::CallbackServerContext* context,
                                           const v1::RestoreSessionRequest* request,
                                           v1::RestoreSessionResponse* response) override {
    constexpr char kRpc[] = "RestoreSession";
    return RunOutOfTurn(
        {kRpc, context, services_}, request,
        [this, context, request, response](const SessionPtr& session) {
          return Answer(services_, *session, *request, CallStop(context), response);
        },
        AnswerAcknowledged<v1::RestoreSessionResponse>{kRpc, response});
  }

  grpc::ServerUnaryReactor* ForkSession(grpc::CallbackServerContext* context,
                                        const v1::ForkSessionRequest* request,
                                        v1::ForkSessionResponse* response) override {
    constexpr char kRpc[] = "ForkSession";
    return RunOutOfTurn(
        {kRpc, context, services_}, request,
        [this, request, response](const SessionPtr& session) {
          return Answer(services_, *session, *request, response);
        },
        AnswerNow{kRpc});
  }

  grpc::ServerUnaryReactor* CreateSnapshot(grpc::CallbackServerContext* context,
                                           const v1::CreateSnapshotRequest* request,
                                           v1::CreateSnapshotResponse* response) override {
    return Run({"CreateSnapshot", context, services_}, request, response);
  }

  grpc::ServerUnaryReactor* ListSnapshots(grpc::CallbackServerContext* context,
                                          const v1::ListSnapshotsRequest* request,
                                          v1::ListSnapshotsResponse* response) override {
    return Run({"ListSnapshots", context, services_}, request, response);
  }

  grpc::ServerUnaryReactor* DeleteSnapshot(grpc::CallbackServerContext* context,
                                           const v1::DeleteSnapshotRequest* request,
                                           v1::DeleteSnapshotResponse* response) override {
    return Run({"DeleteSnapshot", context, services_}, request, response);
  }

 private:
  template <typename Request, typename Response>
  static grpc::ServerUnaryReactor* Run(const UnaryCall& call, const Request* request, Response* response) {
    return RunOutOfTurn(
        call, request,
        [request, response](const SessionPtr& session) { return Answer(*session, *request, response); },
        AnswerNow{call.rpc});
  }

  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeHistoryService(const ServiceContext& context) {
  return std::make_unique<HistoryService>(context);
}

}  // namespace dynmesh
