#ifndef DYNMESH_SERVER_RPC_QUERY_WEIGHT_H_
#define DYNMESH_SERVER_RPC_QUERY_WEIGHT_H_

#include <cstdint>

#include "server/rpc/session_work.h"

/// Which queries and moves in history are heavy (SessionWork), judged before they run: queries by what a mesh
/// of so many entities may make of them at worst, piled up in one place, or all adjacent to one another.
namespace dynmesh {

/// Entities that a light query may come by at worst: up to a microsecond each.
inline constexpr uint64_t kManyVisits = 1'000'000;
/// Points or rays.
inline constexpr uint64_t kManyPlaces = 1'000;

/// Whether `factor` things may come by more than kManyVisits of `num_live` entities.
constexpr bool MayVisitMany(uint64_t factor, uint64_t num_live) {
  return num_live > 0 && factor > kManyVisits / num_live;
}

/// Of asking about `num_places` points or rays. An index that is missing or has fallen behind is made on the
/// way, which takes little where entities are no more than kManyRows.
constexpr bool IsHeavyPlaceQuery(uint64_t num_places, uint64_t num_live) {
  return num_live > kManyRows || num_places > kManyPlaces || MayVisitMany(num_places, num_live);
}

/// Of asking for the rings of `num_selected` entities: already the second may be the whole mesh.
constexpr bool IsHeavyRingQuery(uint64_t num_selected, uint32_t rings, uint64_t num_live) {
  return rings > 1 && MayVisitMany(num_selected, num_live);
}

/// Entities and rows that a light call may put back: a third of a microsecond each, more where they are
/// scattered.
inline constexpr uint64_t kManyRestored = 100'000;

/// Of undoing or redoing `count` batches, the first of which names `num_items`.
constexpr bool IsHeavyMove(uint32_t count, uint64_t num_items) {
  return count > 1 || num_items > kManyRestored;
}

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_QUERY_WEIGHT_H_
