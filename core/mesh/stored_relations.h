#ifndef DYNMESH_CORE_MESH_STORED_RELATIONS_H_
#define DYNMESH_CORE_MESH_STORED_RELATIONS_H_

#include <array>
#include <cstddef>

#include "absl/status/status.h"
#include "absl/types/optional.h"
#include "core/mesh/ids.h"
#include "core/mesh/relation.h"
#include "core/mesh/stored_rows.h"
#include "core/mesh/work_meter.h"

namespace dynmesh {

class Mesh;

/// The tables of a mesh that are stored at present, kept current by it: it tells of each entity that it links
/// or unlinks. A part of Mesh.
class StoredRelations {
 public:
  bool any() const { return cell_edges_.has_value() || num_tables_ > 0; }
  bool Has(Relation relation) const;

  /// nullptr unless stored; cell->edges has its own kind of table.
  const StoredRows* Find(Relation relation) const {
    const int i = StorableIndex(relation);
    return i < kNumStorableRelations && tables_[i].has_value() ? &*tables_[i] : nullptr;
  }
  const CellEdgeRows* cell_edges() const { return cell_edges_.has_value() ? &*cell_edges_ : nullptr; }

  /// Whether `count` entries more have room within the 32-bit limits of every table.
  bool HasRoom(uint32_t count) const;

  /// Fills a table from `mesh`; charges `meter` its bytes before they are taken. Errors: RESOURCE_EXHAUSTED;
  /// the meter's; nothing changed then. REQUIRES: the relation is storable and not stored.
  absl::Status Build(const Mesh& mesh, Relation relation, WorkMeter& meter);
  void Drop(Relation relation);
  /// Bytes of one table; 0 when it is not stored.
  size_t memory_bytes(Relation relation) const;

  /// A slot has a new occupant, which nothing is linked to yet.
  void Begin(EntityId id);
  /// The entity has just been linked, or is about to be unlinked. REQUIRES: its own downward arrays are
  /// valid.
  void CellLinked(const Mesh& mesh, CellId c);
  void CellUnlinking(const Mesh& mesh, CellId c);
  void FaceLinked(const Mesh& mesh, FaceId f);
  void FaceUnlinking(const Mesh& mesh, FaceId f);
  void EdgeLinked(const Mesh& mesh, EdgeId e);
  /// `last`: no other edge joins its ends.
  void EdgeUnlinking(const Mesh& mesh, EdgeId e, bool last);

 private:
  using Table = absl::optional<StoredRows>;
  enum { kCellEdges, kVertexCells, kEdgeCells, kVertexFaces, kCellCells, kVertexVertices };

  /// The rows of all cells of a face with more uses are open.
  static constexpr uint32_t kMaxJoinedUses = StoredRows::kMaxRow + 1;

  absl::Status BuildCellEdges(const Mesh& mesh, WorkMeter& meter);
  static void OpenCrowds(const Mesh& mesh, StoredRows& table);
  void JoinCells(const Mesh& mesh, CellId c, FaceId f);

  std::array<Table, kNumStorableRelations> tables_;
  absl::optional<CellEdgeRows> cell_edges_;
  int num_tables_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_STORED_RELATIONS_H_
