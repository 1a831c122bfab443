#ifndef DYNMESH_SERVER_RPC_IMPORT_REACTOR_H_
#define DYNMESH_SERVER_RPC_IMPORT_REACTOR_H_

#include <atomic>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "dynmesh/v1/sessions.pb.h"
#include "grpcpp/support/server_callback.h"
#include "server/rpc/service_context.h"
#include "server/session/importer/importer.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// One ImportMesh call.
///
///     read ──> stage (quick executor) ──> read ... ──> half-closed ──> announce "building"
///          ──> build (heavy executor) ──> ids, if they are not the caller's ──> result
///
/// The announcement has to be written before the build begins: a read that ends looks the same whether the
/// peer is done or gone, but to one who is gone nothing can be written. So a cut stream is never taken for a
/// short mesh. Ids that wait to be read count as an answer, no longer as an import. A peer that sends nothing
/// for import_idle_timeout, or does not read what it is told for as long, is not waited for: it would keep
/// others from importing. Progress is written when no write is in flight, and left out else. Deletes itself.
class ImportReactor final : public grpc::ServerBidiReactor<v1::ImportMeshRequest, v1::ImportMeshResponse>,
                            public ImportMonitor {
 public:
  ImportReactor(const ServiceContext& services, grpc::CallbackServerContext* context)
      : services_(services), context_(context), lease_(services.registry.answer_budget()) {}

  ImportReactor* Start();

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override { cancelled_ = true; }
  void OnDone() override;

  void OnProgress(uint64_t done, uint64_t total) override;
  bool cancelled() override { return cancelled_; }

 private:
  /// What the timer, which cannot be stopped, holds of a reactor that may be gone.
  struct Watch {
    Mutex mu;
    ImportReactor* reactor ABSL_GUARDED_BY(mu);
  };

  enum class Phase { kReceiving, kAnnouncing, kBuilding, kAnswering, kFinishing };

  absl::Status Stage();
  absl::Status BeginImport(const v1::ImportHeader& header);
  void StageAndReadNext();
  void ReadNext() ABSL_LOCKS_EXCLUDED(mu_);
  void WatchUntil(absl::Time when);
  void OnWatch() ABSL_LOCKS_EXCLUDED(mu_);
  void EndIdle();
  void Announce();
  void Build();
  /// Puts the next ids into ids_; false when all are told.
  bool TakeIds();
  /// Writes the next ids; after the last, the result.
  void WriteIds() ABSL_LOCKS_EXCLUDED(mu_);
  void WriteProgress(const char* phase, uint64_t done, uint64_t total) ABSL_LOCKS_EXCLUDED(mu_);
  /// Ends the call, after the write that is in flight. Called once.
  void EndWith(const absl::Status& status) ABSL_LOCKS_EXCLUDED(mu_);
  void Post(Executor& executor, void (ImportReactor::*step)());

  const ServiceContext services_;
  grpc::CallbackServerContext* const context_;
  const std::shared_ptr<Watch> watch_ = std::make_shared<Watch>();
  std::atomic<bool> cancelled_{false};
  std::unique_ptr<Importer> importer_;
  uint64_t next_report_ = 0;  ///< items received at which progress is due
  v1::ImportMeshRequest request_;
  ImportAnswer answer_;
  Lease lease_;       ///< of the daemon's max_answer_bytes: the ids that wait to be read
  int ids_kind_ = 0;  ///< of the ids to be told next
  size_t ids_next_ = 0;
  v1::ImportMeshResponse progress_;
  v1::ImportMeshResponse ids_;
  v1::ImportMeshResponse result_;

  Mutex mu_;
  Phase phase_ ABSL_GUARDED_BY(mu_) = Phase::kReceiving;
  bool writing_ ABSL_GUARDED_BY(mu_) = false;
  absl::Status end_ ABSL_GUARDED_BY(mu_);
  /// Since when the peer is waited for; infinite future: it is not.
  absl::Time waiting_since_ ABSL_GUARDED_BY(mu_) = absl::InfiniteFuture();
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_IMPORT_REACTOR_H_
