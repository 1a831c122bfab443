#include "server/rpc/apply_edits.h"

#include <memory>
#include <vector>

#include "core/mesh/error.h"
#include "server/rpc/convert_edits.h"
#include "server/rpc/unary.h"

namespace dynmesh {

absl::Status ApplyEdits(Session& session, const v1::ApplyEditsRequest& request, const StopSignal& stop,
                        v1::ApplyEditsResponse* response) {
  DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request, session.limits()));
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Edit> edits, ToEdits(request, session.limits()));
  DYNMESH_ASSIGN_OR_RETURN(const ApplyOptions options, ToApplyOptions(request));
  DYNMESH_ASSIGN_OR_RETURN(const std::shared_ptr<const BatchResult> result,
                           session.Apply(edits, options, stop));
  FromBatchResult(*result, response);
  return absl::OkStatus();
}

size_t MemoryOf(const v1::ApplyEditsRequest& request) {
  return request.ByteSizeLong() + request.edits_size() * (sizeof(v1::Edit) + sizeof(v1::AttributeValues));
}

}  // namespace dynmesh
