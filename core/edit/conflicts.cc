#include "core/edit/conflicts.h"

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace dynmesh {
namespace {

/// As many ids as are told, unless they are long: the server cuts what is longer.
constexpr size_t kMaxIds = 100;
constexpr size_t kMaxIdsBytes = 480;

std::string JoinSome(const std::vector<Slot>& slots) {
  std::string text;
  for (size_t i = 0; i < slots.size(); ++i) {
    const std::string id = absl::StrCat(slots[i]);
    if (i == kMaxIds || text.size() + id.size() > kMaxIdsBytes) return text + ",...";
    absl::StrAppend(&text, i == 0 ? "" : ",", id);
  }
  return text;
}

}  // namespace

/// Gathers entities of one kind that somebody else changed after a revision.
class Conflict {
 public:
  Conflict(const Mesh& mesh, int64_t as_of) : mesh_(mesh), as_of_(as_of) {}

  /// Takes `id` down if the stamp is one that others made since. After the first one, others of its kind
  /// only.
  void Note(EntityId id, Stamp stamp) {
    if (stamp > as_of_ && stamp <= mesh_.revision()) Add(id, stamp);
  }

  void Add(EntityId id, Stamp changed) {
    if (slots_.empty()) kind_ = id.kind;
    if (kind_ != id.kind) return;
    slots_.push_back(id.slot);
    changed_ = std::max(changed_, changed);
  }

  bool empty() const { return slots_.empty(); }

  /// OK if there is none.
  absl::Status ToStatus() {
    if (empty()) return absl::OkStatus();
    std::sort(slots_.begin(), slots_.end());
    slots_.erase(std::unique(slots_.begin(), slots_.end()), slots_.end());
    return MakeError(absl::StatusCode::kAborted, reason::kConflict,
                     absl::StrCat("somebody else changed ", EntityKindName(kind_), " ", slots_.front(),
                                  slots_.size() > 1 ? " and others" : "", " in the meantime"),
                     {{"kind", std::string(EntityKindName(kind_))},
                      {"ids", JoinSome(slots_)},
                      {"changed_revision", absl::StrCat(changed_)}});
  }

 private:
  const Mesh& mesh_;
  const int64_t as_of_;
  EntityKind kind_ = EntityKind::kVertex;
  std::vector<Slot> slots_;
  Stamp changed_ = 0;  ///< the latest
};

namespace {

/// Notes what the steps of a batch touched.
class JournalReader {
 public:
  JournalReader(const Mesh& mesh, Conflict& conflict) : mesh_(mesh), conflict_(conflict) {}

  void Read(const JournalEntry& entry) {
    const EntityId id(entry.kind, entry.slot);
    if (entry.op == JournalOp::kCreate) return NoteVertices(id);
    // Of what the batch made, stamps are those of who had the slot before.
    if (mesh_.slots(id.kind).Born(id.slot) > mesh_.revision()) return;
    switch (entry.op) {
      case JournalOp::kSetElement:
        conflict_.Note(id, entry.b);
        return NoteVertices(id);
      case JournalOp::kDestroy:
        conflict_.Note(id, entry.b);
        return NoteRows(id);
      case JournalOp::kClearElement:
      case JournalOp::kMoveVertex:
      case JournalOp::kSetAttribute:
        return conflict_.Note(id, entry.b);
      default:
        return;
    }
  }

 private:
  void NoteVertices(EntityId id) {
    if (id.kind == EntityKind::kVertex) return;
    for (VertexId v : mesh_.VerticesOf(id))
      conflict_.Note(v, mesh_.changed(EntityKind::kVertex).At(v.slot()));
  }

  /// Removal takes no step for rows that are already as it would leave them.
  void NoteRows(EntityId ended) {
    for (const AttributeColumn& column : mesh_.attributes()) {
      if (column.spec().kind == ended.kind) conflict_.Note(ended, column.stamps().At(ended.slot));
    }
  }

  const Mesh& mesh_;
  Conflict& conflict_;
};

/// The one entity that a refusal names; false if it names none, or many.
bool NamedBy(const ErrorDetail& detail, EntityId& id) {
  uint32_t slot = 0;
  if (!absl::SimpleAtoi(detail.Find("ids"), &slot)) return false;
  for (EntityKind kind : kEntityKinds) {
    if (detail.Find("kind") != EntityKindName(kind)) continue;
    id = {kind, slot};
    return true;
  }
  return false;
}

}  // namespace

const JournalEntry* ConflictCheck::Steps::Find(JournalOp op, EntityId id) {
  const auto& entries = mesh_.journal().entries;
  for (; read_ < entries.size(); ++read_) {
    const JournalEntry& entry = entries[read_];
    if (entry.op != JournalOp::kCreate && entry.op != JournalOp::kDestroy) continue;
    const uint64_t key = KeyOf(entry.op, {entry.kind, entry.slot});
    const auto [place, is_new] = places_.try_emplace(key, read_);
    if (!is_new && !IsAt(place->second, key)) place->second = read_;
  }
  const auto place = places_.find(KeyOf(op, id));
  return place != places_.end() && IsAt(place->second, place->first) ? &entries[place->second] : nullptr;
}

/// False of an entry that was taken back.
bool ConflictCheck::Steps::IsAt(size_t place, uint64_t key) const {
  const auto& entries = mesh_.journal().entries;
  if (place >= entries.size()) return false;
  const JournalEntry& entry = entries[place];
  return KeyOf(entry.op, {entry.kind, entry.slot}) == key;
}

/// Of an entity that was named and is gone, or is another one: perhaps one that the batch has made there.
void ConflictCheck::NoteEnd(EntityId id, Conflict& conflict) {
  const JournalEntry* made = steps_.Find(JournalOp::kCreate, id);
  conflict.Note(id, made != nullptr ? made->b : mesh_.changed(id.kind).At(id.slot));
  conflict.Note(id, mesh_.slots(id.kind).Born(id.slot));
  const bool leaves_trace = id.kind == EntityKind::kVertex || id.kind == EntityKind::kCell;
  if (!conflict.empty() || leaves_trace) return;
  const bool was_there = made == nullptr && mesh_.IsLive(id);
  if (was_there || steps_.Find(JournalOp::kDestroy, id) != nullptr) return;
  conflict.Add(id, static_cast<Stamp>(mesh_.revision()));
}

absl::Status ConflictCheck::CheckSince(Mesh::Savepoint savepoint) const {
  if (!MayConflict()) return absl::OkStatus();
  Conflict conflict(mesh_, as_of_);
  JournalReader reader(mesh_, conflict);
  const auto& entries = mesh_.journal().entries;
  for (size_t i = savepoint; i < entries.size(); ++i) reader.Read(entries[i]);
  return conflict.ToStatus();
}

absl::Status ConflictCheck::Explain(const absl::Status& refused) {
  steps_.Shorten();
  const absl::optional<ErrorDetail> detail = MayConflict() ? GetErrorDetail(refused) : absl::nullopt;
  EntityId id;
  if (!detail.has_value() || !NamedBy(*detail, id)) return refused;
  Conflict conflict(mesh_, as_of_);
  if (detail->reason == reason::kVertexInUse) {
    for (EdgeId e : mesh_.IncidentEdges(VertexId(id.slot))) {
      conflict.Note(e, mesh_.slots(EntityKind::kEdge).Born(e.slot()));
    }
  } else if (detail->reason == reason::kEntityRemoved) {
    NoteEnd(id, conflict);
  } else if (detail->reason == reason::kNotAnElement) {
    conflict.Note(id, mesh_.changed(id.kind).At(id.slot));
  }
  if (conflict.empty()) return refused;
  absl::Status status = conflict.ToStatus();
  for (const auto& [key, value] : detail->metadata) status = WithMetadata(status, key, value);
  return status;
}

}  // namespace dynmesh
