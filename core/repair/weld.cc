#include "core/repair/weld.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/types/optional.h"
#include "core/mesh/error.h"
#include "core/repair/distinct_elements.h"
#include "core/repair/vertex_clusters.h"

namespace dynmesh {
namespace {

constexpr EntityKind kElementKinds[] = {EntityKind::kCell, EntityKind::kFace, EntityKind::kEdge};

/// The triangle that is left of a quad whose first or last two vertices, or any two in a row, are one.
absl::optional<NewElement> TriangleOf(const NewElement& quad) {
  std::array<VertexId, kMaxFaceVertices> left;
  size_t size = 0;
  const auto vertices = quad.vertices();
  for (size_t k = 0; k < vertices.size(); ++k) {
    if (vertices[k] != vertices[(k + 1) % vertices.size()]) left[size++] = vertices[k];
  }
  const auto triangle = absl::MakeConstSpan(left.data(), size);
  if (size != 3 || HasRepeats(triangle)) return absl::nullopt;
  return NewElement(ElementType::kTriangle, triangle);
}

/// Carries out one weld.
class Welder {
 public:
  Welder(RepairWork& work, std::vector<VertexId> becomes, RepairReport& report)
      : work_(work), mesh_(work.mesh()), becomes_(std::move(becomes)), report_(report) {}

  absl::Status Run() {
    NoteMerged();
    if (merged_.empty()) return absl::OkStatus();
    DYNMESH_RETURN_IF_ERROR(Sort());
    for (EntityId id : touched_) {
      DYNMESH_RETURN_IF_ERROR(Replace(id));
      DYNMESH_RETURN_IF_ERROR(work_.ApplyIfLarge(patch_));
    }
    DYNMESH_RETURN_IF_ERROR(work_.Apply(patch_));
    for (VertexId v : merged_) DYNMESH_RETURN_IF_ERROR(mesh_.RemoveVertex(v));
    return absl::OkStatus();
  }

 private:
  void NoteMerged() {
    is_target_.resize(becomes_.size());
    for (Slot slot = 0; slot < becomes_.size(); ++slot) {
      const VertexId v(slot);
      if (!becomes_[slot].valid() || becomes_[slot] == v) continue;
      is_target_[becomes_[slot].slot()] = true;
      merged_.push_back(v);
      report_.Add(RepairFinding::kMerged, v);
    }
  }

  NewElement After(EntityId id) const {
    NewElement element(mesh_.Type(id), mesh_.VerticesOf(id));
    for (VertexId& v : element.mutable_vertices()) v = becomes_[v.slot()];
    return element;
  }

  /// Notes which elements have a vertex that goes, and which others they might be equal to then.
  absl::Status Sort() {
    for (EntityKind kind : kElementKinds) {
      const BitSet& live = mesh_.slots(kind).live();
      for (Slot slot = live.Next(0); slot != kNoSlot; slot = live.Next(slot + 1)) {
        DYNMESH_RETURN_IF_ERROR(work_.Charge(1));
        const EntityId id(kind, slot);
        if (mesh_.IsElement(id)) DYNMESH_RETURN_IF_ERROR(Sort(id));
      }
    }
    return absl::OkStatus();
  }

  absl::Status Sort(EntityId id) {
    const auto vertices = mesh_.VerticesOf(id);
    const bool touched =
        std::any_of(vertices.begin(), vertices.end(), [this](VertexId v) { return becomes_[v.slot()] != v; });
    const bool near =
        std::any_of(vertices.begin(), vertices.end(), [this](VertexId v) { return is_target_[v.slot()]; });
    if (!touched && !near) return absl::OkStatus();
    if (touched) touched_.push_back(id);
    if (!touched && !mesh_.IsDegenerate(id)) distinct_.Insert(After(id));
    return work_.ChargeBytes(DistinctElements::kBytesOfElement);
  }

  absl::Status Replace(EntityId id) {
    DYNMESH_RETURN_IF_ERROR(work_.Charge(1));
    absl::optional<NewElement> element = After(id);
    patch_.Remove(id);
    const bool folded = HasRepeats(element->vertices());
    if (folded) element = element->type == ElementType::kQuad ? TriangleOf(*element) : absl::nullopt;
    if (!element) {
      report_.Add(RepairFinding::kDegenerate, id);
    } else if (!distinct_.Insert(*element)) {
      report_.Add(RepairFinding::kDuplicate, id);
    } else {
      patch_.Add(element->type, element->vertices());
      if (folded) report_.Add(RepairFinding::kShrunk, id);
    }
    return absl::OkStatus();
  }

  RepairWork& work_;
  Mesh& mesh_;
  const std::vector<VertexId> becomes_;
  RepairReport& report_;
  std::vector<VertexId> merged_;
  std::vector<bool> is_target_;  ///< by slot: others become this vertex
  std::vector<EntityId> touched_;
  DistinctElements distinct_;
  Patch patch_;
};

}  // namespace

absl::StatusOr<RepairReport> WeldVertices(RepairWork& work, double tolerance) {
  if (!(tolerance >= 0 && std::isfinite(tolerance))) {
    return InvalidArgument(reason::kBadArgument,
                           absl::StrCat("a tolerance is finite and not negative, not ", tolerance),
                           {{"field", "tolerance"}});
  }
  DYNMESH_ASSIGN_OR_RETURN(std::vector<VertexId> becomes, ClusterVertices(work, tolerance));
  RepairReport report;
  DYNMESH_RETURN_IF_ERROR(Welder(work, std::move(becomes), report).Run());
  return report;
}

}  // namespace dynmesh
