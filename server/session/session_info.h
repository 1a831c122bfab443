#ifndef DYNMESH_SERVER_SESSION_SESSION_INFO_H_
#define DYNMESH_SERVER_SESSION_SESSION_INFO_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"
#include "absl/types/optional.h"
#include "core/mesh/box.h"
#include "core/mesh/estimate.h"
#include "core/mesh/mesh.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// A number for each EntityKind.
using KindCounts = std::array<uint64_t, kNumEntityKinds>;

/// Settings of a session, fixed when it is created.
struct SessionSettings {
  DuplicatePolicy duplicates = DuplicatePolicy::kKeep;
};

/// What a session is and holds at one revision.
struct SessionInfo {
  std::string name;
  std::string uid;
  int64_t revision = 0;
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
  uint64_t memory_bytes = 0;  ///< of the mesh
  uint64_t index_bytes = 0;   ///< of its spatial indices
  uint32_t followers = 0;
  std::vector<AttributeSpec> attributes;
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

/// The parts that `mesh` knows: counts, checksum, attributes, memory and `summary`.
SessionInfo DescribeMesh(const Mesh& mesh, const MeshSummary& summary);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_SESSION_INFO_H_
