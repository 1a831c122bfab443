#include "server/rpc/adapt_reactor.h"

#include <utility>

#include "core/mesh/error.h"
#include "server/rpc/convert_adapt.h"
#include "server/rpc/session_work.h"
#include "server/rpc/status.h"
#include "server/rpc/unary.h"
#include "server/session/catch_exceptions.h"

namespace dynmesh {
namespace {

constexpr char kRpc[] = "AdaptSession";

}  // namespace

AdaptReactor* AdaptReactor::Start() {
  const absl::Status posted = PostStart();
  if (!posted.ok()) EndWith(posted);
  return this;
}

absl::Status AdaptReactor::PostStart() {
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services_.registry.Find(request_.session()));
  return PostWork(services_, session, {AccessMode::kRead, /*heavy=*/true, request_.ByteSizeLong()},
                  [this, session](AccessGrant grant) { StartAdaptation(session, std::move(grant)); });
}

void AdaptReactor::PostNext(AccessMode mode, Work work) {
  services_.heavy().Post([this, mode, work] {
    AccessGrant grant = adaptation_->session().access().Acquire(mode);
    (this->*work)(std::move(grant));
  });
}

void AdaptReactor::StartAdaptation(const SessionPtr& session, AccessGrant grant) {
  absl::Status started = stop_.Check();
  if (started.ok()) {
    started = CatchExceptions([&]() -> absl::Status {
      DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
      DYNMESH_ASSIGN_OR_RETURN(const AdaptOptions options, ToAdaptOptions(request_, services_.limits()));
      DYNMESH_ASSIGN_OR_RETURN(adaptation_,
                               Adaptation::Start(session, services_.registry.adaptation_budget(), options));
      return absl::OkStatus();
    });
  }
  grant.Release();
  started.ok() ? GoOn() : EndWith(started);
}

void AdaptReactor::GoOn() {
  if (adaptation_->done()) return PostNext(AccessMode::kRead, &AdaptReactor::Conclude);
  PostNext(AccessMode::kWrite, &AdaptReactor::Step);
}

void AdaptReactor::Step(AccessGrant grant) {
  absl::Status status = stop_.Check();
  if (status.ok()) status = CatchExceptions([this] { return adaptation_->Step(); });
  grant.Release();
  if (!status.ok()) return EndWith(status);
  WriteProgress();
  GoOn();
}

void AdaptReactor::Conclude(AccessGrant grant) {
  const absl::Status status = CatchExceptions([this]() -> absl::Status {
    DYNMESH_RETURN_IF_ERROR(stop_.Check());
    DYNMESH_ASSIGN_OR_RETURN(const AdaptResult result, adaptation_->Finish());
    FromAdaptResult(result, adaptation_->revision(), result_.mutable_result());
    return absl::OkStatus();
  });
  grant.Release();
  EndWith(status);
}

void AdaptReactor::WriteProgress() {
  {
    MutexLock lock(&mu_);
    if (writing_) return;
    writing_ = true;
  }
  FromAdaptProgress(adaptation_->progress(), adaptation_->revision(), progress_.mutable_progress());
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
    Finish(LoggedStatus(kRpc, status));
  }
}

}  // namespace dynmesh
