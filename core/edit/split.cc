#include "core/edit/split.h"

#include <array>

#include "absl/strings/str_cat.h"
#include "core/edit/cone.h"
#include "core/edit/polygon.h"
#include "core/edit/star.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// Replaces the elements at the edge a-b, one after the other, now that it has a vertex in the middle.
class EdgeSplitter {
 public:
  EdgeSplitter(const Mesh& mesh, VertexId a, VertexId b, VertexId middle, Patch& patch)
      : mesh_(mesh), a_(a), b_(b), middle_(middle), patch_(patch) {}

  void operator()(EntityId element) {
    patch_.Remove(element);
    const ElementType type = mesh_.Type(element);
    const auto vertices = mesh_.VerticesOf(element);
    const bool halves =
        type == ElementType::kWireEdge || type == ElementType::kTriangle || type == ElementType::kTetrahedron;
    if (halves) {
      AddHalf(type, vertices, b_);
      AddHalf(type, vertices, a_);
    } else if (element.kind == EntityKind::kFace) {
      FanOfFace(vertices);
    } else {
      AddCones(
          type, vertices, middle_, [this](auto face) { return HasEdge(face); }, patch_);
    }
  }

 private:
  bool HasEdge(absl::Span<const VertexId> vertices) const {
    return Contains(vertices, a_) && Contains(vertices, b_);
  }

  /// The half of a simplex where the middle stands for `end`.
  void AddHalf(ElementType type, absl::Span<const VertexId> vertices, VertexId end) {
    std::array<VertexId, kMaxElementVertices> half;
    std::replace_copy(vertices.begin(), vertices.end(), half.begin(), end, middle_);
    patch_.Add(type, absl::MakeConstSpan(half.data(), vertices.size()));
  }

  void FanOfFace(absl::Span<const VertexId> vertices) {
    ForEachOtherSide(vertices, a_, b_, [this](VertexId from, VertexId to) {
      patch_.Add(ElementType::kTriangle, {from, to, middle_});
    });
  }

  const Mesh& mesh_;
  const VertexId a_, b_, middle_;
  Patch& patch_;
};

/// Whether cells use a face, or faces a wire, or what it is a duplicate of.
bool IsUsed(const Mesh& mesh, EntityId element) {
  const auto vertices = mesh.VerticesOf(element);
  if (element.kind == EntityKind::kFace) return !mesh.IncidentCells(mesh.FindFace(vertices)).empty();
  if (element.kind == EntityKind::kEdge) {
    return !mesh.IncidentFaces(mesh.FindEdge(vertices[0], vertices[1])).empty();
  }
  return false;
}

}  // namespace

absl::Status PlanSplitEdge(const Mesh& mesh, EdgeId e, const SplitPlace& place, Patch& patch) {
  const auto [a, b] = EndsFrom(mesh, e, place.origin);
  const Star star = StarOf(mesh, e);
  patch.work += star.work;
  DYNMESH_RETURN_IF_ERROR(CheckNotDegenerate(mesh, star));
  const double t = place.parameter;
  const Point on_edge = (1 - t) * mesh.Position(a) + t * mesh.Position(b);
  const VertexId middle = patch.AddVertex(place.position.value_or(on_edge), {{a, b}, {1 - t, t}});
  patch.cuts.push_back({a, b, middle});
  ForEachElement(star, EdgeSplitter(mesh, a, b, middle, patch));
  return absl::OkStatus();
}

absl::Status PlanSplitElement(const Mesh& mesh, EntityId element, const absl::optional<Point>& position,
                              Patch& patch) {
  if (element.kind == EntityKind::kVertex || !mesh.IsElement(element)) {
    return Refuse(reason::kNotAnElement,
                  absl::StrCat(EntityKindName(element.kind), " ", element.slot, " is no element"),
                  element.kind, {element.slot});
  }
  if (mesh.IsDegenerate(element)) {
    return Refuse(reason::kDegenerateElement,
                  absl::StrCat(EntityKindName(element.kind), " ", element.slot, " names a vertex twice"),
                  element.kind, {element.slot});
  }
  const bool used = IsUsed(mesh, element);
  if (used) {
    return Refuse(reason::kElementInTheWay,
                  absl::StrCat("other elements use ", EntityKindName(element.kind), " ", element.slot,
                               ", and would no longer fit"),
                  element.kind, {element.slot});
  }
  const auto vertices = mesh.VerticesOf(element);
  Patch::NewVertex middle = MiddleOf(mesh, patch, vertices);
  const VertexId m = patch.AddVertex(position.value_or(middle.position), std::move(middle.blend));
  patch.Remove(element);
  if (element.kind == EntityKind::kCell) {
    AddCones(
        mesh.Type(element), vertices, m, [](auto) { return false; }, patch);
  } else if (element.kind == EntityKind::kEdge) {
    patch.Add(ElementType::kWireEdge, {vertices[0], m});
    patch.Add(ElementType::kWireEdge, {m, vertices[1]});
  } else {
    for (size_t k = 0; k < vertices.size(); ++k) {
      patch.Add(ElementType::kTriangle, {vertices[k], vertices[(k + 1) % vertices.size()], m});
    }
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
