#include "server/session/history.h"

#include <utility>

#include "server/session/session_errors.h"

namespace dynmesh {

void History::Add(BatchImage image, int64_t revision) {
  Clear(stack(HistoryMove::kRedo));
  Push(std::move(image), stack(HistoryMove::kUndo));
  if (stack(HistoryMove::kUndo).size() > max_batches_) PopOldest(stack(HistoryMove::kUndo));
  ShrinkTo(max_bytes_);
  revision_ = revision;
}

absl::StatusOr<std::vector<const BatchImage*>> History::Last(HistoryMove move, uint32_t count) const {
  const Stack& from = stack(move);
  if (count > from.size()) {
    return move == HistoryMove::kUndo ? NothingToUndo(count, from.size()) : NothingToRedo(count, from.size());
  }
  std::vector<const BatchImage*> images;
  for (auto image = from.rbegin(); image != from.rbegin() + count; ++image) images.push_back(&*image);
  return images;
}

void History::Moved(HistoryMove move, uint32_t count, std::deque<BatchImage> images, int64_t revision) {
  Stack& from = stack(move);
  Stack& to = stack(move == HistoryMove::kUndo ? HistoryMove::kRedo : HistoryMove::kUndo);
  for (uint32_t i = 0; i < count; ++i) {
    bytes_ -= from.back().memory_bytes();
    from.pop_back();
  }
  if (images.size() < count) Clear(to);  // what lies behind the missing ones cannot be reached
  for (BatchImage& image : images) Push(std::move(image), to);
  ShrinkTo(max_bytes_);
  revision_ = revision;
}

void History::Follow(int64_t revision) {
  if (revision == revision_) return;
  for (Stack& stack : stacks_) Clear(stack);
  revision_ = revision;
}

void History::ShrinkTo(uint64_t max_bytes) {
  for (Stack& stack : stacks_) {
    while (bytes_ > max_bytes && !stack.empty()) PopOldest(stack);
  }
}

void History::Push(BatchImage image, Stack& stack) {
  stack.push_back(std::move(image));
  bytes_ += stack.back().memory_bytes();
}

void History::PopOldest(Stack& stack) {
  bytes_ -= stack.front().memory_bytes();
  stack.pop_front();
}

void History::Clear(Stack& stack) {
  while (!stack.empty()) PopOldest(stack);
}

}  // namespace dynmesh
