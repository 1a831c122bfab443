#include "server/session/export.h"

#include <algorithm>
#include <utility>

#include "absl/functional/function_ref.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

/// Walks a mesh and cuts what it finds into chunks.
class Exporter {
 public:
  Exporter(const Mesh& mesh, const QueryBudget& budget) : mesh_(mesh), budget_(budget) {}

  absl::StatusOr<std::vector<ExportChunk>> Run() && {
    DYNMESH_RETURN_IF_ERROR(Vertices());
    for (ElementType type : kElementTypes) DYNMESH_RETURN_IF_ERROR(Elements(type));
    for (const AttributeColumn& column : mesh_.attributes()) DYNMESH_RETURN_IF_ERROR(Rows(column));
    if (chunks_.empty()) chunks_.emplace_back(ExportedVertices());
    return std::move(chunks_);
  }

 private:
  /// Room for `bytes` more in the last chunk, which is a `Chunk`; `fresh` starts the next one.
  template <typename Chunk>
  absl::StatusOr<Chunk*> Room(size_t bytes, const Chunk& fresh) {
    DYNMESH_RETURN_IF_ERROR(budget_.ChargeBytes(bytes));
    if (chunk_bytes_ == 0 || chunk_bytes_ + bytes > kChunkBytes) {
      chunks_.emplace_back(fresh);
      chunk_bytes_ = 0;
    }
    chunk_bytes_ += bytes;
    return &std::get<Chunk>(chunks_.back());
  }

  /// Calls fn for each live slot of a kind.
  absl::Status ForEachLive(EntityKind kind, absl::FunctionRef<absl::Status(Slot)> fn) {
    const BitSet& live = mesh_.slots(kind).live();
    for (Slot slot = live.Next(0); slot != kNoSlot; slot = live.Next(slot + 1)) {
      DYNMESH_RETURN_IF_ERROR(budget_.ChargeSteps(1));
      DYNMESH_RETURN_IF_ERROR(fn(slot));
    }
    return absl::OkStatus();
  }

  absl::Status Vertices() {
    chunk_bytes_ = 0;
    return ForEachLive(EntityKind::kVertex, [this](Slot slot) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(ExportedVertices * chunk,
                               Room(sizeof(Slot) + sizeof(Point), ExportedVertices()));
      chunk->ids.push_back(slot);
      chunk->positions.push_back(mesh_.Position(VertexId(slot)));
      return absl::OkStatus();
    });
  }

  absl::Status Elements(ElementType type) {
    if (mesh_.NumElements(KindOf(type)) == 0) return absl::OkStatus();
    chunk_bytes_ = 0;
    const size_t bytes = (1 + NumVertices(type)) * sizeof(Slot);
    return ForEachLive(KindOf(type), [&](Slot slot) -> absl::Status {
      const EntityId id(KindOf(type), slot);
      if (mesh_.Type(id) != type || !mesh_.IsElement(id)) return absl::OkStatus();
      DYNMESH_ASSIGN_OR_RETURN(ExportedElements * chunk, Room(bytes, ExportedElements{type, {}, {}}));
      const auto vertices = mesh_.VerticesOf(id);
      chunk->ids.push_back(slot);
      chunk->vertices.insert(chunk->vertices.end(), vertices.begin(), vertices.end());
      return absl::OkStatus();
    });
  }

  absl::Status Rows(const AttributeColumn& column) {
    chunk_bytes_ = 0;
    const AttributeSpec& spec = column.spec();
    const ExportedRows fresh{spec, {}, {}};
    chunks_.emplace_back(fresh);
    chunk_bytes_ = 1;
    return ForEachLive(spec.kind, [&](Slot slot) -> absl::Status {
      if (!Travels(column, slot)) return absl::OkStatus();
      DYNMESH_ASSIGN_OR_RETURN(ExportedRows * chunk, Room(sizeof(Slot) + spec.row_bytes(), fresh));
      const auto row = column.Row(slot);
      chunk->ids.push_back(slot);
      chunk->rows.insert(chunk->rows.end(), row.begin(), row.end());
      return absl::OkStatus();
    });
  }

  /// All rows but the defaults of derived entities that nobody set.
  bool Travels(const AttributeColumn& column, Slot slot) const {
    const EntityKind kind = column.spec().kind;
    return kind == EntityKind::kVertex || mesh_.IsElement({kind, slot}) || column.stamps().At(slot) != 0;
  }

  const Mesh& mesh_;
  QueryBudget budget_;
  size_t chunk_bytes_ = 0;  ///< of the last chunk; 0: the next row starts a new one
  std::vector<ExportChunk> chunks_;
};

}  // namespace

absl::StatusOr<ExportAnswer> ExportSession(const Session& session, const QueryTerms& terms) {
  ExportAnswer answer;
  const auto chunks = [&](const SessionView& view) {
    answer.revision = view.mesh.revision();
    return Exporter(view.mesh, QueryBudget(session.limits(), terms)).Run();
  };
  DYNMESH_ASSIGN_OR_RETURN(answer.chunks, session.ReadAs<std::vector<ExportChunk>>(chunks));
  return answer;
}

}  // namespace dynmesh
