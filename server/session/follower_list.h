#ifndef DYNMESH_SERVER_SESSION_FOLLOWER_LIST_H_
#define DYNMESH_SERVER_SESSION_FOLLOWER_LIST_H_

#include <cstdint>
#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_set.h"
#include "absl/status/status.h"
#include "server/session/mutex.h"

namespace dynmesh {

class Follower;

/// Who follows a session. Keeps the followers alive until they are removed or the list is closed.
///
/// Thread safety: full.
class FollowerList {
 public:
  explicit FollowerList(uint32_t max_followers) : max_followers_(max_followers) {}

  /// Errors: RESOURCE_EXHAUSTED LIMIT_EXCEEDED (max_followers); after Close() its status.
  absl::Status Add(std::shared_ptr<Follower> follower);
  void Remove(const std::shared_ptr<Follower>& follower);

  /// Tells all that there is a new revision. Never blocks: followers only post.
  void Wake();

  /// Ends all with `status`, and refuses later ones with it.
  void Close(const absl::Status& status);

  uint32_t size() const;

 private:
  const uint32_t max_followers_;
  mutable Mutex mu_;
  absl::flat_hash_set<std::shared_ptr<Follower>> followers_ ABSL_GUARDED_BY(mu_);
  absl::Status closed_ ABSL_GUARDED_BY(mu_);
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_FOLLOWER_LIST_H_
