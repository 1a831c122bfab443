// Many elements at once: in an order in which neighbours come together.

#include <algorithm>

#include "absl/container/inlined_vector.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/mesh.h"
#include "core/mesh/pipeline.h"
#include "core/mesh/spatial_order.h"

namespace dynmesh {
namespace {

/// Fewer elements stay in the order they came: sorting would cost more than it gives.
constexpr size_t kFewElements = 32;

/// Journal entries for each element of a batch: of a tetrahedron in the middle of others, itself, two faces
/// and little more than an edge.
constexpr size_t kTypicalEntries = 5;

/// Faces on an edge of more are not asked for ahead.
constexpr size_t kManyFaces = 16;

absl::Status WithIndex(const absl::Status& status, size_t index) {
  return WithMetadata(status, "index", absl::StrCat(index));
}

/// Whether many elements share no vertex with the next one, so that what one touches does not help the next.
/// A sample decides.
bool AreScattered(size_t count, absl::FunctionRef<absl::Span<const VertexId>(size_t)> element) {
  constexpr size_t kSample = 128;
  if (count < kFewElements) return false;
  size_t sharing = 0, pairs = 0;
  for (size_t k = 0; k + 1 < count; k += std::max<size_t>(1, count / kSample), ++pairs) {
    const auto next = element(k + 1);
    sharing += std::any_of(next.begin(), next.end(), [here = element(k)](VertexId v) {
      return std::find(here.begin(), here.end(), v) != here.end();
    });
  }
  return sharing * 10 < pairs * 9;
}

template <typename Id>
std::vector<Id> IdsOf(absl::Span<const Slot> slots) {
  return std::vector<Id>(slots.begin(), slots.end());
}

}  // namespace

absl::Status Mesh::AddElements(ElementType type, absl::Span<const VertexId> vertices,
                               absl::FunctionRef<void(size_t, EntityId)> added) {
  if (!IsElementType(static_cast<int>(type))) return CheckVertices(type, {});
  const size_t size = NumVertices(type);
  const size_t count = vertices.size() / size;
  if (vertices.size() % size != 0) return CheckVertices(type, vertices.last(vertices.size() % size));
  for (size_t i = 0; i < count; ++i) {
    const absl::Status checked = CheckVertices(type, vertices.subspan(i * size, size));
    if (!checked.ok()) return WithIndex(checked, i);
  }
  const Permutation order = count < kFewElements ? Permutation() : OrderOfElements(vertices, size);
  const auto index = [&](size_t k) { return order.empty() ? k : order[k]; };
  const auto element = [&](size_t k) { return vertices.subspan(index(k) * size, size); };
  if (journaling()) journal_.Expect(count * kTypicalEntries);
  std::vector<Slot> slots;
  slots.reserve(count);
  const auto add = [&](size_t k, const SmartEdges& known) -> absl::Status {
    const absl::StatusOr<EntityId> id = AddChecked(type, element(k), known);
    if (!id.ok()) return WithIndex(id.status(), index(k));
    slots.push_back(id->slot);
    added(index(k), *id);
    return absl::OkStatus();
  };
  if (KindOf(type) == EntityKind::kCell && AreScattered(count, element)) {
    DYNMESH_RETURN_IF_ERROR(AddScattered(TemplateOf(type), count, element, add));
  } else {
    for (size_t k = 0; k < count; ++k) DYNMESH_RETURN_IF_ERROR(add(k, {}));
  }
  if (KindOf(type) == EntityKind::kCell) SettleBoundaries(slots);
  return absl::OkStatus();
}

absl::Status Mesh::AddScattered(const ElementTemplate& shape, size_t count,
                                absl::FunctionRef<VertexSpan(size_t)> element,
                                absl::FunctionRef<absl::Status(size_t, const SmartEdges&)> add) {
  absl::Status status;
  std::vector<SmartEdges> known(count);
  Pipeline(
      count,
      [&](size_t k) {
        for (VertexId v : element(k)) vertex_edges_.PrefetchList(v.slot());
      },
      [&](size_t k) {
        for (VertexId v : element(k)) vertex_edges_.PrefetchEntries(v.slot());
      },
      [&](size_t k) {
        known[k] = FindSmartEdges(shape, element(k));
        for (EdgeId e : known[k]) {
          if (e.valid()) edge_faces_.PrefetchList(e.slot());
        }
      },
      [&](size_t k) {
        for (EdgeId e : known[k]) {
          if (e.valid()) edge_faces_.PrefetchEntries(e.slot());
        }
      },
      [&](size_t k) {
        for (EdgeId e : known[k]) {
          if (!e.valid() || edge_faces_.Length(e.slot()) > kManyFaces) continue;
          for (FaceId f : IncidentFaces(e)) {
            Prefetch(&face_vertices_[size_t{f.slot()} * face_stride_]);
            Prefetch(&flags_[2][f.slot()]);
          }
        }
      },
      [&](size_t k) { status.Update(status.ok() ? add(k, known[k]) : absl::OkStatus()); });
  return status;
}

Mesh::SmartEdges Mesh::FindSmartEdges(const ElementTemplate& shape, VertexSpan vertices) const {
  SmartEdges found;
  for (int s = 0; s < shape.num_smart_edges; ++s) {
    const LocalEdge& ends = shape.edges[shape.smart_edges[s]];
    found[s] = FindEdge(vertices[ends.vertices[0]], vertices[ends.vertices[1]]);
  }
  return found;
}

Permutation Mesh::OrderOfElements(absl::Span<const VertexId> vertices, size_t size) const {
  std::vector<Point> centers(vertices.size() / size, Point{0, 0, 0});
  for (size_t i = 0; i < centers.size(); ++i) {
    for (VertexId v : vertices.subspan(i * size, size)) {
      for (int axis = 0; axis < 3; ++axis) centers[i][axis] += Position(v)[axis] / size;
    }
  }
  return HilbertOrder(centers);
}

absl::Status Mesh::RemoveElements(EntityKind kind, absl::Span<const Slot> elements) {
  for (size_t i = 0; i < elements.size(); ++i) {
    const absl::Status checked = CheckRemovable({kind, elements[i]});
    if (!checked.ok()) return WithIndex(checked, i);
  }
  std::vector<Slot> sorted(elements.begin(), elements.end());
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) {
    const auto first = std::find(elements.begin(), elements.end(), *twice);
    const auto second = std::find(first + 1, elements.end(), *twice);
    return WithIndex(EntityNotFound(reason::kEntityRemoved, {kind, *twice}), second - elements.begin());
  }
  RemoveAll(kind, sorted);
  return absl::OkStatus();
}

void Mesh::RemoveAll(EntityKind kind, absl::Span<const Slot> elements) {
  if (kind == EntityKind::kCell) return RemoveCells(elements);
  for (Slot slot : elements) ClearElementFlag({kind, slot});
  kind == EntityKind::kFace ? ReleaseFaces(IdsOf<FaceId>(elements)) : ReleaseEdges(IdsOf<EdgeId>(elements));
}

void Mesh::RemoveCells(absl::Span<const Slot> cells) {
  if (journaling()) journal_.Expect(cells.size() * kTypicalEntries);
  absl::InlinedVector<FaceId, kMaxElementFaces> faces;
  faces.reserve(cells.size() * cell_face_stride_);
  Pipeline(
      cells.size(),
      [&](size_t i) {
        Prefetch(&cell_faces_[size_t{cells[i]} * cell_face_stride_]);
        Prefetch(&cell_vertices_[size_t{cells[i]} * cell_vertex_stride_]);
      },
      [&](size_t i) {
        for (OrientedFace oriented : Faces(CellId(cells[i]))) Prefetch(&face_cells_[oriented.face().slot()]);
      },
      [&](size_t i) {
        for (OrientedFace oriented : Faces(CellId(cells[i]))) faces.push_back(oriented.face());
        DestroyCell(CellId(cells[i]));
      });
  ReleaseFaces(faces);
}

void Mesh::ReleaseFaces(absl::Span<const FaceId> faces) {
  absl::InlinedVector<EdgeId, kMaxElementEdges> edges;
  Pipeline(
      faces.size(), [&](size_t i) { Prefetch(&face_edges_[size_t{faces[i].slot()} * face_stride_]); },
      [&](size_t i) {
        for (EdgeId e : Edges(faces[i])) edge_faces_.PrefetchList(e.slot());
      },
      [&](size_t i) {
        for (EdgeId e : Edges(faces[i])) edge_faces_.PrefetchEntries(e.slot());
      },
      [&](size_t i) {
        const FaceId f = faces[i];
        SettleBoundary(f);
        if (!IsUnneeded(f)) return;
        DestroyFace(f);
        for (EdgeId e : Edges(f)) {
          if (IncidentFaces(e).empty()) edges.push_back(e);
        }
      });
  ReleaseEdges(edges);
}

void Mesh::ReleaseEdges(absl::Span<const EdgeId> edges) {
  Pipeline(
      edges.size(), [&](size_t i) { Prefetch(&edge_vertices_[edges[i].slot()]); },
      [&](size_t i) {
        for (VertexId v : Vertices(edges[i])) vertex_edges_.PrefetchList(v.slot());
      },
      [&](size_t i) {
        for (VertexId v : Vertices(edges[i])) vertex_edges_.PrefetchEntries(v.slot());
      },
      [&](size_t i) {
        if (IsUnneeded(edges[i])) DestroyEdge(edges[i]);
      });
}

void Mesh::SettleBoundaries(absl::Span<const Slot> cells) {
  Pipeline(
      cells.size(),
      [&](size_t i) {
        for (OrientedFace oriented : Faces(CellId(cells[i]))) {
          Prefetch(&face_cells_[oriented.face().slot()]);
          Prefetch(&face_edges_[size_t{oriented.face().slot()} * face_stride_]);
        }
      },
      [&](size_t i) {
        for (OrientedFace oriented : Faces(CellId(cells[i]))) {
          if (IsSettled(oriented.face())) continue;
          for (EdgeId e : Edges(oriented.face())) {
            Prefetch(&boundary_uses_[1][e.slot()]);
            Prefetch(&edge_vertices_[e.slot()]);
          }
        }
      },
      [&](size_t i) { SettleBoundary(CellId(cells[i])); });
}

}  // namespace dynmesh
