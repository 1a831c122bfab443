#ifndef DYNMESH_CORE_MESH_ELEMENT_TYPE_H_
#define DYNMESH_CORE_MESH_ELEMENT_TYPE_H_

#include <cassert>
#include <cstdint>

#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/mesh/ids.h"

/// Element types and their topological templates (paper, section 3 and Table 2).
///
/// Node order is VTK's (VTK_LINE, VTK_TRIANGLE, VTK_QUAD, VTK_TETRA, VTK_PYRAMID, VTK_WEDGE,
/// VTK_HEXAHEDRON); faces of cells point outwards in that order.
namespace dynmesh {

/// The values travel on the wire and are stored on disk: never renumber.
enum class ElementType : uint8_t {
  kUnspecified = 0,
  kWireEdge = 1,
  kTriangle = 2,
  kQuad = 3,
  kTetrahedron = 4,
  kPyramid = 5,
  kPrism = 6,
  kHexahedron = 7,
};

inline constexpr int kNumElementTypes = 7;
inline constexpr ElementType kElementTypes[] = {
    ElementType::kWireEdge, ElementType::kTriangle, ElementType::kQuad,      ElementType::kTetrahedron,
    ElementType::kPyramid,  ElementType::kPrism,    ElementType::kHexahedron};

inline constexpr int kMaxElementVertices = 8;
inline constexpr int kMaxElementEdges = 12;
inline constexpr int kMaxElementFaces = 6;
inline constexpr int kMaxFaceVertices = 4;

/// Whether `value` is one of kElementTypes.
constexpr bool IsElementType(int value) { return value >= 1 && value <= kNumElementTypes; }

/// The edge template[e] = {tail, head} as local vertex indices.
struct LocalEdge {
  uint8_t vertices[2];
};

/// A face of a cell: its local vertices in outward order, and its edges as local edges of the cell;
/// edges[k] joins vertices[k] and vertices[k + 1].
struct LocalFace {
  uint8_t size;
  uint8_t vertices[kMaxFaceVertices];
  uint8_t edges[kMaxFaceVertices];
};

/// The topological template of an element type: everything that its vertices imply.
///
/// A triangle or quad has one face, itself; a wire edge has none.
struct ElementTemplate {
  ElementType type;
  EntityKind kind;         ///< dimension of the element itself
  absl::string_view name;  ///< "tetrahedron"
  uint8_t num_vertices;
  uint8_t num_edges;
  uint8_t num_faces;
  LocalEdge edges[kMaxElementEdges];
  LocalFace faces[kMaxElementFaces];
  /// Smart edges: a smallest set of edges such that every face holds one. Faces are looked up round these.
  uint8_t num_smart_edges;
  uint8_t smart_edges[3];
  /// Smart vertices: a smallest set of vertices such that every edge ends in one. Edges are looked up there.
  uint8_t num_smart_vertices;
  uint8_t smart_vertices[5];
  /// For each face the index into smart_edges of the one it is looked up round.
  uint8_t smart_edge_of_face[kMaxElementFaces];
};

namespace internal {
extern const ElementTemplate kElementTemplates[kNumElementTypes + 1];
}

/// REQUIRES: IsElementType(type).
inline const ElementTemplate& TemplateOf(ElementType type) {
  assert(IsElementType(static_cast<int>(type)));
  return internal::kElementTemplates[static_cast<int>(type)];
}

constexpr EntityKind KindOf(ElementType type) {
  return type == ElementType::kWireEdge                                 ? EntityKind::kEdge
         : type == ElementType::kTriangle || type == ElementType::kQuad ? EntityKind::kFace
                                                                        : EntityKind::kCell;
}

constexpr int NumVertices(ElementType type) {
  constexpr uint8_t kCounts[] = {0, 2, 3, 4, 4, 5, 6, 8};
  return kCounts[static_cast<int>(type)];
}

/// "wire_edge", "triangle", ...; "unspecified" for kUnspecified.
absl::string_view ElementTypeName(ElementType type);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_ELEMENT_TYPE_H_
