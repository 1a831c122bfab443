#ifndef DYNMESH_SERVER_SESSION_LIMITS_H_
#define DYNMESH_SERVER_SESSION_LIMITS_H_

#include <algorithm>
#include <cstdint>

#include "absl/time/time.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// The smaller of 64 GiB and three quarters of the machine's memory.
uint64_t DefaultMaxSessionBytes();

/// What one daemon gives away. Beyond any of them: RESOURCE_EXHAUSTED LIMIT_EXCEEDED, whose metadata "limit"
/// is the name of the field here, which is also the name of dynmeshd's flag.
struct Limits {
  uint32_t max_sessions = 1000;
  /// Slots of a session of each kind; edges and faces include the derived ones.
  uint32_t max_vertices = 200'000'000;
  uint32_t max_edges = 1'500'000'000;
  uint32_t max_faces = 500'000'000;
  uint32_t max_cells = 200'000'000;
  /// Memory of one session's mesh; looked at before each batch and during an import.
  uint64_t max_session_bytes = DefaultMaxSessionBytes();
  /// Edits in a batch; vertices, elements and rows that these name, and as many elements that operators make.
  uint64_t max_batch_edits = 100'000;
  uint64_t max_batch_items = 1'000'000;
  /// What is kept of a session to undo and redo batches: so many at most, and so many bytes.
  uint32_t max_undo_batches = 100;
  uint64_t max_undo_bytes = uint64_t{64} << 20;
  /// One request message.
  uint64_t max_message_bytes = uint64_t{4} << 20;
  /// One answer of a query or export, which is gathered in memory so that it speaks of one revision.
  uint64_t max_query_bytes = uint64_t{512} << 20;
  /// What one query or export may look at: entities, and entries of incidence lists; about ten nanoseconds
  /// each.
  uint64_t max_query_steps = 1'000'000'000;
  /// All answers of queries and exports that are gathered and wait to be read.
  uint64_t max_answer_bytes = uint64_t{2} << 30;
  /// Subscriptions of one session.
  uint32_t max_followers = 1000;
  /// Imports and restores that are receiving or building.
  uint32_t max_concurrent_imports = 4;
  /// AdaptSession calls that are under way: each remembers what there is to do, up to 20 bytes an edge.
  uint32_t max_concurrent_adaptations = 4;
  /// What imports have received and not built yet, and restores have built and not finished, all together.
  uint64_t max_staged_bytes = DefaultMaxSessionBytes();
  /// Copies of sessions that backups are written of, all together.
  uint64_t max_backup_bytes = DefaultMaxSessionBytes();
  /// How long an import may send nothing, or leave unread what it is told; a restore and a backup, too.
  absl::Duration import_idle_timeout = absl::Seconds(60);
  /// Calls that wait for a thread or for their session, and the bytes of their requests; for each of the two
  /// pools of threads.
  uint32_t max_queued_tasks = 10'000;
  uint64_t max_queued_bytes = uint64_t{256} << 20;

  uint32_t max_slots(EntityKind kind) const {
    const uint32_t slots[] = {max_vertices, max_edges, max_faces, max_cells};
    return slots[Dimension(kind)];
  }
};

/// Names of the limits on slots, by EntityKind.
inline constexpr const char* kSlotLimitNames[] = {"max_vertices", "max_edges", "max_faces", "max_cells"};

/// The part of `limits` that a mesh enforces itself.
inline MeshLimits ToMeshLimits(const Limits& limits) {
  MeshLimits mesh_limits;
  for (EntityKind kind : kEntityKinds) {
    uint32_t& slots = mesh_limits.max_slots[Dimension(kind)];
    slots = std::min(slots, limits.max_slots(kind));
  }
  return mesh_limits;
}

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_LIMITS_H_
