// Session::MoveInHistory: undoing and redoing batches.

#include <deque>
#include <memory>
#include <utility>

#include "core/edit/restore_batches.h"
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

LoggedRequest RequestOf(const HistoryOptions& options, uint64_t fingerprint, const HistoryResult& result) {
  if (options.request_id.empty()) return {LoggedCall::kHistory};
  return {LoggedCall::kHistory, options.request_id, fingerprint, EncodeAnswer(result)};
}

}  // namespace

absl::StatusOr<Session::HistoryAnswerPtr> Session::MoveInHistory(HistoryMove move,
                                                                 const HistoryOptions& options,
                                                                 const StopSignal& stop) {
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(options.request_id));
  const int64_t revision_before = revision();
  absl::StatusOr<HistoryAnswerPtr> answer;
  {
    WriterMutexLock lock(&mu_);
    DYNMESH_RETURN_IF_ERROR(CheckEditable());
    const bool once = !options.request_id.empty() && !options.validate_only;
    answer = once ? MoveOnce(move, options, stop) : MoveLocked(move, options, 0, stop);
  }
  if (revision() != revision_before) WakeFollowers();
  return answer;
}

absl::StatusOr<Session::HistoryAnswerPtr> Session::MoveOnce(HistoryMove move, const HistoryOptions& options,
                                                            const StopSignal& stop) {
  const uint64_t fingerprint = FingerprintOf(move, options);
  DYNMESH_ASSIGN_OR_RETURN(HistoryAnswerPtr remembered,
                           history_answers_.Find(options.request_id, fingerprint));
  if (remembered != nullptr) return remembered;
  DYNMESH_ASSIGN_OR_RETURN(HistoryAnswerPtr answer, MoveLocked(move, options, fingerprint, stop));
  history_answers_.Remember(options.request_id, fingerprint, answer, sizeof(HistoryResult));
  return answer;
}

absl::StatusOr<Session::HistoryAnswerPtr> Session::MoveLocked(HistoryMove move, const HistoryOptions& options,
                                                              uint64_t fingerprint, const StopSignal& stop) {
  DYNMESH_RETURN_IF_ERROR(CheckRevision(options.if_revision));
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<const BatchImage*> images, history_.Last(move, options.count));
  MeshMeter meter({.used_bytes = 0, .max_bytes = limits().max_session_bytes}, stop);
  absl::StatusOr<RestoredBatches> restored;
  const absl::Status edited = RunEdit([&] {
    restored = RestoreBatches(mesh_, images,
                              {.dry_run = options.validate_only,
                               .meter = meter,
                               .max_image_bytes = history_.max_bytes(),
                               .keeper = log_.get()});
    return restored.status();
  });
  if (!edited.ok()) return edited;
  HistoryResult result = {restored->revision, options.count, restored->checksum, restored->counts};
  if (!options.validate_only) {
    Moved(move, options.count, std::move(restored->images));
    Committed();
  }
  result.undoable_batches = history_.size(HistoryMove::kUndo);
  result.redoable_batches = history_.size(HistoryMove::kRedo);
  if (!options.validate_only) Log([&] { return RequestOf(options, fingerprint, result); });
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
