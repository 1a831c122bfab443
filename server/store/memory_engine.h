#ifndef DYNMESH_SERVER_STORE_MEMORY_ENGINE_H_
#define DYNMESH_SERVER_STORE_MEMORY_ENGINE_H_

#include <functional>
#include <map>
#include <string>

#include "absl/base/thread_annotations.h"
#include "server/session/mutex.h"
#include "server/store/engine.h"

namespace dynmesh {

/// An Engine that forgets: for tests, and for a daemon without a data directory.
///
/// A scan holds writers up.
class MemoryEngine final : public Engine {
 public:
  absl::Status Write(const EngineBatch& batch) override;
  absl::Status Sync() override { return absl::OkStatus(); }
  absl::StatusOr<absl::optional<std::string>> Get(absl::string_view key) const override;
  absl::Status Scan(absl::string_view from, absl::string_view to, Visitor visit) const override;
  absl::StatusOr<absl::optional<std::string>> LastKey(absl::string_view from,
                                                      absl::string_view to) const override;

 private:
  void Apply(const EngineBatch::Change& change) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);

  mutable SharedMutex mu_;
  std::map<std::string, std::string, std::less<>> values_ ABSL_GUARDED_BY(mu_);
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_MEMORY_ENGINE_H_
