#ifndef DYNMESH_SERVER_RPC_SESSION_WORK_H_
#define DYNMESH_SERVER_RPC_SESSION_WORK_H_

#include <cstddef>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "server/rpc/service_context.h"
#include "server/session/access_queue.h"

namespace dynmesh {

/// How a call wants to use a session.
struct SessionWork {
  AccessMode mode = AccessMode::kRead;
  bool heavy = false;        ///< it may take longer than some hundred milliseconds
  size_t request_bytes = 0;  ///< what the request holds while it waits
};

/// From so many rows on a query is heavy.
inline constexpr uint64_t kManyRows = 20'000;

/// Runs task(grant) when it is its turn at `session`. Light work waits without a thread. Heavy work waits
/// with one of the heavy threads, so that it does not keep others from the session while it waits for a
/// thread. Errors: those of Executor::Admit; the task is destroyed then.
template <typename Task>
absl::Status PostWork(const ServiceContext& services, const SessionPtr& session, const SessionWork& work,
                      Task task) {
  if (!work.heavy) {
    return session->access().TryPost(work.mode, services.quick(), work.request_bytes, std::move(task));
  }
  return services.heavy().TryPost(
      [session, mode = work.mode, task = std::move(task)]() mutable {
        task(session->access().Acquire(mode));
      },
      work.request_bytes);
}

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_SESSION_WORK_H_
