#ifndef DYNMESH_SERVER_SESSION_HISTORY_H_
#define DYNMESH_SERVER_SESSION_HISTORY_H_

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/batch_image.h"
#include "server/session/limits.h"

namespace dynmesh {

enum class HistoryMove { kUndo, kRedo };

/// The last batches of a session as images: a stack of those that can be undone, and one of those that were
/// undone and can be redone.
///
///     batch: pushed to undo, redo is forgotten      undo: moves from undo to redo      redo: moves back
///
/// All images together are no more than the limits say (max_undo_batches, max_undo_bytes): the oldest batch
/// is forgotten first, then what lies farthest in the way of redoing. They are of use at one revision only,
/// so a revision that nobody told this of ends it all. Thread safety: that of std::vector.
class History {
 public:
  explicit History(const Limits& limits)
      : max_batches_(limits.max_undo_batches), max_bytes_(limits.max_undo_bytes) {}

  /// Whether it keeps anything at all.
  bool keeps_batches() const { return max_batches_ > 0; }
  uint64_t max_bytes() const { return max_bytes_; }
  /// How many batches can be undone, or redone.
  uint32_t size(HistoryMove move) const { return static_cast<uint32_t>(stack(move).size()); }
  /// Of the batch that is moved next: BatchImage::num_items(). 0 without one.
  uint64_t num_next_items(HistoryMove move) const {
    return stack(move).empty() ? 0 : stack(move).back().num_items();
  }
  uint64_t memory_bytes() const { return bytes_; }

  /// A batch has made `revision`; `image` undoes it.
  void Add(BatchImage image, int64_t revision);

  /// A batch has made `revision` and nothing that can be undone: it does not count.
  void Pass(int64_t revision) { revision_ = revision; }

  /// The images to restore, one after the other, for `count` moves. Valid until this changes.
  /// Errors: FAILED_PRECONDITION NOTHING_TO_UNDO or NOTHING_TO_REDO, metadata requested and available.
  absl::StatusOr<std::vector<const BatchImage*>> Last(HistoryMove move, uint32_t count) const;

  /// The last `count` have been moved, which made `revision`. `images` take the moves back, as
  /// RestoredBatches::images. REQUIRES: Last(move, count) is OK.
  void Moved(HistoryMove move, uint32_t count, std::deque<BatchImage> images, int64_t revision);

  /// The session is at `revision` now: forgets all unless that is where this is of use.
  void Follow(int64_t revision);

  /// Forgets what is more than `max_bytes`.
  void ShrinkTo(uint64_t max_bytes);

 private:
  using Stack = std::deque<BatchImage>;  ///< the last one is the next to be restored

  Stack& stack(HistoryMove move) { return stacks_[static_cast<int>(move)]; }
  const Stack& stack(HistoryMove move) const { return stacks_[static_cast<int>(move)]; }
  void Push(BatchImage image, Stack& stack);
  void PopOldest(Stack& stack);
  void Clear(Stack& stack);

  const uint32_t max_batches_;
  const uint64_t max_bytes_;
  std::array<Stack, 2> stacks_;
  uint64_t bytes_ = 0;
  int64_t revision_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_HISTORY_H_
