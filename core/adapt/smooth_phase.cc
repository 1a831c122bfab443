#include "core/adapt/phases.h"

namespace dynmesh {
namespace {

class SmoothPhase final : public Phase {
 public:
  void Fill(const Mesh& mesh, const AdaptState& state, uint32_t since, WorkList& work) const override {
    mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
      if (state.changes.IsTouchedSince(VertexId(v), since)) work.Add(0, v);
    });
  }

  absl::Status Process(Slot slot, Operations& operations, WorkList&) const override {
    const VertexId v(slot);
    if (operations.mesh().IsLive(v)) operations.Relax(v);
    return absl::OkStatus();
  }
};

}  // namespace

std::unique_ptr<Phase> MakeSmoothPhase() { return std::make_unique<SmoothPhase>(); }

}  // namespace dynmesh
