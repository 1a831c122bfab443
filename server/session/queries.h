#ifndef DYNMESH_SERVER_SESSION_QUERIES_H_
#define DYNMESH_SERVER_SESSION_QUERIES_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/codec/surface_codec.h"
#include "core/mesh/relations.h"
#include "server/session/query_budget.h"
#include "server/session/selection.h"
#include "server/session/session.h"

/// Reading a session. Each answer is gathered under one reader lock, so it speaks of one revision, into
/// chunks of at most kChunkBytes. There is always a first chunk, even without rows.
/// Errors of all: those of QueryBudget, so RESOURCE_EXHAUSTED beyond max_query_bytes of answer or
/// max_query_steps of work, and whatever `terms.stop` says; those of Session::Read.
namespace dynmesh {

/// Rows of neighbours: row i has offsets[i + 1] - offsets[i] of them. A row longer than half a chunk is cut:
/// it begins in chunks without ids, and the offsets of the chunk with its id count from there.
struct NeighborsChunk {
  std::vector<Slot> ids;
  std::vector<uint32_t> offsets = {0};
  std::vector<Slot> neighbors;
};
struct NeighborsAnswer {
  int64_t revision = 0;
  std::vector<NeighborsChunk> chunks;
};

/// A relation, and for entities of the same kind how often it is applied: what lies in at most so many steps
/// (core/mesh/rings.h).
struct Neighborhood {
  Relation relation;
  uint32_t rings = 1;

  Neighborhood(Relation r, uint32_t n = 1) : relation(r), rings(n) {}  // NOLINT: a relation is one
};
inline constexpr uint32_t kMaxRings = 1000;

/// Errors: those of ForEachSelected; INVALID_ARGUMENT BAD_ARGUMENT (rings) for other than one ring between
/// different kinds, none, and more than kMaxRings.
absl::StatusOr<NeighborsAnswer> QueryNeighbors(const Session& session, const Neighborhood& neighborhood,
                                               const Selection& selection, const QueryTerms& terms = {});

enum EntityFlags : uint8_t { kIsElement = 1, kIsOnBoundary = 2, kIsDuplicate = 4 };

struct EntitiesChunk {
  std::vector<Slot> ids;
  std::vector<Point> positions;          ///< vertices only
  std::vector<ElementType> types;        ///< all but vertices
  std::vector<uint32_t> vertex_offsets;  ///< all but vertices
  std::vector<VertexId> vertices;        ///< all but vertices
  std::vector<uint8_t> flags;
  std::vector<int64_t> born_revisions;
};
struct EntitiesAnswer {
  int64_t revision = 0;
  std::vector<EntitiesChunk> chunks;
};

/// Errors: as QueryNeighbors.
absl::StatusOr<EntitiesAnswer> QueryEntities(const Session& session, EntityKind kind,
                                             const Selection& selection, const QueryTerms& terms = {});

/// Of a list of entities.
struct IdsAnswer {
  int64_t revision = 0;
  std::vector<Slot> ids;
};

/// Ascending. Errors: INVALID_ARGUMENT BAD_ENTITY_KIND for cells.
absl::StatusOr<IdsAnswer> QueryBoundary(const Session& session, EntityKind kind,
                                        const QueryTerms& terms = {});

/// The boundary as triangles, not yet encoded: EncodeSurface() needs no session.
struct SurfaceAnswer {
  int64_t revision = 0;
  TriangleSurface surface;
};

/// Faces with exactly one cell and faces that are elements. Quads are cut along the diagonal of their first
/// vertex.
absl::StatusOr<SurfaceAnswer> QuerySurface(const Session& session, const QueryTerms& terms = {});

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_QUERIES_H_
