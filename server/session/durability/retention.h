#ifndef DYNMESH_SERVER_SESSION_DURABILITY_RETENTION_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_RETENTION_H_

#include <algorithm>
#include <cstdint>

#include "absl/time/time.h"

namespace dynmesh {

/// How many of a session's last revisions can be had again. Those that any of the limits lets go are deleted
/// when checkpoints are made, not at once. A field of 0 sets no limit.
struct Retention {
  uint32_t max_revisions = 0;
  absl::Duration max_age = absl::ZeroDuration();
  uint64_t max_bytes = 0;  ///< of their records

  /// What both allow.
  Retention Within(const Retention& other) const {
    const auto smaller = [](auto a, decltype(a) b) {
      if (a == decltype(a)()) return b;
      return b == decltype(a)() ? a : std::min(a, b);
    };
    return {smaller(max_revisions, other.max_revisions), smaller(max_age, other.max_age),
            smaller(max_bytes, other.max_bytes)};
  }

  friend bool operator==(const Retention&, const Retention&) = default;
};

/// What a daemon keeps unless it is told otherwise.
inline constexpr uint32_t kDefaultRetainedRevisions = 4096;
inline constexpr uint64_t kDefaultRetainedBytes = uint64_t{256} << 20;

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_RETENTION_H_
