#include "server/rpc/apply_edits.h"

#include <memory>
#include <vector>

#include "core/mesh/error.h"
#include "server/rpc/convert_edits.h"
#include "server/rpc/unary.h"

namespace dynmesh {

absl::Status ApplyEdits(const ServiceContext& services, const v1::ApplyEditsRequest& request,
                        v1::ApplyEditsResponse* response) {
  DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request, services.limits()));
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services.registry.Find(request.session()));
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Edit> edits, ToEdits(request, services.limits()));
  DYNMESH_ASSIGN_OR_RETURN(const std::shared_ptr<const BatchResult> result,
                           session->Apply(edits, ToApplyOptions(request)));
  FromBatchResult(*result, response);
  return absl::OkStatus();
}

}  // namespace dynmesh
