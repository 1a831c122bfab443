#include "server/rpc/sessions_service.h"

#include <algorithm>
#include <utility>

#include "core/mesh/error.h"
#include "core/mesh/validate.h"
#include "dynmesh/v1/sessions.grpc.pb.h"
#include "server/rpc/chunk_stream.h"
#include "server/rpc/convert_sessions.h"
#include "server/rpc/import_reactor.h"
#include "server/rpc/unary.h"
#include "server/session/export.h"

namespace dynmesh {
namespace {

constexpr int kDefaultPageSize = 100;
constexpr int kMaxPageSize = 1000;
// A page ends early when its sessions, whose attribute lists may be long, hold this much.
constexpr size_t kMaxPageBytes = size_t{1} << 20;

absl::Status CreateSession(const ServiceContext& services, const v1::CreateSessionRequest& request,
                           v1::CreateSessionResponse* response) {
  DYNMESH_ASSIGN_OR_RETURN(const SessionSettings settings, ToSettings(request.settings()));
  DYNMESH_ASSIGN_OR_RETURN(const SessionInfo info,
                           services.registry.Create(request.name(), settings, request.request_id()));
  *response->mutable_session() = FromSessionInfo(info);
  response->set_revision(info.revision);
  return absl::OkStatus();
}

absl::Status GetSession(const ServiceContext& services, const v1::GetSessionRequest& request,
                        v1::GetSessionResponse* response) {
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services.registry.Find(request.name()));
  DYNMESH_ASSIGN_OR_RETURN(const SessionInfo info, session->Info());
  *response->mutable_session() = FromSessionInfo(info);
  response->set_revision(info.revision);
  return absl::OkStatus();
}

absl::Status ListSessions(const ServiceContext& services, const v1::ListSessionsRequest& request,
                          v1::ListSessionsResponse* response) {
  if (request.page_size() < 0) return BadField("page_size", "page_size is negative");
  const size_t size =
      request.page_size() == 0 ? kDefaultPageSize : std::min(request.page_size(), kMaxPageSize);
  DYNMESH_ASSIGN_OR_RETURN(const std::string after, FromPageToken(request.page_token()));
  const std::vector<SessionPtr> sessions = services.registry.ListAfter(after, size + 1);
  size_t bytes = 0;
  for (size_t i = 0; i < sessions.size(); ++i) {
    if (i == size || bytes > kMaxPageBytes) {
      response->set_next_page_token(ToPageToken(sessions[i - 1]->name()));
      break;
    }
    const absl::StatusOr<SessionInfo> info = sessions[i]->Info();
    if (!info.ok()) continue;  // deleted meanwhile
    *response->add_sessions() = FromSessionInfo(*info);
    bytes += response->sessions().rbegin()->ByteSizeLong();
  }
  return absl::OkStatus();
}

absl::Status DeleteSession(const ServiceContext& services, const v1::DeleteSessionRequest& request,
                           v1::DeleteSessionResponse* response) {
  DYNMESH_ASSIGN_OR_RETURN(const int64_t revision, services.registry.Delete(request.name(), request.etag()));
  response->set_revision(revision);
  return absl::OkStatus();
}

absl::Status ValidateSession(const ServiceContext& services, const v1::ValidateSessionRequest& request,
                             v1::ValidateSessionResponse* response) {
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services.registry.Find(request.session()));
  return session->Read([response](const SessionView& view) {
    response->set_revision(view.mesh.revision());
    for (std::string& violation : Validate(view.mesh)) response->add_violations(std::move(violation));
    return absl::OkStatus();
  });
}

class ExportMeshReactor final : public ChunkStreamReactor<v1::ExportMeshResponse> {
 public:
  ExportMeshReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                    const v1::ExportMeshRequest* request)
      : ChunkStreamReactor("ExportMesh", context), services_(services), request_(*request) {}

 private:
  absl::Status Gather() override {
    DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services_.registry.Find(request_.session()));
    DYNMESH_ASSIGN_OR_RETURN(answer_, ExportSession(*session));
    return absl::OkStatus();
  }

  absl::StatusOr<bool> NextChunk(v1::ExportMeshResponse* response) override {
    if (next_ == answer_.chunks.size()) return false;
    response->set_revision(answer_.revision);
    FromExportChunk(std::exchange(answer_.chunks[next_++], {}), response);
    return true;
  }

  const ServiceContext services_;
  const v1::ExportMeshRequest request_;
  ExportAnswer answer_;
  size_t next_ = 0;
};

class SessionsService final : public v1::SessionService::CallbackService {
 public:
  explicit SessionsService(const ServiceContext& services) : services_(services) {}

  grpc::ServerUnaryReactor* CreateSession(grpc::CallbackServerContext* context,
                                          const v1::CreateSessionRequest* request,
                                          v1::CreateSessionResponse* response) override {
    return RunUnary("CreateSession", context, services_.quick(),
                    [=, this] { return dynmesh::CreateSession(services_, *request, response); });
  }

  grpc::ServerUnaryReactor* GetSession(grpc::CallbackServerContext* context,
                                       const v1::GetSessionRequest* request,
                                       v1::GetSessionResponse* response) override {
    return RunUnary("GetSession", context, services_.quick(),
                    [=, this] { return dynmesh::GetSession(services_, *request, response); });
  }

  grpc::ServerUnaryReactor* ListSessions(grpc::CallbackServerContext* context,
                                         const v1::ListSessionsRequest* request,
                                         v1::ListSessionsResponse* response) override {
    return RunUnary("ListSessions", context, services_.quick(),
                    [=, this] { return dynmesh::ListSessions(services_, *request, response); });
  }

  grpc::ServerUnaryReactor* DeleteSession(grpc::CallbackServerContext* context,
                                          const v1::DeleteSessionRequest* request,
                                          v1::DeleteSessionResponse* response) override {
    return RunUnary("DeleteSession", context, services_.quick(),
                    [=, this] { return dynmesh::DeleteSession(services_, *request, response); });
  }

  grpc::ServerUnaryReactor* ValidateSession(grpc::CallbackServerContext* context,
                                            const v1::ValidateSessionRequest* request,
                                            v1::ValidateSessionResponse* response) override {
    return RunUnary("ValidateSession", context, services_.heavy(),
                    [=, this] { return dynmesh::ValidateSession(services_, *request, response); });
  }

  grpc::ServerBidiReactor<v1::ImportMeshRequest, v1::ImportMeshResponse>* ImportMesh(
      grpc::CallbackServerContext*) override {
    return (new ImportReactor(services_))->Start();
  }

  grpc::ServerWriteReactor<v1::ExportMeshResponse>* ExportMesh(
      grpc::CallbackServerContext* context, const v1::ExportMeshRequest* request) override {
    return (new ExportMeshReactor(services_, context, request))->Start(services_.heavy());
  }

 private:
  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeSessionsService(const ServiceContext& context) {
  return std::make_unique<SessionsService>(context);
}

}  // namespace dynmesh
