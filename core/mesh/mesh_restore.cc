// Putting back what a batch changed, as steps of the open batch: so it is rolled back, stamped and sent to
// followers as any other.
//
// What the batch made goes first, then what stays is put right, then what ended comes back, lower dimensions
// first. So no two primaries ever stand on the same vertices, and whatever an entity is linked to is there.

#include <algorithm>
#include <array>
#include <vector>

#include "core/mesh/batch_image.h"
#include "core/mesh/mesh.h"

namespace dynmesh {
namespace {

absl::Status DoesNotFit() {
  return MakeError(absl::StatusCode::kInternal, reason::kInternal,
                   "the mesh is not as the batch left it, so its changes cannot be taken back");
}

/// What one entity of BatchImage::Entities was made of.
struct EntityView {
  EntityId id;
  ElementType type;
  uint8_t state;
  absl::Span<const VertexId> vertices;
  absl::Span<const Slot> parts;
};

/// Calls fn(view) for each until one fails.
template <typename Fn>
absl::Status ForEachEntity(EntityKind kind, const BatchImage::Entities& entities, Fn fn) {
  const bool has_parts = !entities.parts.empty();
  size_t vertex = 0, part = 0;
  for (size_t i = 0; i < entities.slots.size(); ++i) {
    const ElementType type = entities.types[i];
    const size_t num_vertices = NumVertices(type);
    const size_t num_parts = !has_parts                  ? 0
                             : kind == EntityKind::kFace ? num_vertices
                                                         : TemplateOf(type).num_faces;
    DYNMESH_RETURN_IF_ERROR(
        fn(EntityView{{kind, entities.slots[i]},
                      type,
                      entities.states[i],
                      absl::MakeConstSpan(entities.vertices).subspan(vertex, num_vertices),
                      absl::MakeConstSpan(entities.parts).subspan(part, num_parts)}));
    vertex += num_vertices;
    part += num_parts;
  }
  return absl::OkStatus();
}

}  // namespace

/// One Mesh::Restore().
class BatchRestorer {
 public:
  BatchRestorer(Mesh& mesh, const BatchImage& image) : mesh_(mesh), image_(image) {}

  absl::Status Check() const {
    if (!(image_.fit == mesh_.FitNow())) return DoesNotFit();
    bool fits = AreLive(EntityKind::kVertex, image_.moved.slots) &&
                CanBePutBack(EntityKind::kVertex, image_.ended_vertices.slots);
    for (EntityKind kind : kEntityKinds) {
      const int k = Dimension(kind);
      fits = fits && AreLive(kind, image_.made[k]) && AreLive(kind, image_.reshaped[k].slots) &&
             CanBePutBack(kind, image_.ended[k].slots);
    }
    for (const BatchImage::Rows& rows : image_.rows) {
      fits = fits && rows.column < static_cast<int>(mesh_.attributes().size());
    }
    return fits ? absl::OkStatus() : DoesNotFit();
  }

  absl::Status Run() {
    RemoveCells();
    for (Slot slot : DuplicatesFirst(EntityKind::kFace)) Remove(FaceId(slot));
    for (Slot slot : DuplicatesFirst(EntityKind::kEdge)) Remove(EdgeId(slot));
    for (Slot slot : image_.made[0]) mesh_.DestroyVertex(VertexId(slot));
    for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace}) {
      DYNMESH_RETURN_IF_ERROR(ForEachEntity(kind, image_.reshaped[Dimension(kind)],
                                            [this](const EntityView& view) { return Reshape(view); }));
    }
    PutBackVertices();
    for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
      DYNMESH_RETURN_IF_ERROR(PutBackThose(kind, 0));
      DYNMESH_RETURN_IF_ERROR(PutBackThose(kind, BatchImage::kDuplicate));
    }
    mesh_.SettleBoundaries(image_.ended[3].slots);
    for (const BatchImage::Rows& rows : image_.rows) PutBackRows(rows);
    return absl::OkStatus();
  }

 private:
  bool AreLive(EntityKind kind, absl::Span<const Slot> slots) const {
    return std::all_of(slots.begin(), slots.end(), [&](Slot slot) { return mesh_.IsLive({kind, slot}); });
  }

  /// Nobody is there, or somebody who goes.
  bool CanBePutBack(EntityKind kind, absl::Span<const Slot> slots) const {
    const std::vector<Slot>& made = image_.made[Dimension(kind)];
    return std::all_of(slots.begin(), slots.end(), [&](Slot slot) {
      return mesh_.IsLive({kind, slot}) ? std::binary_search(made.begin(), made.end(), slot)
                                        : slot < mesh_.slots(kind).limit();
    });
  }

  // ---- What the batch made ----

  void RemoveCells() {
    std::vector<FaceId> faces;
    for (Slot slot : image_.made[3]) {
      for (OrientedFace oriented : mesh_.Faces(CellId(slot))) faces.push_back(oriented.face());
      mesh_.DestroyCell(CellId(slot));
    }
    for (FaceId f : faces) mesh_.SettleBoundary(f);
  }

  /// Nobody is to inherit from a primary that goes: who stays is told what it was.
  std::vector<Slot> DuplicatesFirst(EntityKind kind) const {
    std::vector<Slot> slots = image_.made[Dimension(kind)];
    std::stable_partition(slots.begin(), slots.end(), [&](Slot slot) {
      return mesh_.IsDuplicate({kind, slot});
    });
    return slots;
  }

  void Remove(FaceId f) {
    if (mesh_.IsElement(f)) mesh_.ClearElementFlag(f);
    mesh_.EndFace(f);
  }

  void Remove(EdgeId e) {
    if (mesh_.IsElement(e)) mesh_.ClearElementFlag(e);
    mesh_.EndEdge(e);
  }

  // ---- What stays ----

  absl::Status Reshape(const EntityView& view) {
    const EntityId id = view.id;
    const bool turned = mesh_.VerticesOf(id) != view.vertices;
    const bool to_be_element = view.state & BatchImage::kElement;
    const bool to_be_duplicate = view.state & BatchImage::kDuplicate;
    if (mesh_.IsElement(id) && (turned || !to_be_element)) mesh_.ClearElementFlag(id);
    if (turned) DYNMESH_RETURN_IF_ERROR(Turn(id, view.vertices));
    if (mesh_.IsDuplicate(id) != to_be_duplicate) mesh_.SetDuplicateFlag(id, to_be_duplicate);
    if (to_be_element && !mesh_.IsElement(id)) mesh_.SetElementFlag(id);
    return absl::OkStatus();
  }

  absl::Status Turn(EntityId id, absl::Span<const VertexId> vertices) {
    if (id.kind == EntityKind::kEdge) {
      mesh_.FlipEdge(EdgeId(id.slot));
      return absl::OkStatus();
    }
    const auto code = MatchFace(mesh_.Vertices(FaceId(id.slot)), vertices);
    if (!code.has_value()) return DoesNotFit();
    mesh_.ReorderFace(FaceId(id.slot), *code);
    return absl::OkStatus();
  }

  // ---- What ended ----

  void PutBackVertices() {
    const auto& [slots, positions] = image_.ended_vertices;
    for (size_t i = 0; i < slots.size(); ++i) {
      JournalEntry entry;
      mesh_.RetakeSlot({EntityKind::kVertex, slots[i]}, entry);
      mesh_.FillVertex(VertexId(slots[i]), positions[i]);
      mesh_.Record(entry);
    }
    for (size_t i = 0; i < image_.moved.slots.size(); ++i) {
      mesh_.MoveTo(VertexId(image_.moved.slots[i]), image_.moved.positions[i]);
    }
  }

  /// Those of this state. Duplicates come last, so that a roll-back ends them first, as DuplicatesFirst().
  absl::Status PutBackThose(EntityKind kind, uint8_t duplicate) {
    return ForEachEntity(kind, image_.ended[Dimension(kind)], [&](const EntityView& view) {
      return (view.state & BatchImage::kDuplicate) == duplicate ? PutBack(view) : absl::OkStatus();
    });
  }

  absl::Status PutBack(const EntityView& view) {
    DYNMESH_RETURN_IF_ERROR(mesh_.CheckListRoom({0, 1, 1, 1}));
    std::array<OrientedFace, kMaxElementFaces> faces;
    if (view.id.kind == EntityKind::kCell) DYNMESH_RETURN_IF_ERROR(Orient(view, faces));
    JournalEntry entry;
    mesh_.RetakeSlot(view.id, entry);
    Fill(view, faces);
    mesh_.Record(entry);
    return absl::OkStatus();
  }

  /// How the faces of a cell lie, which may be another way than when it ended.
  absl::Status Orient(const EntityView& cell, std::array<OrientedFace, kMaxElementFaces>& faces) const {
    const ElementTemplate& shape = TemplateOf(cell.type);
    for (int i = 0; i < shape.num_faces; ++i) {
      const FaceId f(cell.parts[i]);
      if (!mesh_.IsLive(f)) return DoesNotFit();
      const auto code = MatchFace(mesh_.Vertices(f), FaceVertices(shape.faces[i], cell.vertices).span());
      if (!code.has_value()) return DoesNotFit();
      faces[i] = OrientedFace(f, *code);
    }
    return absl::OkStatus();
  }

  void Fill(const EntityView& view, const std::array<OrientedFace, kMaxElementFaces>& faces) {
    uint8_t flags = 0;
    if (view.state & BatchImage::kElement) flags |= Mesh::kElementFlag;
    if (view.state & BatchImage::kDuplicate) flags |= Mesh::kDuplicateFlag;
    if (view.id.kind == EntityKind::kEdge) {
      mesh_.FillEdge(EdgeId(view.id.slot), {view.vertices[0], view.vertices[1]}, flags);
    } else if (view.id.kind == EntityKind::kFace) {
      std::array<EdgeId, kMaxFaceVertices> edges;
      for (size_t k = 0; k < view.parts.size(); ++k) edges[k] = EdgeId(view.parts[k]);
      mesh_.FillFace(FaceId(view.id.slot), view.vertices,
                     absl::MakeConstSpan(edges.data(), view.parts.size()), flags);
    } else {
      mesh_.FillCell(CellId(view.id.slot), view.type, view.vertices,
                     absl::MakeConstSpan(faces.data(), view.parts.size()));
    }
  }

  void PutBackRows(const BatchImage::Rows& rows) {
    const size_t size = mesh_.attributes()[rows.column].spec().row_bytes();
    for (size_t i = 0; i < rows.slots.size(); ++i) {
      const auto row = absl::MakeConstSpan(rows.bytes).subspan(i * size, size);
      if (mesh_.attributes()[rows.column].Row(rows.slots[i]) == row) continue;
      mesh_.WriteAttribute(rows.column, rows.slots[i], row);
    }
  }

  Mesh& mesh_;
  const BatchImage& image_;
};

absl::StatusOr<BatchImage> Mesh::Restore(const BatchImage& image) {
  const Savepoint start = MakeSavepoint();
  BatchRestorer restorer(*this, image);
  DYNMESH_RETURN_IF_ERROR(restorer.Check());
  DYNMESH_RETURN_IF_ERROR(restorer.Run());
  return ImageSince(start);
}

}  // namespace dynmesh
