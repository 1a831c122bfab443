#ifndef DYNMESH_CORE_MESH_NEW_ELEMENT_H_
#define DYNMESH_CORE_MESH_NEW_ELEMENT_H_

#include <algorithm>
#include <array>

#include "absl/types/span.h"
#include "core/mesh/element_type.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// An element that is to be added.
struct NewElement {
  /// REQUIRES: vertices.size() == NumVertices(element_type).
  NewElement(ElementType element_type, absl::Span<const VertexId> vertices) : type(element_type) {
    std::copy(vertices.begin(), vertices.end(), ids.begin());
  }
  absl::Span<const VertexId> vertices() const { return absl::MakeConstSpan(ids.data(), NumVertices(type)); }
  absl::Span<VertexId> mutable_vertices() { return absl::MakeSpan(ids.data(), NumVertices(type)); }

  ElementType type;
  std::array<VertexId, kMaxElementVertices> ids;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_NEW_ELEMENT_H_
