#ifndef DYNMESH_SERVER_SESSION_IMPORTER_BYTE_QUEUE_H_
#define DYNMESH_SERVER_SESSION_IMPORTER_BYTE_QUEUE_H_

#include <cstddef>
#include <deque>
#include <string>
#include <utility>

namespace dynmesh {

/// Bytes that arrive in pieces and are read once, from the front. Large pieces are kept as they came, small
/// ones are joined; what was read is freed. Pieces are never split, so records that came whole stay whole.
///
/// Thread safety: that of std::vector.
class ByteQueue {
 public:
  void Append(std::string piece) {
    if (piece.empty()) return;
    size_ += piece.size();
    if (!blocks_.empty() && blocks_.back().size() + piece.size() <= kJoinBytes) {
      blocks_.back() += piece;
    } else {
      blocks_.push_back(std::move(piece));
    }
  }

  /// Takes the first block off; REQUIRES: !empty().
  std::string TakeFront() {
    std::string block = std::move(blocks_.front());
    blocks_.pop_front();
    size_ -= block.size();
    return block;
  }

  bool empty() const { return blocks_.empty(); }
  size_t size() const { return size_; }
  const std::deque<std::string>& blocks() const { return blocks_; }

 private:
  static constexpr size_t kJoinBytes = 64 << 10;

  std::deque<std::string> blocks_;
  size_t size_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_IMPORTER_BYTE_QUEUE_H_
