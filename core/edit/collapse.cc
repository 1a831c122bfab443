#include "core/edit/collapse.h"

#include <algorithm>
#include <array>

#include "absl/container/inlined_vector.h"
#include "absl/strings/str_cat.h"
#include "core/edit/cone.h"
#include "core/edit/polygon.h"
#include "core/edit/star.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// Edges from one vertex, for many look-ups.
class EdgesFrom {
 public:
  EdgesFrom(const Mesh& mesh, VertexId v) : mesh_(mesh), v_(v) {
    const auto edges = mesh.IncidentEdges(v);
    if (edges.size() > kMaxListed) return;
    for (EdgeId e : edges) {
      if (mesh.IsDuplicate(e)) continue;
      const auto ends = mesh.Vertices(e);
      others_.push_back(ends[0] == v ? ends[1] : ends[0]);
      edges_.push_back(e);
    }
  }

  /// As Mesh::FindEdge.
  EdgeId To(VertexId other) const {
    if (others_.empty()) return mesh_.FindEdge(v_, other);
    const size_t i = std::find(others_.begin(), others_.end(), other) - others_.begin();
    return i < edges_.size() ? edges_[i] : EdgeId();
  }

 private:
  static constexpr size_t kMaxListed = 64;  ///< the mesh has a better way to find one among very many

  const Mesh& mesh_;
  const VertexId v_;
  absl::InlinedVector<VertexId, 32> others_;
  absl::InlinedVector<EdgeId, 32> edges_;
};

/// What the collapse of one edge ties together, and whether anything else would merge.
class LinkCondition {
 public:
  LinkCondition(const Mesh& mesh, VertexId kept, VertexId gone, uint64_t& work)
      : mesh_(mesh), kept_(kept), gone_(gone), edges_of_kept_(mesh, kept), work_(work) {}

  absl::Status Check(EdgeId e) const {
    if (mesh_.IsOnBoundary(kept_) && mesh_.IsOnBoundary(gone_) && !mesh_.IsOnBoundary(e)) {
      return Refuse(reason::kBoundary,
                    absl::StrCat("edge ", e.slot(), " runs inside from boundary to boundary"),
                    EntityKind::kEdge, {e.slot()});
    }
    for (EdgeId other : mesh_.IncidentEdges(gone_)) {
      DYNMESH_RETURN_IF_ERROR(CheckEdge(other));
      for (FaceId f : mesh_.IncidentFaces(other)) {
        if (IsLowerEdge(mesh_, f, gone_, other)) DYNMESH_RETURN_IF_ERROR(CheckFace(f));
      }
    }
    return absl::OkStatus();
  }

 private:
  VertexId OtherEnd(EdgeId e) const {
    const auto ends = mesh_.Vertices(e);
    return ends[0] == gone_ ? ends[1] : ends[0];
  }

  /// An edge of `gone` may merge with one of `kept` only across a triangle of the three.
  absl::Status CheckEdge(EdgeId of_gone) const {
    const VertexId c = OtherEnd(of_gone);
    if (c == kept_) return absl::OkStatus();
    work_ += WorkOfLookUp();
    const EdgeId of_kept = edges_of_kept_.To(c);
    if (!of_kept.valid()) return absl::OkStatus();
    const FaceId between = FindAt(of_gone, {kept_, gone_, c});
    const auto refuse = [&](absl::string_view why) {
      return Refuse(reason::kLinkCondition, absl::StrCat("vertex ", c.slot(), " ", why), EntityKind::kVertex,
                    {c.slot()});
    };
    if (!between.valid()) return refuse("is adjacent to both ends, and no triangle lies between");
    if (mesh_.IsElement(of_kept) || mesh_.IsElement(of_gone)) {
      return Refuse(reason::kElementInTheWay, "a wire edge would merge with another edge", EntityKind::kEdge,
                    {of_kept.slot(), of_gone.slot()});
    }
    const bool solid = !mesh_.IncidentCells(between).empty();
    if (solid && mesh_.IsOnBoundary(of_kept) && mesh_.IsOnBoundary(of_gone) && !mesh_.IsOnBoundary(between)) {
      return refuse("is joined to both ends along the boundary, round a triangle that lies inside");
    }
    return absl::OkStatus();
  }

  /// A face of `gone` may merge with one of `kept` only across a cell of both.
  absl::Status CheckFace(FaceId of_gone) const {
    const auto vertices = mesh_.Vertices(of_gone);
    if (Contains(vertices, kept_)) return CheckShrinking(of_gone);
    if (!AreNeighborsJoined(vertices)) return absl::OkStatus();
    std::array<VertexId, kMaxFaceVertices> moved;
    std::replace_copy(vertices.begin(), vertices.end(), moved.begin(), gone_, kept_);
    const size_t at = std::find(vertices.begin(), vertices.end(), gone_) - vertices.begin();
    const VertexId beside = vertices[(at + 1) % vertices.size()];
    const FaceId of_kept =
        FindAt(edges_of_kept_.To(beside), absl::MakeConstSpan(moved.data(), vertices.size()));
    if (!of_kept.valid()) return absl::OkStatus();
    for (CellId c : mesh_.IncidentCells(of_gone)) {
      ++work_;
      if (HasFace(c, of_kept)) return CheckDangling(of_kept, of_gone);
    }
    return RefuseMerger(of_gone, of_kept);
  }

  /// Whether the vertices beside `gone` in a face are adjacent to `kept`.
  bool AreNeighborsJoined(absl::Span<const VertexId> cycle) const {
    work_ += 2 * WorkOfLookUp();
    const size_t at = std::find(cycle.begin(), cycle.end(), gone_) - cycle.begin(), n = cycle.size();
    return edges_of_kept_.To(cycle[(at + 1) % n]).valid() &&
           edges_of_kept_.To(cycle[(at + n - 1) % n]).valid();
  }

  /// A quad of both becomes a triangle, which must not be there, with either end.
  absl::Status CheckShrinking(FaceId quad) const {
    const auto vertices = mesh_.Vertices(quad);
    for (VertexId end : {gone_, kept_}) {
      std::array<VertexId, kMaxFaceVertices> rest;
      const auto size = std::remove_copy(vertices.begin(), vertices.end(), rest.begin(), end) - rest.begin();
      if (size < 3) return absl::OkStatus();
      const FaceId triangle = Find(absl::MakeConstSpan(rest.data(), size));
      if (triangle.valid()) return RefuseMerger(quad, triangle);
    }
    return absl::OkStatus();
  }

  /// The face of these vertices, one of whose edges is known.
  FaceId FindAt(EdgeId of_face, absl::Span<const VertexId> cycle) const {
    constexpr size_t kFew = 32;  // the mesh has better ways to find one among many
    const auto faces = mesh_.IncidentFaces(of_face);
    if (faces.size() > kFew || mesh_.HasDuplicates(EntityKind::kEdge)) return Find(cycle);
    work_ += faces.size();
    for (FaceId f : faces) {
      if (!mesh_.IsDuplicate(f) && MatchFace(mesh_.Vertices(f), cycle)) return f;
    }
    return FaceId();
  }

  FaceId Find(absl::Span<const VertexId> cycle) const {
    work_ += 3 * WorkOfLookUp();
    return mesh_.FindFace(cycle);
  }

  absl::Status RefuseMerger(FaceId f, FaceId other) const {
    return Refuse(
        reason::kLinkCondition,
        absl::StrCat("faces ", f.slot(), " and ", other.slot(), " would merge, and no cell lies between"),
        EntityKind::kFace, {f.slot(), other.slot()});
  }

  bool HasFace(CellId c, FaceId f) const {
    const auto faces = mesh_.Faces(c);
    return std::any_of(faces.begin(), faces.end(),
                       [f](OrientedFace oriented) { return oriented.face() == f; });
  }

  /// An edge or face is looked for in a list of at most so many.
  uint64_t WorkOfLookUp() const {
    return 1 + std::min<uint64_t>(mesh_.IncidentEdges(kept_).size(), Mesh::kSortedIncident);
  }

  absl::Status CheckDangling(FaceId of_kept, FaceId of_gone) const {
    if (!mesh_.IsElement(of_kept) || !mesh_.IsElement(of_gone)) return absl::OkStatus();
    return Refuse(reason::kElementInTheWay, "two faces that are elements would merge", EntityKind::kFace,
                  {of_kept.slot(), of_gone.slot()});
  }

  const Mesh& mesh_;
  const VertexId kept_, gone_;
  const EdgesFrom edges_of_kept_;
  uint64_t& work_;
};

/// FAILED_PRECONDITION LINK_CONDITION if a cell of a patch would equal one that stays: both have a face
/// without the kept vertex in common, which is there.
class TwinCheck {
 public:
  TwinCheck(const Mesh& mesh, VertexId kept, VertexId gone) : mesh_(mesh), kept_(kept), gone_(gone) {}

  /// Adds what it looked at to the patch's work; TOO_MANY_ELEMENTS beyond kMaxPatchWork.
  absl::Status Check(Patch& patch) const {
    for (size_t i = 0; i < patch.added.size(); ++i) {
      const EntityId parent = patch.removed[patch.parents[i]];
      if (parent.kind != EntityKind::kCell) continue;
      const CellId twin = TwinOf(patch.added[i], CellId(parent.slot), patch.work);
      if (patch.work > kMaxPatchWork) return TooManyElements(gone_);
      if (!twin.valid()) continue;
      return Refuse(reason::kLinkCondition,
                    absl::StrCat("cell ", parent.slot, " would become equal to cell ", twin.slot()),
                    EntityKind::kCell, {parent.slot, twin.slot()});
    }
    return absl::OkStatus();
  }

 private:
  CellId TwinOf(const NewElement& element, CellId parent, uint64_t& work) const {
    const ElementTemplate& shape = TemplateOf(element.type);
    for (int i = 0; i < shape.num_faces; ++i) {
      const FaceVertices face(shape.faces[i], element.vertices());
      const auto span = face.span();
      const bool is_new =
          std::any_of(span.begin(), span.end(), [](VertexId v) { return v.slot() & kNewVertex; });
      if (is_new || Contains(span, kept_)) continue;
      const FaceId f = FaceOf(parent, i, span);
      if (!f.valid()) return CellId();
      work += mesh_.IncidentCells(f).size();
      return TwinAt(f, element, parent);
    }
    return CellId();
  }

  /// The face with these vertices, which most likely is one of the parent's, and the i-th.
  FaceId FaceOf(CellId parent, size_t i, absl::Span<const VertexId> vertices) const {
    const auto faces = mesh_.Faces(parent);
    if (i < faces.size() && MatchFace(mesh_.Vertices(faces[i].face()), vertices)) return faces[i].face();
    for (OrientedFace oriented : faces) {
      if (MatchFace(mesh_.Vertices(oriented.face()), vertices)) return oriented.face();
    }
    return mesh_.FindFace(vertices);
  }

  /// Duplicates that were there before stay what they are.
  bool AreEqual(CellId a, CellId b) const {
    const auto first = mesh_.Vertices(a), second = mesh_.Vertices(b);
    return std::is_permutation(first.begin(), first.end(), second.begin(), second.end());
  }

  CellId TwinAt(FaceId f, const NewElement& element, CellId parent) const {
    const auto ours = element.vertices();
    for (CellId c : mesh_.IncidentCells(f)) {
      const auto theirs = mesh_.Vertices(c);
      const bool has_gone = Contains(theirs, gone_), has_kept = Contains(theirs, kept_);
      if (!has_gone && !has_kept) continue;  // which nearly all are
      const bool shrinks = has_gone && has_kept;
      if (c == parent || mesh_.Type(c) != element.type || shrinks || AreEqual(c, parent)) continue;
      std::array<VertexId, kMaxElementVertices> moved;
      const auto end = std::replace_copy(theirs.begin(), theirs.end(), moved.begin(), gone_, kept_);
      if (std::is_permutation(moved.begin(), end, ours.begin(), ours.end())) return c;
    }
    return CellId();
  }

  const Mesh& mesh_;
  const VertexId kept_, gone_;
};

/// Replaces the elements of the vertex that goes.
class Collapser {
 public:
  Collapser(const Mesh& mesh, VertexId kept, VertexId gone, Patch& patch)
      : mesh_(mesh), kept_(kept), gone_(gone), patch_(patch) {}

  absl::Status Replace(EntityId element) {
    patch_.Remove(element);
    const auto vertices = mesh_.VerticesOf(element);
    if (!Contains(vertices, kept_)) return Substitute(mesh_.Type(element), vertices);
    switch (element.kind) {
      case EntityKind::kCell:
        return CollapseCell(element, vertices);
      case EntityKind::kFace:
        return CollapseFace(element, vertices);
      default:
        return absl::OkStatus();
    }
  }

 private:
  absl::Status Substitute(ElementType type, absl::Span<const VertexId> vertices) {
    std::array<VertexId, kMaxElementVertices> moved;
    std::replace_copy(vertices.begin(), vertices.end(), moved.begin(), gone_, kept_);
    patch_.Add(type, absl::MakeConstSpan(moved.data(), vertices.size()));
    return absl::OkStatus();
  }

  absl::Status RefuseCorners(EntityId element) const {
    return Refuse(reason::kNotSimplex,
                  absl::StrCat("the ends of the edge are opposite corners of ", EntityKindName(element.kind),
                               " ", element.slot),
                  element.kind, {element.slot});
  }

  static bool AreOpposite(absl::Span<const VertexId> cycle, VertexId a, VertexId b) {
    return cycle.size() == 4 && ((cycle[0] == a && cycle[2] == b) || (cycle[0] == b && cycle[2] == a) ||
                                 (cycle[1] == a && cycle[3] == b) || (cycle[1] == b && cycle[3] == a));
  }

  absl::Status CollapseFace(EntityId element, absl::Span<const VertexId> vertices) {
    if (AreOpposite(vertices, kept_, gone_)) return RefuseCorners(element);
    const Polygon shrunk = Merged(vertices, kept_, gone_);
    if (shrunk.size == 3) patch_.Add(ElementType::kTriangle, shrunk.span());
    return absl::OkStatus();
  }

  absl::Status CollapseCell(EntityId element, absl::Span<const VertexId> vertices) {
    const ElementTemplate& shape = TemplateOf(mesh_.Type(element));
    std::array<Polygon, kMaxElementFaces> faces;
    size_t num_faces = 0, merged = 0;
    bool cone = true;
    for (int i = 0; i < shape.num_faces; ++i) {
      const FaceVertices face(shape.faces[i], vertices);
      const auto span = face.span();
      if (AreOpposite(span, kept_, gone_)) return RefuseCorners(element);
      const Polygon shrunk = Merged(span, kept_, gone_);
      merged += shrunk.size < span.size();
      if (shrunk.size < 3) continue;
      cone &= shrunk.size == 3 || !Contains(shrunk.span(), kept_);
      faces[num_faces++] = shrunk;
    }
    if (merged != 2) return RefuseCorners(element);
    const auto left = absl::MakeConstSpan(faces.data(), num_faces);
    cone ? Cones(left, kept_) : Cones(left, AddMiddle(vertices));
    return absl::OkStatus();
  }

  void Cones(absl::Span<const Polygon> faces, VertexId apex) {
    for (const Polygon& face : faces) {
      if (!Contains(face.span(), apex)) AddCone(face.span(), apex, patch_);
    }
  }

  /// A vertex in the middle of what is left of a cell.
  VertexId AddMiddle(absl::Span<const VertexId> vertices) {
    std::array<VertexId, kMaxElementVertices> left;
    const auto count = std::remove_copy(vertices.begin(), vertices.end(), left.begin(), gone_) - left.begin();
    Patch::NewVertex middle = MiddleOf(mesh_, patch_, absl::MakeConstSpan(left.data(), count));
    return patch_.AddVertex(middle.position, std::move(middle.blend));
  }

  const Mesh& mesh_;
  const VertexId kept_, gone_;
  Patch& patch_;
};

}  // namespace

absl::Status PlanCollapseEdge(const Mesh& mesh, EdgeId e, const CollapsePlace& place, Patch& patch) {
  const auto ends = EndsFrom(mesh, e, place.origin);
  const bool first_stays = place.parameter <= 0.5;
  const VertexId kept = ends[first_stays ? 0 : 1], gone = ends[first_stays ? 1 : 0];
  const Star star = StarOf(mesh, gone);
  patch.work += star.work;
  DYNMESH_RETURN_IF_ERROR(CheckNotDegenerate(mesh, star));
  DYNMESH_RETURN_IF_ERROR(LinkCondition(mesh, kept, gone, patch.work).Check(e));
  const double t = place.parameter;
  const Point on_edge = (1 - t) * mesh.Position(ends[0]) + t * mesh.Position(ends[1]);
  const bool stays = !place.position && (t == 0 || t == 1);
  if (!stays) {
    patch.work += WorkOfStar(mesh, kept);
    patch.moves.push_back({kept, place.position.value_or(on_edge)});
  }
  Collapser collapser(mesh, kept, gone, patch);
  absl::Status status;
  ForEachElement(star, [&](EntityId element) {
    if (status.ok()) status = collapser.Replace(element);
  });
  patch.mergers.push_back({kept, gone, first_stays ? t : 1 - t});
  patch.removed_vertices.push_back(gone);
  patch.check_euler = true;
  return status.ok() ? TwinCheck(mesh, kept, gone).Check(patch) : status;
}

}  // namespace dynmesh
