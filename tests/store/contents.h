#ifndef DYNMESH_TESTS_STORE_CONTENTS_H_
#define DYNMESH_TESTS_STORE_CONTENTS_H_

#include <cstdint>
#include <map>
#include <ostream>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "server/store/store.h"
#include "tests/store/store_rig.h"

namespace dynmesh::testing {

using Records = std::vector<std::pair<int64_t, std::string>>;

struct CheckpointContents {
  int64_t revision = 0;
  std::string manifest;
  std::map<PageKey, std::string> pages;

  bool operator==(const CheckpointContents&) const = default;
};

/// What a recovery of a session reads.
struct SessionContents {
  int64_t checkpoint = 0;
  std::string manifest;
  std::map<PageKey, std::string> pages;
  Records records;                              ///< after the checkpoint
  std::vector<CheckpointContents> former = {};  ///< checkpoints that are kept

  bool operator==(const SessionContents&) const = default;
};
void PrintTo(const SessionContents& contents, std::ostream* out);

using StoreContents = std::map<std::string, SessionContents>;

absl::StatusOr<SessionContents> ReadSession(SessionStore& session);
/// Opens the rig's store, reads all sessions, and closes it. Errors: the first one.
absl::StatusOr<StoreContents> ReadStore(StoreRig& rig);

/// The same where nothing may fail.
Records RecordsAfter(SessionStore& session, int64_t after);
SessionContents ContentsOf(SessionStore& session);

/// Writes to two sessions at random, and knows what it wrote.
class RandomAuthor {
 public:
  /// Borrows both.
  RandomAuthor(StoreRig* rig, std::mt19937* random) : rig_(rig), random_(random) {}

  /// Opens the rig's store, makes so many steps, and closes it.
  void Write(int num_steps);
  const StoreContents& written() const { return written_; }

 private:
  void Step(SessionStore& session, SessionContents& contents);
  void Append(SessionStore& session, SessionContents& contents);
  void MakeCheckpoint(SessionStore& session, SessionContents& contents);
  void DropCheckpoint(SessionStore& session, SessionContents& contents);
  void ChangePages(CheckpointWriter& writer, std::map<PageKey, std::string>& pages);
  std::string AnyBytes() { return std::string(Below(300), static_cast<char>(Below(256))); }
  uint32_t Below(uint32_t end) { return (*random_)() % end; }

  StoreRig* const rig_;
  std::mt19937* const random_;
  StoreContents written_;
};

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_STORE_CONTENTS_H_
