#ifndef DYNMESH_CORE_MESH_VERTEX_CYCLE_H_
#define DYNMESH_CORE_MESH_VERTEX_CYCLE_H_

#include <array>
#include <cstddef>
#include <cstdint>

#include "absl/types/optional.h"
#include "absl/types/span.h"
#include "core/mesh/element_type.h"
#include "core/mesh/ids.h"

/// Vertices of a face in order: how two lists of the same cycle lie against each other.
namespace dynmesh {

/// How a stored face lies in a cell (or another list of the same vertices): with n vertices,
/// key[k] = stored[(rotation + k) mod n], or stored[(rotation - k) mod n] when flipped.
struct FaceCode {
  uint8_t value = 0;  ///< rotation | flipped << 2

  constexpr int rotation() const { return value & 3; }
  constexpr bool flipped() const { return value & 4; }
  /// Position in the stored face of the key's vertex k.
  constexpr int StoredVertex(int k, int n) const { return Wrap(rotation() + (flipped() ? n - k : k), n); }
  /// Position in the stored face of the key's edge k, which joins key vertices k and k + 1.
  constexpr int StoredEdge(int k, int n) const { return Wrap(rotation() + (flipped() ? n - k - 1 : k), n); }
  /// The code by which the stored face lies in the key.
  constexpr FaceCode Inverse(int n) const {
    return flipped() ? *this : FaceCode{static_cast<uint8_t>(Wrap(n - rotation(), n))};
  }

 private:
  /// k mod n of a k below 2n: divisions are slow.
  static constexpr int Wrap(int k, int n) { return k < n ? k : k - n; }
};

/// Vertices of one face of a cell, in the template's outward order.
struct FaceVertices {
  FaceVertices(const LocalFace& face, absl::Span<const VertexId> cell) : size(face.size) {
    for (int k = 0; k < size; ++k) vertices[k] = cell[face.vertices[k]];
  }
  absl::Span<const VertexId> span() const { return absl::MakeConstSpan(vertices.data(), size); }

  int size;
  std::array<VertexId, kMaxFaceVertices> vertices;
};

/// Whether a vertex is named twice.
inline bool HasRepeats(absl::Span<const VertexId> vertices) {
  for (size_t i = 1; i < vertices.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      if (vertices[i] == vertices[j]) return true;
    }
  }
  return false;
}

/// MatchFace for cycles of any length.
absl::optional<FaceCode> MatchCycle(absl::Span<const VertexId> stored, absl::Span<const VertexId> key);

/// The same for triangles, which most faces are.
inline absl::optional<FaceCode> MatchTriangle(const VertexId* stored, const VertexId* key) {
  constexpr uint8_t kFlipped = 4;
  for (uint8_t rotation = 0; rotation < 3; ++rotation) {
    const int next = rotation == 2 ? 0 : rotation + 1, last = rotation == 0 ? 2 : rotation - 1;
    if (stored[rotation] != key[0]) continue;
    if (stored[next] == key[1] && stored[last] == key[2]) return FaceCode{rotation};
    if (stored[last] == key[1] && stored[next] == key[2])
      return FaceCode{static_cast<uint8_t>(rotation | kFlipped)};
  }
  return absl::nullopt;
}

/// How `stored` lies against `key`, or nullopt if they are not the same cycle.
inline absl::optional<FaceCode> MatchFace(absl::Span<const VertexId> stored, absl::Span<const VertexId> key) {
  if (stored.size() != key.size()) return absl::nullopt;
  return stored.size() == 3 ? MatchTriangle(stored.data(), key.data()) : MatchCycle(stored, key);
}

/// A cycle of up to four vertices in a form that is the same for every rotation and reflection: the smallest
/// of them, padded with invalid ids. Of an edge: its ends, sorted.
using CycleKey = std::array<VertexId, kMaxFaceVertices>;
CycleKey CanonicalCycle(absl::Span<const VertexId> cycle);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_VERTEX_CYCLE_H_
