#include "server/rpc/check_reactor.h"

#include <string>
#include <utility>

#include "core/mesh/error.h"
#include "server/rpc/session_work.h"
#include "server/rpc/status.h"
#include "server/rpc/unary.h"
#include "server/session/catch_exceptions.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

constexpr char kCheckRpc[] = "CheckSession";

}  // namespace

CheckReactor::CheckReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                           const v1::CheckSessionRequest& request)
    : services_(services), request_(request), stop_(context), lease_(services.registry.answer_budget()) {}

CheckReactor* CheckReactor::Start() {
  const absl::Status posted = Post();
  if (!posted.ok()) Finish(LoggedStatus(kCheckRpc, posted));
  return this;
}

absl::Status CheckReactor::Post() {
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, services_.registry.Find(request_.session()));
  return PostWork(services_, session, {AccessMode::kRead, /*heavy=*/true, request_.ByteSizeLong()},
                  [this, session](AccessGrant grant) { CheckAndAnswer(*session, std::move(grant)); });
}

void CheckReactor::CheckAndAnswer(const Session& session, AccessGrant grant) {
  status_ = stop_.Check();
  if (status_.ok()) status_ = CatchExceptions([&] { return Check(session, grant); });
  grant.Release();
  {
    MutexLock lock(&mu_);
    checked_ = true;
    if (writing_) return;  // OnWriteDone goes on
    if (broken_) status_.Update(CallCancelled());
  }
  WriteNext();
}

absl::Status CheckReactor::Check(const Session& session, AccessGrant& grant) {
  DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
  DYNMESH_ASSIGN_OR_RETURN(const CheckQuestion question, ToCheckQuestion(request_));
  const QueryTerms terms{stop_, &lease_};
  if (question.part.has_value()) {
    DYNMESH_ASSIGN_OR_RETURN(report_, CheckPartOfSession(session, question, terms));
  } else {
    const auto copied = [&](int64_t revision) {
      revision_ = revision;
      grant.Release();
    };
    DYNMESH_ASSIGN_OR_RETURN(report_, CheckWholeSession(session, question, terms, *this, copied));
  }
  revision_ = report_.revision;
  pieces_ = CutFindings(report_);
  return absl::OkStatus();
}

void CheckReactor::OnProgress(absl::string_view phase, uint64_t done, uint64_t total) {
  {
    MutexLock lock(&mu_);
    if (writing_ || broken_) return;  // nobody else begins to write before all is checked
  }
  response_.set_revision(revision_);
  v1::CheckProgress* progress = response_.mutable_progress();
  progress->set_phase(std::string(phase));
  progress->set_done(done);
  progress->set_total(total);
  {
    MutexLock lock(&mu_);
    writing_ = true;  // last: memory may have run out before
  }
  StartWrite(&response_);
}

void CheckReactor::OnWriteDone(bool ok) {
  {
    MutexLock lock(&mu_);
    writing_ = false;
    broken_ |= !ok;
    if (!checked_) return;
    if (broken_) status_.Update(CallCancelled());
  }
  WriteNext();
}

void CheckReactor::WriteNext() {
  const bool is_last = next_ == pieces_.size();
  if (status_.ok()) status_ = CatchExceptions([this] { return FillNext(); });
  if (!status_.ok()) return Finish(LoggedStatus(kCheckRpc, status_));
  is_last ? StartWriteAndFinish(&response_, grpc::WriteOptions(), grpc::Status::OK) : StartWrite(&response_);
}

absl::Status CheckReactor::FillNext() {
  lease_.Shrink(response_.ByteSizeLong());
  response_.Clear();
  response_.set_revision(revision_);
  if (next_ == pieces_.size()) {
    FromSummary(report_, response_.mutable_summary());
  } else {
    FromFindings(report_, pieces_[next_++], response_.mutable_findings());
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
