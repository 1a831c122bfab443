#ifndef DYNMESH_SERVER_STORE_PAGE_TABLE_H_
#define DYNMESH_SERVER_STORE_PAGE_TABLE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/optional.h"
#include "server/store/engine.h"
#include "server/store/layout.h"
#include "server/store/store.h"

namespace dynmesh {

/// Which checkpoint wrote each page of a session's last one.
///
/// A page lies under its own key and the number of the checkpoint that wrote it, so a new checkpoint never
/// overwrites what the last one needs. The manifest vouches for the set by a count and a hash.
/// Thread safety: as std::vector.
class PageTable {
 public:
  /// Reads all pages, hands them to fn, and the manifest to `checkpoint`, which stays empty without one.
  /// Errors: DATA_LOSS STORE_DAMAGED: a page is damaged, missing, or there twice; those of fn.
  static absl::StatusOr<PageTable> Read(const Engine& engine, layout::SessionId id,
                                        absl::optional<Checkpoint>& checkpoint, SessionStore::PageFn fn);

  /// The checkpoint that wrote a page; 0 when it is not there.
  uint64_t Find(PageKey page) const;
  void Put(const layout::PageVersion& version);
  void Remove(PageKey page);

  uint64_t size() const { return versions_.size(); }
  uint64_t hash() const { return hash_; }
  /// A number that no page has.
  uint64_t TakeNextCheckpoint() { return ++last_checkpoint_; }

  /// Pages of checkpoints that were never committed, to be deleted.
  const std::vector<layout::PageVersion>& leftovers() const { return leftovers_; }
  void ClearLeftovers() { leftovers_.clear(); }

 private:
  absl::Status Add(const layout::PageVersion& version);

  absl::flat_hash_map<PageKey, uint64_t> versions_;
  std::vector<layout::PageVersion> leftovers_;
  uint64_t hash_ = 0;
  uint64_t last_checkpoint_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_PAGE_TABLE_H_
