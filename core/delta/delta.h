#ifndef DYNMESH_CORE_DELTA_DELTA_H_
#define DYNMESH_CORE_DELTA_DELTA_H_

#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/attributes.h"
#include "core/mesh/checksum.h"
#include "core/mesh/element_type.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// Elements of one dimension that a delta writes or removes. All slot lists ascend strictly.
struct ElementChanges {
  std::vector<Slot> removed;
  std::vector<Slot> slots;             ///< upserted
  std::vector<ElementType> types;      ///< types[i] belongs to slots[i]
  std::vector<VertexId> vertices;      ///< concatenated, NumVertices(types[i]) for each

  friend bool operator==(const ElementChanges&, const ElementChanges&) = default;
};

/// Rows of one attribute column.
struct AttributeChanges {
  AttributeSpec spec;
  std::vector<Slot> slots;             ///< ascending strictly
  std::vector<uint8_t> rows;           ///< slots.size() * spec.row_bytes(), little-endian

  friend bool operator==(const AttributeChanges&, const AttributeChanges&) = default;
};

/// The difference between two revisions of a session as after-images: for each slot that changed, what is
/// there now. Applying it twice, or after another delta that overlaps it, gives the same state, which is
/// why a late follower needs no log.
///
/// Derived faces and edges do not travel: elements imply them. A delta whose `consistent` is false is one
/// chunk of a longer answer: elements may refer to vertices that a later chunk brings, and only after
/// the chunk with consistent = true does the copy equal the session at `to_revision`.
///
/// Invariants (checked by CheckDelta): 0 <= from_revision <= to_revision; at most kMaxAttributeColumns columns, each
/// once; slot lists ascend; sizes agree; no slot is both removed and upserted;
/// no slot, also of an element's vertex, is kNoSlot; element types have the dimension of their list;
/// attribute specs are valid; positions and float attributes are finite.
struct Delta {
  int64_t from_revision = 0;           ///< 0: from nothing
  int64_t to_revision = 0;
  bool consistent = true;

  std::vector<Slot> removed_vertices;
  std::vector<Slot> vertex_slots;      ///< new or moved
  std::vector<Point> positions;        ///< positions[i] belongs to vertex_slots[i]
  std::array<ElementChanges, 3> elements;  ///< [0] wire edges, [1] faces, [2] cells
  std::vector<AttributeChanges> attributes;
  Checksum checksum;                   ///< of the session at to_revision; meaningful when consistent

  ElementChanges& OfKind(EntityKind kind) { return elements[Dimension(kind) - 1]; }
  const ElementChanges& OfKind(EntityKind kind) const { return elements[Dimension(kind) - 1]; }

  size_t num_upserted_elements() const {
    return elements[0].slots.size() + elements[1].slots.size() + elements[2].slots.size();
  }
  size_t num_removed_elements() const {
    return elements[0].removed.size() + elements[1].removed.size() + elements[2].removed.size();
  }
  bool empty() const {
    return removed_vertices.empty() && vertex_slots.empty() && num_upserted_elements() == 0 &&
           num_removed_elements() == 0 && attributes.empty();
  }

  friend bool operator==(const Delta&, const Delta&) = default;
};

/// DATA_LOSS CORRUPT_PAYLOAD naming the first invariant of Delta that does not hold. Cost: one scan.
absl::Status CheckDelta(const Delta& delta);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_DELTA_DELTA_H_
