#include <algorithm>

#include "core/adapt/phases.h"

namespace dynmesh {
namespace {

/// Swaps are tried between passes on what is worse than this, whatever quality is asked for.
constexpr double kGoodForSwaps = 0.35;

/// Edges of more cells or faces than these are hardly ever worth a swap.
constexpr size_t kMaxRingToTry = 7;

/// Collapses that are to improve shapes may make edges so long.
constexpr double kLongForShape = 1.5;

class ImprovePhase final : public Phase {
 public:
  explicit ImprovePhase(Remedies remedies) : remedies_(remedies) {}

  void Fill(const Mesh& mesh, const AdaptState& state, uint32_t since, WorkList& work) const override {
    ForEachAdaptable(mesh, [&](EntityId element) {
      if (state.changes.AnyTouchedSince(mesh.VerticesOf(element), since)) {
        AddIfBad(mesh, state, element, work);
      }
    });
  }

  absl::Status Process(Slot slot, Operations& operations, WorkList& work) const override {
    const Mesh& mesh = operations.mesh();
    const EntityId element(ElementKindOf(mesh), slot);
    const AdaptState& state = operations.state();
    if (!mesh.IsLive(element) || !mesh.IsElement(element)) return absl::OkStatus();
    if (state.goodness.Of(mesh, element) >= GoodEnough(state)) return absl::OkStatus();
    DYNMESH_ASSIGN_OR_RETURN(bool improved, Swap(element, operations));
    if (!improved && remedies_ == Remedies::kAll) {
      improved = Climb(element, operations);
      if (improved) AddIfBad(mesh, state, element, work);
      if (improved) return absl::OkStatus();
      DYNMESH_ASSIGN_OR_RETURN(improved, Collapse(element, operations));
    }
    if (!improved) return absl::OkStatus();
    for (EntityId made : operations.applied().added) AddIfBad(mesh, state, made, work);
    return absl::OkStatus();
  }

 private:
  double GoodEnough(const AdaptState& state) const {
    const double wanted = state.options.min_quality;
    return remedies_ == Remedies::kSwaps ? std::max(wanted, kGoodForSwaps) : wanted;
  }

  void AddIfBad(const Mesh& mesh, const AdaptState& state, EntityId element, WorkList& work) const {
    if (KindOf(mesh.Type(element)) != ElementKindOf(mesh)) return;
    const double goodness = state.goodness.Of(mesh, element);
    if (goodness < GoodEnough(state)) work.Add(-goodness, element.slot);
  }

  static std::vector<EdgeId> EdgesOf(const Mesh& mesh, EntityId element) {
    if (element.kind == EntityKind::kFace) {
      const auto edges = mesh.Edges(FaceId(element.slot));
      return {edges.begin(), edges.end()};
    }
    std::vector<EdgeId> edges;
    for (int k = 0; k < 6; ++k) edges.push_back(mesh.Edge(CellId(element.slot), k));
    return edges;
  }

  static absl::StatusOr<bool> Swap(EntityId element, Operations& operations) {
    const Mesh& mesh = operations.mesh();
    for (EdgeId e : EdgesOf(mesh, element)) {
      if (mesh.IncidentFaces(e).size() > kMaxRingToTry) continue;
      DYNMESH_ASSIGN_OR_RETURN(const bool swapped, operations.SwapEdge(e));
      if (swapped) return true;
    }
    if (element.kind == EntityKind::kFace) return false;
    std::vector<FaceId> faces;
    for (OrientedFace face : mesh.Faces(CellId(element.slot))) faces.push_back(face.face());
    for (FaceId f : faces) {
      DYNMESH_ASSIGN_OR_RETURN(const bool swapped, operations.SwapFace(f));
      if (swapped) return true;
    }
    return false;
  }

  static bool Climb(EntityId element, Operations& operations) {
    const auto corners = operations.mesh().VerticesOf(element);
    const std::vector<VertexId> vertices(corners.begin(), corners.end());
    return std::any_of(vertices.begin(), vertices.end(), [&](VertexId v) { return operations.Climb(v); });
  }

  static absl::StatusOr<bool> Collapse(EntityId element, Operations& operations) {
    const Mesh& mesh = operations.mesh();
    for (EdgeId e : EdgesOf(mesh, element)) {
      for (int end = 0; end < 2; ++end) {
        DYNMESH_ASSIGN_OR_RETURN(
            const bool collapsed,
            operations.Collapse(e, mesh.Vertices(e)[end], Operations::Aim::kShape, kLongForShape));
        if (collapsed) return true;
      }
    }
    return false;
  }

  const Remedies remedies_;
};

}  // namespace

std::unique_ptr<Phase> MakeImprovePhase(Remedies remedies) {
  return std::make_unique<ImprovePhase>(remedies);
}

}  // namespace dynmesh
