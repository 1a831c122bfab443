// What a batch changed, read off its journal: the net effect, as it was before.
//
// Arrays still hold what ended at a slot, or the journal does where another entity was put there; later steps
// that changed it are taken back on a copy.

#include <algorithm>
#include <limits>

#include "core/mesh/batch_image.h"
#include "core/mesh/entity_content.h"
#include "core/mesh/mesh.h"

namespace dynmesh {
namespace {

void Reorder(FaceCode code, EntityContent& face) {
  const int n = NumVertices(face.type);
  const EntityContent before = face;
  for (int k = 0; k < n; ++k) {
    face.vertices[k] = before.vertices[code.StoredVertex(k, n)];
    face.parts[k] = before.parts[code.StoredEdge(k, n)];
  }
}

/// Of a step that changed flags or order of an edge or face. `code` is that of kReorderFace.
void TakeBack(JournalOp op, uint8_t code, EntityContent& content) {
  switch (op) {
    case JournalOp::kSetElement:
    case JournalOp::kClearElement:
      content.state ^= BatchImage::kElement;
      return;
    case JournalOp::kSetDuplicate:
    case JournalOp::kClearDuplicate:
      content.state ^= BatchImage::kDuplicate;
      return;
    case JournalOp::kFlipEdge:
      return std::swap(content.vertices[0], content.vertices[1]);
    default:
      return Reorder(FaceCode{code}, content);
  }
}

/// Sorts by slot and keeps the first of each, in the order that they had. Nearly always they ascend already.
template <typename Item>
void KeepFirstOfEach(std::vector<Item>& items) {
  const auto less = [](const Item& a, const Item& b) { return a.slot < b.slot; };
  if (!std::is_sorted(items.begin(), items.end(), less)) std::stable_sort(items.begin(), items.end(), less);
  items.erase(
      std::unique(items.begin(), items.end(), [](const Item& a, const Item& b) { return a.slot == b.slot; }),
      items.end());
}

void SortSlots(std::vector<Slot>& slots) {
  if (!std::is_sorted(slots.begin(), slots.end())) std::sort(slots.begin(), slots.end());
}

}  // namespace

/// One Mesh::ImageSince().
///
/// Of an entity only the steps before it ended count, and of one that was made none. What tells whose step it
/// is where a slot had several occupants, is whether somebody was made there before it.
class BatchImageBuilder {
 public:
  BatchImageBuilder(const Mesh& mesh, Mesh::Savepoint since) : mesh_(mesh), since_(since) {}

  BatchImage Build() && {
    ListMade();
    ReadBackwards();
    KeepMoves();
    KeepRows();
    for (EntityKind kind : kEntityKinds) {
      if (kind != EntityKind::kVertex) KeepEnded(kind);
      if (kind != EntityKind::kVertex) KeepReshaped(kind);
      KeepMade(kind);
    }
    image_.fit = mesh_.FitNow();
    return std::move(image_);
  }

 private:
  static constexpr size_t kNever = std::numeric_limits<size_t>::max();

  /// Something of a slot: the n-th on a stack or in the journal, or from a byte on.
  struct At {
    Slot slot;
    size_t at;
  };

  /// A step that changed flags or order of an edge or face.
  struct Change {
    Slot slot;
    JournalOp op;
    uint8_t code;  ///< of kReorderFace
  };

  void ListMade() {
    const auto& entries = mesh_.journal().entries;
    for (size_t i = since_; i < entries.size(); ++i) {
      if (entries[i].op != JournalOp::kCreate) continue;
      made_[Dimension(entries[i].kind)].push_back({entries[i].slot, i});
    }
    for (std::vector<At>& made : made_) KeepFirstOfEach(made);
  }

  /// The entry at which somebody was first made at a slot since the savepoint, or kNever.
  size_t FirstMade(EntityId id) const {
    if (mesh_.slots(id.kind).Born(id.slot) <= mesh_.revision()) return kNever;
    return Find(id.slot, made_[Dimension(id.kind)]);
  }

  static size_t Find(Slot slot, const std::vector<At>& items) {
    const auto it = std::lower_bound(items.begin(), items.end(), slot,
                                     [](const At& item, Slot wanted) { return item.slot < wanted; });
    return it != items.end() && it->slot == slot ? it->at : kNever;
  }

  /// Last entry first: so stacks can be walked down, and what happened to one entity comes in the order in
  /// which it is taken back.
  void ReadBackwards() {
    const Journal& journal = mesh_.journal();
    positions_end_ = journal.positions.size();
    rows_end_ = journal.rows.size();
    rows_.resize(mesh_.attributes().size());
    contents_end_ = journal.contents.size();
    for (size_t i = journal.entries.size(); i > since_; --i) Read(journal.entries[i - 1], i - 1);
    for (std::vector<At>& replaced : replaced_) KeepFirstOfEach(replaced);
  }

  void Read(const JournalEntry& entry, size_t index) {
    if (entry.op == JournalOp::kCreate || entry.op == JournalOp::kAddAttribute) return;
    const EntityId id(entry.kind, entry.slot);
    const size_t first_made = FirstMade(id);
    const bool of_made = index > first_made;
    switch (entry.op) {
      case JournalOp::kRecycle:
        return ReadReplaced(id, of_made);
      case JournalOp::kDestroy:
        if (!of_made) ended_[Dimension(id.kind)].push_back(id.slot);
        return;
      case JournalOp::kMoveVertex:
        --positions_end_;
        if (!of_made) moves_.push_back({id.slot, positions_end_});
        return;
      case JournalOp::kSetAttribute:
        rows_end_ -= mesh_.attributes()[entry.a].spec().row_bytes();
        if (!of_made) rows_[entry.a].push_back({id.slot, rows_end_});
        return;
      default:
        if (of_made) return;
        auto& changes = first_made == kNever && mesh_.IsLive(id) ? live_changes_ : ended_changes_;
        changes[Dimension(id.kind)].push_back({id.slot, entry.op, static_cast<uint8_t>(entry.a)});
    }
  }

  /// Somebody is about to be put where another ended. Where a vertex stood, is as good as a move from there.
  void ReadReplaced(EntityId id, bool of_made) {
    const bool is_vertex = id.kind == EntityKind::kVertex;
    const size_t at = is_vertex ? --positions_end_ : --contents_end_;
    if (!of_made) (is_vertex ? moves_ : replaced_[Dimension(id.kind)]).push_back({id.slot, at});
  }

  void KeepMade(EntityKind kind) {
    std::vector<Slot>& kept = image_.made[Dimension(kind)];
    for (const At& made : made_[Dimension(kind)]) {
      if (mesh_.IsLive({kind, made.slot})) kept.push_back(made.slot);
    }
    kept.shrink_to_fit();
  }

  void KeepMoves() {
    std::reverse(moves_.begin(), moves_.end());
    KeepFirstOfEach(moves_);
    std::vector<Slot>& ended = ended_[0];
    SortSlots(ended);
    image_.ended_vertices.slots.reserve(ended.size());
    image_.ended_vertices.positions.reserve(ended.size());
    auto move = moves_.begin();
    for (Slot slot : ended) {
      for (; move != moves_.end() && move->slot < slot; ++move) KeepMove(*move);
      const bool moved = move != moves_.end() && move->slot == slot;
      image_.ended_vertices.slots.push_back(slot);
      image_.ended_vertices.positions.push_back(moved ? mesh_.journal().positions[(move++)->at]
                                                      : mesh_.Position(VertexId(slot)));
    }
    for (; move != moves_.end(); ++move) KeepMove(*move);
  }

  void KeepMove(const At& move) {
    if (FirstMade(VertexId(move.slot)) != kNever) return;  // nobody was there at the savepoint
    image_.moved.slots.push_back(move.slot);
    image_.moved.positions.push_back(mesh_.journal().positions[move.at]);
  }

  void KeepRows() {
    const std::vector<uint8_t>& bytes = mesh_.journal().rows;
    for (size_t column = 0; column < rows_.size(); ++column) {
      if (rows_[column].empty()) continue;
      std::reverse(rows_[column].begin(), rows_[column].end());
      KeepFirstOfEach(rows_[column]);
      BatchImage::Rows& kept = image_.rows.emplace_back();
      kept.column = static_cast<int>(column);
      const size_t size = mesh_.attributes()[column].spec().row_bytes();
      for (const auto& [slot, at] : rows_[column]) {
        kept.slots.push_back(slot);
        kept.bytes.insert(kept.bytes.end(), bytes.begin() + at, bytes.begin() + at + size);
      }
    }
  }

  static void SortChanges(std::vector<Change>& changes) {
    const auto less = [](const Change& a, const Change& b) { return a.slot < b.slot; };
    std::stable_sort(changes.begin(), changes.end(), less);
  }

  void KeepEnded(EntityKind kind) {
    std::vector<Slot>& ended = ended_[Dimension(kind)];
    std::vector<Change>& changes = ended_changes_[Dimension(kind)];
    SortSlots(ended);
    SortChanges(changes);
    BatchImage::Entities& kept = image_.ended[Dimension(kind)];
    if (!ended.empty()) Expect(ended.size(), kept);
    auto change = changes.begin();
    for (Slot slot : ended) {
      EntityContent content = LastContent({kind, slot});
      for (; change != changes.end() && change->slot == slot; ++change)
        TakeBack(change->op, change->code, content);
      Append(slot, content, kept);
    }
    Trim(kept);
  }

  /// Of who was there at the savepoint, when it ended.
  EntityContent LastContent(EntityId id) const {
    const size_t at = Find(id.slot, replaced_[Dimension(id.kind)]);
    return at == kNever ? ContentOf(mesh_, id) : Unpack(mesh_.journal().contents[at], id.kind);
  }

  static EntityContent Unpack(const SlotContent& saved, EntityKind kind) {
    EntityContent content;
    content.type = saved.type;
    if (saved.flags & Mesh::kElementFlag) content.state |= BatchImage::kElement;
    if (saved.flags & Mesh::kDuplicateFlag) content.state |= BatchImage::kDuplicate;
    content.vertices = saved.vertices;
    if (kind == EntityKind::kFace) content.num_parts = NumVertices(content.type);
    if (kind == EntityKind::kCell) content.num_parts = TemplateOf(content.type).num_faces;
    for (int k = 0; k < content.num_parts; ++k) {
      const uint32_t part = saved.parts[k];
      content.parts[k] = kind == EntityKind::kCell ? OrientedFace::FromPacked(part).face().slot() : part;
    }
    return content;
  }

  void KeepReshaped(EntityKind kind) {
    std::vector<Change>& changes = live_changes_[Dimension(kind)];
    SortChanges(changes);
    for (auto change = changes.begin(); change != changes.end();) {
      const Slot slot = change->slot;
      const EntityContent now = ContentOf(mesh_, {kind, slot});
      EntityContent before = now;
      for (; change != changes.end() && change->slot == slot; ++change)
        TakeBack(change->op, change->code, before);
      before.num_parts = 0;
      if (!before.IsShapedAs(now)) Append(slot, before, image_.reshaped[Dimension(kind)]);
    }
  }

  const Mesh& mesh_;
  const Mesh::Savepoint since_;
  BatchImage image_;
  size_t positions_end_ = 0;
  size_t rows_end_ = 0;
  size_t contents_end_ = 0;
  std::array<std::vector<At>, kNumEntityKinds> made_;      ///< slots with entries
  std::array<std::vector<At>, kNumEntityKinds> replaced_;  ///< slots with contents, of who ended there
  std::array<std::vector<Slot>, kNumEntityKinds> ended_;
  std::array<std::vector<Change>, kNumEntityKinds> ended_changes_;
  std::array<std::vector<Change>, kNumEntityKinds> live_changes_;
  std::vector<At> moves_;
  std::vector<std::vector<At>> rows_;  ///< by column
};

BatchImage Mesh::ImageSince(Savepoint savepoint) const { return BatchImageBuilder(*this, savepoint).Build(); }

BatchImage::Fit Mesh::FitNow() const {
  BatchImage::Fit fit = {checksum_, {}};
  for (EntityKind kind : kEntityKinds) fit.num_live[Dimension(kind)] = NumLive(kind);
  return fit;
}

}  // namespace dynmesh
