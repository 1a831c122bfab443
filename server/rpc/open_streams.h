#ifndef DYNMESH_SERVER_RPC_OPEN_STREAMS_H_
#define DYNMESH_SERVER_RPC_OPEN_STREAMS_H_

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_set.h"
#include "server/session/mutex.h"

namespace dynmesh {

/// A stream that has no end of its own and must be told when the server shuts down.
class Drainable {
 public:
  virtual ~Drainable() = default;
  /// Must neither block nor touch OpenStreams.
  virtual void OnDrain() = 0;
};

/// The streams that wait for their peers. Thread safety: full.
class OpenStreams {
 public:
  /// False when the server is shutting down already; the stream is not added then.
  bool Add(Drainable* stream) {
    MutexLock lock(&mu_);
    if (draining_) return false;
    streams_.insert(stream);
    return true;
  }

  /// Afterwards OnDrain() is not called any more. A stream that was not added is ignored.
  void Remove(Drainable* stream) {
    MutexLock lock(&mu_);
    streams_.erase(stream);
  }

  void Drain() {
    MutexLock lock(&mu_);
    draining_ = true;
    for (Drainable* stream : streams_) stream->OnDrain();
  }

 private:
  Mutex mu_;
  absl::flat_hash_set<Drainable*> streams_ ABSL_GUARDED_BY(mu_);
  bool draining_ ABSL_GUARDED_BY(mu_) = false;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_OPEN_STREAMS_H_
