#ifndef DYNMESH_SERVER_STORE_LOCAL_STORE_H_
#define DYNMESH_SERVER_STORE_LOCAL_STORE_H_

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/session/mutex.h"
#include "server/store/committer.h"
#include "server/store/engine.h"
#include "server/store/layout.h"
#include "server/store/ownership.h"
#include "server/store/store.h"

namespace dynmesh {

/// A Store in one process, on an engine:
///
///     LocalStore --- Engine (RocksDB in a directory, or memory)
///         |  \------ Committer, the one that writes
///         \--------- Ownership of each session <--- LocalSession <--- LocalCheckpoint
///
/// Its destructor brings to disk what was appended. A damaged entry of the catalogue costs that session only.
class LocalStore final : public Store {
 public:
  /// Reads the catalogue; marks a new store with its format.
  /// Errors: FAILED_PRECONDITION STORE_FORMAT_NEWER; those of the engine.
  static absl::StatusOr<std::unique_ptr<Store>> Open(std::unique_ptr<Engine> engine,
                                                     const CommitterOptions& options = {});

  std::vector<std::string> ListSessions() const override;
  absl::Status CreateSession(absl::string_view name) override;
  absl::StatusOr<std::unique_ptr<SessionStore>> OpenSession(absl::string_view name) override;
  absl::Status DeleteSession(absl::string_view name) override;
  absl::Status status() const override { return committer_.status(); }

 private:
  struct Entry {
    std::shared_ptr<Ownership> ownership;
    absl::Status damage;  ///< if not OK, the ownership's id is none
  };
  using Catalogue = std::map<std::string, Entry, std::less<>>;

  LocalStore(std::unique_ptr<Engine> engine, const CommitterOptions& options)
      : engine_(std::move(engine)), committer_(engine_.get(), options) {}
  absl::Status Load();
  absl::Status LoadFormat();
  absl::Status LoadCatalogue();
  static void AddEntry(absl::string_view key, absl::string_view value, Catalogue& catalogue);
  absl::StatusOr<std::shared_ptr<Ownership>> MarkDeleted(absl::string_view name);
  absl::Status Write(EngineBatch batch);
  void Forget(absl::string_view name);

  const std::unique_ptr<Engine> engine_;
  mutable Mutex mu_;  ///< taken before an Ownership's
  Catalogue catalogue_ ABSL_GUARDED_BY(mu_);
  layout::SessionId last_id_ ABSL_GUARDED_BY(mu_) = 0;
  Committer committer_;  ///< destroyed first
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_LOCAL_STORE_H_
