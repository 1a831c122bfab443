#include "core/edit/star.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"

namespace dynmesh {
namespace {

template <typename Ids>
void SortUnique(Ids& ids) {
  if (ids.size() < 2) return;
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

void Gather(const Mesh& mesh, EdgeId e, Star& star) {
  ++star.work;
  if (mesh.IsElement(e)) star.wires.push_back(e);
  for (FaceId f : mesh.IncidentFaces(e)) {
    if (mesh.IsElement(f)) star.faces.push_back(f);
    const auto cells = mesh.IncidentCells(f);
    star.cells.insert(star.cells.end(), cells.begin(), cells.end());
    star.work += 1 + cells.size();
  }
}

/// Whether `f` is the first face of a cell that has `v`.
bool IsFirstFace(const Mesh& mesh, CellId c, VertexId v, FaceId f) {
  for (OrientedFace oriented : mesh.Faces(c)) {
    if (oriented.face() == f) return true;
    if (Contains(mesh.Vertices(oriented.face()), v)) return false;
  }
  return false;
}

/// Gather at a vertex where no element is degenerate: looks at each face once, and takes each cell once.
void GatherPlain(const Mesh& mesh, VertexId v, Star& star) {
  for (EdgeId e : mesh.IncidentEdges(v)) {
    ++star.work;
    if (mesh.IsElement(e)) star.wires.push_back(e);
    for (FaceId f : mesh.IncidentFaces(e)) {
      ++star.work;
      if (!IsLowerEdge(mesh, f, v, e)) continue;
      if (mesh.IsElement(f)) star.faces.push_back(f);
      const auto cells = mesh.IncidentCells(f);
      star.work += cells.size();
      for (CellId c : cells) {
        if (IsFirstFace(mesh, c, v, f)) star.cells.push_back(c);
      }
    }
  }
}

void MakeUnique(Star& star) {
  SortUnique(star.cells);
  SortUnique(star.faces);
  SortUnique(star.wires);
}

}  // namespace

bool IsLowerEdge(const Mesh& mesh, FaceId f, VertexId v, EdgeId e) {
  const auto vertices = mesh.Vertices(f);
  const auto edges = mesh.Edges(f);
  const size_t next = std::find(vertices.begin(), vertices.end(), v) - vertices.begin();
  return e == std::min(edges[next], edges[next == 0 ? edges.size() - 1 : next - 1]);
}

Star StarOf(const Mesh& mesh, EdgeId e) {
  Star star;
  if (!mesh.HasDuplicates(EntityKind::kEdge)) {
    Gather(mesh, e, star);
    MakeUnique(star);
    return star;
  }
  const auto ends = mesh.Vertices(e);
  const auto fewer = std::min(mesh.IncidentEdges(ends[0]), mesh.IncidentEdges(ends[1]),
                              [](const auto& a, const auto& b) { return a.size() < b.size(); });
  star.work += fewer.size();
  for (EdgeId other : fewer) {
    const auto others = mesh.Vertices(other);
    if (Contains(others, ends[0]) && Contains(others, ends[1])) Gather(mesh, other, star);
  }
  MakeUnique(star);
  return star;
}

Star StarOf(const Mesh& mesh, VertexId v) {
  Star star;
  if (mesh.IsPlain()) {
    GatherPlain(mesh, v, star);
  } else {
    for (EdgeId e : mesh.IncidentEdges(v)) Gather(mesh, e, star);
  }
  MakeUnique(star);
  return star;
}

bool HasElementAt(const Mesh& mesh, FaceId f) {
  const auto others = mesh.IncidentFaces(mesh.Edges(f)[0]);
  return mesh.IsElement(f) || std::any_of(others.begin(), others.end(), [&](FaceId other) {
           return mesh.IsElement(other) && MatchFace(mesh.Vertices(f), mesh.Vertices(other));
         });
}

uint64_t WorkOfStar(const Mesh& mesh, VertexId v) {
  uint64_t work = 0;
  for (EdgeId e : mesh.IncidentEdges(v)) {
    ++work;
    for (FaceId f : mesh.IncidentFaces(e)) work += 1 + mesh.IncidentCells(f).size();
  }
  return work;
}

absl::Status CheckNotDegenerate(const Mesh& mesh, const Star& star) {
  absl::Status status;
  if (mesh.IsPlain()) return status;
  ForEachElement(star, [&](EntityId id) {
    if (!mesh.IsDegenerate(id) || !status.ok()) return;
    status = Refuse(reason::kDegenerateElement,
                    absl::StrCat(EntityKindName(id.kind), " ", id.slot, " names a vertex twice"), id.kind,
                    {id.slot});
  });
  return status;
}

absl::Status CheckTetrahedra(const Mesh& mesh, absl::Span<const CellId> cells) {
  for (CellId c : cells) {
    if (mesh.Type(c) == ElementType::kTetrahedron) continue;
    return Refuse(reason::kNotSimplex, absl::StrCat("cell ", c.slot(), " is no tetrahedron"),
                  EntityKind::kCell, {c.slot()});
  }
  return absl::OkStatus();
}

std::array<VertexId, 2> EndsFrom(const Mesh& mesh, EdgeId e, VertexId origin) {
  const auto ends = mesh.Vertices(e);
  return ends[1] == origin ? std::array<VertexId, 2>{ends[1], ends[0]}
                           : std::array<VertexId, 2>{ends[0], ends[1]};
}

absl::Status TooManyElements(VertexId v) {
  return Refuse(reason::kTooManyElements, absl::StrCat("vertex ", v.slot(), " has too many elements"),
                EntityKind::kVertex, {v.slot()});
}

absl::Status Refuse(absl::string_view reason, absl::string_view message, EntityKind kind,
                    absl::Span<const Slot> ids) {
  return FailedPrecondition(reason, message,
                            {{"kind", std::string(EntityKindName(kind))}, {"ids", JoinSlots(ids)}});
}

}  // namespace dynmesh
