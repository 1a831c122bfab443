#include "server/rpc/import_reactor.h"

#include <algorithm>
#include <utility>

#include "absl/time/clock.h"
#include "core/mesh/error.h"
#include "server/rpc/convert.h"
#include "server/rpc/convert_sessions.h"
#include "server/rpc/status.h"
#include "server/rpc/unary.h"
#include "server/session/catch_exceptions.h"
#include "server/session/selection.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

constexpr char kImportRpc[] = "ImportMesh";
constexpr char kReceiving[] = "receiving";
constexpr char kBuilding[] = "building";
constexpr uint64_t kItemsPerReport = 100'000;

}  // namespace

ImportReactor* ImportReactor::Start() {
  {
    MutexLock lock(&watch_->mu);
    watch_->reactor = this;
  }
  WatchUntil(absl::Now() + services_.limits().import_idle_timeout);
  ReadNext();
  return this;
}

void ImportReactor::OnDone() {
  {
    MutexLock lock(&watch_->mu);
    watch_->reactor = nullptr;
  }
  delete this;
}

void ImportReactor::ReadNext() {
  {
    MutexLock lock(&mu_);
    waiting_since_ = absl::Now();
  }
  StartRead(&request_);
}

void ImportReactor::WatchUntil(absl::Time when) {
  services_.registry.workers().timer->RunAt(when, [watch = watch_] {
    MutexLock lock(&watch->mu);
    if (watch->reactor != nullptr) watch->reactor->OnWatch();
  });
}

// Holds watch_->mu, so OnDone() waits.
void ImportReactor::OnWatch() {
  const absl::Duration timeout = services_.limits().import_idle_timeout;
  const absl::Time now = absl::Now();
  Phase phase;
  absl::Time due;
  {
    MutexLock lock(&mu_);
    phase = phase_;
    due = std::min(waiting_since_, now) + timeout;
    if (phase == Phase::kReceiving && due <= now)
      phase_ = Phase::kFinishing;  // a read that ends now is ignored
  }
  if (phase == Phase::kBuilding) return;
  if (due > now || phase == Phase::kReceiving) WatchUntil(due > now ? due : now + timeout);
  if (due > now) return;
  if (phase == Phase::kReceiving) return services_.quick().Post([this] { EndIdle(); });
  context_->TryCancel();  // a write is in flight that the peer does not read
}

void ImportReactor::EndIdle() {
  importer_ = nullptr;
  EndWith(ImportIdle(services_.limits().import_idle_timeout));
}

void ImportReactor::OnReadDone(bool ok) {
  {
    MutexLock lock(&mu_);
    waiting_since_ = absl::InfiniteFuture();
    if (phase_ == Phase::kFinishing) return;
  }
  if (ok) return Post(services_.quick(), &ImportReactor::StageAndReadNext);
  if (importer_ == nullptr) {
    return EndWith(cancelled_ ? CallCancelled() : BadField("header", "an import begins with a header"));
  }
  Announce();
}

void ImportReactor::Post(Executor& executor, void (ImportReactor::*step)()) {
  const absl::Status posted = executor.TryPost([this, step] { (this->*step)(); }, request_.ByteSizeLong());
  if (!posted.ok()) EndWith(posted);
}

void ImportReactor::StageAndReadNext() {
  const absl::Status staged = cancelled_ ? CallCancelled() : CatchExceptions([this] { return Stage(); });
  if (!staged.ok()) {
    importer_ = nullptr;
    return EndWith(staged);
  }
  if (importer_->num_received() >= next_report_) {
    next_report_ = importer_->num_received() + kItemsPerReport;
    WriteProgress(kReceiving, importer_->num_received(), importer_->num_announced());
  }
  ReadNext();
}

absl::Status ImportReactor::Stage() {
  DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
  if (importer_ != nullptr) return StagePart(&request_, importer_->staged());
  if (!request_.has_header()) return BadField("header", "an import begins with a header");
  return BeginImport(request_.header());
}

absl::Status ImportReactor::BeginImport(const v1::ImportHeader& header) {
  DYNMESH_ASSIGN_OR_RETURN(SessionPtr session, services_.registry.Find(header.session()));
  DYNMESH_ASSIGN_OR_RETURN(const ImportOptions options, ToImportOptions(header));
  DYNMESH_ASSIGN_OR_RETURN(importer_,
                           Importer::Start(std::move(session), services_.registry.import_gate(), options));
  return absl::OkStatus();
}

void ImportReactor::Announce() {
  {
    MutexLock lock(&mu_);
    phase_ = Phase::kAnnouncing;
    waiting_since_ = absl::Now();
    if (writing_) return;  // OnWriteDone comes back here
  }
  WriteProgress(kBuilding, 0, importer_->num_received());
}

void ImportReactor::OnWriteDone(bool ok) {
  Phase phase;
  absl::Status end;
  {
    MutexLock lock(&mu_);
    writing_ = false;
    phase = phase_;
    end = end_;
    if (phase == Phase::kAnnouncing && progress_.progress().phase() == kBuilding) phase_ = Phase::kBuilding;
  }
  if (!ok) cancelled_ = true;
  if (phase == Phase::kFinishing) return EndWith(end);
  if (phase == Phase::kAnswering) return ok ? WriteIds() : EndWith(CallCancelled());
  if (phase != Phase::kAnnouncing) return;
  if (!ok) return EndWith(CallCancelled());
  if (progress_.progress().phase() != kBuilding) return Announce();
  Post(services_.heavy(), &ImportReactor::Build);
}

void ImportReactor::Build() {
  const absl::Status built = CatchExceptions([this]() -> absl::Status {
    DYNMESH_RETURN_IF_ERROR(lease_.Grow(importer_->num_slot_bytes()));  // before anything is changed
    DYNMESH_ASSIGN_OR_RETURN(answer_, importer_->Finish(*this));
    FromImportOutcome(*answer_.outcome, result_.mutable_result());
    return absl::OkStatus();
  });
  importer_ = nullptr;  // leaves the gate before the peer knows that it may come again
  if (!built.ok()) return EndWith(built);
  WatchUntil(absl::Now() + services_.limits().import_idle_timeout);
  {
    MutexLock lock(&mu_);
    phase_ = Phase::kAnswering;
    waiting_since_ = absl::Now();
    if (writing_) return;  // OnWriteDone comes back here
  }
  WriteIds();
}

bool ImportReactor::TakeIds() {
  while (ids_kind_ < kNumEntityKinds && ids_next_ == answer_.slots[ids_kind_].size()) {
    lease_.Shrink(ids_next_ * sizeof(Slot));
    answer_.slots[ids_kind_++] = {};
    ids_next_ = 0;
  }
  if (ids_kind_ == kNumEntityKinds) return false;
  const Permutation& slots = answer_.slots[ids_kind_];
  const size_t count = std::min(kChunkBytes / sizeof(Slot), slots.size() - ids_next_);
  ids_.mutable_ids()->set_kind(FromEntityKind(kEntityKinds[ids_kind_]));
  ids_.mutable_ids()->set_ids(slots.data() + ids_next_, count * sizeof(Slot));
  ids_next_ += count;
  return true;
}

void ImportReactor::WriteIds() {
  if (!TakeIds()) return EndWith(absl::OkStatus());
  {
    MutexLock lock(&mu_);
    writing_ = true;
    waiting_since_ = absl::Now();
  }
  StartWrite(&ids_);
}

void ImportReactor::OnProgress(uint64_t done, uint64_t total) { WriteProgress(kBuilding, done, total); }

void ImportReactor::WriteProgress(const char* phase, uint64_t done, uint64_t total) {
  {
    MutexLock lock(&mu_);
    if (writing_ || phase_ == Phase::kFinishing) return;
    writing_ = true;
    v1::ImportProgress* progress = progress_.mutable_progress();
    progress->set_phase(phase);
    progress->set_done(done);
    progress->set_total(total);
  }
  StartWrite(&progress_);
}

void ImportReactor::EndWith(const absl::Status& status) {
  {
    MutexLock lock(&mu_);
    phase_ = Phase::kFinishing;
    waiting_since_ = absl::Now();
    end_ = status;
    if (writing_) return;  // OnWriteDone comes back here
  }
  if (status.ok()) {
    StartWriteAndFinish(&result_, grpc::WriteOptions(), grpc::Status::OK);
  } else {
    Finish(LoggedStatus(kImportRpc, status));
  }
}

}  // namespace dynmesh
