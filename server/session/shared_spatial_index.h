#ifndef DYNMESH_SERVER_SESSION_SHARED_SPATIAL_INDEX_H_
#define DYNMESH_SERVER_SESSION_SHARED_SPATIAL_INDEX_H_

#include <array>
#include <atomic>
#include <cstdint>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/mesh/mesh.h"
#include "core/mesh/work_meter.h"
#include "core/spatial/spatial_index.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// A session's spatial indices, one for each kind of entity, made when somebody first asks for it and caught
/// up when somebody asks after edits.
///
/// The first reader at a revision catches up, others wait for it, then all read side by side: as no edit
/// happens while anybody reads the session, nobody who reads an index keeps others from it.
/// Thread safety: full, where the mesh does not change during the calls that take it.
class SharedSpatialIndex {
 public:
  /// `max_bytes`: of the mesh and its indices together.
  explicit SharedSpatialIndex(uint64_t max_bytes) : max_bytes_(max_bytes) {}

  /// Calls fn(index) with the index of `kind`, which has caught up with `mesh`, and returns what it returns.
  /// Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_session_bytes); the meter's.
  /// REQUIRES: `mesh` is the session's, and the session's reader lock is held.
  absl::Status Read(const Mesh& mesh, EntityKind kind, WorkMeter& meter,
                    absl::FunctionRef<absl::Status(const SpatialIndex&)> fn);

  /// Whether the index of `kind` has caught up with `revision`, so that Read() has little to do. Never waits.
  bool IsCurrent(EntityKind kind, int64_t revision) const {
    return kinds_[Dimension(kind)].revision.load() == revision;
  }
  /// Of all indices. Never waits.
  uint64_t memory_bytes() const;

  /// Forgets all indices; they are made again when asked for. REQUIRES: nobody reads the session.
  void Clear();

 private:
  struct OfKind {
    explicit OfKind(EntityKind kind) : index(kind) {}

    SharedMutex mu;
    SpatialIndex index ABSL_GUARDED_BY(mu);
    std::atomic<int64_t> revision{-1};  ///< the index's
    std::atomic<uint64_t> bytes{0};
  };

  absl::Status CatchUp(const Mesh& mesh, WorkMeter& meter, OfKind& own);
  absl::Status CheckRoom(const Mesh& mesh, const OfKind& own) const ABSL_SHARED_LOCKS_REQUIRED(own.mu);

  const uint64_t max_bytes_;
  std::array<OfKind, kNumEntityKinds> kinds_ = {OfKind(EntityKind::kVertex), OfKind(EntityKind::kEdge),
                                                OfKind(EntityKind::kFace), OfKind(EntityKind::kCell)};
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_SHARED_SPATIAL_INDEX_H_
