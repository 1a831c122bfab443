#include "server/session/queries.h"

#include <utility>

#include "core/mesh/error.h"
#include "core/mesh/rings.h"
#include "server/session/row_walk.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

/// Cuts rows of neighbours into chunks.
class NeighborsBuilder {
 public:
  NeighborsBuilder(const Mesh& mesh, const Neighborhood& neighborhood, QueryBudget& budget)
      : rings_(neighborhood.rings),
        walk_(mesh, neighborhood.relation, budget),
        ring_walk_(mesh, neighborhood.relation.from, budget),
        budget_(budget) {
    chunks_.emplace_back();
  }

  absl::Status AddRow(Slot slot) {
    DYNMESH_RETURN_IF_ERROR(rings_ == 1 ? walk_.Walk(slot, row_) : ring_walk_.Walk(slot, rings_, row_));
    DYNMESH_RETURN_IF_ERROR(budget_.ChargeBytes(row_.size() * sizeof(Slot) + kRowBytes));
    size_t cut = 0;
    if (row_.size() > kPieceIds) {
      cut = CutLongRow();
    } else if (BytesOf(chunks_.back()) + row_.size() * sizeof(Slot) + kRowBytes > kChunkBytes) {
      StartChunk(0);
    }
    NeighborsChunk& chunk = chunks_.back();
    chunk.ids.push_back(slot);
    chunk.neighbors.insert(chunk.neighbors.end(), row_.begin() + cut, row_.end());
    chunk.offsets.push_back(first_offset_ + chunk.neighbors.size());
    return absl::OkStatus();
  }

  std::vector<NeighborsChunk> Take() && { return std::move(chunks_); }

 private:
  static constexpr size_t kRowBytes = sizeof(Slot) + sizeof(uint32_t);
  static constexpr size_t kPieceIds = kChunkBytes / sizeof(Slot) / 2;

  static size_t BytesOf(const NeighborsChunk& chunk) {
    return chunk.ids.size() * kRowBytes + chunk.neighbors.size() * sizeof(Slot);
  }

  void StartChunk(size_t first_offset) {
    if (!chunks_.back().ids.empty() || !chunks_.back().neighbors.empty()) chunks_.emplace_back();
    first_offset_ = first_offset;
  }

  /// Puts all but the last piece of a long row into chunks without ids; returns how many neighbours these
  /// took.
  size_t CutLongRow() {
    const size_t cut = (row_.size() - 1) / kPieceIds * kPieceIds;
    for (size_t begin = 0; begin < cut; begin += kPieceIds) {
      StartChunk(0);
      chunks_.back().neighbors.assign(row_.begin() + begin, row_.begin() + begin + kPieceIds);
    }
    StartChunk(cut);
    return cut;
  }

  const uint32_t rings_;
  RowWalk walk_;
  RingWalk ring_walk_;
  QueryBudget& budget_;
  std::vector<Slot> row_;
  size_t first_offset_ = 0;  ///< neighbours of the last chunk's first row that earlier chunks hold
  std::vector<NeighborsChunk> chunks_;
};

/// Gathers what there is to say of entities of one kind.
class EntitiesBuilder {
 public:
  EntitiesBuilder(const Mesh& mesh, EntityKind kind, QueryBudget& budget)
      : mesh_(mesh), kind_(kind), budget_(budget) {
    StartChunk();
  }

  absl::Status Add(Slot slot) {
    const size_t row_bytes = kind_ == EntityKind::kVertex
                                 ? kFixedBytes + sizeof(Point)
                                 : kFixedBytes + (2 + mesh_.VerticesOf({kind_, slot}).size()) * sizeof(Slot);
    DYNMESH_RETURN_IF_ERROR(budget_.ChargeSteps(1));
    DYNMESH_RETURN_IF_ERROR(budget_.ChargeBytes(row_bytes));
    if (chunk_bytes_ + row_bytes > kChunkBytes) StartChunk();
    chunk_bytes_ += row_bytes;
    Append(EntityId(kind_, slot), chunks_.back());
    return absl::OkStatus();
  }

  std::vector<EntitiesChunk> Take() && { return std::move(chunks_); }

 private:
  static constexpr size_t kFixedBytes = sizeof(Slot) + sizeof(int64_t) + 1;

  void StartChunk() {
    chunks_.emplace_back();
    if (kind_ != EntityKind::kVertex) chunks_.back().vertex_offsets.push_back(0);
    chunk_bytes_ = 0;
  }

  void Append(EntityId id, EntitiesChunk& chunk) const {
    chunk.ids.push_back(id.slot);
    chunk.flags.push_back(FlagsOf(id));
    chunk.born_revisions.push_back(mesh_.slots(id.kind).Born(id.slot));
    if (id.kind == EntityKind::kVertex) {
      chunk.positions.push_back(mesh_.Position(VertexId(id.slot)));
      return;
    }
    const auto vertices = mesh_.VerticesOf(id);
    chunk.types.push_back(mesh_.Type(id));
    chunk.vertices.insert(chunk.vertices.end(), vertices.begin(), vertices.end());
    chunk.vertex_offsets.push_back(chunk.vertices.size());
  }

  uint8_t FlagsOf(EntityId id) const {
    return (mesh_.IsElement(id) ? kIsElement : 0) | (mesh_.IsOnBoundary(id) ? kIsOnBoundary : 0) |
           (mesh_.IsDuplicate(id) ? kIsDuplicate : 0);
  }

  const Mesh& mesh_;
  const EntityKind kind_;
  QueryBudget& budget_;
  size_t chunk_bytes_ = 0;
  std::vector<EntitiesChunk> chunks_;
};

absl::StatusOr<NeighborsAnswer> GatherNeighbors(const SelectionScope& scope, const Neighborhood& neighborhood,
                                                const Selection& selection, QueryBudget& budget) {
  NeighborsBuilder builder(scope.mesh, neighborhood, budget);
  DYNMESH_RETURN_IF_ERROR(ForEachSelected(scope, neighborhood.relation.from, selection,
                                          [&](Slot slot) { return builder.AddRow(slot); }));
  return NeighborsAnswer{scope.mesh.revision(), std::move(builder).Take()};
}

absl::StatusOr<EntitiesAnswer> GatherEntities(const SelectionScope& scope, EntityKind kind,
                                              const Selection& selection, QueryBudget& budget) {
  EntitiesBuilder builder(scope.mesh, kind, budget);
  DYNMESH_RETURN_IF_ERROR(
      ForEachSelected(scope, kind, selection, [&](Slot slot) { return builder.Add(slot); }));
  return EntitiesAnswer{scope.mesh.revision(), std::move(builder).Take()};
}

absl::Status CheckRings(const Neighborhood& neighborhood) {
  const auto& [relation, rings] = neighborhood;
  if (rings < 1 || rings > kMaxRings) return BadField("rings", "rings is outside 1-1000");
  if (rings == 1 || relation.from == relation.to) return absl::OkStatus();
  return BadField("rings", "rings are of adjacent entities: from and to must be the same kind");
}

absl::StatusOr<IdsAnswer> GatherBoundary(const Mesh& mesh, EntityKind kind, QueryBudget budget) {
  const BitSet& boundary = mesh.Boundary(kind);
  DYNMESH_RETURN_IF_ERROR(budget.ChargeSteps(boundary.size()));
  DYNMESH_RETURN_IF_ERROR(budget.ChargeBytes(boundary.size() * sizeof(Slot)));
  IdsAnswer answer{mesh.revision(), {}};
  boundary.ListMembers(answer.ids);
  return answer;
}

}  // namespace

absl::StatusOr<NeighborsAnswer> QueryNeighbors(const Session& session, const Neighborhood& neighborhood,
                                               const Selection& selection, const QueryTerms& terms) {
  DYNMESH_RETURN_IF_ERROR(CheckRings(neighborhood));
  return session.ReadAs<NeighborsAnswer>([&](const SessionView& view) {
    QueryBudget budget(session.limits(), terms);
    return GatherNeighbors({view.mesh, session.spatial(), budget}, neighborhood, selection, budget);
  });
}

absl::StatusOr<EntitiesAnswer> QueryEntities(const Session& session, EntityKind kind,
                                             const Selection& selection, const QueryTerms& terms) {
  return session.ReadAs<EntitiesAnswer>([&](const SessionView& view) {
    QueryBudget budget(session.limits(), terms);
    return GatherEntities({view.mesh, session.spatial(), budget}, kind, selection, budget);
  });
}

absl::StatusOr<IdsAnswer> QueryBoundary(const Session& session, EntityKind kind, const QueryTerms& terms) {
  DYNMESH_RETURN_IF_ERROR(CheckHasBoundary(kind));
  return session.ReadAs<IdsAnswer>([&](const SessionView& view) {
    return GatherBoundary(view.mesh, kind, QueryBudget(session.limits(), terms));
  });
}

}  // namespace dynmesh
