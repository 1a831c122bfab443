#ifndef DYNMESH_CORE_MESH_CHECKSUM_H_
#define DYNMESH_CORE_MESH_CHECKSUM_H_

#include <array>
#include <bit>
#include <cstdint>

#include "absl/types/span.h"
#include "core/mesh/element_type.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// Position in space, in the units of the caller's mesh.
using Point = std::array<double, 3>;

/// Two order-free 64-bit hashes of a mesh: what a mirror compares to prove itself.
///
/// Each is the sum modulo 2^64 of one term for each live entity, so an edit adds or subtracts the terms
/// that it touches, and numpy computes the same over whole columns. With mix() = the finaliser of
/// SplitMix64 (`mix(z)`: z += 0x9e3779b97f4a7c15; z = (z ^ z>>30) * 0xbf58476d1ce4e5b9;
/// z = (z ^ z>>27) * 0x94d049bb133111eb; z ^ z>>31) the terms are folds h = mix(h ^ word), from h = 0:
///
///   topology: live vertex:  words [slot]
///             element:      words [kind << 40 | type << 32 | slot, vertex 0, vertex 1, ...]
///   geometry: live vertex:  words [slot, bits of x, bits of y, bits of z] (IEEE 754 binary64)
///
/// kind is the dimension (1, 2, 3); type is the value of ElementType. It detects errors, not forgers.
struct Checksum {
  uint64_t topology = 0;
  uint64_t geometry = 0;

  friend bool operator==(const Checksum&, const Checksum&) = default;

  static constexpr uint64_t Mix(uint64_t z) {
    z += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

  /// Term of a live vertex in `topology`.
  static constexpr uint64_t VertexTerm(Slot slot) { return Mix(slot); }

  /// Term of a live vertex in `geometry`.
  static uint64_t PositionTerm(Slot slot, const Point& position) {
    uint64_t h = Mix(slot);
    for (double coordinate : position) h = Mix(h ^ std::bit_cast<uint64_t>(coordinate));
    return h;
  }

  /// Term of an element in `topology`; `vertices` are slots in template order.
  static uint64_t ElementTerm(ElementType type, Slot slot, absl::Span<const VertexId> vertices) {
    uint64_t h = Mix(static_cast<uint64_t>(Dimension(KindOf(type))) << 40 |
                     static_cast<uint64_t>(type) << 32 | slot);
    for (VertexId v : vertices) h = Mix(h ^ v.slot());
    return h;
  }
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_CHECKSUM_H_
