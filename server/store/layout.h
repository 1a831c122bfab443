#ifndef DYNMESH_SERVER_STORE_LAYOUT_H_
#define DYNMESH_SERVER_STORE_LAYOUT_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/store/store.h"

/// Keys and values of a store in an Engine. FORMAT.md says what they are, byte by byte.
namespace dynmesh::layout {

inline constexpr uint64_t kFormat = 2;  ///< 1 was never released

inline constexpr uint64_t kMaxNumber = INT64_MAX;  ///< of all that counts, so that one more never overflows

using SessionId = uint64_t;  ///< never used again, so that nothing of a deleted session can come back

/// Keys [from, to).
struct KeyRange {
  std::string from;
  std::string to;
};

std::string FormatKey();
std::string NameKey(absl::string_view name);
KeyRange Names();
/// The name in a key of Names().
absl::string_view NameOfKey(absl::string_view key);

/// Everything that is kept of a session, and of all.
KeyRange DataOf(SessionId id);
KeyRange DataOfAll();
std::string ManifestKey(SessionId id, uint64_t checkpoint);
std::string PageKeyOf(SessionId id, PageKey page, uint64_t checkpoint);
std::string RecordKey(SessionId id, int64_t revision);
std::string TrimmedKey(SessionId id);
std::string ValueKey(SessionId id, absl::string_view name);
KeyRange ManifestsOf(SessionId id);
/// The manifests and all pages: the manifests come first.
KeyRange CheckpointsOf(SessionId id);
bool IsManifestKey(absl::string_view key);
/// Records after `after`, up to and including `last`.
KeyRange RecordsOf(SessionId id, int64_t after, int64_t last = INT64_MAX);

/// What a key of DataOfAll() tells. Errors: DATA_LOSS STORE_DAMAGED: it is too short.
absl::StatusOr<SessionId> SessionOfKey(absl::string_view key);
absl::StatusOr<int64_t> RevisionOfKey(absl::string_view record_key);
absl::StatusOr<uint64_t> CheckpointOfKey(absl::string_view manifest_key);
struct PageVersion {
  PageKey page;
  uint64_t checkpoint;  ///< the one that wrote it

  friend bool operator==(const PageVersion&, const PageVersion&) = default;
  template <typename H>
  friend H AbslHashValue(H hash, const PageVersion& version) {
    return H::combine(std::move(hash), version.page, version.checkpoint);
  }
};
absl::StatusOr<PageVersion> VersionOfKey(absl::string_view page_key);

/// A value with its seal, which tells whether it was damaged, or written under another key.
std::string Seal(absl::string_view key, std::string payload);
/// The payload, in `value`. Errors: DATA_LOSS STORE_DAMAGED.
absl::StatusOr<absl::string_view> Unseal(absl::string_view key, absl::string_view value);

/// The payloads. Reading Errors: DATA_LOSS STORE_DAMAGED.
std::string WriteNumber(uint64_t number);
absl::StatusOr<uint64_t> ReadNumber(absl::string_view payload);

struct StoredRecord {
  int64_t previous = 0;  ///< revision of the record or checkpoint before it
  absl::string_view bytes;
};
std::string WriteRecord(const StoredRecord& record);
absl::StatusOr<StoredRecord> ReadRecord(absl::string_view payload);

struct StoredManifest {
  int64_t revision = 0;
  std::vector<PageVersion> pages;  ///< ascending by page, each once
  absl::string_view bytes;
};
std::string WriteManifest(const StoredManifest& manifest);
absl::StatusOr<StoredManifest> ReadManifest(absl::string_view payload);

}  // namespace dynmesh::layout

#endif  // DYNMESH_SERVER_STORE_LAYOUT_H_
