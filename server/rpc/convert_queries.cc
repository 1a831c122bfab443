#include "server/rpc/convert_queries.h"

#include <algorithm>

#include "server/rpc/convert.h"
#include "server/rpc/convert_spatial.h"
#include "server/session/session_errors.h"

namespace dynmesh {

absl::StatusOr<Selection> ToSelection(const v1::Selection& message, int64_t as_of_revision) {
  Selection selection;
  selection.as_of_revision = as_of_revision;
  selection.boundary_only = message.boundary_only();
  if (message.has_box()) {
    DYNMESH_ASSIGN_OR_RETURN(selection.box, ToBox(message.box(), "selection.box"));
  }
  if (message.has_ids()) {
    DYNMESH_ASSIGN_OR_RETURN(selection.which, ToArray<Slot>(message.ids(), "selection.ids"));
    return selection;
  }
  if (message.has_range()) {
    selection.which = Selection::Range{message.range().begin(), message.range().end()};
    return selection;
  }
  if (message.has_all() && message.all()) return selection;
  return BadField("selection", "selection names neither ids nor a range nor all");
}

uint64_t CountSelected(const v1::Selection& message, uint64_t num_live) {
  if (message.has_ids()) return message.ids().size() / sizeof(Slot);
  if (!message.has_range()) return num_live;
  const auto& range = message.range();
  return std::min<uint64_t>(num_live, range.end() - std::min(range.begin(), range.end()));
}

absl::StatusOr<Neighborhood> ToNeighborhood(const v1::GetNeighborsRequest& request) {
  Relation relation;
  DYNMESH_ASSIGN_OR_RETURN(relation.from, ToEntityKind(request.from(), "from"));
  DYNMESH_ASSIGN_OR_RETURN(relation.to, ToEntityKind(request.to(), "to"));
  return Neighborhood(relation, request.rings() == 0 ? 1 : request.rings());
}

void FromNeighborsChunk(const NeighborsChunk& chunk, v1::GetNeighborsResponse* response) {
  response->set_ids(FromArray(chunk.ids));
  response->set_offsets(FromArray(chunk.offsets));
  response->set_neighbors(FromArray(chunk.neighbors));
}

void FromEntitiesChunk(const EntitiesChunk& chunk, v1::GetEntitiesResponse* response) {
  response->set_ids(FromArray(chunk.ids));
  response->set_positions(FromArray(chunk.positions));
  response->set_types(FromArray(chunk.types));
  response->set_vertex_offsets(FromArray(chunk.vertex_offsets));
  response->set_vertices(FromArray(chunk.vertices));
  response->set_flags(FromArray(chunk.flags));
  response->set_born_revisions(FromArray(chunk.born_revisions));
}

}  // namespace dynmesh
