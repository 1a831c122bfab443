#include "core/edit/swap.h"

#include <algorithm>
#include <array>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/strings/str_cat.h"
#include "core/edit/geometry.h"
#include "core/edit/ring_triangulation.h"
#include "core/edit/star.h"

namespace dynmesh {
namespace {

absl::Status RefuseEdge(absl::string_view reason, absl::string_view why, EdgeId e) {
  return Refuse(reason, absl::StrCat("edge ", e.slot(), " ", why), EntityKind::kEdge, {e.slot()});
}

// ---- Two triangles ----

/// The corner of a triangle that is neither end of an edge.
VertexId ApexOf(absl::Span<const VertexId> triangle, VertexId a, VertexId b) {
  return *std::find_if(triangle.begin(), triangle.end(), [&](VertexId v) { return v != a && v != b; });
}

/// Whether a triangle goes from `a` straight to `b`.
bool Walks(absl::Span<const VertexId> triangle, VertexId a, VertexId b) {
  for (size_t k = 0; k < triangle.size(); ++k) {
    if (triangle[k] == a && triangle[(k + 1) % triangle.size()] == b) return true;
  }
  return false;
}

absl::Status PlanFlip(const Mesh& mesh, EdgeId e, absl::Span<const FaceId> faces, Patch& patch) {
  if (faces.size() == 1) return RefuseEdge(reason::kBoundary, "has one triangle", e);
  if (faces.size() > 2) return RefuseEdge(reason::kNonManifoldEdge, "has more than two faces", e);
  for (FaceId f : faces) {
    if (mesh.Type(f) == ElementType::kTriangle) continue;
    return Refuse(reason::kNotSimplex, absl::StrCat("face ", f.slot(), " is no triangle"), EntityKind::kFace,
                  {f.slot()});
  }
  VertexId a = mesh.Vertices(e)[0], b = mesh.Vertices(e)[1];
  const auto first = mesh.Vertices(faces[0]), second = mesh.Vertices(faces[1]);
  if (!Walks(first, a, b)) std::swap(a, b);
  if (!Walks(second, b, a)) {
    return Refuse(reason::kInconsistentOrientation, "the two triangles turn differently", EntityKind::kFace,
                  {faces[0].slot(), faces[1].slot()});
  }
  const VertexId c = ApexOf(first, a, b), d = ApexOf(second, a, b);
  const EdgeId across = mesh.FindEdge(c, d);
  if (c == d || across.valid()) {
    return RefuseEdge(reason::kEdgeExists, "has two triangles whose other corners are joined already", e);
  }
  patch.Remove(faces[0]);
  patch.Add(ElementType::kTriangle, {a, d, c});
  patch.Remove(faces[1]);
  patch.Add(ElementType::kTriangle, {d, b, c});
  return absl::OkStatus();
}

// ---- Tetrahedra ----

/// The other two vertices c, d of a tetrahedron such that a b c d turns as its own vertices do.
std::array<VertexId, 2> OthersInOrder(absl::Span<const VertexId> tet, VertexId a, VertexId b) {
  std::array<int, 4> order = {0, 0, 0, 0};
  int others = 2;
  for (int i = 0; i < 4; ++i) order[tet[i] == a ? 0 : tet[i] == b ? 1 : others++] = i;
  int inversions = 0;
  for (int i = 0; i < 4; ++i) {
    for (int j = i + 1; j < 4; ++j) inversions += order[i] > order[j];
  }
  return inversions % 2 == 0 ? std::array<VertexId, 2>{tet[order[2]], tet[order[3]]}
                             : std::array<VertexId, 2>{tet[order[3]], tet[order[2]]};
}

/// The vertices round an edge a-b, in the order in which its tetrahedra follow each other: cells[i] has a, b,
/// vertices[i] and vertices[i + 1], and turns as these do.
struct Ring {
  absl::InlinedVector<VertexId, 8> vertices;
  absl::InlinedVector<CellId, 8> cells;
};

absl::Status CheckFacesRound(const Mesh& mesh, EdgeId e) {
  for (FaceId f : mesh.IncidentFaces(e)) {
    if (mesh.IsElement(f)) {
      return Refuse(reason::kElementInTheWay, absl::StrCat("face ", f.slot(), " is an element beside cells"),
                    EntityKind::kFace, {f.slot()});
    }
    const size_t uses = mesh.IncidentCells(f).size();
    if (uses == 1) return RefuseEdge(reason::kBoundary, "is not surrounded by cells", e);
    if (uses > 2) return RefuseEdge(reason::kNonManifoldEdge, "has a face of more than two cells", e);
  }
  return absl::OkStatus();
}

absl::StatusOr<Ring> RingRound(const Mesh& mesh, EdgeId e, absl::Span<const CellId> cells) {
  const VertexId a = mesh.Vertices(e)[0], b = mesh.Vertices(e)[1];
  absl::InlinedVector<std::array<VertexId, 2>, 8> steps;
  for (CellId c : cells) steps.push_back(OthersInOrder(mesh.Vertices(c), a, b));
  Ring ring;
  VertexId at = steps[0][0];
  do {
    const auto next =
        std::find_if(steps.begin(), steps.end(), [at](const auto& step) { return step[0] == at; });
    if (next == steps.end()) {
      return RefuseEdge(reason::kInconsistentOrientation, "has cells that turn differently", e);
    }
    ring.vertices.push_back(at);
    ring.cells.push_back(cells[next - steps.begin()]);
    at = (*next)[1];
  } while (at != steps[0][0] && ring.cells.size() <= cells.size());
  if (ring.cells.size() != cells.size())
    return RefuseEdge(reason::kNonManifoldEdge, "has more than one ring of cells", e);
  return ring;
}

/// The pairs of tetrahedra between the triangles of a ring and the two ends of the edge that it surrounds.
class RingFiller {
 public:
  RingFiller(const Mesh& mesh, EdgeId e, absl::Span<const VertexId> ring, int orientation)
      : mesh_(mesh),
        a_(mesh.Vertices(e)[0]),
        b_(mesh.Vertices(e)[1]),
        ring_(ring),
        orientation_(orientation) {}

  /// Finds the triangulation that makes the worst new tetrahedron best, and adds its tetrahedra. False when
  /// every one needs an edge or face that is there already.
  bool Fill(Patch& patch) const {
    RingTriangulation triangulation(ring_.size(), RingTriangulation::Aim::kBestWorst);
    const bool found = triangulation.Find(
        [this](size_t i, size_t j) { return !mesh_.FindEdge(ring_[i], ring_[j]).valid(); },
        [this](const RingTriangulation::Triangle& triangle) { return QualityOf(triangle); });
    if (!found) return false;
    triangulation.ForEach([&](const RingTriangulation::Triangle& triangle) {
      const auto [i, k, j] = triangle;
      patch.AddChildOf(i, ElementType::kTetrahedron, {ring_[i], ring_[k], ring_[j], b_});
      patch.AddChildOf(i, ElementType::kTetrahedron, {ring_[i], ring_[j], ring_[k], a_});
    });
    return true;
  }

 private:
  double QualityOf(const RingTriangulation::Triangle& triangle) const {
    const auto [i, k, j] = triangle;
    if (ring_.size() == 3 && mesh_.FindFace({ring_[i], ring_[k], ring_[j]}).valid()) {
      return RingTriangulation::kForbidden;
    }
    return std::min(SignedQuality({ring_[i], ring_[k], ring_[j], b_}),
                    SignedQuality({ring_[i], ring_[j], ring_[k], a_}));
  }

  double SignedQuality(const std::array<VertexId, 4>& tet) const {
    std::array<Point, 4> points;
    for (int i = 0; i < 4; ++i) points[i] = mesh_.Position(tet[i]);
    const double quality = Quality(ElementType::kTetrahedron, points);
    return Orientation(ElementType::kTetrahedron, points) == orientation_ ? quality : -quality;
  }

  const Mesh& mesh_;
  const VertexId a_, b_;
  const absl::Span<const VertexId> ring_;
  const int orientation_;
};

/// Of the first of some tetrahedra that is not flat; 0 when all are.
int OrientationOf(const Mesh& mesh, absl::Span<const CellId> cells) {
  int orientation = 0;
  for (CellId c : cells) {
    std::array<Point, 4> points;
    for (int i = 0; i < 4; ++i) points[i] = mesh.Position(mesh.Vertices(c)[i]);
    if (orientation == 0) orientation = Orientation(ElementType::kTetrahedron, points);
  }
  return orientation;
}

absl::Status PlanRemoveEdge(const Mesh& mesh, EdgeId e, absl::Span<const CellId> cells, Patch& patch) {
  DYNMESH_RETURN_IF_ERROR(CheckTetrahedra(mesh, cells));
  DYNMESH_RETURN_IF_ERROR(CheckFacesRound(mesh, e));
  if (cells.size() > kMaxRing) {
    return RefuseEdge(reason::kTooManyElements,
                      absl::StrCat("has ", cells.size(), " cells, more than ", kMaxRing), e);
  }
  DYNMESH_ASSIGN_OR_RETURN(const Ring ring, RingRound(mesh, e, cells));
  const size_t n = ring.vertices.size();
  if (n < 3) return RefuseEdge(reason::kNonManifoldEdge, "has two cells that share two faces", e);
  patch.orientation = OrientationOf(mesh, cells);
  patch.work += n * n * n;
  for (CellId c : ring.cells) patch.Remove(c);
  if (!RingFiller(mesh, e, ring.vertices, patch.orientation).Fill(patch)) {
    return n == 3 ? RefuseEdge(reason::kFaceExists, "has a ring that is a face already", e)
                  : RefuseEdge(reason::kEdgeExists, "has a ring whose vertices are joined already", e);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status PlanSwapEdge(const Mesh& mesh, EdgeId e, Patch& patch) {
  const Star star = StarOf(mesh, e);
  patch.work += star.work;
  DYNMESH_RETURN_IF_ERROR(CheckNotDegenerate(mesh, star));
  if (!star.wires.empty()) return RefuseEdge(reason::kElementInTheWay, "is an element itself", e);
  if (star.cells.empty()) return PlanFlip(mesh, e, star.faces, patch);
  return PlanRemoveEdge(mesh, e, star.cells, patch);
}

absl::Status PlanSwapFace(const Mesh& mesh, FaceId f, Patch& patch) {
  const auto refuse = [f](absl::string_view reason, absl::string_view why) {
    return Refuse(reason, absl::StrCat("face ", f.slot(), " ", why), EntityKind::kFace, {f.slot()});
  };
  const auto cells = mesh.IncidentCells(f);
  patch.work += mesh.IncidentFaces(mesh.Edges(f)[0]).size();
  if (HasElementAt(mesh, f))
    return refuse(reason::kElementInTheWay, "is an element itself, or a duplicate of it is");
  if (cells.size() < 2) return refuse(reason::kBoundary, "has one cell");
  if (cells.size() > 2) return refuse(reason::kNonManifoldFace, "has more than two cells");
  DYNMESH_RETURN_IF_ERROR(CheckTetrahedra(mesh, cells));
  const CellId first = cells[0], second = cells[1];
  const auto apex_of = [&](CellId c) {
    const auto vertices = mesh.Vertices(c);
    return *std::find_if(vertices.begin(), vertices.end(),
                         [&](VertexId v) { return !Contains(mesh.Vertices(f), v); });
  };
  if (mesh.IsDegenerate(first) || mesh.IsDegenerate(second) || first == second) {
    return refuse(reason::kDegenerateElement, "has a cell that names a vertex twice");
  }
  const VertexId a = apex_of(first), b = apex_of(second);
  if (a == b || mesh.FindEdge(a, b).valid()) {
    return refuse(reason::kEdgeExists, "has two cells whose other corners are joined already");
  }
  // As seen from the first cell, the face turns outwards: p q r; the second cell must see it the other way.
  const VertexId p = mesh.Vertices(f)[0];
  const auto outwards = OthersInOrder(mesh.Vertices(first), a, p);
  const auto from_second = OthersInOrder(mesh.Vertices(second), b, p);
  if (outwards[0] == from_second[0])
    return refuse(reason::kInconsistentOrientation, "has cells that turn differently");
  const std::array<VertexId, 3> cycle = {p, outwards[0], outwards[1]};
  patch.orientation = OrientationOf(mesh, cells);
  patch.Remove(first);
  patch.Remove(second);
  for (int k = 0; k < 3; ++k) {
    patch.AddChildOf(0, ElementType::kTetrahedron, {a, b, cycle[k], cycle[(k + 1) % 3]});
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
