#ifndef DYNMESH_SERVER_STORE_LOCAL_CHECKPOINT_H_
#define DYNMESH_SERVER_STORE_LOCAL_CHECKPOINT_H_

#include <cstdint>
#include <string>

#include "absl/container/flat_hash_map.h"
#include "server/store/engine.h"
#include "server/store/layout.h"
#include "server/store/local_session.h"
#include "server/store/page_table.h"
#include "server/store/store.h"

namespace dynmesh {

/// Deletes records up to and including `revision`.
void AddTrim(layout::SessionId id, int64_t revision, EngineBatch& batch);

/// A checkpoint of a LocalSession: writes pages under its own number, beside those of the last one. The batch
/// that commits it puts the manifest and deletes the pages that it replaces.
class LocalCheckpoint final : public CheckpointWriter {
 public:
  LocalCheckpoint(LocalSession* session, int64_t revision)
      : session_(session), revision_(revision), number_(session->pages_->TakeNextCheckpoint()) {}
  LocalCheckpoint(const LocalCheckpoint&) = delete;
  LocalCheckpoint& operator=(const LocalCheckpoint&) = delete;
  ~LocalCheckpoint() override;

  absl::Status WritePage(PageKey page, std::string bytes) override;
  absl::Status DropPage(PageKey page) override;
  absl::Status Commit(std::string manifest) override;

 private:
  enum class Change { kWritten, kDropped };

  std::string KeyOf(const layout::PageVersion& version) const;
  absl::Status Enqueue(EngineBatch batch);
  void AddPages(PageTable& pages, EngineBatch& batch) const;
  void AddManifest(const PageTable& pages, std::string manifest, EngineBatch& batch) const;
  void NoteCommitted(PageTable pages);

  LocalSession* const session_;
  const int64_t revision_;
  const uint64_t number_;
  absl::flat_hash_map<PageKey, Change> changes_;
  bool ended_ = false;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_LOCAL_CHECKPOINT_H_
