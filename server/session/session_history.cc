// Undoing and redoing batches, and going back to a revision.

#include <deque>
#include <memory>
#include <utility>

#include "core/edit/restore_batches.h"
#include "core/edit/restore_revision.h"
#include "core/mesh/error.h"
#include "server/session/catch_exceptions.h"
#include "server/session/durability/answer_codec.h"
#include "server/session/fingerprint.h"
#include "server/session/mesh_meter.h"
#include "server/session/session.h"
#include "spdlog/spdlog.h"

namespace dynmesh {
namespace {

uint64_t FingerprintOf(HistoryMove move, const HistoryOptions& options) {
  Fingerprint fingerprint;
  fingerprint.AddNumber(static_cast<uint64_t>(move));
  fingerprint.AddNumber(options.count);
  fingerprint.AddNumber(options.if_revision.has_value());
  fingerprint.AddNumber(options.if_revision.value_or(0));
  return fingerprint.value();
}

uint64_t FingerprintOfRestoration(const HistoryOptions& options) {
  constexpr uint64_t kRestore = 2;  // beside those of HistoryMove
  Fingerprint fingerprint;
  fingerprint.AddNumber(kRestore);
  fingerprint.AddString(options.target);
  fingerprint.AddNumber(options.if_revision.has_value());
  fingerprint.AddNumber(options.if_revision.value_or(0));
  return fingerprint.value();
}

LoggedCall CallOf(HistoryMove move) {
  return move == HistoryMove::kUndo ? LoggedCall::kUndo : LoggedCall::kRedo;
}

/// `request` with its answer.
LoggedRequest Answered(LoggedRequest request, const HistoryResult& result) {
  if (!request.request_id.empty()) request.answer = EncodeAnswer(result);
  return request;
}

}  // namespace

absl::StatusOr<Session::HistoryAnswerPtr> Session::MoveInHistory(HistoryMove move,
                                                                 const HistoryOptions& options,
                                                                 const StopSignal& stop) {
  const LoggedRequest request{
      CallOf(move), options.request_id, FingerprintOf(move, options), {}, options.note};
  return AnswerOnce(options, request, [&]() ABSL_NO_THREAD_SAFETY_ANALYSIS {
    return MoveLocked(move, options, request, stop);
  });
}

absl::StatusOr<Session::HistoryAnswerPtr> Session::RestoreTo(const Mesh& then, const HistoryOptions& options,
                                                             const StopSignal& stop) {
  const LoggedRequest request{
      LoggedCall::kRestore, options.request_id, FingerprintOfRestoration(options), {}, options.note};
  return AnswerOnce(options, request, [&]() ABSL_NO_THREAD_SAFETY_ANALYSIS {
    return RestoreLocked(then, options, request, stop);
  });
}

absl::StatusOr<Session::HistoryAnswerPtr> Session::FindRestoration(const HistoryOptions& options) const {
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(options.request_id));
  if (options.request_id.empty() || options.validate_only) return HistoryAnswerPtr();
  ReaderMutexLock lock(&mu_);
  return history_answers_.Find(options.request_id, FingerprintOfRestoration(options));
}

absl::StatusOr<Session::HistoryAnswerPtr> Session::AnswerOnce(
    const HistoryOptions& options, const LoggedRequest& request,
    absl::FunctionRef<absl::StatusOr<HistoryAnswerPtr>()> answer_now) {
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(options.request_id));
  DYNMESH_RETURN_IF_ERROR(CheckNote(options.note));
  const int64_t revision_before = revision();
  absl::StatusOr<HistoryAnswerPtr> answer;
  {
    WriterMutexLock lock(&mu_);
    DYNMESH_RETURN_IF_ERROR(CheckEditable());
    const bool once = !options.request_id.empty() && !options.validate_only;
    if (once) {
      DYNMESH_ASSIGN_OR_RETURN(HistoryAnswerPtr remembered,
                               history_answers_.Find(options.request_id, request.fingerprint));
      if (remembered != nullptr) return remembered;
    }
    DYNMESH_ASSIGN_OR_RETURN(answer, answer_now());
    if (once) {
      history_answers_.Remember(options.request_id, request.fingerprint, *answer, sizeof(HistoryResult));
    }
  }
  if (revision() != revision_before) WakeFollowers();
  return answer;
}

absl::StatusOr<Session::HistoryAnswerPtr> Session::MoveLocked(HistoryMove move, const HistoryOptions& options,
                                                              const LoggedRequest& request,
                                                              const StopSignal& stop) {
  DYNMESH_RETURN_IF_ERROR(CheckRevision(options.if_revision));
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<const BatchImage*> images, history_.Last(move, options.count));
  DYNMESH_ASSIGN_OR_RETURN(RestoredBatches restored,
                           RunRestore(options, stop, [&](const RestoreOptions& restore) {
                             return RestoreBatches(mesh_, images, restore);
                           }));
  if (!options.validate_only) {
    Moved(move, options.count, std::move(restored.images));
    Committed();
  }
  return Restored({restored.revision, options.count, restored.checksum, restored.counts}, options, request);
}

absl::StatusOr<Session::HistoryAnswerPtr> Session::RestoreLocked(const Mesh& then,
                                                                 const HistoryOptions& options,
                                                                 const LoggedRequest& request,
                                                                 const StopSignal& stop) {
  DYNMESH_RETURN_IF_ERROR(CheckRevision(options.if_revision));
  DYNMESH_ASSIGN_OR_RETURN(RestoredBatches restored,
                           RunRestore(options, stop, [&](const RestoreOptions& restore) {
                             return RestoreRevision(mesh_, then, restore);
                           }));
  if (!options.validate_only) {
    if (!restored.images.empty()) Remember(std::move(restored.images.front()));
    Committed();
    MakeRoom(mesh_.memory_bytes());
  }
  HistoryResult result{restored.revision, 0, restored.checksum, restored.counts};
  result.target_revision = then.revision();
  return Restored(result, options, request);
}

absl::StatusOr<RestoredBatches> Session::RunRestore(
    const HistoryOptions& options, const StopSignal& stop,
    absl::FunctionRef<absl::StatusOr<RestoredBatches>(const RestoreOptions&)> restore) {
  MeshMeter meter({.used_bytes = 0, .max_bytes = limits().max_session_bytes}, stop);
  absl::StatusOr<RestoredBatches> restored;
  DYNMESH_RETURN_IF_ERROR(RunEdit([&] {
    restored = restore({.dry_run = options.validate_only,
                        .meter = meter,
                        .max_image_bytes = history_.max_bytes(),
                        .keeper = log_.get()});
    return restored.status();
  }));
  return restored;
}

/// The answer of what was restored, which is logged if it is to stay.
Session::HistoryAnswerPtr Session::Restored(HistoryResult result, const HistoryOptions& options,
                                            const LoggedRequest& request) {
  result.undoable_batches = history_.size(HistoryMove::kUndo);
  result.redoable_batches = history_.size(HistoryMove::kRedo);
  if (!options.validate_only) Log([&] { return Answered(request, result); });
  return std::make_shared<const HistoryResult>(result);
}

void Session::Moved(HistoryMove move, uint32_t count, std::deque<BatchImage> images) {
  const absl::Status moved = CatchExceptions([&]() ABSL_NO_THREAD_SAFETY_ANALYSIS {
    history_.Moved(move, count, std::move(images), mesh_.revision());
    return absl::OkStatus();
  });
  if (!moved.ok()) spdlog::warn("undo_forgotten name={} error=\"{}\"", name(), moved.ToString());
}

}  // namespace dynmesh
