#ifndef DYNMESH_SERVER_STORE_CHECKPOINT_TABLE_H_
#define DYNMESH_SERVER_STORE_CHECKPOINT_TABLE_H_

#include <cstdint>
#include <map>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/optional.h"
#include "server/store/engine.h"
#include "server/store/layout.h"
#include "server/store/store.h"

namespace dynmesh {

/// The checkpoints that a session keeps, and which pages each is made of.
///
/// A page lies under its own key and the number of the checkpoint that wrote it, so a new checkpoint never
/// overwrites what another one needs, and what several need is there once.
/// Thread safety: as std::vector.
class CheckpointTable {
 public:
  struct Kept {
    int64_t revision = 0;
    std::vector<layout::PageVersion> pages;  ///< ascending by page
  };

  /// Reads all manifests, and the pages of checkpoint `number` (0: of the last one), which it hands to fn;
  /// `found` is that checkpoint, or stays empty.
  /// Errors: DATA_LOSS STORE_DAMAGED: a page is damaged or missing; those of fn.
  static absl::StatusOr<CheckpointTable> Read(const Engine& engine, layout::SessionId id, uint64_t number,
                                              absl::optional<Checkpoint>& found, SessionStore::PageFn fn);

  /// Without those of a session that has no checkpoint.
  const std::vector<layout::PageVersion>& last_pages() const;
  /// 0: there is none.
  uint64_t last_number() const { return kept_.empty() ? 0 : kept_.rbegin()->first; }
  bool Contains(uint64_t number) const { return kept_.contains(number); }
  /// A number that no page has.
  uint64_t TakeNextNumber() { return ++last_number_; }

  void Add(uint64_t number, Kept checkpoint);
  /// Returns the pages that no other one has. REQUIRES: it is there.
  std::vector<layout::PageVersion> Remove(uint64_t number);

  /// Pages of checkpoints that were never committed, to be deleted.
  const std::vector<layout::PageVersion>& leftovers() const { return leftovers_; }
  void ClearLeftovers() { leftovers_.clear(); }

 private:
  class Reader;

  std::map<uint64_t, Kept> kept_;  ///< by number
  absl::flat_hash_map<layout::PageVersion, uint32_t> num_uses_;
  std::vector<layout::PageVersion> leftovers_;
  uint64_t last_number_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_CHECKPOINT_TABLE_H_
