// What the open batch has touched, read from its journal. Arrays still tell what stood at a slot that was
// freed, or the journal does where another entity was put there.

#include <algorithm>

#include "core/mesh/mesh.h"

namespace dynmesh {
namespace {

/// Slots that are met many times each, kept without too many repeats.
class SlotGatherer {
 public:
  void Add(Slot slot) {
    slots_.push_back(slot);
    if (slots_.size() >= limit_) Compact();
  }
  /// Those of `live`, ascending.
  std::vector<Slot> Take(const Slots& live) && {
    Compact();
    slots_.erase(std::remove_if(slots_.begin(), slots_.end(), [&](Slot slot) { return !live.IsLive(slot); }),
                 slots_.end());
    return std::move(slots_);
  }

 private:
  void Compact() {
    std::sort(slots_.begin(), slots_.end());
    slots_.erase(std::unique(slots_.begin(), slots_.end()), slots_.end());
    limit_ = std::max(kFew, 2 * slots_.size());
  }

  static constexpr size_t kFew = 4096;
  std::vector<Slot> slots_;
  size_t limit_ = kFew;
};

class TouchedGatherer {
 public:
  TouchedGatherer(const Mesh& mesh, WorkMeter& meter) : mesh_(mesh), meter_(meter) {}

  absl::Status Gather(const Journal& journal) {
    auto replaced = journal.contents.begin();
    for (const JournalEntry& entry : journal.entries) {
      DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(1));
      const bool replaces = entry.op == JournalOp::kRecycle && entry.kind != EntityKind::kVertex;
      if (replaces) AddPartsOf(entry.kind, *replaced++);
      DYNMESH_RETURN_IF_ERROR(Gather(entry));
    }
    return AddStars(std::move(moved_).Take(mesh_.slots(EntityKind::kVertex)));
  }

  EntitySlots Take() && {
    EntitySlots slots;
    for (EntityKind kind : kEntityKinds) {
      slots[Dimension(kind)] = std::move(gathered_[Dimension(kind)]).Take(mesh_.slots(kind));
    }
    return slots;
  }

 private:
  absl::Status Gather(const JournalEntry& entry) {
    switch (entry.op) {
      case JournalOp::kMoveVertex:
        moved_.Add(entry.slot);
        return absl::OkStatus();
      case JournalOp::kAddAttribute:
      case JournalOp::kSetAttribute:
      case JournalOp::kRecycle:  // the new occupant is created next
        return absl::OkStatus();
      case JournalOp::kCreate:
      case JournalOp::kDestroy:
      case JournalOp::kSetElement:
      case JournalOp::kClearElement:
      case JournalOp::kSetDuplicate:
      case JournalOp::kClearDuplicate:
      case JournalOp::kFlipEdge:
      case JournalOp::kReorderFace:
        return AddWithParts({entry.kind, entry.slot});
    }
    return absl::OkStatus();
  }

  /// An entity and what lies below it, whether it is still live or not.
  absl::Status AddWithParts(EntityId id) {
    Add(id);
    if (id.kind == EntityKind::kVertex) return absl::OkStatus();
    for (VertexId v : mesh_.VerticesOf(id)) Add(v);
    if (id.kind == EntityKind::kFace) {
      for (EdgeId e : mesh_.Edges(FaceId(id.slot))) Add(e);
    }
    if (id.kind != EntityKind::kCell) return absl::OkStatus();
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(kMaxElementFaces));
    for (OrientedFace oriented : mesh_.Faces(CellId(id.slot))) {
      Add(oriented.face());
      for (EdgeId e : mesh_.Edges(oriented.face())) Add(e);
    }
    return absl::OkStatus();
  }

  /// Of a face that ended too, the edges are told by its own entry.
  void AddPartsOf(EntityKind kind, const SlotContent& ended) {
    for (int k = 0; k < NumVertices(ended.type); ++k) Add(ended.vertices[k]);
    if (kind == EntityKind::kFace) {
      for (int k = 0; k < NumVertices(ended.type); ++k) Add(EdgeId(ended.parts[k]));
    } else if (kind == EntityKind::kCell) {
      AddFaces(absl::MakeConstSpan(ended.parts.data(), TemplateOf(ended.type).num_faces));
    }
  }

  void AddFaces(absl::Span<const uint32_t> packed) {
    for (uint32_t face : packed) {
      const FaceId f = OrientedFace::FromPacked(face).face();
      Add(f);
      for (EdgeId e : mesh_.Edges(f)) Add(e);
    }
  }

  absl::Status AddStars(absl::Span<const Slot> vertices) {
    for (Slot v : vertices) {
      Add(VertexId(v));
      for (EdgeId e : mesh_.IncidentEdges(VertexId(v))) DYNMESH_RETURN_IF_ERROR(AddStar(e));
    }
    return absl::OkStatus();
  }

  absl::Status AddStar(EdgeId e) {
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(1));
    Add(e);
    for (FaceId f : mesh_.IncidentFaces(e)) {
      const auto cells = mesh_.IncidentCells(f);
      DYNMESH_RETURN_IF_ERROR(meter_.ChargeManySteps(1 + cells.size()));
      Add(f);
      for (CellId c : cells) Add(c);
    }
    return absl::OkStatus();
  }

  void Add(EntityId id) { gathered_[Dimension(id.kind)].Add(id.slot); }

  const Mesh& mesh_;
  WorkMeter& meter_;
  SlotGatherer moved_;
  std::array<SlotGatherer, kNumEntityKinds> gathered_;
};

}  // namespace

absl::StatusOr<EntitySlots> Mesh::Touched(WorkMeter& meter) const {
  TouchedGatherer gatherer(*this, meter);
  DYNMESH_RETURN_IF_ERROR(gatherer.Gather(journal_));
  return std::move(gatherer).Take();
}

}  // namespace dynmesh
