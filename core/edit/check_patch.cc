#include "core/edit/check_patch.h"

#include <algorithm>
#include <array>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/edit/geometry.h"
#include "core/edit/star.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// Points of one element.
struct Shape {
  ElementType type;
  std::array<Point, kMaxElementVertices> points;

  absl::Span<const Point> span() const { return absl::MakeConstSpan(points.data(), NumVertices(type)); }
};

class PatchChecker {
 public:
  PatchChecker(const Mesh& mesh, const Patch& patch, const PatchLimits& limits)
      : mesh_(mesh), patch_(patch), limits_(limits) {}

  absl::Status CheckAdded() {
    for (size_t i = 0; i < patch_.added.size(); ++i) {
      const NewElement& element = patch_.added[i];
      DYNMESH_RETURN_IF_ERROR(
          Check(patch_.removed[patch_.parents[i]], After(element.type, element.vertices())));
    }
    return absl::OkStatus();
  }

  absl::Status CheckMoved() {
    std::vector<EntityId> removed;
    if (!patch_.moves.empty()) removed = patch_.removed;
    std::sort(removed.begin(), removed.end());
    for (const Patch::Move& move : patch_.moves) {
      absl::Status status;
      ForEachElement(StarOf(mesh_, move.vertex), [&](EntityId id) {
        if (!status.ok() || std::binary_search(removed.begin(), removed.end(), id)) return;
        status = Check(id, After(mesh_.Type(id), mesh_.VerticesOf(id)));
      });
      DYNMESH_RETURN_IF_ERROR(status);
    }
    return absl::OkStatus();
  }

 private:
  Shape After(ElementType type, absl::Span<const VertexId> vertices) const {
    Shape shape{type, {}};
    for (size_t k = 0; k < vertices.size(); ++k) shape.points[k] = PositionAfter(mesh_, patch_, vertices[k]);
    return shape;
  }

  Shape Before(EntityId id) const {
    Shape shape{mesh_.Type(id), {}};
    const auto vertices = mesh_.VerticesOf(id);
    for (size_t k = 0; k < vertices.size(); ++k) shape.points[k] = mesh_.Position(vertices[k]);
    return shape;
  }

  absl::Status Check(EntityId parent, const Shape& child) {
    if (limits_.keep_orientation && Turns(parent, child)) {
      return Refuse(
          reason::kWouldInvert,
          absl::StrCat("the ", ElementTypeName(child.type), " in place of ", EntityKindName(parent.kind), " ",
                       parent.slot, " would be flat or turned over"),
          parent.kind, {parent.slot});
    }
    if (limits_.min_quality > 0 && !(Quality(child.type, child.span()) >= limits_.min_quality)) {
      return Refuse(
          reason::kWouldDegrade,
          absl::StrCat("the ", ElementTypeName(child.type), " in place of ", EntityKindName(parent.kind), " ",
                       parent.slot, " would have a quality of ", Quality(child.type, child.span())),
          parent.kind, {parent.slot});
    }
    return absl::OkStatus();
  }

  bool Turns(EntityId parent, const Shape& child) {
    switch (KindOf(child.type)) {
      case EntityKind::kCell: {
        const int before = patch_.orientation != 0 ? patch_.orientation : OrientationBefore(parent);
        return before != 0 && Orientation(child.type, child.span()) != before;
      }
      case EntityKind::kFace: {
        const Shape face = Before(parent);
        if (IsFlatFace(face.type, face.span())) return false;
        const Point before = AreaVector(face.type, face.span());
        return IsFlatFace(child.type, child.span()) ||
               !(Dot(before, AreaVector(child.type, child.span())) > 0);
      }
      default:
        return false;
    }
  }

  /// Children of one parent follow each other.
  int OrientationBefore(EntityId parent) {
    if (parent != last_parent_) {
      const Shape shape = Before(parent);
      last_parent_ = parent;
      last_orientation_ = Orientation(shape.type, shape.span());
    }
    return last_orientation_;
  }

  const Mesh& mesh_;
  const Patch& patch_;
  const PatchLimits& limits_;
  EntityId last_parent_;
  int last_orientation_ = 0;
};

}  // namespace

absl::Status CheckPatch(const Mesh& mesh, const Patch& patch, const PatchLimits& limits) {
  PatchChecker checker(mesh, patch, limits);
  DYNMESH_RETURN_IF_ERROR(checker.CheckAdded());
  return checker.CheckMoved();
}

}  // namespace dynmesh
