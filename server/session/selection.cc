#include "server/session/selection.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/spatial/spatial_search.h"
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

absl::Status CheckListed(const Mesh& mesh, EntityKind kind, const Selection& selection) {
  int64_t as_of = selection.as_of_revision;
  if (as_of < 0) return BadField("as_of_revision", "as_of_revision is negative");
  if (as_of > mesh.revision()) return RevisionInFuture(as_of, mesh.revision());
  if (as_of == 0) as_of = mesh.revision();
  return CheckAllLive(mesh, kind, std::get<std::vector<Slot>>(selection.which), as_of);
}

/// Calls fn unless a filter holds the entity back.
absl::Status Offer(const SelectionScope& scope, EntityId id, const Selection& selection,
                   absl::FunctionRef<absl::Status(Slot)> fn) {
  const bool passes = (!selection.boundary_only || scope.mesh.IsOnBoundary(id)) &&
                      (!selection.box.has_value() || Meet(BoundsOf(scope.mesh, id), *selection.box));
  return passes ? fn(id.slot) : scope.meter.ChargeSteps(1);
}

absl::Status ForEachListed(const SelectionScope& scope, EntityKind kind, const Selection& selection,
                           absl::FunctionRef<absl::Status(Slot)> fn) {
  DYNMESH_RETURN_IF_ERROR(CheckListed(scope.mesh, kind, selection));
  for (Slot slot : std::get<std::vector<Slot>>(selection.which)) {
    DYNMESH_RETURN_IF_ERROR(Offer(scope, {kind, slot}, selection, fn));
  }
  return absl::OkStatus();
}

absl::Status ForEachInRange(const SelectionScope& scope, EntityKind kind, const Selection& selection,
                            absl::FunctionRef<absl::Status(Slot)> fn) {
  Selection::Range range{0, kNoSlot};
  if (const auto* given = std::get_if<Selection::Range>(&selection.which)) range = *given;
  const BitSet& slots = selection.boundary_only ? scope.mesh.Boundary(kind) : scope.mesh.slots(kind).live();
  for (Slot slot = slots.Next(range.begin); slot < range.end; slot = slots.Next(slot + 1)) {
    DYNMESH_RETURN_IF_ERROR(Offer(scope, {kind, slot}, selection, fn));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<Slot>> SlotsInBox(const SelectionScope& scope, EntityKind kind, const Box& box) {
  absl::StatusOr<std::vector<Slot>> slots;
  DYNMESH_RETURN_IF_ERROR(scope.spatial.Read(scope.mesh, kind, scope.meter, [&](const SpatialIndex& index) {
    slots = SpatialSearch(scope.mesh, index, scope.meter).InBox(box);
    return slots.status();
  }));
  return slots;
}

absl::Status ForEachInBox(const SelectionScope& scope, EntityKind kind, const Selection& selection,
                          absl::FunctionRef<absl::Status(Slot)> fn) {
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Slot> slots, SlotsInBox(scope, kind, *selection.box));
  for (Slot slot : slots) DYNMESH_RETURN_IF_ERROR(Offer(scope, {kind, slot}, selection, fn));
  return absl::OkStatus();
}

}  // namespace

absl::Status ForEachSelected(const SelectionScope& scope, EntityKind kind, const Selection& selection,
                             absl::FunctionRef<absl::Status(Slot)> fn) {
  if (selection.boundary_only) DYNMESH_RETURN_IF_ERROR(CheckHasBoundary(kind));
  if (std::holds_alternative<std::vector<Slot>>(selection.which)) {
    return ForEachListed(scope, kind, selection, fn);
  }
  const bool all = std::holds_alternative<Selection::All>(selection.which);
  return all && selection.box.has_value() ? ForEachInBox(scope, kind, selection, fn)
                                          : ForEachInRange(scope, kind, selection, fn);
}

absl::Status CheckHasBoundary(EntityKind kind) {
  if (kind != EntityKind::kCell) return absl::OkStatus();
  return InvalidArgument(reason::kBadEntityKind, "cells are never on the boundary", {{"kind", "cell"}});
}

}  // namespace dynmesh
