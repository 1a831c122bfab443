#include "core/adapt/phases.h"

namespace dynmesh {
namespace {

class SplitPhase final : public Phase {
 public:
  void Fill(const Mesh& mesh, const AdaptState& state, uint32_t since, WorkList& work) const override {
    mesh.slots(EntityKind::kEdge).live().ForEach([&](Slot slot) {
      const EdgeId e(slot);
      if (state.changes.AnyTouchedSince(mesh.Vertices(e), since)) AddIfLong(mesh, state, e, work);
    });
  }

  absl::Status Process(Slot slot, Operations& operations, WorkList& work) const override {
    const Mesh& mesh = operations.mesh();
    const EdgeId e(slot);
    if (!mesh.IsLive(e) || operations.state().sizing.RatioOf(mesh, e) <= kLong) return absl::OkStatus();
    AdaptState& state = operations.state();
    if (mesh.NumElements(ElementKindOf(mesh)) >= state.options.max_elements) {
      state.result.end = AdaptEnd::kMaxElements;
      work.Clear();
      return absl::OkStatus();
    }
    DYNMESH_ASSIGN_OR_RETURN(const bool split, operations.Split(e));
    if (!split) return absl::OkStatus();
    for (EdgeId made : mesh.IncidentEdges(operations.applied().new_vertices[0])) {
      AddIfLong(mesh, state, made, work);
    }
    return absl::OkStatus();
  }

 private:
  static void AddIfLong(const Mesh& mesh, const AdaptState& state, EdgeId e, WorkList& work) {
    const double ratio = state.sizing.RatioOf(mesh, e);
    if (ratio > kLong) work.Add(ratio, e.slot());
  }
};

}  // namespace

std::unique_ptr<Phase> MakeSplitPhase() { return std::make_unique<SplitPhase>(); }

}  // namespace dynmesh
