// What a session does so that it outlives the process: its log, loading, checkpoints.

#include <thread>
#include <utility>

#include "core/mesh/error.h"
#include "server/session/catch_exceptions.h"
#include "server/session/durability/answer_codec.h"
#include "server/session/durability/manifest.h"
#include "server/session/durability/recover.h"
#include "server/session/session.h"
#include "server/session/session_errors.h"
#include "spdlog/spdlog.h"

namespace dynmesh {
namespace {

/// Remembers an answer that was stored as bytes.
template <typename Answer>
absl::Status RememberIn(AnswerMemory<Answer>& memory, const LoggedRequest& request,
                        absl::StatusOr<Answer> answer) {
  if (!answer.ok()) return answer.status();
  memory.Remember(request.request_id, request.fingerprint, std::make_shared<const Answer>(*std::move(answer)),
                  request.answer.size());
  return absl::OkStatus();
}

}  // namespace

// ---- Loading ----

void Session::EnsureLoaded() {
  if (load_begun_.exchange(true)) return;
  if (!load_failed_) {  // its turn comes before that of whoever asks next
    access_->Post(AccessMode::kWrite, *workers().heavy,
                  [self = shared_from_this()](AccessGrant) { self->Load(); });
    return;
  }
  // Others may hold threads while they wait for their turn: with a turn and no thread it would wait for them.
  workers().heavy->Post([self = shared_from_this()] {
    const AccessGrant turn = self->access().Acquire(AccessMode::kWrite);
    self->Load();
  });
}

void Session::Load() {
  absl::StatusOr<RecoveredSession> recovered;
  const absl::Status read = CatchExceptions([&] {
    recovered = RecoverSession(log_->store(), limits());
    if (recovered.ok()) DYNMESH_RETURN_IF_ERROR(ForgetWrongOrigin(*recovered));
    if (recovered.ok()) StoreRelationsAgain(recovered->mesh);
    return recovered.status();
  });
  WriterMutexLock lock(&mu_);
  if (absl::IsNotFound(gone_)) return;  // deleted meanwhile
  const absl::Status loaded =
      read.ok() ? CatchExceptions([&]() ABSL_NO_THREAD_SAFETY_ANALYSIS { return LoadLocked(*recovered); })
                : read;
  if (loaded.ok()) {
    gone_ = absl::OkStatus();
    state_ = SessionState::kLoaded;
    spdlog::info("session_loaded name={} revision={}", name(), mesh_.revision());
    return;
  }
  gone_ = loaded;
  // What may be better next time is tried again then; what is damaged stays so.
  if (absl::IsDataLoss(loaded) || absl::IsFailedPrecondition(loaded)) {
    state_ = SessionState::kDamaged;
  } else {
    load_failed_ = true;
    load_begun_ = false;
  }
  spdlog::error("session_not_loaded name={} error=\"{}\"", name(), loaded.ToString());
}

/// Without those that it has no room for: answers are the same.
void Session::StoreRelationsAgain(Mesh& mesh) const {
  const absl::Status stored = StoreJust(mesh, options_.settings.stored_relations, limits().max_session_bytes);
  if (!stored.ok()) spdlog::warn("relations_not_stored name={} error=\"{}\"", name(), stored.ToString());
}

absl::Status Session::LoadLocked(RecoveredSession& recovered) {
  log_->NoteStored(std::move(recovered.stored), recovered.changed_pages);
  if (recovered.origin.has_value()) DYNMESH_RETURN_IF_ERROR(RememberAgain(recovered.origin->request));
  for (const LoggedRequest& request : recovered.requests) DYNMESH_RETURN_IF_ERROR(RememberAgain(request));
  mesh_ = std::move(recovered.mesh);
  Committed();
  commit_time_ = recovered.commit_time;
  measured_bytes_ = mesh_.memory_bytes();
  return absl::OkStatus();
}

/// One of a later revision than the session has was never made: a crash came in between.
absl::Status Session::ForgetWrongOrigin(RecoveredSession& recovered) const {
  if (!recovered.origin.has_value() || recovered.origin->revision <= recovered.mesh.revision()) {
    return absl::OkStatus();
  }
  recovered.origin.reset();
  return log_->store().DeleteValue(kOriginName);
}

absl::Status Session::RememberAgain(const LoggedRequest& request) {
  if (request.request_id.empty()) return absl::OkStatus();
  switch (request.call) {
    case LoggedCall::kEdit:
      return RememberIn(answers_, request, DecodeBatchResult(request.answer));
    case LoggedCall::kUndo:
    case LoggedCall::kRedo:
    case LoggedCall::kRestore:
      return RememberIn(history_answers_, request, DecodeHistoryResult(request.answer));
    case LoggedCall::kRepair: {
      MutexLock lock(&repairs_mu_);
      return RememberIn(repairs_, request, DecodeRepairOutcome(request.answer));
    }
    case LoggedCall::kImport: {
      MutexLock lock(&imports_mu_);
      return RememberIn(imports_, request, DecodeImportOutcome(request.answer));
    }
    case LoggedCall::kAdaptation:
    case LoggedCall::kCreation:  // the registry remembers it
      break;
  }
  return absl::OkStatus();
}

SessionInfo Session::Outline() const {
  SessionInfo info;
  info.name = name();
  info.uid = uid();
  info.state = state();
  info.revision = revision();
  info.durable_revision = durable_revision();
  info.settings = options_.settings;
  info.create_time = create_time_;
  info.update_time = options_.update_time.value_or(create_time_);
  info.etag = EtagAt(info.revision);
  if (info.state != SessionState::kDamaged) return info;  // nobody holds the lock of a damaged one for long
  ReaderMutexLock lock(&mu_);
  info.state_message = std::string(gone_.message());
  return info;
}

// ---- Logging ----

void Session::AwaitAcknowledged(int64_t revision, Done done) {
  if (log_ == nullptr) return done(absl::OkStatus());
  log_->AwaitAcknowledged(revision, std::move(done));
}

absl::Status Session::WaitUntilAcknowledged(int64_t revision) {
  return log_ == nullptr ? absl::OkStatus() : log_->WaitUntilAcknowledged(revision);
}

absl::Status Session::WaitUntilDurable(int64_t revision) {
  return log_ == nullptr ? absl::OkStatus() : log_->WaitUntilDurable(revision);
}

void Session::AwaitDurable(int64_t revision, Done done) {
  if (log_ == nullptr) return done(absl::OkStatus());
  log_->AwaitDurable(revision, std::move(done));
}

void Session::Log(absl::FunctionRef<LoggedRequest()> request) {
  if (log_ == nullptr) return;
  const absl::Status sent = CatchExceptions([&]() ABSL_NO_THREAD_SAFETY_ANALYSIS {
    log_->Append(mesh_.revision(), commit_time_, request());
    return absl::OkStatus();
  });
  if (!sent.ok()) log_->Fail(sent);
  if (log_->IsCheckpointDue() && !writes_checkpoint_.exchange(true)) StartCheckpoint();
}

void Session::StartCheckpoint() {
  const absl::Status posted = CatchExceptions([&] {
    workers().heavy->Post([self = shared_from_this()] { self->WriteCheckpoint(); });
    return absl::OkStatus();
  });
  if (!posted.ok()) writes_checkpoint_ = false;
}

void Session::WriteCheckpoint() {
  const absl::Status written = CatchExceptions([&] {
    return log_->WriteCheckpoint([this](absl::FunctionRef<absl::Status(const Mesh&, absl::Time)> fn) {
      std::this_thread::yield();  // who holds a turn had better not lose the processor
      const AccessGrant turn = access().Acquire(AccessMode::kRead);  // so that edits come in between
      return Read([&](const SessionView& view) { return fn(view.mesh, view.commit_time); });
    });
  });
  if (!written.ok() && !absl::IsNotFound(written)) {
    spdlog::error("checkpoint_failed name={} error=\"{}\"", name(), written.ToString());
  }
  writes_checkpoint_ = false;
}

// ---- What is stored beside batches ----

// Edits meanwhile would be no part of what is stored.
absl::Status Session::StoreImport(const Mesh& mesh, absl::Time commit_time, const LoggedRequest& request) {
  {
    WriterMutexLock lock(&mu_);
    DYNMESH_RETURN_IF_ERROR(CheckEditable());
    DYNMESH_RETURN_IF_ERROR(CheckEmpty());
    stores_import_ = true;
  }
  const absl::Status stored = CatchExceptions([&] { return log_->StoreAll(mesh, commit_time, request); });
  if (stored.ok()) return stored;
  log_->store().DeleteValue(kOriginName).IgnoreError();  // nothing came of it
  WriterMutexLock lock(&mu_);
  stores_import_ = false;
  return stored;
}

absl::Status Session::StoreIdentity() {
  DYNMESH_RETURN_IF_ERROR(Read([](const SessionView&) { return absl::OkStatus(); }));
  const SessionIdentity identity{uid_,
                                 create_time_,
                                 Settings(),
                                 options_.create_request_id,
                                 options_.create_fingerprint,
                                 options_.create_revision};
  return log_->store().PutValue(kIdentityName, EncodeIdentity(identity));
}

}  // namespace dynmesh
