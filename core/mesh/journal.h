#ifndef DYNMESH_CORE_MESH_JOURNAL_H_
#define DYNMESH_CORE_MESH_JOURNAL_H_

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/mesh/checksum.h"
#include "core/mesh/element_type.h"
#include "core/mesh/ids.h"
#include "core/mesh/stamps.h"

namespace dynmesh {

/// The smallest steps that edits are made of; each can be undone when all later ones have been.
enum class JournalOp : uint8_t {
  kRecycle,         ///< a slot that the batch had freed is about to be taken; before: Journal::contents
  kCreate,          ///< entity began; a = born stamp before, b = changed stamp before
  kDestroy,         ///< entity ended; its arrays still hold it; b = changed stamp before
  kSetElement,      ///< element flag set; b = changed stamp before
  kClearElement,    ///< element flag cleared; b = changed stamp before
  kSetDuplicate,    ///< duplicate flag set
  kClearDuplicate,  ///< duplicate flag cleared
  kFlipEdge,        ///< the two vertices changed places
  kReorderFace,     ///< a = FaceCode that leads back
  kMoveVertex,      ///< b = changed stamp before; position before: Journal::positions
  kAddAttribute,    ///< the last column was added
  kSetAttribute,    ///< a = column, b = stamp before; row before: Journal::rows
};

struct JournalEntry {
  JournalOp op;
  EntityKind kind;
  Slot slot;
  uint32_t a;
  uint32_t b;
};

/// What the arrays hold at a slot: the entity that was there last. Of a vertex its position is on the stack
/// of positions.
struct SlotContent {
  ElementType type = ElementType::kUnspecified;
  uint8_t flags = 0;
  std::array<VertexId, kMaxElementVertices> vertices;
  std::array<uint32_t, kMaxElementFaces> parts;  ///< of a face its edges, of a cell its oriented faces
};

/// What Mesh::Rollback undoes, last entry first. Values too large for an entry stand on stacks beside.
struct Journal {
  std::vector<JournalEntry> entries;
  std::vector<Point> positions;
  std::vector<uint8_t> rows;
  std::vector<SlotContent> contents;

  /// Makes room for `count` entries more.
  void Expect(size_t count) {
    const size_t needed = entries.size() + count;
    if (needed > entries.capacity()) entries.reserve(std::max(needed, 2 * entries.capacity()));
  }

  /// Room for batches of usual sizes stays.
  void Clear() {
    constexpr size_t kKeptBytes = 4 << 20;
    Clear(entries, kKeptBytes);
    Clear(positions, kKeptBytes);
    Clear(rows, kKeptBytes);
    Clear(contents, kKeptBytes);
  }

 private:
  template <typename T>
  static void Clear(std::vector<T>& items, size_t kept_bytes) {
    items.clear();
    if (items.capacity() * sizeof(T) > kept_bytes) std::vector<T>().swap(items);
  }
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_JOURNAL_H_
