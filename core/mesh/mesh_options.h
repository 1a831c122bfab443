#ifndef DYNMESH_CORE_MESH_MESH_OPTIONS_H_
#define DYNMESH_CORE_MESH_MESH_OPTIONS_H_

#include <array>
#include <cstdint>

#include "core/mesh/ids.h"

namespace dynmesh {

/// What becomes of an element that equals another one: both live, or the second is refused.
enum class DuplicatePolicy { kKeep, kRefuse };

/// Upper bounds on slots ever used, for each kind; beyond: RESOURCE_EXHAUSTED. An element is let in only if
/// there is room for all its faces and edges, as if none of them existed.
struct MeshLimits {
  /// Vertex ids stay below 2^31 (edit batches use the top bit), faces below 2^29 (oriented_face.h).
  std::array<uint32_t, kNumEntityKinds> max_slots = {0x7fffffffu, 0x7fffffffu, 0x1fffffffu, 0x7fffffffu};
};

struct MeshOptions {
  DuplicatePolicy duplicates = DuplicatePolicy::kKeep;
  MeshLimits limits;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_MESH_OPTIONS_H_
