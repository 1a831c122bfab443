#ifndef DYNMESH_CORE_EDIT_CORNERS_H_
#define DYNMESH_CORE_EDIT_CORNERS_H_

#include <cstdint>

#include "absl/types/span.h"
#include "core/mesh/element_type.h"

namespace dynmesh {

/// A vertex and the other ends of three of its edges, which turn as the first corner of a tetrahedron does.
/// Of a pyramid and a prism the third end is the apex, or lies on the other triangle.
struct Corner {
  uint8_t at;
  uint8_t ends[3];
};

/// Of a cell: all of them, but the apex of a pyramid, which has four edges. Of other types: none.
absl::Span<const Corner> CornersOf(ElementType type);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_CORNERS_H_
