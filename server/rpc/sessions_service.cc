#include "server/rpc/sessions_service.h"

#include <algorithm>
#include <utility>

#include "core/mesh/error.h"
#include "core/mesh/validate.h"
#include "dynmesh/v1/sessions.grpc.pb.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/chunk_stream.h"
#include "server/rpc/convert.h"
#include "server/rpc/convert_sessions.h"
#include "server/rpc/import_reactor.h"
#include "server/rpc/session_work.h"
#include "server/rpc/unary.h"
#include "server/session/catch_exceptions.h"
#include "server/session/export.h"

namespace dynmesh {
namespace {

// A page ends early when its sessions, whose attribute lists may be long, hold this much.
constexpr size_t kMaxPageBytes = size_t{1} << 20;
constexpr uint64_t kManyEntities = 10'000'000;

absl::Status CreateSession(const ServiceContext& services, const v1::CreateSessionRequest& request,
                           v1::CreateSessionResponse* response) {
  DYNMESH_ASSIGN_OR_RETURN(const SessionSettings settings, ToSettings(request.settings()));
  DYNMESH_ASSIGN_OR_RETURN(const SessionInfo info,
                           services.registry.Create(request.name(), settings, request.request_id()));
  *response->mutable_session() = FromSessionInfo(info);
  response->set_revision(info.revision);
  return absl::OkStatus();
}

absl::Status GetSession(const Session& session, v1::GetSessionResponse* response) {
  DYNMESH_ASSIGN_OR_RETURN(const SessionInfo info, session.Info());
  *response->mutable_session() = FromSessionInfo(info);
  response->set_revision(info.revision);
  return absl::OkStatus();
}

absl::Status UpdateSession(Session& session, const v1::UpdateSessionRequest& request, const StopSignal& stop,
                           v1::UpdateSessionResponse* response) {
  DYNMESH_ASSIGN_OR_RETURN(const SettingsUpdate update, ToSettingsUpdate(request));
  DYNMESH_RETURN_IF_ERROR(session.Update(update, request.session().etag(), stop));
  DYNMESH_ASSIGN_OR_RETURN(const SessionInfo info, session.Info());
  *response->mutable_session() = FromSessionInfo(info);
  response->set_revision(info.revision);
  return absl::OkStatus();
}

/// What is to be told of the sessions is scanned once for each revision: for many entities that takes a
/// while.
bool IsLarge(const Session& session) {
  if (session.state() != SessionState::kLoaded) return true;  // nobody knows
  uint64_t entities = 0;
  for (EntityKind kind : kEntityKinds) entities += session.num_live(kind);
  return entities > kManyEntities;
}

/// One ListSessions call: visits the sessions of a page one after the other, each when it is its turn there.
/// Deletes itself.
class ListSessionsCall {
 public:
  ListSessionsCall(const UnaryCall& call, v1::ListSessionsResponse* response)
      : call_(call), reactor_(call.context->DefaultReactor()), response_(response) {}

  grpc::ServerUnaryReactor* Start(const v1::ListSessionsRequest& request) {
    grpc::ServerUnaryReactor* reactor = reactor_;  // this may be gone when Visit() returns
    const absl::Status chosen = ChoosePage(request);
    chosen.ok() ? Visit() : Finish(chosen);
    return reactor;
  }

 private:
  absl::Status ChoosePage(const v1::ListSessionsRequest& request) {
    DYNMESH_ASSIGN_OR_RETURN(page_size_, ToPageSize(request.page_size()));
    DYNMESH_ASSIGN_OR_RETURN(const std::string after, FromPageToken(request.page_token()));
    sessions_ = call_.services.registry.ListAfter(after, page_size_ + 1);
    return absl::OkStatus();
  }

  void Visit() {
    const absl::Status added = CatchExceptions([this] { return AddOutlines(); });
    if (!added.ok()) return Finish(added);
    if (next_ == sessions_.size()) return Finish(absl::OkStatus());
    if (IsFull()) {
      response_->set_next_page_token(ToPageToken(sessions_[next_ - 1]->name()));
      return Finish(absl::OkStatus());
    }
    const SessionPtr& session = sessions_[next_];
    const absl::Status posted = PostWork(call_.services, session, {AccessMode::kRead, IsLarge(*session)},
                                         [this](AccessGrant grant) { Describe(std::move(grant)); });
    if (!posted.ok()) Finish(posted);
  }

  bool IsFull() const { return next_ == page_size_ || bytes_ > kMaxPageBytes; }

  /// Of the next sessions that are not loaded: nobody has to wait for them to be read.
  absl::Status AddOutlines() {
    for (; next_ < sessions_.size() && !IsFull(); ++next_) {
      if (sessions_[next_]->state() == SessionState::kLoaded) break;
      Add(sessions_[next_]->Outline());
    }
    return absl::OkStatus();
  }

  void Add(const SessionInfo& info) {
    *response_->add_sessions() = FromSessionInfo(info);
    bytes_ += response_->sessions().rbegin()->ByteSizeLong();
  }

  void Describe(AccessGrant grant) {
    const absl::Status stopped = CallStop(call_.context).Check();
    if (!stopped.ok()) return Finish(stopped);
    const absl::Status described = CatchExceptions([this]() -> absl::Status {
      const Session& session = *sessions_[next_];
      const absl::StatusOr<SessionInfo> info = session.Info();
      const bool damaged = !info.ok() && session.state() == SessionState::kDamaged;  // since it was chosen
      if (!info.ok() && !damaged) return info.status();
      Add(damaged ? session.Outline() : *info);
      return absl::OkStatus();
    });
    grant.Release();
    if (!described.ok() && !absl::IsNotFound(described)) return Finish(described);
    ++next_;  // one that is not found was deleted meanwhile
    Visit();
  }

  void Finish(const absl::Status& status) {
    reactor_->Finish(LoggedStatus(call_.rpc, status));
    delete this;
  }

  const UnaryCall call_;
  grpc::ServerUnaryReactor* const reactor_;
  v1::ListSessionsResponse* const response_;
  size_t page_size_ = 0;
  std::vector<SessionPtr> sessions_;  ///< of the page, and the one after it
  size_t next_ = 0;
  size_t bytes_ = 0;
};

absl::Status DeleteSession(const ServiceContext& services, const SessionPtr& session,
                           const v1::DeleteSessionRequest& request, v1::DeleteSessionResponse* response) {
  DYNMESH_ASSIGN_OR_RETURN(const int64_t revision, services.registry.Delete(session, request.etag()));
  response->set_revision(revision);
  return absl::OkStatus();
}

/// Checks a copy: nobody waits for the session meanwhile.
absl::Status ValidateSession(const Session& session, const StopSignal& stop, AccessGrant grant,
                             v1::ValidateSessionResponse* response) {
  absl::optional<Mesh> copy;
  DYNMESH_RETURN_IF_ERROR(session.Read([&copy](const SessionView& view) {
    copy = view.mesh.Clone();
    return absl::OkStatus();
  }));
  grant.Release();
  absl::Status stopped;
  const auto goes_on = [&] { return (stopped = stop.Check()).ok(); };
  std::vector<std::string> violations = Validate(*copy, {.goes_on = goes_on});
  DYNMESH_RETURN_IF_ERROR(stopped);
  response->set_revision(copy->revision());
  for (std::string& violation : violations) response->add_violations(std::move(violation));
  return absl::OkStatus();
}

class ExportMeshReactor final : public ChunkStreamReactor<v1::ExportMeshResponse> {
 public:
  ExportMeshReactor(const ServiceContext& services, grpc::CallbackServerContext* context)
      : ChunkStreamReactor("ExportMesh", context, services) {}

 private:
  bool IsHeavy(const Session&) const override { return true; }

  absl::Status Gather(const Session& session, const QueryTerms& terms, AccessGrant&) override {
    DYNMESH_ASSIGN_OR_RETURN(answer_, ExportSession(session, terms));
    return absl::OkStatus();
  }

  absl::StatusOr<bool> NextChunk(v1::ExportMeshResponse* response) override {
    if (next_ == answer_.chunks.size()) return false;
    response->set_revision(answer_.revision);
    FromExportChunk(std::exchange(answer_.chunks[next_++], {}), response);
    return true;
  }

  ExportAnswer answer_;
  size_t next_ = 0;
};

class SessionsService final : public v1::SessionService::CallbackService {
 public:
  explicit SessionsService(const ServiceContext& services) : services_(services) {}

  grpc::ServerUnaryReactor* CreateSession(grpc::CallbackServerContext* context,
                                          const v1::CreateSessionRequest* request,
                                          v1::CreateSessionResponse* response) override {
    return RunUnary("CreateSession", context, MayWaitForDisk() ? services_.heavy() : services_.quick(),
                    [=, this] { return dynmesh::CreateSession(services_, *request, response); });
  }

  grpc::ServerUnaryReactor* GetSession(grpc::CallbackServerContext* context,
                                       const v1::GetSessionRequest* request,
                                       v1::GetSessionResponse* response) override {
    const absl::StatusOr<SessionPtr> found = services_.registry.Find(request->name());
    const bool heavy = found.ok() && IsLarge(**found);
    return RunOnSession({"GetSession", context, services_}, request->name(), {AccessMode::kRead, heavy},
                        [response](const SessionPtr& session, AccessGrant) {
                          return dynmesh::GetSession(*session, response);
                        });
  }

  grpc::ServerUnaryReactor* ListSessions(grpc::CallbackServerContext* context,
                                         const v1::ListSessionsRequest* request,
                                         v1::ListSessionsResponse* response) override {
    return (new ListSessionsCall({"ListSessions", context, services_}, response))->Start(*request);
  }

  grpc::ServerUnaryReactor* UpdateSession(grpc::CallbackServerContext* context,
                                          const v1::UpdateSessionRequest* request,
                                          v1::UpdateSessionResponse* response) override {
    return RunOnSession({"UpdateSession", context, services_}, request->session().name(),
                        {AccessMode::kWrite, /*heavy=*/true},
                        [context, request, response](const SessionPtr& session, AccessGrant) {
                          return dynmesh::UpdateSession(*session, *request, CallStop(context), response);
                        });
  }

  grpc::ServerUnaryReactor* DeleteSession(grpc::CallbackServerContext* context,
                                          const v1::DeleteSessionRequest* request,
                                          v1::DeleteSessionResponse* response) override {
    return RunOnSession({"DeleteSession", context, services_}, request->name(),
                        {AccessMode::kWrite, /*heavy=*/MayWaitForDisk()},
                        [this, request, response](const SessionPtr& session, AccessGrant) {
                          return dynmesh::DeleteSession(services_, session, *request, response);
                        });
  }

  grpc::ServerUnaryReactor* ValidateSession(grpc::CallbackServerContext* context,
                                            const v1::ValidateSessionRequest* request,
                                            v1::ValidateSessionResponse* response) override {
    return RunOnSession(
        {"ValidateSession", context, services_}, request->session(), {AccessMode::kRead, /*heavy=*/true},
        [context, response](const SessionPtr& session, AccessGrant grant) {
          return dynmesh::ValidateSession(*session, CallStop(context), std::move(grant), response);
        });
  }

  grpc::ServerBidiReactor<v1::ImportMeshRequest, v1::ImportMeshResponse>* ImportMesh(
      grpc::CallbackServerContext* context) override {
    return (new ImportReactor(services_, context))->Start();
  }

  grpc::ServerWriteReactor<v1::ExportMeshResponse>* ExportMesh(
      grpc::CallbackServerContext* context, const v1::ExportMeshRequest* request) override {
    return (new ExportMeshReactor(services_, context))->Start(request->session(), request->ByteSizeLong());
  }

 private:
  bool MayWaitForDisk() const { return services_.registry.keeps_sessions(); }

  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeSessionsService(const ServiceContext& context) {
  return std::make_unique<SessionsService>(context);
}

}  // namespace dynmesh
