#include "server/session/repair_session.h"

#include <bit>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/session/durability/answer_codec.h"
#include "server/session/fingerprint.h"
#include "server/session/mesh_meter.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

/// Looks at each entity that a step may take on the whole: far more than any but crowded meshes need.
constexpr uint64_t kMaxStepsForEntity = 500;
constexpr uint64_t kMaxStepsForAny = 10'000'000;

/// Adds the fields of each kind of step.
struct StepVisitor {
  Fingerprint& fingerprint;

  void operator()(const OrientStep& step) { fingerprint.AddNumber(step.options.outward); }
  void operator()(const WeldStep& step) { AddReal(step.tolerance); }
  void operator()(const RemoveDuplicatesStep& step) {
    fingerprint.AddNumber(step.options.max_measure.has_value());
    AddReal(step.options.max_measure.value_or(0));
    fingerprint.AddNumber(step.options.isolated_vertices);
  }
  void operator()(const SplitNonManifoldStep&) {}
  void operator()(const FillHolesStep& step) { fingerprint.AddNumber(step.max_edges); }

  void AddReal(double value) { fingerprint.AddNumber(std::bit_cast<uint64_t>(value)); }
};

uint64_t FingerprintOf(const RepairRequest& request) {
  Fingerprint fingerprint;
  fingerprint.AddNumber(request.if_revision.has_value());
  fingerprint.AddNumber(request.if_revision.value_or(0));
  for (const RepairStep& step : request.steps) {
    fingerprint.AddNumber(step.index());
    std::visit(StepVisitor{fingerprint}, step);
  }
  return fingerprint.value();
}

size_t BytesOf(const RepairOutcome& outcome) {
  size_t bytes = sizeof(outcome) + outcome.reports.size() * sizeof(RepairReport);
  for (const RepairReport& report : outcome.reports) {
    report.ForEach([&](RepairFinding, const RepairTally& tally) {
      bytes += tally.entities.capacity() * sizeof(EntityId);
    });
  }
  return bytes;
}

/// One repair of one session, while it has the writer lock.
class SessionRepair {
 public:
  SessionRepair(Session& session, const RepairRequest& request, const StopSignal& stop,
                absl::FunctionRef<void(size_t)> done)
      : session_(session),
        request_(request),
        stop_(stop),
        done_(done),
        once_(!request.request_id.empty() && !request.validate_only),
        fingerprint_(once_ ? FingerprintOf(request) : 0) {}

  absl::StatusOr<BatchEnding> Edit(Mesh& mesh) {
    if (once_) {
      DYNMESH_ASSIGN_OR_RETURN(remembered_, session_.FindRepair(request_.request_id, fingerprint_));
      if (remembered_ != nullptr) return BatchEnding::kRollBack;
    }
    const int64_t expected = request_.if_revision.value_or(mesh.revision());
    if (expected != mesh.revision()) return RevisionMismatch(expected, mesh.revision());
    DYNMESH_RETURN_IF_ERROR(Repair(mesh));
    outcome_.checksum = mesh.checksum();
    for (EntityKind kind : kEntityKinds) outcome_.counts[Dimension(kind)] = mesh.NumLive(kind);
    const bool unchanged = mesh.MakeSavepoint() == 0;
    return request_.validate_only || unchanged ? BatchEnding::kRollBack : BatchEnding::kCommit;
  }

  LoggedRequest Finish(const Mesh& mesh) {
    outcome_.revision = mesh.revision();
    if (remembered_ != nullptr) return {};
    remembered_ = std::make_shared<const RepairOutcome>(std::move(outcome_));
    if (!once_) return {LoggedCall::kRepair, {}, 0, {}, request_.note};
    session_.RememberRepair(request_.request_id, fingerprint_, remembered_, BytesOf(*remembered_));
    return {LoggedCall::kRepair, request_.request_id, fingerprint_, EncodeAnswer(*remembered_),
            request_.note};
  }

  std::shared_ptr<const RepairOutcome> outcome() const { return remembered_; }

 private:
  absl::Status Repair(Mesh& mesh) {
    uint64_t entities = 0;
    for (EntityKind kind : kEntityKinds) entities += mesh.slots(kind).limit();
    const uint64_t steps = request_.steps.size() * (kMaxStepsForAny + kMaxStepsForEntity * entities);
    MeshMeter meter({mesh.memory_bytes(), session_.limits().max_session_bytes, steps, "max_repair_work"},
                    stop_);
    DYNMESH_RETURN_IF_ERROR(meter.ChargeBytes(0));
    done_(0);
    DYNMESH_RETURN_IF_ERROR(
        RepairMesh(mesh, request_.steps, meter, [this](size_t i, const RepairReport& report) {
          outcome_.reports.push_back(report);
          done_(i + 1);
        }));
    const uint64_t max_bytes = session_.limits().max_session_bytes;  // the meter was told estimates
    const uint64_t bytes = mesh.memory_bytes();
    return bytes <= max_bytes ? absl::OkStatus() : LimitExceeded("max_session_bytes", max_bytes, bytes);
  }

  Session& session_;
  const RepairRequest& request_;
  const StopSignal& stop_;
  const absl::FunctionRef<void(size_t)> done_;
  const bool once_;  ///< a retry gets the first answer
  const uint64_t fingerprint_;
  RepairOutcome outcome_;
  std::shared_ptr<const RepairOutcome> remembered_;
};

}  // namespace

absl::StatusOr<std::shared_ptr<const RepairOutcome>> RepairSession(Session& session,
                                                                   const RepairRequest& request,
                                                                   const StopSignal& stop,
                                                                   absl::FunctionRef<void(size_t)> done) {
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(request.request_id));
  DYNMESH_RETURN_IF_ERROR(CheckNote(request.note));
  if (request.steps.size() > kMaxRepairSteps) {
    return BadField("steps", absl::StrCat("a repair has at most ", kMaxRepairSteps, " steps"));
  }
  SessionRepair repair(session, request, stop, done);
  DYNMESH_RETURN_IF_ERROR(session.EditMesh([&](Mesh& mesh) { return repair.Edit(mesh); },
                                           [&](const Mesh& mesh) { return repair.Finish(mesh); }));
  return repair.outcome();
}

}  // namespace dynmesh
