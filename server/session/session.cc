#include "server/session/session.h"

#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <utility>
#include <variant>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/check/neighborhood_check.h"
#include "core/mesh/error.h"
#include "server/session/catch_exceptions.h"
#include "server/session/durability/answer_codec.h"
#include "server/session/fingerprint.h"
#include "server/session/mesh_meter.h"
#include "server/session/session_errors.h"
#include "spdlog/spdlog.h"

namespace dynmesh {
namespace {

constexpr size_t kMaxSessionNameBytes = 64;
// A mesh is measured after so many new items, not for each batch.
constexpr uint64_t kItemsBetweenChecks = 1000;
constexpr uint64_t kBytesBetweenChecks = 64 << 10;

uint64_t FingerprintOf(absl::Span<const Edit> edits, const ApplyOptions& options) {
  Fingerprint fingerprint;
  fingerprint.AddNumber(options.as_of_revision);
  fingerprint.AddNumber(options.if_revision.has_value());
  fingerprint.AddNumber(options.if_revision.value_or(0));
  fingerprint.AddNumber(options.skip_refused);
  fingerprint.AddNumber(options.report_lineage);
  fingerprint.AddNumber(static_cast<uint64_t>(options.conflict_policy));
  for (const Edit& edit : edits) fingerprint.AddEdit(edit);
  return fingerprint.value();
}

constexpr size_t kRefusalBytes = 512;  ///< with its texts

/// Entities that the operators of one batch may look at: some seconds, during which nobody else can edit.
constexpr uint64_t kMaxBatchWork = 200'000'000;

size_t BytesOf(const BatchResult& result) {
  size_t bytes = sizeof(result) + (result.degenerate.size() + result.duplicate.size()) * sizeof(EntityId);
  for (const EditResult& edit : result.results) {
    bytes += sizeof(edit) + edit.new_slots.size() * sizeof(Slot) + edit.lineage.size() * sizeof(Lineage) +
             edit.skipped.size() * sizeof(uint32_t) + edit.refusals.size() * kRefusalBytes;
  }
  for (const BatchWarning& warning : result.warnings) {
    bytes += sizeof(warning) + warning.ids.size() * (sizeof(Slot) + sizeof(double));
  }
  return bytes;
}

LoggedRequest RequestOf(const ApplyOptions& options, uint64_t fingerprint, const BatchResult& result) {
  if (options.request_id.empty()) return {LoggedCall::kEdit, {}, 0, {}, options.note};
  return {LoggedCall::kEdit, options.request_id, fingerprint, EncodeAnswer(result), options.note};
}

bool Grows(const Edit& edit) {
  return std::holds_alternative<AddVerticesEdit>(edit) || std::holds_alternative<AddElementsEdit>(edit) ||
         std::holds_alternative<AddAttributeEdit>(edit) || std::holds_alternative<SetAttributeEdit>(edit) ||
         IsOperator(edit);
}

bool WritesRows(const Edit& edit) {
  return std::holds_alternative<SetAttributeEdit>(edit) || IsOperator(edit);
}

/// Bytes that the rows which `edits` set would add where columns and entities are there already; what else
/// they set is counted as it comes (BatchOptions::max_attribute_bytes).
uint64_t AttributeGrowth(const Mesh& mesh, absl::Span<const Edit> edits) {
  std::map<int, std::vector<Slot>> slots;  // by column
  for (const Edit& edit : edits) {
    const auto* set = std::get_if<SetAttributeEdit>(&edit);
    if (set == nullptr) continue;
    const int column = mesh.FindAttribute(set->spec.name, set->spec.kind);
    if (column < 0) continue;
    const Slot limit = mesh.slots(set->spec.kind).limit();
    for (Slot slot : set->slots) {
      if (slot < limit) slots[column].push_back(slot);
    }
  }
  uint64_t bytes = 0;
  for (const auto& [column, rows] : slots) bytes += mesh.attributes()[column].BytesToSet(rows);
  return bytes;
}

absl::Status CheckBatchSize(absl::Span<const Edit> edits, const Limits& limits) {
  if (edits.size() > limits.max_batch_edits) {
    return LimitExceeded("max_batch_edits", limits.max_batch_edits, edits.size());
  }
  uint64_t items = 0;
  for (const Edit& edit : edits) items += NumItems(edit);
  if (items > limits.max_batch_items) {
    return LimitExceeded("max_batch_items", limits.max_batch_items, items);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckSessionName(absl::string_view name) {
  const bool known_characters = std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return absl::ascii_isalnum(c) || c == '_' || c == '.' || c == '-';
  });
  if (!name.empty() && name.size() <= kMaxSessionNameBytes && known_characters &&
      absl::ascii_isalnum(name[0])) {
    return absl::OkStatus();
  }
  return InvalidArgument(
      reason::kBadSessionName,
      "a session name has 1-64 characters of [A-Za-z0-9_.-] and starts with a letter or a digit",
      {{"field", "name"}});
}

Session::Session(const Options& options, std::shared_ptr<SessionLog> log, Content content)
    : options_(options),
      uid_(options.uid.empty() ? NewUid() : options.uid),
      create_time_(options.create_time),
      log_(std::move(log)),
      mesh_(MeshOptions{options.settings.duplicates, ToMeshLimits(options.limits)}),
      commit_time_(create_time_),
      history_(options.limits),
      num_updates_(options.num_updates),
      checks_(options.settings.checks),
      retention_(options.settings.retention),
      spatial_(options.limits.max_session_bytes),
      followers_(std::make_shared<FollowerList>(options.limits.max_followers)),
      deltas_(*this) {
  // Nothing to fill: this cannot fail for relations that are storable.
  for (Relation relation : options.settings.stored_relations)
    mesh_.StoreRelation(relation, true).IgnoreError();
  if (!options.damage.ok()) {
    gone_ = options.damage;
    state_ = SessionState::kDamaged;
  }
  if (log_ == nullptr) return;
  if (content == Content::kStored) {
    gone_ = SessionLoading(name());
    revision_ = log_->durable_revision();
    state_ = SessionState::kStored;
    load_begun_ = false;
  }
  log_->WatchDurable(
      [followers = followers_] { followers->Wake(); });  // last: another session may have had it
}

Session::~Session() = default;

void Session::BeginWith(Mesh mesh, absl::Time commit_time) {
  WriterMutexLock lock(&mu_);
  mesh_ = std::move(mesh);
  Committed();
  commit_time_ = commit_time;
}

std::string Session::NewUid() {
  std::random_device device;
  return absl::StrCat(absl::Hex(uint64_t{device()} << 32 | device(), absl::kZeroPad16));
}

absl::Status Session::Read(absl::FunctionRef<absl::Status(const SessionView&)> fn) const {
  ReaderMutexLock lock(&mu_);
  DYNMESH_RETURN_IF_ERROR(gone_);
  return fn(SessionView{mesh_, commit_time_});
}

absl::StatusOr<SessionInfo> Session::Info() const {
  return ReadAs<SessionInfo>([this](const SessionView& view) {
    return Describe(view.mesh, summary_.Of(view.mesh), view.commit_time);
  });
}

SessionInfo Session::Describe(const Mesh& mesh, const MeshSummary& summary, absl::Time update_time) const {
  SessionInfo info = DescribeMesh(mesh, summary);
  info.name = name();
  info.uid = uid();
  info.durable_revision = durable_revision();
  info.settings.durability = options_.settings.durability;
  info.settings.duplicates = duplicates();
  info.settings.checks = checks();
  info.settings.retention = retention();
  info.etag = EtagAt(info.revision);
  info.create_time = create_time_;
  info.update_time = update_time;
  info.index_bytes = spatial_.memory_bytes();
  info.history_bytes = history_bytes_.load();
  info.undoable_batches = num_undoable_.load();
  info.redoable_batches = num_redoable_.load();
  info.followers = followers_->size();
  return info;
}

absl::StatusOr<Session::AnswerPtr> Session::Apply(absl::Span<const Edit> edits, const ApplyOptions& options,
                                                  const StopSignal& stop) {
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(options.request_id));
  DYNMESH_RETURN_IF_ERROR(CheckNote(options.note));
  DYNMESH_RETURN_IF_ERROR(CheckBatchSize(edits, limits()));
  const bool once = !options.request_id.empty() && !options.validate_only;
  const uint64_t fingerprint = once ? FingerprintOf(edits, options) : 0;
  const int64_t revision_before = revision();
  absl::StatusOr<AnswerPtr> answer;
  {
    WriterMutexLock lock(&mu_);
    DYNMESH_RETURN_IF_ERROR(CheckEditable());
    answer = once ? ApplyOnce(edits, options, fingerprint, stop) : ApplyLocked(edits, options, 0, stop);
  }
  if (revision() != revision_before) WakeFollowers();
  return answer;
}

void Session::WakeFollowers() {
  if (log_ == nullptr) followers_->Wake();  // else the log does when it is durable
}

absl::StatusOr<Session::AnswerPtr> Session::ApplyOnce(absl::Span<const Edit> edits,
                                                      const ApplyOptions& options, uint64_t fingerprint,
                                                      const StopSignal& stop) {
  DYNMESH_ASSIGN_OR_RETURN(AnswerPtr remembered, answers_.Find(options.request_id, fingerprint));
  if (remembered != nullptr) return remembered;
  DYNMESH_ASSIGN_OR_RETURN(AnswerPtr answer, ApplyLocked(edits, options, fingerprint, stop));
  answers_.Remember(options.request_id, fingerprint, answer, BytesOf(*answer));
  return answer;
}

absl::StatusOr<Session::AnswerPtr> Session::ApplyLocked(absl::Span<const Edit> edits,
                                                        const ApplyOptions& options, uint64_t fingerprint,
                                                        const StopSignal& stop) {
  DYNMESH_RETURN_IF_ERROR(CheckRevisions(options));
  if (edits.empty()) return Unchanged();
  DYNMESH_ASSIGN_OR_RETURN(const bool is_large, CheckMemory(edits));
  MeshMeter meter({.used_bytes = 0, .max_bytes = limits().max_session_bytes}, stop);
  BatchOptions batch{.meter = meter};
  if (options.as_of_revision != 0) batch.as_of_revision = options.as_of_revision;
  batch.dry_run = options.validate_only;
  batch.skip_refused = options.skip_refused;
  if (options.report_lineage) batch.max_lineage = kMaxLineage;
  batch.conflict_policy = options.conflict_policy;
  batch.make_image = history_.keeps_batches();
  batch.keeper = log_.get();
  batch.max_made = limits().max_batch_items;
  batch.max_work = kMaxBatchWork;
  const uint64_t used = std::any_of(edits.begin(), edits.end(), WritesRows) ? mesh_.memory_bytes() : 0;
  batch.max_attribute_bytes = limits().max_session_bytes - std::min(used, limits().max_session_bytes);
  const CheckSettings settings = checks();
  NeighborhoodCheck checker(settings);
  if (settings.AnyOn()) batch.checker = &checker;
  absl::StatusOr<BatchResult> result;
  const absl::Status applied = RunEdit([&] {
    result = ApplyBatch(mesh_, edits, batch);
    return result.status();
  });
  if (!applied.ok()) return applied;
  items_since_check_ += result->num_made;
  if (!options.validate_only) {
    Remember(std::exchange(result->image, absl::nullopt));
    Committed();
    Log([&] { return RequestOf(options, fingerprint, *result); });
    if (is_large) MakeRoom(mesh_.memory_bytes());
  }
  return std::make_shared<const BatchResult>(*std::move(result));
}

void Session::Remember(absl::optional<BatchImage> image) {
  if (!image.has_value()) return;
  if (image->num_items() == 0) return history_.Pass(mesh_.revision());
  const absl::Status added = CatchExceptions([&] {
    history_.Add(*std::move(image), mesh_.revision());
    return absl::OkStatus();
  });
  if (!added.ok()) spdlog::warn("undo_forgotten name={} error=\"{}\"", name(), added.ToString());
}

absl::Status Session::RunEdit(absl::FunctionRef<absl::Status()> fn) {
  bool returned = false;
  const absl::Status status = CatchExceptions([&] {
    absl::Status edited = fn();
    returned = true;
    return edited;
  });
  if (returned) return status;
  spdlog::error("session_damaged name={} error=\"{}\"", name(), status.ToString());
  gone_ = SessionDamaged(name());
  state_ = SessionState::kDamaged;
  return gone_;
}

absl::Status Session::EditMesh(absl::FunctionRef<absl::StatusOr<BatchEnding>(Mesh&)> edit,
                               absl::FunctionRef<LoggedRequest(const Mesh&)> ended) {
  BatchEnding ending;
  {
    WriterMutexLock lock(&mu_);
    DYNMESH_RETURN_IF_ERROR(CheckEditable());
    DYNMESH_ASSIGN_OR_RETURN(ending, EditLocked(edit));
    if (ending == BatchEnding::kCommit && log_ != nullptr) {
      Log([&] { return ended(mesh_); });
    } else {
      ended(mesh_);
    }
  }
  if (ending == BatchEnding::kCommit) WakeFollowers();
  return absl::OkStatus();
}

absl::StatusOr<BatchEnding> Session::EditLocked(absl::FunctionRef<absl::StatusOr<BatchEnding>(Mesh&)> edit) {
  absl::StatusOr<BatchEnding> wanted;
  absl::optional<BatchImage> image;
  const auto edit_and_note = [&] {
    wanted = edit(mesh_);
    const bool is_kept = wanted.ok() && *wanted == BatchEnding::kCommit && history_.keeps_batches();
    if (is_kept) image = mesh_.ImageSince(0);
    return wanted.status();
  };
  DYNMESH_RETURN_IF_ERROR(RunEdit([&] {
    const absl::Status status = RunInBatch(mesh_, edit_and_note);
    return status.ok() ? EndBatch(mesh_, *wanted, log_.get()) : status;
  }));
  items_since_check_ = kItemsBetweenChecks;
  if (*wanted == BatchEnding::kRollBack) return wanted;
  Remember(std::move(image));
  Committed();
  MakeRoom(mesh_.memory_bytes());
  return wanted;
}

absl::Status Session::CheckEditable() const {
  DYNMESH_RETURN_IF_ERROR(gone_);
  return stores_import_ ? SessionLoading(name()) : absl::OkStatus();
}

absl::Status Session::CheckRevisions(const ApplyOptions& options) const {
  const int64_t now = mesh_.revision();
  if (options.as_of_revision < 0) return BadField("as_of_revision", "as_of_revision is negative");
  if (options.as_of_revision == 0 && options.conflict_policy == ConflictPolicy::kTouched) {
    return BadField("as_of_revision", "conflict_policy says nothing without as_of_revision");
  }
  if (options.as_of_revision > now) return RevisionInFuture(options.as_of_revision, now);
  return CheckRevision(options.if_revision);
}

absl::Status Session::CheckRevision(absl::optional<int64_t> if_revision) const {
  const int64_t now = mesh_.revision();
  const int64_t expected = if_revision.value_or(now);
  return expected == now ? absl::OkStatus() : RevisionMismatch(expected, now);
}

absl::StatusOr<bool> Session::CheckMemory(absl::Span<const Edit> edits) {
  if (std::none_of(edits.begin(), edits.end(), Grows)) return false;
  for (const Edit& edit : edits) items_since_check_ += NumItems(edit);
  const uint64_t growth = AttributeGrowth(mesh_, edits);
  if (items_since_check_ < kItemsBetweenChecks && growth < kBytesBetweenChecks) return false;
  const uint64_t bytes = mesh_.memory_bytes() + growth;
  if (bytes > limits().max_session_bytes) {
    return LimitExceeded("max_session_bytes", limits().max_session_bytes, bytes);
  }
  items_since_check_ = 0;
  return true;
}

void Session::MakeRoom(uint64_t mesh_bytes) {
  const uint64_t max_bytes = limits().max_session_bytes;
  if (mesh_bytes + spatial_.memory_bytes() + history_.memory_bytes() > max_bytes) spatial_.Clear();
  history_.ShrinkTo(max_bytes - std::min(mesh_bytes, max_bytes));
  CountHistory();
  measured_bytes_ = mesh_bytes + answers_.bytes() + history_answers_.bytes();
}

void Session::CountHistory() {
  num_undoable_.store(history_.size(HistoryMove::kUndo));
  num_redoable_.store(history_.size(HistoryMove::kRedo));
  for (HistoryMove move : {HistoryMove::kUndo, HistoryMove::kRedo}) {
    num_history_items_[static_cast<int>(move)].store(history_.num_next_items(move));
  }
  history_bytes_.store(history_.memory_bytes());
}

Session::AnswerPtr Session::Unchanged() const {
  auto result = std::make_shared<BatchResult>();
  result->revision = mesh_.revision();
  result->checksum = mesh_.checksum();
  for (EntityKind kind : kEntityKinds) result->counts[Dimension(kind)] = mesh_.NumLive(kind);
  return result;
}

void Session::Committed() {
  commit_time_ = NowToTheMicrosecond();
  revision_.store(mesh_.revision());
  for (EntityKind kind : kEntityKinds) num_live_[Dimension(kind)].store(mesh_.NumLive(kind));
  history_.Follow(mesh_.revision());
  CountHistory();
}

absl::Status Session::CheckEmpty() const {
  return revision() == 0 ? absl::OkStatus() : SessionNotEmpty(name(), revision());
}

absl::Status Session::Adopt(Mesh& mesh, const LoggedRequest& request) {
  DYNMESH_RETURN_IF_ERROR(CheckEmpty());                 // else the lock may be busy for long
  const absl::Time commit_time = NowToTheMicrosecond();  // as the store has it
  if (log_ != nullptr) DYNMESH_RETURN_IF_ERROR(StoreImport(mesh, commit_time, request));
  {
    WriterMutexLock lock(&mu_);
    const absl::Status adopted =
        CatchExceptions([&]() ABSL_NO_THREAD_SAFETY_ANALYSIS { return AdoptLocked(mesh); });
    if (!adopted.ok() && stores_import_) log_->Fail(adopted);  // the store has what this has not
    stores_import_ = false;
    if (!adopted.ok()) return adopted;
    commit_time_ = commit_time;
  }
  followers_->Wake();  // an import is on disk before it is seen
  return absl::OkStatus();
}

absl::Status Session::AdoptLocked(Mesh& mesh) {
  DYNMESH_RETURN_IF_ERROR(gone_);
  DYNMESH_RETURN_IF_ERROR(CheckEmpty());
  DYNMESH_RETURN_IF_ERROR(StoreJust(mesh, StoredRelationsOf(mesh_), limits().max_session_bytes));
  MakeRoom(mesh.memory_bytes());
  std::swap(mesh_, mesh);
  Committed();
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<const ImportOutcome>> Session::FindImport(absl::string_view request_id,
                                                                         uint64_t fingerprint) const {
  MutexLock lock(&imports_mu_);
  return imports_.Find(request_id, fingerprint);
}

void Session::RememberImport(const std::string& request_id, uint64_t fingerprint,
                             std::shared_ptr<const ImportOutcome> outcome) {
  MutexLock lock(&imports_mu_);
  imports_.Remember(request_id, fingerprint, std::move(outcome), 0);
}

absl::StatusOr<std::shared_ptr<const RepairOutcome>> Session::FindRepair(absl::string_view request_id,
                                                                         uint64_t fingerprint) const {
  MutexLock lock(&repairs_mu_);
  return repairs_.Find(request_id, fingerprint);
}

void Session::RememberRepair(const std::string& request_id, uint64_t fingerprint,
                             std::shared_ptr<const RepairOutcome> outcome, size_t bytes) {
  MutexLock lock(&repairs_mu_);
  repairs_.Remember(request_id, fingerprint, std::move(outcome), bytes);
}

absl::StatusOr<int64_t> Session::Delete(absl::string_view etag) {
  {
    WriterMutexLock lock(&mu_);
    if (absl::IsNotFound(gone_)) return gone_;
    DYNMESH_RETURN_IF_ERROR(CheckEtag(etag));
    gone_ = SessionDeleted(name());
  }
  followers_->Close(SessionDeleted(name()));
  return revision();
}

absl::Status Session::CheckEtag(absl::string_view etag) const {
  const std::string present = EtagAt(revision());
  return etag.empty() || etag == present ? absl::OkStatus() : EtagMismatch(name(), present);
}

std::string Session::EtagAt(int64_t revision) const {
  return absl::StrCat(uid_, "-", revision, "-", num_updates_.load());
}

}  // namespace dynmesh
