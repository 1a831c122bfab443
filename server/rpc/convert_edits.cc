#include "server/rpc/convert_edits.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/rpc/convert.h"
#include "server/rpc/status.h"
#include "server/session/mesh_warnings.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

absl::StatusOr<Edit> ToEdit(const v1::AddVertices& message) {
  AddVerticesEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.positions, ToArray<Point>(message.positions(), "positions"));
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::RemoveVertices& message) {
  RemoveVerticesEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.vertices, ToArray<Slot>(message.ids(), "ids"));
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::MoveVertices& message) {
  MoveVerticesEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.vertices, ToArray<Slot>(message.ids(), "ids"));
  DYNMESH_ASSIGN_OR_RETURN(edit.positions, ToArray<Point>(message.positions(), "positions"));
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::ElementBlock& message) {
  AddElementsEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.type, ToElementType(message.type()));
  const size_t record_bytes = NumVertices(edit.type) * sizeof(Slot);
  if (message.vertices().size() % record_bytes != 0) {
    return BadArrayLength("vertices", message.vertices().size(), record_bytes);
  }
  DYNMESH_ASSIGN_OR_RETURN(edit.vertices, ToArray<Slot>(message.vertices(), "vertices"));
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::RemoveElements& message) {
  RemoveElementsEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.kind, ToEntityKind(message.kind(), "kind"));
  if (edit.kind == EntityKind::kVertex) {
    return InvalidArgument(reason::kBadEntityKind, "vertices are no elements", {{"field", "kind"}});
  }
  DYNMESH_ASSIGN_OR_RETURN(edit.elements, ToArray<Slot>(message.ids(), "ids"));
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::AttributeSpec& message) {
  AddAttributeEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.spec, ToAttributeSpec(message));
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::AttributeValues& message) {
  SetAttributeEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.spec, ToAttributeSpec(message.spec()));
  DYNMESH_ASSIGN_OR_RETURN(edit.slots, ToArray<Slot>(message.ids(), "ids"));
  DYNMESH_ASSIGN_OR_RETURN(edit.rows, ToArray<uint8_t>(message.values(), "values"));
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::Edit& message) {
  switch (message.kind_case()) {
    case v1::Edit::kAddVertices:
      return ToEdit(message.add_vertices());
    case v1::Edit::kRemoveVertices:
      return ToEdit(message.remove_vertices());
    case v1::Edit::kMoveVertices:
      return ToEdit(message.move_vertices());
    case v1::Edit::kAddElements:
      return ToEdit(message.add_elements());
    case v1::Edit::kRemoveElements:
      return ToEdit(message.remove_elements());
    case v1::Edit::kAddAttribute:
      return ToEdit(message.add_attribute());
    case v1::Edit::kSetAttribute:
      return ToEdit(message.set_attribute());
    case v1::Edit::KIND_NOT_SET:
      break;
  }
  return BadField("edits", "an edit says nothing, or is of a kind that this server does not know");
}

}  // namespace

absl::StatusOr<std::vector<Edit>> ToEdits(const v1::ApplyEditsRequest& request, const Limits& limits) {
  const size_t size = request.edits_size();
  if (size > limits.max_batch_edits) return LimitExceeded("max_batch_edits", limits.max_batch_edits, size);
  std::vector<Edit> edits;
  edits.reserve(size);
  for (const v1::Edit& message : request.edits()) {
    absl::StatusOr<Edit> edit = ToEdit(message);
    if (!edit.ok()) return WithMetadata(edit.status(), "edit", absl::StrCat(edits.size()));
    edits.push_back(*std::move(edit));
  }
  return edits;
}

ApplyOptions ToApplyOptions(const v1::ApplyEditsRequest& request) {
  ApplyOptions options;
  options.as_of_revision = request.as_of_revision();
  if (request.has_if_revision()) options.if_revision = request.if_revision();
  options.request_id = request.request_id();
  options.validate_only = request.validate_only();
  return options;
}

void FromBatchResult(const BatchResult& result, v1::ApplyEditsResponse* response) {
  response->set_revision(result.revision);
  for (const EditResult& edit : result.results) {
    response->add_results()->set_new_ids(FromArray(edit.new_slots));
  }
  *response->mutable_checksum() = FromChecksum(result.checksum);
  KindCounts counts;
  std::copy(result.counts.begin(), result.counts.end(), counts.begin());
  *response->mutable_counts() = FromCounts(counts);
  for (const MeshWarning& warning : WarningsOf(result)) *response->add_warnings() = FromWarning(warning);
}

void FromError(const absl::Status& status, v1::EditError* error) {
  const grpc::Status converted = ToGrpcStatus(status);
  const ErrorDetail detail = DetailOf(status);
  error->set_code(converted.error_code());
  error->set_message(converted.error_message());
  error->set_reason(detail.reason);
  for (const auto& [key, value] : detail.metadata) (*error->mutable_metadata())[key] = value;
}

}  // namespace dynmesh
