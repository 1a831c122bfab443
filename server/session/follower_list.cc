#include "server/session/follower_list.h"

#include <utility>

#include "core/mesh/error.h"
#include "server/session/follower.h"

namespace dynmesh {

absl::Status FollowerList::Add(std::shared_ptr<Follower> follower) {
  MutexLock lock(&mu_);
  DYNMESH_RETURN_IF_ERROR(closed_);
  if (followers_.size() >= max_followers_) {
    return LimitExceeded("max_followers", max_followers_, followers_.size() + 1);
  }
  followers_.insert(std::move(follower));
  return absl::OkStatus();
}

void FollowerList::Remove(const std::shared_ptr<Follower>& follower) {
  MutexLock lock(&mu_);
  followers_.erase(follower);
}

void FollowerList::Wake() {
  MutexLock lock(&mu_);
  for (const std::shared_ptr<Follower>& follower : followers_) follower->Wake();
}

void FollowerList::Close(const absl::Status& status) {
  absl::flat_hash_set<std::shared_ptr<Follower>> followers;
  {
    MutexLock lock(&mu_);
    if (!closed_.ok()) return;
    closed_ = status;
    followers.swap(followers_);
  }
  // Without the lock, because an ending follower removes itself.
  for (const std::shared_ptr<Follower>& follower : followers) follower->End(status);
}

uint32_t FollowerList::size() const {
  MutexLock lock(&mu_);
  return followers_.size();
}

}  // namespace dynmesh
