// The relations that follow from the default ones.

#include <algorithm>

#include "core/mesh/vertex_cycle.h"
#include "tests/bench/limit/flat_mesh.h"

namespace dynmesh::bench {
namespace {

/// The edge of a cell that the template calls e, by the first of its faces that has it.
struct EdgePlace {
  int face, place;
};

std::array<EdgePlace, kMaxElementEdges> PlacesOf(const ElementTemplate& shape) {
  std::array<EdgePlace, kMaxElementEdges> places{};
  for (int face = shape.num_faces - 1; face >= 0; --face) {
    for (int k = 0; k < shape.faces[face].size; ++k) places[shape.faces[face].edges[k]] = {face, k};
  }
  return places;
}

FlatRows CellEdges(const FlatMesh& mesh) {
  const ElementTemplate& shape = TemplateOf(mesh.type);
  const auto places = PlacesOf(shape);
  const FlatRows& faces = mesh.rows[3][2];
  const FlatRows& edges = mesh.rows[2][1];
  FlatRows rows;
  rows.stride = shape.num_edges;
  rows.ids.resize(faces.size() * rows.stride);
  uint32_t* out = rows.ids.data();
  for (size_t first = 0; first < faces.ids.size(); first += shape.num_faces) {
    for (int e = 0; e < shape.num_edges; ++e) {
      const size_t use = first + places[e].face;
      const int at = FaceCode{mesh.face_codes[use]}.StoredEdge(places[e].place, edges.stride);
      *out++ = edges.ids[size_t{faces.ids[use]} * edges.stride + at];
    }
  }
  return rows;
}

void SortLastRow(FlatRows& rows) {
  const auto begin = rows.ids.begin() + rows.offsets.back();
  std::sort(begin, rows.ids.end());
  rows.ids.erase(std::unique(begin, rows.ids.end()), rows.ids.end());
  rows.offsets.push_back(rows.ids.size());
}

/// Row i: everything in the `up` rows of what the `down` row of i holds, but i.
FlatRows Adjacent(const FlatRows& down, const FlatRows& up) {
  FlatRows rows;
  rows.offsets.reserve(down.size() + 1);
  rows.offsets.push_back(0);
  for (uint32_t i = 0; i < down.size(); ++i) {
    for (uint32_t via : down.Row(i)) {
      for (uint32_t neighbor : up.Row(via)) {
        if (neighbor != i) rows.ids.push_back(neighbor);
      }
    }
    SortLastRow(rows);
  }
  return rows;
}

}  // namespace

void AddFlatStorable(FlatMesh& mesh) {
  auto& rows = mesh.rows;
  rows[0][0] = Adjacent(rows[0][1], rows[1][0]);
  rows[0][2] = Invert(rows[2][0], mesh.num_vertices());
  if (!mesh.has_cells()) return;
  rows[3][1] = CellEdges(mesh);
  rows[0][3] = Invert(rows[3][0], mesh.num_vertices());
  rows[1][3] = Invert(rows[3][1], mesh.num_edges());
  rows[3][3] = Adjacent(rows[3][2], rows[2][3]);
}

void AddFlatAdjacent(FlatMesh& mesh) {
  mesh.rows[1][1] = Adjacent(mesh.rows[1][0], mesh.rows[0][1]);
  mesh.rows[2][2] = Adjacent(mesh.rows[2][1], mesh.rows[1][2]);
}

}  // namespace dynmesh::bench
