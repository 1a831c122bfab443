#ifndef DYNMESH_SERVER_SESSION_SPATIAL_QUERIES_H_
#define DYNMESH_SERVER_SESSION_SPATIAL_QUERIES_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/box.h"
#include "core/spatial/spatial_search.h"
#include "server/session/queries.h"
#include "server/session/query_budget.h"
#include "server/session/session.h"

/// Asking a session about places (core/spatial/spatial_search.h says what the answers are). As in queries.h
/// each answer speaks of one revision, comes in chunks, and has a first chunk always.
/// Errors of all: those of SharedSpatialIndex::Read, QueryBudget and Session::Read.
/// REQUIRES: what is asked about is finite.
namespace dynmesh {

/// Rows of entities with a number each: row i has offsets[i + 1] - offsets[i] of them. A row longer than half
/// a chunk is cut: it begins in chunks without rows, and the offsets of the chunk that ends it count from
/// there.
struct ScoredChunk {
  std::vector<uint32_t> offsets = {0};
  std::vector<Slot> ids;
  std::vector<double> scores;
};
struct ScoredAnswer {
  int64_t revision = 0;
  std::vector<ScoredChunk> chunks;
};

/// Entities of a kind in a box, ascending.
absl::StatusOr<IdsAnswer> QueryInBox(const Session& session, EntityKind kind, const Box& box,
                                     const QueryTerms& terms = {});

struct NearestQuestion {
  std::vector<Point> points;
  uint32_t count = 1;
};
inline constexpr uint32_t kMaxNearest = 10'000;

/// A row for each point; scores are distances. Errors: INVALID_ARGUMENT BAD_ARGUMENT (count) unless count is
/// 1 to kMaxNearest.
absl::StatusOr<ScoredAnswer> QueryNearestVertices(const Session& session, const NearestQuestion& question,
                                                  const QueryTerms& terms = {});

struct LocateQuestion {
  EntityKind kind = EntityKind::kCell;
  std::vector<Point> points;
  double tolerance = 0;  ///< for faces
};

/// An id for each point: kNoSlot where nothing is. Errors: INVALID_ARGUMENT BAD_ENTITY_KIND for vertices and
/// edges, BAD_ARGUMENT for a tolerance that is negative, or that is given for cells.
absl::StatusOr<IdsAnswer> QueryLocate(const Session& session, const LocateQuestion& question,
                                      const QueryTerms& terms = {});

struct RaysQuestion {
  std::vector<Ray> rays;  ///< directions are not zero
  RayOptions options;
};

/// A row for each ray; scores are the parameters t.
absl::StatusOr<ScoredAnswer> QueryRays(const Session& session, const RaysQuestion& question,
                                       const QueryTerms& terms = {});

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_SPATIAL_QUERIES_H_
