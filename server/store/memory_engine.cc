#include "server/store/memory_engine.h"

#include <iterator>

#include "core/mesh/error.h"

namespace dynmesh {

absl::Status MemoryEngine::Write(const EngineBatch& batch) {
  WriterMutexLock lock(&mu_);
  for (const EngineBatch::Change& change : batch.changes()) Apply(change);
  return absl::OkStatus();
}

void MemoryEngine::Apply(const EngineBatch::Change& change) {
  switch (change.kind) {
    case EngineBatch::Kind::kPut:
      values_.insert_or_assign(change.key, change.value);
      return;
    case EngineBatch::Kind::kDelete:
      values_.erase(change.key);
      return;
    case EngineBatch::Kind::kDeleteRange:
      if (change.key < change.value) {
        values_.erase(values_.lower_bound(change.key), values_.lower_bound(change.value));
      }
      return;
  }
}

absl::StatusOr<absl::optional<std::string>> MemoryEngine::Get(absl::string_view key) const {
  ReaderMutexLock lock(&mu_);
  const auto found = values_.find(key);
  if (found == values_.end()) return absl::optional<std::string>();
  return absl::optional<std::string>(found->second);
}

absl::Status MemoryEngine::Scan(absl::string_view from, absl::string_view to, Visitor visit) const {
  ReaderMutexLock lock(&mu_);
  for (auto it = values_.lower_bound(from); it != values_.end() && it->first < to; ++it) {
    DYNMESH_RETURN_IF_ERROR(visit(it->first, it->second));
  }
  return absl::OkStatus();
}

absl::StatusOr<absl::optional<std::string>> MemoryEngine::LastKey(absl::string_view from,
                                                                  absl::string_view to) const {
  ReaderMutexLock lock(&mu_);
  const auto end = values_.lower_bound(to);
  if (end == values_.begin() || std::prev(end)->first < from) return absl::optional<std::string>();
  return absl::optional<std::string>(std::prev(end)->first);
}

}  // namespace dynmesh
