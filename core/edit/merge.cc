#include "core/edit/merge.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/strings/str_cat.h"
#include "core/edit/star.h"

namespace dynmesh {
namespace {

/// Looks for elements that others would equal.
class TwinFinder {
 public:
  TwinFinder(const Mesh& mesh, const Star& replaced) : mesh_(mesh) {
    ForEachElement(replaced, [this](EntityId id) { replaced_.push_back(id); });
    std::sort(replaced_.begin(), replaced_.end());
  }

  /// An element that has just these vertices, in whatever order, and is not replaced; or an invalid id. Adds
  /// what it looked at to `work`.
  EntityId Find(const NewElement& element, uint64_t& work) const {
    const auto wanted = Sorted(element.vertices());
    const VertexId fewest = *std::min_element(wanted.begin(), wanted.end(), [this](VertexId a, VertexId b) {
      return mesh_.IncidentEdges(a).size() < mesh_.IncidentEdges(b).size();
    });
    const Star star = StarOf(mesh_, fewest);
    work += star.work;
    EntityId twin;
    ForEachElement(star, [&](EntityId id) {
      const bool equal = mesh_.Type(id) == element.type && Sorted(mesh_.VerticesOf(id)) == wanted;
      if (equal && !std::binary_search(replaced_.begin(), replaced_.end(), id)) twin = id;
    });
    return twin;
  }

 private:
  using Vertices = absl::InlinedVector<VertexId, kMaxElementVertices>;

  static Vertices Sorted(absl::Span<const VertexId> vertices) {
    Vertices sorted(vertices.begin(), vertices.end());
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  }

  const Mesh& mesh_;
  std::vector<EntityId> replaced_;
};

absl::Status CheckApart(const Mesh& mesh, VertexId kept, VertexId gone, const Star& star) {
  if (const EdgeId e = mesh.FindEdge(kept, gone); e.valid()) {
    return Refuse(reason::kEdgeExists, absl::StrCat("edge ", e.slot(), " joins the vertices: collapse it"),
                  EntityKind::kEdge, {e.slot()});
  }
  absl::Status status;
  ForEachElement(star, [&](EntityId id) {
    if (!status.ok() || !Contains(mesh.VerticesOf(id), kept)) return;
    status =
        Refuse(reason::kNotSimplex, absl::StrCat(EntityKindName(id.kind), " ", id.slot, " has both vertices"),
               id.kind, {id.slot});
  });
  return status;
}

}  // namespace

absl::Status PlanMergeVertices(const Mesh& mesh, VertexId kept, VertexId gone,
                               const absl::optional<Point>& position, Patch& patch) {
  if (kept == gone) {
    return InvalidArgument(reason::kBadArgument,
                           absl::StrCat("vertex ", kept.slot(), " is to merge with itself"),
                           {{"kind", "vertex"}, {"ids", absl::StrCat(kept.slot())}});
  }
  const Star star = StarOf(mesh, gone);
  patch.work += star.work;
  DYNMESH_RETURN_IF_ERROR(CheckNotDegenerate(mesh, star));
  DYNMESH_RETURN_IF_ERROR(CheckApart(mesh, kept, gone, star));
  if (position) {
    patch.work += WorkOfStar(mesh, kept);
    patch.moves.push_back({kept, *position});
  }
  const TwinFinder twins(mesh, star);
  absl::Status status;
  ForEachElement(star, [&](EntityId id) {
    if (!status.ok()) return;
    const auto vertices = mesh.VerticesOf(id);
    std::array<VertexId, kMaxElementVertices> moved;
    std::replace_copy(vertices.begin(), vertices.end(), moved.begin(), gone, kept);
    patch.Remove(id);
    patch.Add(mesh.Type(id), absl::MakeConstSpan(moved.data(), vertices.size()));
    const EntityId twin = twins.Find(patch.added.back(), patch.work);
    if (patch.work > kMaxPatchWork) status = TooManyElements(gone);
    if (twin.slot == kNoSlot) return;
    status = Refuse(reason::kDuplicateElement,
                    absl::StrCat(EntityKindName(id.kind), " ", id.slot, " would equal ", twin.slot), id.kind,
                    {id.slot, twin.slot});
  });
  patch.mergers.push_back({kept, gone});
  patch.removed_vertices.push_back(gone);
  return status;
}

}  // namespace dynmesh
