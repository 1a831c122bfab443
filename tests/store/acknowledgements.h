#ifndef DYNMESH_TESTS_STORE_ACKNOWLEDGEMENTS_H_
#define DYNMESH_TESTS_STORE_ACKNOWLEDGEMENTS_H_

#include <cstdint>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "server/session/mutex.h"
#include "server/store/store.h"
#include "tests/support/await.h"

namespace dynmesh::testing {

/// What a store acknowledged, in its order.
class Acknowledgements {
 public:
  using List = std::vector<std::pair<int, absl::Status>>;

  /// The callback of the write that the test calls `id`.
  SessionStore::Done Of(int id) {
    return [this, id](const absl::Status& status) {
      MutexLock lock(&mu_);
      list_.emplace_back(id, status);
      changed_.NotifyAll();
    };
  }

  /// All so far, when there are `count` or patience has ended.
  List Await(size_t count) {
    MutexLock lock(&mu_);
    AwaitThat(&mu_, changed_, [&] { return list_.size() >= count; });
    return list_;
  }

  /// The ids of Await(), of those that succeeded.
  std::vector<int> AwaitSuccesses(size_t count) {
    std::vector<int> ids;
    for (const auto& [id, status] : Await(count)) {
      if (status.ok()) ids.push_back(id);
    }
    return ids;
  }

 private:
  Mutex mu_;
  CondVar changed_;
  List list_;
};

/// Appends and waits for the acknowledgement.
inline absl::Status AppendNow(SessionStore& session, int64_t revision, std::string bytes,
                              Durability durability = Durability::kSync) {
  std::promise<absl::Status> promise;
  std::future<absl::Status> result = promise.get_future();
  session.Append(
      {revision, std::move(bytes)}, durability,
      [promise = std::move(promise)](const absl::Status& status) mutable { promise.set_value(status); });
  return result.get();
}

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_STORE_ACKNOWLEDGEMENTS_H_
