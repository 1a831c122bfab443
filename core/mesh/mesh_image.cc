// What a batch changed, read off its journal: the net effect, as it was before.
//
// No slot has two occupants between a savepoint and the end of a batch, so arrays still hold what ended
// there, but for what later steps changed of it: those are taken back on a copy.

#include <algorithm>

#include "core/mesh/batch_image.h"
#include "core/mesh/mesh.h"

namespace dynmesh {
namespace {

/// One edge, face or cell, as BatchImage::Entities tells it.
struct Content {
  ElementType type;
  uint8_t state;
  std::array<VertexId, kMaxElementVertices> vertices;
  std::array<Slot, kMaxElementFaces> parts;
  int num_parts;

  /// All but the parts, which follow from the vertices.
  bool IsShapedAs(const Content& other) const {
    return state == other.state &&
           std::equal(vertices.begin(), vertices.begin() + NumVertices(type), other.vertices.begin());
  }
};

Content ContentOf(const Mesh& mesh, EntityId id) {
  Content content = {mesh.Type(id), 0, {}, {}, 0};
  if (mesh.IsElement(id)) content.state |= BatchImage::kElement;
  if (mesh.IsDuplicate(id)) content.state |= BatchImage::kDuplicate;
  const auto vertices = mesh.VerticesOf(id);
  std::copy(vertices.begin(), vertices.end(), content.vertices.begin());
  if (id.kind == EntityKind::kFace) {
    for (EdgeId e : mesh.Edges(FaceId(id.slot))) content.parts[content.num_parts++] = e.slot();
  } else if (id.kind == EntityKind::kCell) {
    for (OrientedFace oriented : mesh.Faces(CellId(id.slot))) {
      content.parts[content.num_parts++] = oriented.face().slot();
    }
  }
  return content;
}

void Append(Slot slot, const Content& content, BatchImage::Entities& entities) {
  entities.slots.push_back(slot);
  entities.types.push_back(content.type);
  entities.states.push_back(content.state);
  entities.vertices.insert(entities.vertices.end(), content.vertices.begin(),
                           content.vertices.begin() + NumVertices(content.type));
  entities.parts.insert(entities.parts.end(), content.parts.begin(),
                        content.parts.begin() + content.num_parts);
}

/// Room for what most entities need: of tetrahedra exactly.
void Expect(size_t count, BatchImage::Entities& entities) {
  constexpr size_t kTypicalVertices = 4;
  entities.slots.reserve(count);
  entities.types.reserve(count);
  entities.states.reserve(count);
  entities.vertices.reserve(count * kTypicalVertices);
  entities.parts.reserve(count * kTypicalVertices);
}

/// Images may be kept for long.
void Trim(BatchImage::Entities& entities) {
  entities.slots.shrink_to_fit();
  entities.types.shrink_to_fit();
  entities.states.shrink_to_fit();
  entities.vertices.shrink_to_fit();
  entities.parts.shrink_to_fit();
}

/// A step that changed flags or order of an edge or face.
struct Change {
  Slot slot;
  JournalOp op;
  uint8_t code;  ///< of kReorderFace
};

void Reorder(FaceCode code, Content& face) {
  const int n = NumVertices(face.type);
  const Content before = face;
  for (int k = 0; k < n; ++k) {
    face.vertices[k] = before.vertices[code.StoredVertex(k, n)];
    face.parts[k] = before.parts[code.StoredEdge(k, n)];
  }
}

void TakeBack(const Change& change, Content& content) {
  switch (change.op) {
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
      return Reorder(FaceCode{change.code}, content);
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

class ImageBuilder {
 public:
  ImageBuilder(const Mesh& mesh, Mesh::Savepoint since) : mesh_(mesh), since_(since) {}

  BatchImage Build() && {
    ListMade();
    ReadBackwards();
    KeepMoves();
    KeepRows();
    for (EntityKind kind : kEntityKinds) {
      if (kind != EntityKind::kVertex) KeepEnded(kind);
      if (kind != EntityKind::kVertex) KeepReshaped(kind);
      std::vector<Slot>& made = image_.made[Dimension(kind)];
      const auto is_gone = [&](Slot slot) { return !mesh_.IsLive({kind, slot}); };
      made.erase(std::remove_if(made.begin(), made.end(), is_gone), made.end());
      made.shrink_to_fit();
    }
    image_.fit = mesh_.FitNow();
    return std::move(image_);
  }

 private:
  /// A value before: the n-th on its stack, or from a byte on.
  struct Before {
    Slot slot;
    size_t at;
  };

  void ListMade() {
    const auto& entries = mesh_.journal().entries;
    for (size_t i = since_; i < entries.size(); ++i) {
      if (entries[i].op == JournalOp::kCreate) {
        image_.made[Dimension(entries[i].kind)].push_back(entries[i].slot);
      }
    }
    for (std::vector<Slot>& slots : image_.made) SortSlots(slots);
  }

  /// Whether it began since the savepoint.
  bool IsMade(EntityId id) const {
    if (mesh_.slots(id.kind).Born(id.slot) <= mesh_.revision()) return false;
    const std::vector<Slot>& made = image_.made[Dimension(id.kind)];
    return std::binary_search(made.begin(), made.end(), id.slot);
  }

  /// Last entry first: so stacks can be walked down, and what happened to one entity comes in the order in
  /// which it is taken back.
  void ReadBackwards() {
    const Journal& journal = mesh_.journal();
    positions_end_ = journal.positions.size();
    rows_end_ = journal.rows.size();
    rows_.resize(mesh_.attributes().size());
    for (size_t i = journal.entries.size(); i > since_; --i) Read(journal.entries[i - 1]);
  }

  void Read(const JournalEntry& entry) {
    const EntityId id(entry.kind, entry.slot);
    switch (entry.op) {
      case JournalOp::kCreate:
      case JournalOp::kAddAttribute:
        return;
      case JournalOp::kRecycle:
        if (id.kind == EntityKind::kVertex) --positions_end_;
        return;
      case JournalOp::kDestroy:
        if (!IsMade(id)) ended_[Dimension(id.kind)].push_back(id.slot);
        return;
      case JournalOp::kMoveVertex:
        --positions_end_;
        if (!IsMade(id)) moves_.push_back({id.slot, positions_end_});
        return;
      case JournalOp::kSetAttribute:
        rows_end_ -= mesh_.attributes()[entry.a].spec().row_bytes();
        if (!IsMade(id)) rows_[entry.a].push_back({id.slot, rows_end_});
        return;
      default:
        if (IsMade(id)) return;
        auto& changes = mesh_.IsLive(id) ? live_changes_ : ended_changes_;
        changes[Dimension(id.kind)].push_back({id.slot, entry.op, static_cast<uint8_t>(entry.a)});
    }
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

  void KeepMove(const Before& move) {
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
      Content content = ContentOf(mesh_, {kind, slot});
      for (; change != changes.end() && change->slot == slot; ++change) TakeBack(*change, content);
      Append(slot, content, kept);
    }
    Trim(kept);
  }

  void KeepReshaped(EntityKind kind) {
    std::vector<Change>& changes = live_changes_[Dimension(kind)];
    SortChanges(changes);
    for (auto change = changes.begin(); change != changes.end();) {
      const Slot slot = change->slot;
      const Content now = ContentOf(mesh_, {kind, slot});
      Content before = now;
      for (; change != changes.end() && change->slot == slot; ++change) TakeBack(*change, before);
      before.num_parts = 0;
      if (!before.IsShapedAs(now)) Append(slot, before, image_.reshaped[Dimension(kind)]);
    }
  }

  const Mesh& mesh_;
  const Mesh::Savepoint since_;
  BatchImage image_;
  size_t positions_end_ = 0;
  size_t rows_end_ = 0;
  std::array<std::vector<Slot>, kNumEntityKinds> ended_;
  std::array<std::vector<Change>, kNumEntityKinds> ended_changes_;
  std::array<std::vector<Change>, kNumEntityKinds> live_changes_;
  std::vector<Before> moves_;
  std::vector<std::vector<Before>> rows_;  ///< by column
};

}  // namespace

BatchImage Mesh::ImageSince(Savepoint savepoint) const { return ImageBuilder(*this, savepoint).Build(); }

BatchImage::Fit Mesh::FitNow() const {
  BatchImage::Fit fit = {checksum_, {}};
  for (EntityKind kind : kEntityKinds) fit.num_live[Dimension(kind)] = NumLive(kind);
  return fit;
}

}  // namespace dynmesh
