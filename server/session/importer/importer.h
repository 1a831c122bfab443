#ifndef DYNMESH_SERVER_SESSION_IMPORTER_IMPORTER_H_
#define DYNMESH_SERVER_SESSION_IMPORTER_IMPORTER_H_

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/session/importer/mesh_builder.h"
#include "server/session/importer/staged_mesh.h"
#include "server/session/mesh_warnings.h"
#include "server/session/session.h"
#include "server/session/session_info.h"

namespace dynmesh {

/// What an import gave, and what a retry of it is given again.
struct ImportOutcome {
  int64_t revision = 0;  ///< 1; 0 when only validated
  SessionInfo info;      ///< when only validated: with the counts and checksum that would be
  std::vector<MeshWarning> warnings;
};

/// What Importer::Finish gives.
struct ImportAnswer {
  std::shared_ptr<const ImportOutcome> outcome;
  /// slots[kind][i] = slot of the i-th item of a kind; empty with SlotOrder::kCaller.
  std::array<Permutation, kNumEntityKinds> slots;
};

/// The fields of ImportHeader but the session.
struct ImportOptions {
  uint64_t num_vertices = 0;  ///< announced; 0: not
  uint64_t num_elements = 0;
  bool validate_only = false;
  std::string request_id = {};
  SlotOrder slot_order = SlotOrder::kCaller;
  RevisionNote note = {};
};

/// Counts the imports that are under way in a daemon, and the bytes that they have staged. Thread safety:
/// full.
class ImportGate {
 public:
  /// Leaves the gate when destroyed.
  class Ticket {
   public:
    explicit Ticket(std::atomic<uint32_t>& count) : count_(count) {}
    Ticket(const Ticket&) = delete;
    Ticket& operator=(const Ticket&) = delete;
    ~Ticket() { --count_; }

   private:
    std::atomic<uint32_t>& count_;
  };

  explicit ImportGate(const Limits& limits)
      : max_imports_(limits.max_concurrent_imports),
        staged_(std::make_shared<Budget>("max_staged_bytes", limits.max_staged_bytes)) {}

  /// Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_concurrent_imports).
  absl::StatusOr<std::unique_ptr<Ticket>> Enter();

  const std::shared_ptr<Budget>& staged() const { return staged_; }

 private:
  const uint32_t max_imports_;
  std::atomic<uint32_t> count_{0};
  const std::shared_ptr<Budget> staged_;
};

/// Fills an empty session from pieces that arrive one after the other, as revision 1.
///
///     auto importer = Importer::Start(session, gate, options);
///     importer->staged().AddPositions(...); ... importer->staged().AddElements(...); ...
///     importer->Finish(monitor);   // builds without any lock, then swaps the mesh in
///
/// Nobody sees anything before Finish has succeeded; a failed or abandoned import leaves the session empty.
/// Thread safety: that of std::vector.
class Importer {
 public:
  /// Errors: FAILED_PRECONDITION SESSION_NOT_EMPTY; RESOURCE_EXHAUSTED (also for what is announced);
  /// INVALID_ARGUMENT; NOT_FOUND SESSION_DELETED.
  static absl::StatusOr<std::unique_ptr<Importer>> Start(SessionPtr session, ImportGate& gate,
                                                         const ImportOptions& options);

  /// Where pieces go.
  StagedMesh& staged() { return staged_; }
  uint64_t num_received() const { return staged_.num_vertices() + staged_.num_elements(); }
  /// Bytes of ImportAnswer::slots.
  uint64_t num_slot_bytes() const {
    return options_.slot_order == SlotOrder::kCaller ? 0 : num_received() * sizeof(Slot);
  }
  uint64_t num_announced() const { return options_.num_vertices + options_.num_elements; }

  /// Errors: INVALID_ARGUMENT COUNT_MISMATCH and those of MeshBuilder; FAILED_PRECONDITION SESSION_NOT_EMPTY
  /// when somebody was faster; CANCELLED. To be called once, from a heavy executor.
  absl::StatusOr<ImportAnswer> Finish(ImportMonitor& monitor);

 private:
  using OutcomePtr = std::shared_ptr<const ImportOutcome>;

  Importer(SessionPtr session, std::unique_ptr<ImportGate::Ticket> ticket, Lease staged,
           const ImportOptions& options);
  absl::Status CheckCounts() const;
  uint64_t Fingerprint() const;
  BulkOptions BuildOptions() const;
  absl::StatusOr<ImportAnswer> AnswerAgain(OutcomePtr remembered, ImportMonitor& monitor);
  absl::StatusOr<ImportAnswer> BuildAndAdopt(ImportMonitor& monitor, uint64_t fingerprint);
  LoggedRequest RequestOf(uint64_t fingerprint, const ImportOutcome& outcome) const;
  absl::StatusOr<Mesh> Build(MeshBuilder& builder);

  const SessionPtr session_;
  const std::unique_ptr<ImportGate::Ticket> ticket_;
  const ImportOptions options_;
  StagedMesh staged_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_IMPORTER_IMPORTER_H_
