#include "tests/bench/operators.h"

#include <numeric>
#include <random>

#include "core/edit/check_patch.h"
#include "core/edit/collapse.h"
#include "core/edit/split.h"
#include "core/edit/star.h"
#include "core/edit/swap.h"

namespace dynmesh::bench {
namespace {

absl::Status Split(const Mesh& mesh, Slot e, dynmesh::Patch& patch) {
  return PlanSplitEdge(mesh, EdgeId(e), {}, patch);
}

absl::Status Collapse(const Mesh& mesh, Slot e, dynmesh::Patch& patch) {
  return PlanCollapseEdge(mesh, EdgeId(e), {.parameter = 0}, patch);
}

absl::Status SwapEdge(const Mesh& mesh, Slot e, dynmesh::Patch& patch) {
  return PlanSwapEdge(mesh, EdgeId(e), patch);
}

absl::Status SwapFace(const Mesh& mesh, Slot f, dynmesh::Patch& patch) {
  return PlanSwapFace(mesh, FaceId(f), patch);
}

Edit SplitAll(const std::vector<Slot>& edges) {
  SplitEdgesEdit edit;
  edit.edges.ids = edges;
  return edit;
}

Edit CollapseAll(const std::vector<Slot>& edges) {
  CollapseEdgesEdit edit;
  edit.edges.ids = edges;
  edit.parameters.assign(edges.size(), 0);
  return edit;
}

Edit SwapAllEdges(const std::vector<Slot>& edges) {
  SwapEdgesEdit edit;
  edit.edges.ids = edges;
  return edit;
}

Edit SwapAllFaces(const std::vector<Slot>& faces) {
  SwapFacesEdit edit;
  edit.faces = faces;
  return edit;
}

/// Vertices of what a patch replaces, and their neighbours: nothing else decides whether it is accepted.
class Claims {
 public:
  explicit Claims(const Mesh& mesh) : mesh_(mesh), taken_(mesh.slots(EntityKind::kVertex).limit()) {}

  /// False, and nothing is claimed, when some of it is taken.
  bool Claim(const dynmesh::Patch& patch) {
    std::vector<VertexId> wanted;
    for (EntityId id : patch.removed) {
      for (VertexId v : mesh_.VerticesOf(id)) wanted.push_back(v);
    }
    for (VertexId v : wanted) {
      if (taken_[v.slot()]) return false;
    }
    for (VertexId v : wanted) {
      taken_[v.slot()] = true;
      for (EdgeId e : mesh_.IncidentEdges(v)) {
        for (VertexId w : mesh_.Vertices(e)) taken_[w.slot()] = true;
      }
    }
    return true;
  }

 private:
  const Mesh& mesh_;
  std::vector<bool> taken_;
};

}  // namespace

std::vector<Operator> OperatorsFor(ElementType type) {
  std::vector<Operator> operators = {{"split", EntityKind::kEdge, Split, SplitAll},
                                     {"collapse", EntityKind::kEdge, Collapse, CollapseAll}};
  if (type == ElementType::kTetrahedron || type == ElementType::kTriangle) {
    operators.push_back({"swap_edge", EntityKind::kEdge, SwapEdge, SwapAllEdges});
  }
  if (type == ElementType::kTetrahedron) operators.push_back({"swap_face", EntityKind::kFace, SwapFace, SwapAllFaces});
  return operators;
}

std::vector<Slot> PlacesFor(const Mesh& mesh, const Operator& op, size_t count) {
  std::vector<Slot> order(mesh.slots(op.kind).limit()), places;
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(11));
  Claims claims(mesh);
  dynmesh::Patch patch;
  for (Slot slot : order) {
    if (places.size() == count) break;
    patch.Clear();
    const bool accepted =
        mesh.IsLive({op.kind, slot}) && op.plan(mesh, slot, patch).ok() && CheckPatch(mesh, patch).ok();
    if (accepted && claims.Claim(patch)) places.push_back(slot);
  }
  return places;
}

}  // namespace dynmesh::bench
