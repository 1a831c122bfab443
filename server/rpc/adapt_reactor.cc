#include "server/rpc/adapt_reactor.h"

#include <utility>

#include "core/mesh/error.h"
#include "server/rpc/convert.h"
#include "server/rpc/convert_adapt.h"
#include "server/rpc/session_work.h"
#include "server/rpc/status.h"
#include "server/rpc/unary.h"
#include "server/session/catch_exceptions.h"

namespace dynmesh {
namespace {

constexpr char kAdaptRpc[] = "AdaptSession";

}  // namespace

AdaptReactor* AdaptReactor::Start() {
  const absl::Status posted = CatchExceptions([this] { return PostStart(); });
  if (!posted.ok()) EndWith(posted);
  return this;
}

absl::Status AdaptReactor::PostStart() {
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services_.registry.Find(request_.session()));
  return PostWork(services_, session, {AccessMode::kRead, /*heavy=*/true, request_.ByteSizeLong()},
                  [this, session](AccessGrant grant) {
                    GoOnAfter(CatchExceptions([&] { return Begin(session, std::move(grant)); }));
                  });
}

/// Whatever fails, also for want of memory, ends the call.
void AdaptReactor::PostNext(AccessMode mode, Work work) {
  const auto run = [this, mode, work] {
    GoOnAfter(CatchExceptions([&] { return (this->*work)(adaptation_->session().access().Acquire(mode)); }));
  };
  const absl::Status posted = CatchExceptions([&] {
    services_.heavy().Post(run);
    return absl::OkStatus();
  });
  if (!posted.ok()) EndWith(posted);
}

void AdaptReactor::GoOnAfter(const absl::Status& status) {
  if (!status.ok() || concluded_) return EndWith(status);
  if (adaptation_->done()) return PostNext(AccessMode::kRead, &AdaptReactor::Conclude);
  PostNext(AccessMode::kWrite, &AdaptReactor::Step);
}

absl::Status AdaptReactor::Begin(const SessionPtr& session, AccessGrant) {
  DYNMESH_RETURN_IF_ERROR(stop_.Check());
  DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
  DYNMESH_ASSIGN_OR_RETURN(const AdaptOptions options, ToAdaptOptions(request_, services_.limits()));
  DYNMESH_ASSIGN_OR_RETURN(adaptation_, Adaptation::Start(session, services_.registry.adaptation_budget(),
                                                          options, ToNote(request_.note())));
  return absl::OkStatus();
}

absl::Status AdaptReactor::Step(AccessGrant grant) {
  DYNMESH_RETURN_IF_ERROR(stop_.Check());
  DYNMESH_RETURN_IF_ERROR(adaptation_->Step());
  grant.Release();
  WriteProgress();
  return absl::OkStatus();
}

absl::Status AdaptReactor::Conclude(AccessGrant grant) {
  DYNMESH_RETURN_IF_ERROR(stop_.Check());
  DYNMESH_ASSIGN_OR_RETURN(const AdaptResult result, adaptation_->Finish());
  grant.Release();
  DYNMESH_RETURN_IF_ERROR(adaptation_->session().WaitUntilAcknowledged(adaptation_->revision()));
  FromAdaptResult(result, adaptation_->revision(), result_.mutable_result());
  result_.mutable_result()->set_durable_revision(adaptation_->session().durable_revision());
  concluded_ = true;
  return absl::OkStatus();
}

void AdaptReactor::WriteProgress() {
  {
    MutexLock lock(&mu_);
    if (writing_) return;  // nobody else begins to write before the end
  }
  FromAdaptProgress(adaptation_->progress(), adaptation_->revision(), progress_.mutable_progress());
  {
    MutexLock lock(&mu_);
    writing_ = true;  // last: memory may have run out before
  }
  StartWrite(&progress_);
}

void AdaptReactor::OnWriteDone(bool) {
  absl::Status end;
  {
    MutexLock lock(&mu_);
    writing_ = false;
    if (!ending_) return;
    end = end_;
  }
  FinishNow(end);
}

void AdaptReactor::EndWith(const absl::Status& status) {
  adaptation_ = nullptr;  // gives its place back before the peer knows that it may come again
  {
    MutexLock lock(&mu_);
    ending_ = true;
    end_ = status;
    if (writing_) return;  // OnWriteDone finishes
  }
  FinishNow(status);
}

void AdaptReactor::FinishNow(const absl::Status& status) {
  if (status.ok()) {
    StartWriteAndFinish(&result_, grpc::WriteOptions(), grpc::Status::OK);
  } else {
    Finish(LoggedStatus(kAdaptRpc, status));
  }
}

}  // namespace dynmesh
