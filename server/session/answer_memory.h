#ifndef DYNMESH_SERVER_SESSION_ANSWER_MEMORY_H_
#define DYNMESH_SERVER_SESSION_ANSWER_MEMORY_H_

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/mesh/error.h"
#include "server/session/session_errors.h"

namespace dynmesh {

inline constexpr size_t kMaxRequestIdBytes = 128;
inline constexpr size_t kRememberedAnswers = 4096;
inline constexpr size_t kRememberedAnswerBytes = size_t{16} << 20;

/// INVALID_ARGUMENT unless `id` has at most kMaxRequestIdBytes.
inline absl::Status CheckRequestId(absl::string_view id) {
  if (id.size() <= kMaxRequestIdBytes) return absl::OkStatus();
  return BadField("request_id", "request_id is longer than 128 bytes");
}

/// The answers that requests with a request_id got, so that a retry gets the first one again.
///
/// Remembers the last kRememberedAnswers, and fewer when they hold more than kRememberedAnswerBytes.
/// Cost: O(1). Thread safety: that of std::vector.
template <typename Answer>
class AnswerMemory {
 public:
  using AnswerPtr = std::shared_ptr<const Answer>;

  /// The answer that `id` got, nullptr if none is remembered.
  /// Errors: INVALID_ARGUMENT REQUEST_ID_REUSED when that request had another fingerprint.
  absl::StatusOr<AnswerPtr> Find(absl::string_view id, uint64_t fingerprint) const {
    const auto found = entries_.find(id);
    if (found == entries_.end()) return AnswerPtr();
    if (found->second.fingerprint == fingerprint) return found->second.answer;
    return InvalidArgument(reason::kRequestIdReused, "request_id was used for a request with other content",
                           {{"field", "request_id"}});
  }

  /// In place of what the id got before, if anything. `answer_bytes` is about the memory that the answer
  /// holds.
  void Remember(const std::string& id, uint64_t fingerprint, AnswerPtr answer, size_t answer_bytes) {
    const auto [entry, is_new] = entries_.try_emplace(id);
    if (is_new) order_.push_back(id);
    bytes_ += answer_bytes - entry->second.bytes;
    entry->second = Entry{fingerprint, answer_bytes, std::move(answer)};
    while (order_.size() > kRememberedAnswers || (bytes_ > kRememberedAnswerBytes && order_.size() > 1)) {
      Forget();
    }
  }

  /// What the answers hold, about.
  uint64_t bytes() const { return bytes_; }

 private:
  struct Entry {
    uint64_t fingerprint = 0;
    size_t bytes = 0;
    AnswerPtr answer;
  };

  void Forget() {
    const auto oldest = entries_.find(order_.front());
    bytes_ -= oldest->second.bytes;
    entries_.erase(oldest);
    order_.pop_front();
  }

  absl::flat_hash_map<std::string, Entry> entries_;
  std::deque<std::string> order_;
  size_t bytes_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_ANSWER_MEMORY_H_
