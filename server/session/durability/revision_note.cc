#include "server/session/durability/revision_note.h"

#include "absl/strings/str_cat.h"
#include "server/session/session_errors.h"

namespace dynmesh {

absl::Status CheckNote(const RevisionNote& note) {
  if (note.author.size() > kMaxAuthorBytes) {
    return BadField("note.author", absl::StrCat("an author has at most ", kMaxAuthorBytes, " bytes"));
  }
  if (note.message.size() > kMaxNoteBytes) {
    return BadField("note.message", absl::StrCat("a message has at most ", kMaxNoteBytes, " bytes"));
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
