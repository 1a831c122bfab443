#ifndef DYNMESH_CORE_MESH_BATCH_IMAGE_H_
#define DYNMESH_CORE_MESH_BATCH_IMAGE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/mesh/checksum.h"
#include "core/mesh/element_type.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// What a batch changed, as it was before: all that it takes to put the mesh back with all ids of all kinds.
///
///     mesh.BeginBatch();
///     ... edits ...
///     const BatchImage undo = mesh.ImageSince(0);
///     mesh.Commit();                                   // revision r
///     mesh.BeginBatch();
///     const BatchImage redo = *mesh.Restore(undo);     // what stood there at r - 1, stamped r + 1
///     mesh.Commit();
///
/// An image fits the mesh that the batch left, and no other: batches are undone last first. It holds the net
/// effect: what a batch both made and removed is not in it. All slot lists ascend strictly. A slot at which one
/// entity ended and another was made is in both lists; its rows are those of the one that ended. Columns that
/// a batch added stay; their rows go back to what they were at first.
struct BatchImage {
  /// What an edge, face or cell is made of. In `states`: bits.
  static constexpr uint8_t kElement = 1;
  static constexpr uint8_t kDuplicate = 2;

  /// Entities of one kind, one after the other.
  struct Entities {
    std::vector<Slot> slots;
    std::vector<ElementType> types;
    std::vector<uint8_t> states;
    std::vector<VertexId> vertices;  ///< NumVertices(type) each
    std::vector<Slot> parts;         ///< of a face its edges, of a cell its faces

    size_t memory_bytes() const;
  };

  struct Positions {
    std::vector<Slot> slots;
    std::vector<Point> positions;

    size_t memory_bytes() const;
  };

  /// Rows of one attribute column.
  struct Rows {
    int column = 0;
    std::vector<Slot> slots;
    std::vector<uint8_t> bytes;

    size_t memory_bytes() const;
  };

  /// What tells the mesh that an image fits from most others.
  struct Fit {
    Checksum checksum;
    std::array<uint32_t, kNumEntityKinds> num_live = {};

    friend bool operator==(const Fit&, const Fit&) = default;
  };

  Fit fit;
  std::array<std::vector<Slot>, kNumEntityKinds> made;  ///< by the batch: to be removed
  Positions ended_vertices;                             ///< to be put back
  std::array<Entities, kNumEntityKinds> ended;          ///< the same of edges, faces and cells
  Positions moved;                                      ///< vertices that stay
  /// Edges and faces that stay, whose state or order of vertices changed; without parts.
  std::array<Entities, kNumEntityKinds> reshaped;
  std::vector<Rows> rows;  ///< of entities that stay or are put back; ascending by column

  /// How many entities and rows it names.
  uint64_t num_items() const;
  /// Heap and all.
  size_t memory_bytes() const;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_BATCH_IMAGE_H_
