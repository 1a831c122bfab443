#include "server/session/selection.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

constexpr size_t kMaxNamedIds = 16;

absl::Status CheckAllLive(const Mesh& mesh, EntityKind kind, const std::vector<Slot>& slots, int64_t as_of) {
  absl::Status first;
  std::vector<Slot> missing;
  for (Slot slot : slots) {
    absl::Status status = mesh.CheckLive({kind, slot}, as_of);
    if (status.ok()) continue;
    if (first.ok()) first = std::move(status);
    missing.push_back(slot);
    if (missing.size() > kMaxNamedIds) break;
  }
  if (missing.size() <= 1) return first;
  return MakeError(first.code(), ErrorReason(first),
                   absl::StrCat(first.message(), ", and it is not the only one"),
                   {{"kind", std::string(EntityKindName(kind))}, {"ids", JoinSlots(missing)}});
}

absl::Status ForEachListed(const Mesh& mesh, EntityKind kind, const Selection& selection,
                           absl::FunctionRef<absl::Status(Slot)> fn) {
  const auto& slots = std::get<std::vector<Slot>>(selection.which);
  int64_t as_of = selection.as_of_revision;
  if (as_of < 0) return BadField("as_of_revision", "as_of_revision is negative");
  if (as_of > mesh.revision()) return RevisionInFuture(as_of, mesh.revision());
  if (as_of == 0) as_of = mesh.revision();
  DYNMESH_RETURN_IF_ERROR(CheckAllLive(mesh, kind, slots, as_of));
  for (Slot slot : slots) DYNMESH_RETURN_IF_ERROR(fn(slot));
  return absl::OkStatus();
}

}  // namespace

absl::Status ForEachSelected(const Mesh& mesh, EntityKind kind, const Selection& selection,
                             absl::FunctionRef<absl::Status(Slot)> fn) {
  if (std::holds_alternative<std::vector<Slot>>(selection.which)) {
    return ForEachListed(mesh, kind, selection, fn);
  }
  Selection::Range range{0, kNoSlot};
  if (const auto* given = std::get_if<Selection::Range>(&selection.which)) range = *given;
  const BitSet& live = mesh.slots(kind).live();
  for (Slot slot = live.Next(range.begin); slot < range.end; slot = live.Next(slot + 1)) {
    DYNMESH_RETURN_IF_ERROR(fn(slot));
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
