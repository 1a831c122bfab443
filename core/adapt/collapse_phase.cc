#include "core/adapt/phases.h"
#include "core/edit/star.h"

namespace dynmesh {
namespace {

class CollapsePhase final : public Phase {
 public:
  void Fill(const Mesh& mesh, const AdaptState& state, uint32_t since, WorkList& work) const override {
    mesh.slots(EntityKind::kEdge).live().ForEach([&](Slot slot) {
      const EdgeId e(slot);
      if (state.changes.AnyTouchedSince(mesh.Vertices(e), since)) AddIfShort(mesh, state, e, work);
    });
  }

  /// Into either end: one that lies on a feature cannot go.
  absl::Status Process(Slot slot, Operations& operations, WorkList& work) const override {
    const Mesh& mesh = operations.mesh();
    const AdaptState& state = operations.state();
    const EdgeId e(slot);
    if (!mesh.IsLive(e) || state.sizing.RatioOf(mesh, e) >= kShort) return absl::OkStatus();
    for (const VertexId kept : EndsFrom(mesh, e, VertexId())) {
      DYNMESH_ASSIGN_OR_RETURN(const bool collapsed,
                               operations.Collapse(e, kept, Operations::Aim::kSize, kLong));
      if (!collapsed) continue;
      for (EdgeId other : mesh.IncidentEdges(kept)) AddIfShort(mesh, state, other, work);
      return absl::OkStatus();
    }
    return absl::OkStatus();
  }

 private:
  static void AddIfShort(const Mesh& mesh, const AdaptState& state, EdgeId e, WorkList& work) {
    const double ratio = state.sizing.RatioOf(mesh, e);
    if (ratio < kShort) work.Add(-ratio, e.slot());
  }
};

}  // namespace

std::unique_ptr<Phase> MakeCollapsePhase() { return std::make_unique<CollapsePhase>(); }

}  // namespace dynmesh
