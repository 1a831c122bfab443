#ifndef DYNMESH_TESTS_CORE_ARCHIVE_ARCHIVE_SUPPORT_H_
#define DYNMESH_TESTS_CORE_ARCHIVE_ARCHIVE_SUPPORT_H_

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/archive/dirty_pages.h"
#include "core/archive/page.h"
#include "core/archive/rebuilder.h"
#include "core/archive/record.h"
#include "core/mesh/mesh.h"

namespace dynmesh::testing {

/// What a store would hold of a mesh.
struct Archive {
  std::string head;
  std::map<PageId, std::string> pages;
  std::vector<std::string> records;

  /// Head and pages of a mesh as it is now.
  static Archive Of(const Mesh& mesh);
};

/// Pages in an order that `shuffle_seed` gives, or ascending for 0.
absl::StatusOr<Mesh> Rebuild(const Archive& archive, uint32_t shuffle_seed = 0,
                             const RebuildOptions& options = {});

/// Everything that users or later edits can tell of a mesh, one entity a line.
std::string DescribeExactly(const Mesh& mesh);

/// Fails the test unless both are sound and the same to the last id, stamp, flag, part, order and row, and
/// give the same deltas.
void ExpectIdentical(const Mesh& rebuilt, const Mesh& mesh);

/// The same bytes with a seal that fits them.
std::string Resealed(std::string bytes);

/// Keeps an archive of a mesh as a store does: a record for each batch, and checkpoints of the dirty pages
/// which are copied one by one while batches go on.
class ArchiveKeeper {
 public:
  explicit ArchiveKeeper(const Mesh& mesh) : archive_(Archive::Of(mesh)) {}

  /// Takes the record of the open batch. Commit() must follow.
  void Keep(const Mesh& mesh);

  void BeginCheckpoint(const Mesh& mesh);
  bool is_checkpointing() const { return !to_copy_.empty(); }
  /// Copies one of the dirty pages; which, is for the caller to say.
  void CopyPage(const Mesh& mesh, size_t which);
  /// Ends it when all pages are copied: the old head and the records before are gone then.
  void EndCheckpoint();

  const Archive& archive() const { return archive_; }

 private:
  Archive archive_;
  RecordEncoder encoder_;
  DirtyPages dirty_;
  std::vector<PageId> to_copy_;
  std::string next_head_;
  size_t records_at_begin_ = 0;
};

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_CORE_ARCHIVE_ARCHIVE_SUPPORT_H_
