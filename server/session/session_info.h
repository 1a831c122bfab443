#ifndef DYNMESH_SERVER_SESSION_SESSION_INFO_H_
#define DYNMESH_SERVER_SESSION_SESSION_INFO_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "absl/types/optional.h"
#include "absl/types/span.h"
#include "core/check/check.h"
#include "core/mesh/box.h"
#include "core/mesh/estimate.h"
#include "core/mesh/mesh.h"
#include "server/session/durability/retention.h"
#include "server/session/mutex.h"
#include "server/session/stop_signal.h"

namespace dynmesh {

/// A number for each EntityKind.
using KindCounts = std::array<uint64_t, kNumEntityKinds>;

/// When the edits of a session are acknowledged. Stored: never renumber.
enum class SessionDurability : uint8_t {
  kDefault = 0,  ///< kSync where the daemon has a store, else kNone
  kNone = 1,     ///< at once; the session ends with the process
  kAsync = 2,    ///< once written: a loss of power takes the last moments (CommitterOptions::async_delay)
  kSync = 3,     ///< once on disk
};

/// Whether a session's content is in memory.
enum class SessionState : uint8_t {
  kLoaded,
  kStored,   ///< not yet, or no more: it is read from the store when somebody uses the session
  kDamaged,  ///< it cannot be read; the session can only be deleted
};

struct SessionSettings {
  DuplicatePolicy duplicates = DuplicatePolicy::kKeep;         ///< fixed when the session is created
  std::vector<Relation> stored_relations = {};                 ///< each of kStorableRelations, once
  CheckSettings checks = {};                                   ///< local ones, made on each batch
  SessionDurability durability = SessionDurability::kDefault;  ///< fixed when the session is created
  Retention retention = {};                                    ///< of earlier revisions
};

/// Settings of a session that are to be changed; those that are absent stay.
struct SettingsUpdate {
  absl::optional<std::vector<Relation>> stored_relations = absl::nullopt;
  absl::optional<CheckSettings> checks = absl::nullopt;
  absl::optional<Retention> retention = absl::nullopt;
};

/// A relation that a session keeps stored, and the bytes of its table.
struct StoredRelation {
  Relation relation;
  uint64_t memory_bytes = 0;
};

/// Those of `mesh`, in the order of kStorableRelations.
std::vector<Relation> StoredRelationsOf(const Mesh& mesh);

/// Makes `mesh` store just those of `wanted`; on failure it stores what it did before.
/// Errors: INVALID_ARGUMENT unless all are storable; RESOURCE_EXHAUSTED, also LIMIT_EXCEEDED
/// (max_session_bytes) when the mesh would take more than `max_bytes`; what `stop` says. Cost: all rows of
/// each new relation.
absl::Status StoreJust(Mesh& mesh, absl::Span<const Relation> wanted, uint64_t max_bytes,
                       const StopSignal& stop = StopSignal::Never());

/// What a session is and holds at one revision.
struct SessionInfo {
  std::string name;
  std::string uid;
  SessionState state = SessionState::kLoaded;
  std::string state_message = {};  ///< why it is kDamaged
  int64_t revision = 0;
  int64_t durable_revision = 0;  ///< the last one that is on disk; without durability, `revision`
  std::string etag;
  SessionSettings settings;
  absl::Time create_time;
  absl::Time update_time;
  KindCounts counts = {};
  KindCounts estimated_counts = {};  ///< from counts[vertices] and the elements (paper, Table 1)
  KindCounts boundary_counts = {};
  KindCounts element_counts = {};
  int64_t euler_characteristic = 0;
  Checksum checksum;
  uint64_t memory_bytes = 0;   ///< of the mesh
  uint64_t index_bytes = 0;    ///< of its spatial indices
  uint64_t history_bytes = 0;  ///< of what undoes and redoes batches
  uint32_t undoable_batches = 0;
  uint32_t redoable_batches = 0;
  uint32_t followers = 0;
  std::vector<AttributeSpec> attributes;
  std::vector<StoredRelation> stored_relations;  ///< those of settings, in that order
  absl::optional<Box> bounds;
};

/// The parts of SessionInfo that take a scan of the mesh.
struct MeshSummary {
  absl::optional<Box> bounds;
  KindCounts estimated_counts = {};
};

/// The summary of a session's mesh, scanned at most once for each revision.
///
/// Thread safety: full.
class SummaryCache {
 public:
  /// REQUIRES: `mesh` does not change during the call. Cost: slots, when its revision is new.
  MeshSummary Of(const Mesh& mesh);

 private:
  Mutex mu_;
  int64_t revision_ ABSL_GUARDED_BY(mu_) = -1;
  MeshSummary summary_ ABSL_GUARDED_BY(mu_);
};

/// The parts that `mesh` knows: counts, checksum, attributes, stored relations, memory and `summary`.
SessionInfo DescribeMesh(const Mesh& mesh, const MeshSummary& summary);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_SESSION_INFO_H_
