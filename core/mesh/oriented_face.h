#ifndef DYNMESH_CORE_MESH_ORIENTED_FACE_H_
#define DYNMESH_CORE_MESH_ORIENTED_FACE_H_

#include <cstdint>

#include "core/mesh/ids.h"
#include "core/mesh/vertex_cycle.h"

namespace dynmesh {

/// A face of a cell with its orientation code, in 32 bits: hence at most 2^29 - 1 faces.
class OrientedFace {
 public:
  constexpr OrientedFace() = default;
  constexpr OrientedFace(FaceId face, FaceCode code) : packed_(face.slot() << 3 | code.value) {}

  constexpr FaceId face() const { return FaceId(packed_ >> 3); }
  constexpr FaceCode code() const { return FaceCode{static_cast<uint8_t>(packed_ & 7)}; }
  /// The 32 bits.
  constexpr uint32_t packed() const { return packed_; }
  static constexpr OrientedFace FromPacked(uint32_t packed) {
    OrientedFace oriented;
    oriented.packed_ = packed;
    return oriented;
  }

 private:
  uint32_t packed_ = kNoSlot;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_ORIENTED_FACE_H_
