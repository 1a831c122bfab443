#include "core/mesh/element_type.h"

#include <initializer_list>

namespace dynmesh {
namespace {

using Pair = std::initializer_list<int>;
using Pairs = std::initializer_list<Pair>;

// What a template cannot derive from the rest of it.
struct Outline {
  ElementType type;
  absl::string_view name;
  Pairs edges;
  Pairs faces;
  Pair smart_edges;
  Pair smart_vertices;
};

constexpr bool Joins(const LocalEdge& edge, int a, int b) {
  return (edge.vertices[0] == a && edge.vertices[1] == b) || (edge.vertices[0] == b && edge.vertices[1] == a);
}

// The local edge between two local vertices; num_edges when there is none, which Consistent() reports.
constexpr int FindEdge(const ElementTemplate& t, int a, int b) {
  int e = 0;
  while (e < t.num_edges && !Joins(t.edges[e], a, b)) ++e;
  return e;
}

constexpr int Next(const LocalFace& face, int k) { return face.vertices[(k + 1) % face.size]; }

constexpr bool FaceHasEdge(const LocalFace& face, int edge) {
  for (int k = 0; k < face.size; ++k) {
    if (face.edges[k] == edge) return true;
  }
  return false;
}

constexpr LocalFace MakeFace(const ElementTemplate& t, Pair vertices) {
  LocalFace face{};
  for (int v : vertices) face.vertices[face.size++] = v;
  for (int k = 0; k < face.size; ++k) face.edges[k] = FindEdge(t, face.vertices[k], Next(face, k));
  return face;
}

// Index of the first smart edge on `face`; num_smart_edges when there is none, which Consistent() reports.
constexpr int FindSmartEdge(const ElementTemplate& t, const LocalFace& face) {
  int i = 0;
  while (i < t.num_smart_edges && !FaceHasEdge(face, t.smart_edges[i])) ++i;
  return i;
}

constexpr ElementTemplate Build(const Outline& outline) {
  ElementTemplate t{};
  t.type = outline.type;
  t.kind = KindOf(outline.type);
  t.name = outline.name;
  t.num_vertices = NumVertices(outline.type);
  for (Pair edge : outline.edges) {
    const int* ends = edge.begin();
    t.edges[t.num_edges++] = LocalEdge{{uint8_t(ends[0]), uint8_t(ends[1])}};
  }
  for (Pair face : outline.faces) t.faces[t.num_faces++] = MakeFace(t, face);
  for (int e : outline.smart_edges) t.smart_edges[t.num_smart_edges++] = e;
  for (int v : outline.smart_vertices) t.smart_vertices[t.num_smart_vertices++] = v;
  for (int f = 0; f < t.num_faces; ++f) t.smart_edge_of_face[f] = FindSmartEdge(t, t.faces[f]);
  return t;
}

}  // namespace

constexpr ElementTemplate internal::kElementTemplates[] = {
    ElementTemplate{},
    Build({ElementType::kWireEdge, "wire_edge", {{0, 1}}, {}, {}, {0}}),
    Build({ElementType::kTriangle, "triangle", {{0, 1}, {1, 2}, {2, 0}}, {{0, 1, 2}}, {0}, {0, 1}}),
    Build({ElementType::kQuad, "quad", {{0, 1}, {1, 2}, {2, 3}, {3, 0}}, {{0, 1, 2, 3}}, {0}, {0, 2}}),
    Build({ElementType::kTetrahedron,
           "tetrahedron",
           {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}},
           {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 2, 1}},
           {0, 5},
           {0, 1, 2}}),
    Build({ElementType::kPyramid,
           "pyramid",
           {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 4}, {2, 4}, {3, 4}},
           {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}},
           {0, 6, 7},
           {0, 2, 4}}),
    Build({ElementType::kPrism,
           "prism",
           {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}},
           {{0, 1, 2}, {3, 5, 4}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}},
           {0, 4, 6},
           {0, 1, 4, 5}}),
    Build({ElementType::kHexahedron,
           "hexahedron",
           {{0, 1}, {1, 2}, {3, 2}, {0, 3}, {4, 5}, {5, 6}, {7, 6}, {4, 7}, {0, 4}, {1, 5}, {3, 7}, {2, 6}},
           {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}},
           {0, 5, 10},
           {0, 2, 5, 7}}),
};

namespace {

constexpr bool FacesUseCellEdges(const ElementTemplate& t) {
  for (int f = 0; f < t.num_faces; ++f) {
    for (int k = 0; k < t.faces[f].size; ++k) {
      if (t.faces[f].edges[k] >= t.num_edges) return false;
    }
  }
  return true;
}

// How often the faces walk from local vertex a to b.
constexpr int CountWalks(const ElementTemplate& t, int a, int b) {
  int walks = 0;
  for (int f = 0; f < t.num_faces; ++f) {
    const LocalFace& face = t.faces[f];
    for (int k = 0; k < face.size; ++k) walks += face.vertices[k] == a && Next(face, k) == b;
  }
  return walks;
}

constexpr bool ClosedAndOriented(const ElementTemplate& t) {
  if (t.kind != EntityKind::kCell) return true;
  for (int e = 0; e < t.num_edges; ++e) {
    const uint8_t(&ends)[2] = t.edges[e].vertices;
    if (CountWalks(t, ends[0], ends[1]) != 1 || CountWalks(t, ends[1], ends[0]) != 1) return false;
  }
  return t.num_vertices - t.num_edges + t.num_faces == 2;
}

// Whether every edge ends in a vertex of the bit set `vertices`.
constexpr bool Covers(const ElementTemplate& t, unsigned vertices) {
  for (int e = 0; e < t.num_edges; ++e) {
    if (!((vertices >> t.edges[e].vertices[0] | vertices >> t.edges[e].vertices[1]) & 1)) return false;
  }
  return true;
}

// Whether every face holds an edge of the bit set `edges`.
constexpr bool HitsFaces(const ElementTemplate& t, unsigned edges) {
  for (int f = 0; f < t.num_faces; ++f) {
    bool hit = false;
    for (int k = 0; k < t.faces[f].size; ++k) hit |= edges >> t.faces[f].edges[k] & 1;
    if (!hit) return false;
  }
  return true;
}

constexpr unsigned BitsOf(const uint8_t* items, int count) {
  unsigned bits = 0;
  for (int i = 0; i < count; ++i) bits |= 1u << items[i];
  return bits;
}

constexpr int CountBits(unsigned bits) {
  int count = 0;
  for (; bits != 0; bits &= bits - 1) ++count;
  return count;
}

// Whether `chosen` passes `fits` and no smaller subset of `size` items does.
constexpr bool IsSmallest(const ElementTemplate& t, unsigned chosen, int size,
                          bool (*fits)(const ElementTemplate&, unsigned)) {
  if (!fits(t, chosen)) return false;
  for (unsigned set = 0; set < 1u << size; ++set) {
    if (CountBits(set) < CountBits(chosen) && fits(t, set)) return false;
  }
  return true;
}

constexpr bool Consistent(ElementType type) {
  const ElementTemplate& t = internal::kElementTemplates[static_cast<int>(type)];
  return t.type == type && FacesUseCellEdges(t) && ClosedAndOriented(t) &&
         IsSmallest(t, BitsOf(t.smart_edges, t.num_smart_edges), t.num_edges, HitsFaces) &&
         IsSmallest(t, BitsOf(t.smart_vertices, t.num_smart_vertices), t.num_vertices, Covers);
}

static_assert(Consistent(ElementType::kWireEdge));
static_assert(Consistent(ElementType::kTriangle));
static_assert(Consistent(ElementType::kQuad));
static_assert(Consistent(ElementType::kTetrahedron));
static_assert(Consistent(ElementType::kPyramid));
static_assert(Consistent(ElementType::kPrism));
static_assert(Consistent(ElementType::kHexahedron));

}  // namespace

absl::string_view ElementTypeName(ElementType type) {
  return IsElementType(static_cast<int>(type)) ? TemplateOf(type).name : absl::string_view("unspecified");
}

}  // namespace dynmesh
