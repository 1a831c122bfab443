#ifndef DYNMESH_CORE_DELTA_MIRROR_H_
#define DYNMESH_CORE_DELTA_MIRROR_H_

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/delta/delta.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// A flat copy of a session: elements and vertices by slot, no derived entities, kept equal by deltas.
///
///     Mirror mirror;
///     DYNMESH_RETURN_IF_ERROR(mirror.Apply(delta));   // checksum compared when the delta is consistent
///
/// Cost: Apply linear in the delta; memory 24 bytes a vertex slot, 1 + 4 * 8 a cell slot at most.
/// Thread safety: that of std::vector.
class Mirror {
 public:
  enum class Geometry { kExact, kQuantized };  ///< kQuantized: only the topology checksum is compared

  /// Slots beyond are refused: the arrays are as long as the highest slot.
  static constexpr Slot kMaxSlots = Slot{1} << 28;

  explicit Mirror(Geometry geometry = Geometry::kExact) : geometry_(geometry) {}

  /// Applies a delta that starts at or before what this copy holds, and does not end before it.
  /// Errors: FAILED_PRECONDITION REVISION_MISMATCH (it starts later or ends earlier), DATA_LOSS CORRUPT_PAYLOAD
  /// (CheckDelta), RESOURCE_EXHAUSTED (kMaxSlots): nothing changed. DATA_LOSS CHECKSUM_MISMATCH: applied, and
  /// the copy is not equal; follow from 0 with a new Mirror.
  absl::Status Apply(const Delta& delta);

  /// Of the last consistent delta.
  int64_t revision() const { return revision_; }
  const Checksum& checksum() const { return checksum_; }

  uint32_t num_vertices() const { return num_vertices_; }
  uint32_t num_elements(EntityKind kind) const { return elements_[Dimension(kind) - 1].count; }
  bool HasVertex(VertexId v) const;
  /// REQUIRES: HasVertex(v).
  const Point& Position(VertexId v) const { return positions_[v.slot()]; }
  /// kUnspecified where no element stands.
  ElementType TypeAt(EntityKind kind, Slot slot) const;
  /// REQUIRES: TypeAt(...) != kUnspecified.
  absl::Span<const VertexId> VerticesAt(EntityKind kind, Slot slot) const;
  /// One past the highest slot that may hold an element.
  Slot SlotLimit(EntityKind kind) const;
  const std::vector<AttributeColumn>& attributes() const { return attributes_; }

 private:
  struct Table {
    int stride = 2;
    uint32_t count = 0;
    std::vector<ElementType> types;
    std::vector<VertexId> vertices;
  };

  void RemoveVertex(Slot slot);
  void PutVertex(Slot slot, const Point& position);
  void RemoveElement(EntityKind kind, Slot slot);
  void PutElement(EntityKind kind, ElementType type, Slot slot, const VertexId* vertices);
  void Widen(Table& table, int stride);
  AttributeColumn* FindColumn(const AttributeSpec& spec);
  absl::Status CheckFits(const Delta& delta) const;
  absl::Status CheckColumns(const Delta& delta);
  void ApplyElements(EntityKind kind, const ElementChanges& changes);
  void ApplyAttributes(const AttributeChanges& changes);
  absl::Status CheckEqual(const Delta& delta);

  Geometry geometry_;
  int64_t revision_ = 0;
  uint32_t num_vertices_ = 0;
  std::vector<bool> has_vertex_;
  std::vector<Point> positions_;
  std::array<Table, 3> elements_;
  std::vector<AttributeColumn> attributes_;
  Checksum checksum_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_DELTA_MIRROR_H_
