#include "server/rpc/edits_service.h"

#include "core/mesh/error.h"
#include "dynmesh/v1/edits.grpc.pb.h"
#include "server/rpc/apply_edits.h"
#include "server/rpc/call_stop.h"
#include "server/rpc/convert_edits.h"
#include "server/rpc/query_weight.h"
#include "server/rpc/stream_edits_reactor.h"
#include "server/rpc/unary.h"

namespace dynmesh {
namespace {

/// UndoEdits or RedoEdits.
template <typename Request, typename Response>
grpc::ServerUnaryReactor* MoveInHistory(const UnaryCall& call, HistoryMove move, const Request& request,
                                        Response* response) {
  const absl::StatusOr<SessionPtr> found = call.services.registry.Find(request.session());
  const bool heavy = found.ok() && IsHeavyMove(request.count(), (*found)->num_history_items(move));
  return RunEdit(call, request.session(), {AccessMode::kWrite, heavy, request.ByteSizeLong()}, response,
                 [context = call.context, move, &request, response](const SessionPtr& session,
                                                                    const AccessGrant&) -> absl::Status {
                   DYNMESH_ASSIGN_OR_RETURN(
                       const std::shared_ptr<const HistoryResult> result,
                       session->MoveInHistory(move, ToHistoryOptions(request), CallStop(context)));
                   FromHistoryResult(*result, response);
                   return absl::OkStatus();
                 });
}

class EditsService final : public v1::EditService::CallbackService {
 public:
  explicit EditsService(const ServiceContext& services) : services_(services) {}

  grpc::ServerUnaryReactor* ApplyEdits(grpc::CallbackServerContext* context,
                                       const v1::ApplyEditsRequest* request,
                                       v1::ApplyEditsResponse* response) override {
    return RunEdit({"ApplyEdits", context, services_}, request->session(),
                   {AccessMode::kWrite, /*heavy=*/false, MemoryOf(*request)}, response,
                   [context, request, response](const SessionPtr& session, const AccessGrant&) {
                     return dynmesh::ApplyEdits(*session, *request, CallStop(context), response);
                   });
  }

  grpc::ServerUnaryReactor* UndoEdits(grpc::CallbackServerContext* context,
                                      const v1::UndoEditsRequest* request,
                                      v1::UndoEditsResponse* response) override {
    return MoveInHistory({"UndoEdits", context, services_}, HistoryMove::kUndo, *request, response);
  }

  grpc::ServerUnaryReactor* RedoEdits(grpc::CallbackServerContext* context,
                                      const v1::RedoEditsRequest* request,
                                      v1::RedoEditsResponse* response) override {
    return MoveInHistory({"RedoEdits", context, services_}, HistoryMove::kRedo, *request, response);
  }

  grpc::ServerBidiReactor<v1::StreamEditsRequest, v1::StreamEditsResponse>* StreamEdits(
      grpc::CallbackServerContext* context) override {
    return (new StreamEditsReactor(services_, context))->Start();
  }

 private:
  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeEditsService(const ServiceContext& context) {
  return std::make_unique<EditsService>(context);
}

}  // namespace dynmesh
