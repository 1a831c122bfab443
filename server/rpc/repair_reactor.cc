#include "server/rpc/repair_reactor.h"

#include <utility>

#include "core/mesh/error.h"
#include "server/rpc/convert_repairs.h"
#include "server/rpc/status.h"
#include "server/rpc/unary.h"
#include "server/session/catch_exceptions.h"

namespace dynmesh {
namespace {

constexpr char kRepairRpc[] = "RepairSession";

/// What the findings of a step may take in an answer.
constexpr uint64_t kMaxStepBytes =
    kNumRepairFindings * (RepairTally::kMaxTold * (sizeof(Slot) + sizeof(uint8_t)) + 64);

}  // namespace

RepairReactor* RepairReactor::Start() {
  const absl::Status posted = CatchExceptions([this] { return Post(); });
  if (!posted.ok()) EndWith(posted);
  return this;
}

absl::Status RepairReactor::Post() {
  DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
  DYNMESH_ASSIGN_OR_RETURN(repair_, ToRepairRequest(request_));
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services_.registry.Find(request_.session()));
  return PostWork(services_, session, {AccessMode::kWrite, /*heavy=*/true, request_.ByteSizeLong()},
                  [this, session](AccessGrant grant) {
                    absl::Status status = stop_.Check();
                    if (status.ok()) status = CatchExceptions([&] { return Repair(*session); });
                    grant.Release();
                    if (status.ok()) status = session->WaitUntilAcknowledged(result_.result().revision());
                    result_.mutable_result()->set_durable_revision(session->durable_revision());
                    EndWith(status);
                  });
}

absl::Status RepairReactor::Repair(Session& session) {
  DYNMESH_RETURN_IF_ERROR(lease_.Grow(repair_.steps.size() * kMaxStepBytes));  // before anything is changed
  const int64_t revision = session.revision();
  DYNMESH_ASSIGN_OR_RETURN(
      const std::shared_ptr<const RepairOutcome> outcome,
      RepairSession(session, repair_, stop_, [&](size_t done) { WriteProgress(done, revision); }));
  FromRepairOutcome(*outcome, result_.mutable_result());
  return absl::OkStatus();
}

void RepairReactor::WriteProgress(size_t steps_done, int64_t revision) {
  {
    MutexLock lock(&mu_);
    if (writing_) return;
    writing_ = true;
    v1::RepairProgress* progress = progress_.mutable_progress();
    progress->set_steps_done(steps_done);
    progress->set_steps_total(repair_.steps.size());
    progress->set_revision(revision);
  }
  StartWrite(&progress_);
}

void RepairReactor::OnWriteDone(bool) {
  absl::optional<absl::Status> end;
  {
    MutexLock lock(&mu_);
    writing_ = false;
    end = end_;
  }
  // A peer that is gone is noticed by stop_; what was committed by then stays.
  if (end) WriteEnd(*end);
}

void RepairReactor::EndWith(const absl::Status& status) {
  {
    MutexLock lock(&mu_);
    end_ = status;
    if (writing_) return;  // OnWriteDone goes on
  }
  WriteEnd(status);
}

void RepairReactor::WriteEnd(const absl::Status& status) {
  if (status.ok()) {
    StartWriteAndFinish(&result_, grpc::WriteOptions(), grpc::Status::OK);
  } else {
    Finish(LoggedStatus(kRepairRpc, status));
  }
}

}  // namespace dynmesh
