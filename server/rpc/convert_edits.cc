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

// ---- Operators ----

PatchLimits ToPatchLimits(const v1::OperatorLimits& message) {
  return {.keep_orientation = !message.allow_inversion(), .min_quality = message.min_quality()};
}

absl::StatusOr<EdgeNames> ToEdgeNames(const v1::EdgeNames& message) {
  EdgeNames names;
  DYNMESH_ASSIGN_OR_RETURN(names.ids, ToArray<Slot>(message.ids(), "ids"));
  DYNMESH_ASSIGN_OR_RETURN(names.ends, ToArray<Slot>(message.ends(), "ends"));
  return names;
}

/// Of SplitEdges and CollapseEdges.
template <typename EdgesEdit, typename Message>
absl::StatusOr<Edit> ToEdgesEdit(const Message& message) {
  EdgesEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.edges, ToEdgeNames(message.edges()));
  DYNMESH_ASSIGN_OR_RETURN(edit.parameters, ToArray<double>(message.parameters(), "parameters"));
  DYNMESH_ASSIGN_OR_RETURN(edit.positions, ToArray<Point>(message.positions(), "positions"));
  edit.limits = ToPatchLimits(message.limits());
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::SwapEdges& message) {
  SwapEdgesEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.edges, ToEdgeNames(message.edges()));
  edit.limits = ToPatchLimits(message.limits());
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::SwapFaces& message) {
  SwapFacesEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.faces, ToArray<Slot>(message.ids(), "ids"));
  edit.limits = ToPatchLimits(message.limits());
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::SplitElements& message) {
  SplitElementsEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.kind, ToEntityKind(message.kind(), "kind"));
  DYNMESH_ASSIGN_OR_RETURN(edit.elements, ToArray<Slot>(message.ids(), "ids"));
  DYNMESH_ASSIGN_OR_RETURN(edit.positions, ToArray<Point>(message.positions(), "positions"));
  edit.limits = ToPatchLimits(message.limits());
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::MergeVertices& message) {
  MergeVerticesEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.pairs, ToArray<Slot>(message.pairs(), "pairs"));
  DYNMESH_ASSIGN_OR_RETURN(edit.positions, ToArray<Point>(message.positions(), "positions"));
  edit.limits = ToPatchLimits(message.limits());
  return edit;
}

absl::StatusOr<Edit> ToEdit(const v1::DissolveVertices& message) {
  DissolveVerticesEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.vertices, ToArray<Slot>(message.ids(), "ids"));
  edit.limits = ToPatchLimits(message.limits());
  return edit;
}

absl::StatusOr<SmoothMethod> ToSmoothMethod(int method) {
  switch (method) {
    case v1::SMOOTH_METHOD_LAPLACIAN:
      return SmoothMethod::kLaplacian;
    case v1::SMOOTH_METHOD_UNSPECIFIED:
    case v1::SMOOTH_METHOD_GUARDED:
      return SmoothMethod::kGuarded;
    case v1::SMOOTH_METHOD_OPTIMIZING:
      return SmoothMethod::kOptimizing;
    default:
      return BadField("method", "this server does not know that method of smoothing");
  }
}

absl::StatusOr<Edit> ToEdit(const v1::SmoothVertices& message) {
  SmoothVerticesEdit edit;
  DYNMESH_ASSIGN_OR_RETURN(edit.vertices, ToArray<Slot>(message.ids(), "ids"));
  DYNMESH_ASSIGN_OR_RETURN(edit.rule.method, ToSmoothMethod(message.method()));
  if (message.has_factor()) edit.rule.factor = message.factor();
  edit.rule.move_boundary = message.move_boundary();
  edit.rule.tangential = message.tangential();
  if (message.iterations() != 0) edit.iterations = message.iterations();
  edit.limits = ToPatchLimits(message.limits());
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
    case v1::Edit::kSplitEdges:
      return ToEdgesEdit<SplitEdgesEdit>(message.split_edges());
    case v1::Edit::kCollapseEdges:
      return ToEdgesEdit<CollapseEdgesEdit>(message.collapse_edges());
    case v1::Edit::kSwapEdges:
      return ToEdit(message.swap_edges());
    case v1::Edit::kSwapFaces:
      return ToEdit(message.swap_faces());
    case v1::Edit::kSplitElements:
      return ToEdit(message.split_elements());
    case v1::Edit::kMergeVertices:
      return ToEdit(message.merge_vertices());
    case v1::Edit::kDissolveVertices:
      return ToEdit(message.dissolve_vertices());
    case v1::Edit::kSmoothVertices:
      return ToEdit(message.smooth_vertices());
    case v1::Edit::KIND_NOT_SET:
      break;
  }
  return BadField("edits", "an edit says nothing, or is of a kind that this server does not know");
}

void FromLineage(absl::Span<const Lineage> lineage, v1::EditResult* message) {
  std::vector<uint8_t> kinds;
  std::vector<Slot> elements, parents;
  for (const auto& [element, parent] : lineage) {
    kinds.push_back(FromEntityKind(element.kind));
    elements.push_back(element.slot);
    parents.push_back(parent.slot);
  }
  message->set_element_kinds(FromArray(kinds));
  message->set_element_ids(FromArray(elements));
  message->set_parent_ids(FromArray(parents));
}

void FromEditResult(const EditResult& result, v1::EditResult* message) {
  message->set_new_ids(FromArray(result.new_slots));
  message->set_skipped(FromArray(result.skipped));
  for (const Refusal& refusal : result.refusals) {
    v1::SkippedItem* item = message->add_refusals();
    item->set_index(refusal.index);
    FromError(refusal.status, item->mutable_error());
  }
  FromLineage(result.lineage, message);
  message->set_num_moved(result.num_moved);
}

absl::StatusOr<ConflictPolicy> ToConflictPolicy(v1::ConflictPolicy policy) {
  switch (policy) {
    case v1::CONFLICT_POLICY_UNSPECIFIED:
      return ConflictPolicy::kNone;
    case v1::CONFLICT_POLICY_TOUCHED:
      return ConflictPolicy::kTouched;
    default:
      return BadField("conflict_policy", "a policy that this server does not know");
  }
}

/// Of UndoEditsRequest and RedoEditsRequest, which say the same.
template <typename Request>
HistoryOptions HistoryOptionsOf(const Request& request) {
  HistoryOptions options;
  if (request.count() != 0) options.count = request.count();
  if (request.has_if_revision()) options.if_revision = request.if_revision();
  options.request_id = request.request_id();
  options.validate_only = request.validate_only();
  options.note = ToNote(request.note());
  return options;
}

template <typename Response>
void FillFrom(const HistoryResult& result, Response* response) {
  response->set_revision(result.revision);
  response->set_count(result.count);
  *response->mutable_checksum() = FromChecksum(result.checksum);
  *response->mutable_counts() = FromCounts(ToKindCounts(result.counts));
  response->set_undoable_batches(result.undoable_batches);
  response->set_redoable_batches(result.redoable_batches);
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

absl::StatusOr<ApplyOptions> ToApplyOptions(const v1::ApplyEditsRequest& request) {
  ApplyOptions options;
  DYNMESH_ASSIGN_OR_RETURN(options.conflict_policy, ToConflictPolicy(request.conflict_policy()));
  options.as_of_revision = request.as_of_revision();
  if (request.has_if_revision()) options.if_revision = request.if_revision();
  options.request_id = request.request_id();
  options.validate_only = request.validate_only();
  options.skip_refused = request.skip_refused();
  options.report_lineage = request.report_lineage();
  options.note = ToNote(request.note());
  return options;
}

HistoryOptions ToHistoryOptions(const v1::UndoEditsRequest& request) { return HistoryOptionsOf(request); }

HistoryOptions ToHistoryOptions(const v1::RedoEditsRequest& request) { return HistoryOptionsOf(request); }

void FromHistoryResult(const HistoryResult& result, v1::UndoEditsResponse* response) {
  FillFrom(result, response);
}

void FromHistoryResult(const HistoryResult& result, v1::RedoEditsResponse* response) {
  FillFrom(result, response);
}

void FromBatchResult(const BatchResult& result, v1::ApplyEditsResponse* response) {
  response->set_revision(result.revision);
  for (const EditResult& edit : result.results) {
    FromEditResult(edit, response->add_results());
  }
  *response->mutable_checksum() = FromChecksum(result.checksum);
  *response->mutable_counts() = FromCounts(ToKindCounts(result.counts));
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
