#ifndef DYNMESH_SERVER_SESSION_DURABILITY_REVISION_NOTE_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_REVISION_NOTE_H_

#include <cstddef>
#include <string>

#include "absl/status/status.h"

namespace dynmesh {

/// What somebody says of a revision that he makes.
struct RevisionNote {
  std::string author = {};
  std::string message = {};

  friend bool operator==(const RevisionNote&, const RevisionNote&) = default;
};

inline constexpr size_t kMaxAuthorBytes = 256;
inline constexpr size_t kMaxNoteBytes = 4096;

/// INVALID_ARGUMENT BAD_ARGUMENT, metadata field, when a text is too long.
absl::Status CheckNote(const RevisionNote& note);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_REVISION_NOTE_H_
