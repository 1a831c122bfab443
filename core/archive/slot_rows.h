#ifndef DYNMESH_CORE_ARCHIVE_SLOT_ROWS_H_
#define DYNMESH_CORE_ARCHIVE_SLOT_ROWS_H_

#include <array>
#include <cstdint>

#include "core/archive/row_bytes.h"
#include "core/codec/bytes.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// What a mesh holds at one slot, and since when. See "Rows of slots" in FORMAT.md.
struct SlotRow {
  bool live = false;
  bool element = false;
  bool duplicate = false;
  ElementType type = ElementType::kUnspecified;  ///< kUnspecified also of vertices
  Stamp born = 0;
  Stamp changed = 0;
  Point position = {};
  std::array<Slot, kMaxElementVertices> vertices;
  std::array<Slot, kMaxElementFaces> parts;  ///< of a face its edges, of a cell its faces

  int num_vertices() const { return NumVertices(type); }
};

/// How many parts a face or cell of this type has; 0 of edges.
inline int NumParts(ElementType type) {
  if (KindOf(type) == EntityKind::kCell) return TemplateOf(type).num_faces;
  return KindOf(type) == EntityKind::kFace ? NumVertices(type) : 0;
}

/// What a row is told against: the row before it.
struct RowContext {
  Stamp born = 0;
  Stamp changed = 0;
  Slot vertex = 0;
  Slot part = 0;

  /// Before the first row of what was written at a revision.
  static RowContext At(int64_t revision) {
    const Stamp stamp = static_cast<Stamp>(revision);
    return {stamp, stamp, 0, 0};
  }
};

/// Writes rows of slots of one kind, each against the one before.
///
/// Faces of cells are told without their orientation codes: those follow from the vertices, and change unseen
/// when a face is turned. REQUIRES: the mesh outlives it.
class SlotRowWriter {
 public:
  SlotRowWriter(const Mesh& mesh, EntityKind kind, const RowContext& start, ByteWriter& out)
      : mesh_(mesh), kind_(kind), last_(start), out_(out) {}

  void Write(Slot slot);

 private:
  uint8_t TagOf(EntityId id) const;
  void WriteStamps(Slot slot, uint8_t tag);
  void WriteContent(EntityId id);
  template <typename Items, typename SlotOf>
  void WriteSlots(const Items& items, Slot& last, SlotOf slot_of);

  const Mesh& mesh_;
  const EntityKind kind_;
  RowContext last_;
  RowBuffer row_;
  ByteWriter& out_;
};

/// Reads what SlotRowWriter wrote.
class SlotRowReader {
 public:
  SlotRowReader(EntityKind kind, const MeshLimits& limits, const RowContext& start, ByteReader& in)
      : kind_(kind), limits_(limits), last_(start), in_(in) {}

  /// The next row, into `row`. False if the bytes are none: a flag or type that this kind has not, an id
  /// beyond the limits, a stamp that is none, a position that is not finite. Of `row` only what the type has
  /// is written.
  bool Read(SlotRow& row);

 private:
  bool ReadTag(uint8_t tag, SlotRow& row) const;
  bool ReadStamps(uint8_t tag, SlotRow& row);
  bool ReadContent(SlotRow& row);
  bool ReadSlots(int count, Slot limit, Slot& last, Slot* slots);

  const EntityKind kind_;
  const MeshLimits& limits_;
  RowContext last_;
  ByteReader& in_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ARCHIVE_SLOT_ROWS_H_
