#ifndef DYNMESH_SERVER_STORE_ENGINE_H_
#define DYNMESH_SERVER_STORE_ENGINE_H_

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/optional.h"

namespace dynmesh {

/// Changes of an Engine, made in order and all or nothing.
class EngineBatch {
 public:
  enum class Kind { kPut, kDelete, kDeleteRange };
  struct Change {
    Kind kind;
    std::string key;    ///< of a range, the first
    std::string value;  ///< of a range, the key after its last
  };

  void Put(std::string key, std::string value) { Add({Kind::kPut, std::move(key), std::move(value)}); }
  void Delete(std::string key) { Add({Kind::kDelete, std::move(key), {}}); }
  void DeleteRange(std::string from, std::string to) {
    Add({Kind::kDeleteRange, std::move(from), std::move(to)});
  }
  void Append(EngineBatch&& later) {
    bytes_ += later.bytes_;
    for (Change& change : later.changes_) changes_.push_back(std::move(change));
    later = EngineBatch();
  }

  const std::vector<Change>& changes() const { return changes_; }
  /// Of all keys and values.
  size_t bytes() const { return bytes_; }

 private:
  void Add(Change change) {
    bytes_ += change.key.size() + change.value.size();
    changes_.push_back(std::move(change));
  }

  std::vector<Change> changes_;
  size_t bytes_ = 0;
};

/// An ordered map of byte strings on some medium: what a Store needs of a key-value library.
///
/// Writes are durable in order: what is on disk after a crash is what a first part of them made. What an
/// engine finds when it is opened is on disk from then on.
/// Errors of all: DATA_LOSS STORE_DAMAGED, UNAVAILABLE STORE_FAILED.
/// Errors of Write() and Sync(): also RESOURCE_EXHAUSTED STORE_FULL. After one of either nothing is known of
/// that batch, or of what was not on disk: write nothing more. Thread safety: full, except that one thread at
/// a time writes, and one at a time syncs: each beside the other.
class Engine {
 public:
  /// The views are valid during the call. An error ends the scan and is its result.
  using Visitor = absl::FunctionRef<absl::Status(absl::string_view key, absl::string_view value)>;

  virtual ~Engine() = default;

  /// From here on it is read, and survives the end of the process.
  virtual absl::Status Write(const EngineBatch& batch) = 0;

  /// What was written before the call is on disk on return. What is written meanwhile may be, or not.
  virtual absl::Status Sync() = 0;

  /// Whether writes would soon have to wait for what moves earlier ones to their place: what has time should
  /// wait instead. Never for ever.
  virtual bool IsBehind() const { return false; }

  virtual absl::StatusOr<absl::optional<std::string>> Get(absl::string_view key) const = 0;

  /// Keys in [from, to) in order, as they were at one moment. `visit` must not write.
  virtual absl::Status Scan(absl::string_view from, absl::string_view to, Visitor visit) const = 0;

  /// The greatest key in [from, to).
  virtual absl::StatusOr<absl::optional<std::string>> LastKey(absl::string_view from,
                                                              absl::string_view to) const = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_ENGINE_H_
