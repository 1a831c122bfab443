#ifndef DYNMESH_SERVER_STORE_LOCAL_CHECKPOINT_H_
#define DYNMESH_SERVER_STORE_LOCAL_CHECKPOINT_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/types/span.h"
#include "server/store/checkpoint_table.h"
#include "server/store/engine.h"
#include "server/store/layout.h"
#include "server/store/local_session.h"
#include "server/store/store.h"

namespace dynmesh {

/// Deletes records up to and including `revision`, but for those of `kept`.
void AddTrim(layout::SessionId id, int64_t revision, absl::Span<const RecordRange> kept, EngineBatch& batch);

/// Deletes a checkpoint, from `table` too, and the pages that only it has.
void AddDrop(layout::SessionId id, uint64_t number, CheckpointTable& table, EngineBatch& batch);

/// A checkpoint of a LocalSession: writes pages under its own number, beside those of the last one. The batch
/// that commits it puts the manifest and deletes that of the last one, if that is not kept, with the pages
/// that only it had.
class LocalCheckpoint final : public CheckpointWriter {
 public:
  LocalCheckpoint(LocalSession* session, int64_t revision)
      : session_(session), revision_(revision), number_(session->table_->TakeNextNumber()) {}
  LocalCheckpoint(const LocalCheckpoint&) = delete;
  LocalCheckpoint& operator=(const LocalCheckpoint&) = delete;
  ~LocalCheckpoint() override;

  uint64_t number() const override { return number_; }
  absl::Status WritePage(PageKey page, std::string bytes) override;
  absl::Status DropPage(PageKey page) override;
  using CheckpointWriter::Commit;
  absl::Status Commit(std::string manifest, FormerCheckpoint former) override;

 private:
  enum class Change { kWritten, kDropped };

  std::string KeyOf(const layout::PageVersion& version) const;
  absl::Status Enqueue(EngineBatch batch);
  std::vector<layout::PageVersion> Pages() const;
  void AddManifest(const std::vector<layout::PageVersion>& pages, std::string manifest,
                   EngineBatch& batch) const;
  void NoteCommitted(CheckpointTable table);

  LocalSession* const session_;
  const int64_t revision_;
  const uint64_t number_;
  absl::flat_hash_map<PageKey, Change> changes_;
  bool ended_ = false;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_LOCAL_CHECKPOINT_H_
