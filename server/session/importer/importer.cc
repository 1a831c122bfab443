#include "server/session/importer/importer.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "server/session/answer_memory.h"
#include "server/session/durability/answer_codec.h"
#include "server/session/fingerprint.h"
#include "server/session/heap.h"
#include "server/session/revisions.h"
#include "server/session/session_errors.h"
#include "spdlog/spdlog.h"

namespace dynmesh {
namespace {

absl::Status CheckAnnounced(const ImportOptions& options, const Limits& limits) {
  if (options.num_vertices > limits.max_vertices) {
    return LimitExceeded("max_vertices", limits.max_vertices, options.num_vertices);
  }
  const uint64_t max_elements = uint64_t{limits.max_edges} + limits.max_faces + limits.max_cells;
  if (options.num_elements > max_elements) {
    return LimitExceeded("max_cells", limits.max_cells, options.num_elements);
  }
  return absl::OkStatus();
}

absl::Status CheckAnnouncedCount(absl::string_view what, uint64_t announced, uint64_t received) {
  if (announced == 0 || announced == received) return absl::OkStatus();
  return InvalidArgument(reason::kCountMismatch,
                         absl::StrCat(announced, " ", what, " were announced and ", received, " arrived"),
                         {{"field", absl::StrCat("num_", what)},
                          {"expected", absl::StrCat(announced)},
                          {"actual", absl::StrCat(received)}});
}

}  // namespace

absl::StatusOr<std::unique_ptr<ImportGate::Ticket>> ImportGate::Enter() {
  auto ticket = std::make_unique<Ticket>(count_);
  const uint32_t count = ++count_;
  if (count > max_imports_) return LimitExceeded("max_concurrent_imports", max_imports_, count);
  return ticket;
}

absl::StatusOr<std::unique_ptr<Importer>> Importer::Start(SessionPtr session, ImportGate& gate,
                                                          const ImportOptions& options) {
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(options.request_id));
  DYNMESH_RETURN_IF_ERROR(CheckNote(options.note));
  DYNMESH_RETURN_IF_ERROR(CheckAnnounced(options, session->limits()));
  // A retry has to arrive in full before it is known to be one.
  if (options.request_id.empty() || options.validate_only) DYNMESH_RETURN_IF_ERROR(session->CheckEmpty());
  DYNMESH_ASSIGN_OR_RETURN(std::unique_ptr<ImportGate::Ticket> ticket, gate.Enter());
  return std::unique_ptr<Importer>(
      new Importer(std::move(session), std::move(ticket), Lease(gate.staged()), options));
}

Importer::Importer(SessionPtr session, std::unique_ptr<ImportGate::Ticket> ticket, Lease staged,
                   const ImportOptions& options)
    : session_(std::move(session)),
      ticket_(std::move(ticket)),
      options_(options),
      staged_(session_->limits(), std::move(staged)) {}

absl::StatusOr<ImportAnswer> Importer::Finish(ImportMonitor& monitor) {
  DYNMESH_RETURN_IF_ERROR(CheckCounts());
  if (options_.request_id.empty() || options_.validate_only) return BuildAndAdopt(monitor, 0);
  const uint64_t fingerprint = Fingerprint();
  DYNMESH_RETURN_IF_ERROR(AwaitLoaded(*session_));  // else it does not know of the first one
  DYNMESH_ASSIGN_OR_RETURN(OutcomePtr remembered, session_->FindImport(options_.request_id, fingerprint));
  if (remembered != nullptr) return AnswerAgain(std::move(remembered), monitor);
  DYNMESH_RETURN_IF_ERROR(session_->CheckEmpty());
  DYNMESH_ASSIGN_OR_RETURN(ImportAnswer answer, BuildAndAdopt(monitor, fingerprint));
  session_->RememberImport(options_.request_id, fingerprint, answer.outcome);
  return answer;
}

uint64_t Importer::Fingerprint() const {
  class Fingerprint fingerprint;
  fingerprint.AddNumber(staged_.Fingerprint());
  fingerprint.AddNumber(static_cast<uint64_t>(options_.slot_order));
  return fingerprint.value();
}

BulkOptions Importer::BuildOptions() const {
  return {{session_->duplicates(), ToMeshLimits(session_->limits())}, options_.slot_order};
}

// The slots of the first answer follow from what was sent: they are not kept, but found again.
absl::StatusOr<ImportAnswer> Importer::AnswerAgain(OutcomePtr remembered, ImportMonitor& monitor) {
  ImportAnswer answer{std::move(remembered), {}};
  if (options_.slot_order == SlotOrder::kCaller) return answer;
  MeshBuilder builder(BuildOptions(), session_->limits(), monitor);
  DYNMESH_RETURN_IF_ERROR(builder.Build(std::move(staged_)).status());
  answer.slots = std::move(builder.slots());
  return answer;
}

absl::Status Importer::CheckCounts() const {
  DYNMESH_RETURN_IF_ERROR(CheckAnnouncedCount("vertices", options_.num_vertices, staged_.num_vertices()));
  DYNMESH_RETURN_IF_ERROR(CheckAnnouncedCount("elements", options_.num_elements, staged_.num_elements()));
  return staged_.CheckColumns();
}

// With the relations that the session stores, so that Adopt() need not fill them under its lock.
absl::StatusOr<Mesh> Importer::Build(MeshBuilder& builder) {
  DYNMESH_ASSIGN_OR_RETURN(Mesh mesh, builder.Build(std::move(staged_)));
  session_->access().Acquire(AccessMode::kRead).Release();  // it may still be loading
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Relation> stored,
                           session_->ReadAs<std::vector<Relation>>([](const SessionView& view) {
                             return absl::StatusOr<std::vector<Relation>>(StoredRelationsOf(view.mesh));
                           }));
  DYNMESH_RETURN_IF_ERROR(StoreJust(mesh, stored, session_->limits().max_session_bytes));
  return mesh;
}

LoggedRequest Importer::RequestOf(uint64_t fingerprint, const ImportOutcome& outcome) const {
  if (options_.request_id.empty()) return {LoggedCall::kImport, {}, 0, {}, options_.note};
  return {LoggedCall::kImport, options_.request_id, fingerprint, EncodeAnswer(outcome), options_.note};
}

absl::StatusOr<ImportAnswer> Importer::BuildAndAdopt(ImportMonitor& monitor, uint64_t fingerprint) {
  const absl::Time begin = absl::Now();
  MeshBuilder builder(BuildOptions(), session_->limits(), monitor);
  DYNMESH_ASSIGN_OR_RETURN(Mesh mesh, Build(builder));
  auto outcome = std::make_shared<ImportOutcome>();
  outcome->warnings = builder.warnings();
  // Described before others can edit it: the answer speaks of the import alone.
  outcome->info = session_->Describe(mesh, SummaryCache().Of(mesh), NowToTheMicrosecond());
  if (options_.validate_only) {
    outcome->info.revision = 0;
    outcome->info.etag.clear();
  }
  outcome->revision = outcome->info.revision;
  outcome->info.durable_revision = outcome->revision;  // it is told once it is there
  if (monitor.cancelled()) return CallCancelled();
  if (!options_.validate_only) {
    DYNMESH_RETURN_IF_ERROR(session_->Adopt(mesh, RequestOf(fingerprint, *outcome)));
  }
  spdlog::info("import session={} vertices={} cells={} validate_only={} build_ms={}", session_->name(),
               outcome->info.counts[0], outcome->info.counts[3], options_.validate_only,
               absl::ToInt64Milliseconds(absl::Now() - begin));
  TrimHeap();
  return ImportAnswer{std::move(outcome), std::move(builder.slots())};
}

}  // namespace dynmesh
