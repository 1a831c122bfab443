#include "server/session/adaptation.h"

#include <utility>

namespace dynmesh {

absl::StatusOr<std::unique_ptr<Adaptation>> Adaptation::Start(SessionPtr session,
                                                              std::shared_ptr<Budget> places,
                                                              const AdaptOptions& options,
                                                              RevisionNote note) {
  DYNMESH_RETURN_IF_ERROR(CheckNote(note));
  Lease place(std::move(places));
  DYNMESH_RETURN_IF_ERROR(place.Grow(1));
  std::unique_ptr<Adaptation> adaptation(
      new Adaptation(std::move(session), std::move(place), std::move(note)));
  DYNMESH_RETURN_IF_ERROR(adaptation->session_->Read([&](const SessionView& view) -> absl::Status {
    DYNMESH_ASSIGN_OR_RETURN(adaptation->adapter_, Adapter::Start(view.mesh, options));
    return absl::OkStatus();
  }));
  return adaptation;
}

absl::Status Adaptation::Step() {
  const auto edit = [this](Mesh& mesh) -> absl::StatusOr<BatchEnding> {
    const Mesh::Savepoint before = mesh.MakeSavepoint();
    DYNMESH_RETURN_IF_ERROR(adapter_->Step(mesh));
    const uint64_t bytes = mesh.memory_bytes(), most = session_->limits().max_session_bytes;
    if (bytes > most) return LimitExceeded("max_session_bytes", most, bytes);
    return mesh.MakeSavepoint() == before ? BatchEnding::kRollBack : BatchEnding::kCommit;
  };
  return session_->EditMesh(edit, [this](const Mesh&) {
    return LoggedRequest{LoggedCall::kAdaptation, {}, 0, {}, note_};
  });
}

absl::StatusOr<AdaptResult> Adaptation::Finish() {
  return session_->ReadAs<AdaptResult>(
      [this](const SessionView& view) -> absl::StatusOr<AdaptResult> { return adapter_->Finish(view.mesh); });
}

}  // namespace dynmesh
