// What must hold of a mesh that was rebuilt: bytes that were damaged and sealed again must not make a mesh
// that breaks its own invariants.

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/archive/part.h"
#include "core/archive/rebuilder.h"
#include "core/mesh/first_equal.h"

namespace dynmesh {
namespace {

/// Edges of a face but the lowest, ascending.
template <int Words>
VertexKey<Words> KeyOf(absl::Span<const EdgeId> edges) {
  std::array<Slot, kMaxFaceVertices> slots;
  slots.fill(kNoSlot);
  std::transform(edges.begin(), edges.end(), slots.begin(), [](EdgeId e) { return e.slot(); });
  std::sort(slots.begin(), slots.end());
  VertexKey<Words> key;
  key.lowest = slots[0];
  std::copy_n(slots.begin() + 1, Words, key.others.begin());
  return key;
}

}  // namespace

// ---- Slots and rows ----

absl::Status Rebuilder::CheckSlots(EntityKind kind) const {
  const Slot limit = std::max(Limit(kind), head_.slot_limits[Dimension(kind)]);
  for (EntityId id(kind, 0); id.slot < limit; ++id.slot) {
    const Stamp born = mesh_.slots(kind).Born(id.slot), changed = mesh_.changed(kind).At(id.slot);
    if (born == 0) return EntityDamaged(id, "is in no page of the archive");
    if (born > revision() || changed > revision()) return EntityDamaged(id, "is of a later revision");
    const bool has_changed = mesh_.IsLive(id) && (kind == EntityKind::kVertex || mesh_.IsElement(id));
    if (has_changed && changed < born) return EntityDamaged(id, "has changed before it was there");
  }
  return absl::OkStatus();
}

absl::Status Rebuilder::CheckColumn(const AttributeColumn& column) const {
  const EntityKind kind = column.spec().kind;
  Slot bad = kNoSlot;
  column.stamps().ForEachSince(0, 0, column.stamps().size(), [&](Slot slot) {
    const bool sound = slot < Limit(kind) && column.stamps().At(slot) <= revision() &&
                       (mesh_.IsLive({kind, slot}) || column.Row(slot) == column.default_row());
    if (!sound) bad = std::min(bad, slot);
  });
  if (bad != kNoSlot) return EntityDamaged({kind, bad}, "has an attribute that it cannot have");
  if (column.born() <= revision()) return absl::OkStatus();
  return ArchiveDamaged("a column of an archive is of a later revision", {{"attribute", column.spec().name}});
}

// ---- Derived entities and duplicates ----

absl::Status Rebuilder::CheckUses() const {
  const Slot num_faces = Limit(EntityKind::kFace), num_edges = Limit(EntityKind::kEdge);
  for (Slot e = 0; e < num_edges; ++e) {
    const bool needed = mesh_.IsElement(EdgeId(e)) || mesh_.edge_faces_.Length(e) > 0;
    if (Lives(EdgeId(e)) && !needed) return EntityDamaged(EdgeId(e), "is derived of nothing");
  }
  for (Slot f = 0; f < num_faces; ++f) {
    const bool needed = mesh_.IsElement(FaceId(f)) || mesh_.face_cells_[f][0].valid();
    if (Lives(FaceId(f)) && !needed) return EntityDamaged(FaceId(f), "is derived of nothing");
  }
  return absl::OkStatus();
}

absl::Status Rebuilder::CheckPrimaryEdges() const {
  const Slot num_edges = Limit(EntityKind::kEdge);
  const auto is_primary = [&](Slot e) { return Lives(EdgeId(e)) && !mesh_.IsDuplicate(EdgeId(e)); };
  FirstEqual<1> first(num_edges, Limit(EntityKind::kVertex));
  for (Slot e = 0; e < num_edges; ++e) {
    const auto& [a, b] = mesh_.edge_vertices_[e];
    if (is_primary(e)) first.Count(std::min(a, b).slot());
  }
  first.EndCount();
  for (Slot e = 0; e < num_edges; ++e) {
    const auto [low, high] = std::minmax(mesh_.edge_vertices_[e][0], mesh_.edge_vertices_[e][1]);
    if (is_primary(e)) first.Put(e, {low.slot(), {high.slot()}});
  }
  const std::vector<uint32_t> firsts = std::move(first).Take();
  for (Slot e = 0; e < num_edges; ++e) {
    if (is_primary(e) && firsts[e] != e) return EntityDamaged(EdgeId(e), "is there twice");
  }
  return absl::OkStatus();
}

absl::Status Rebuilder::CheckPrimaryFaces() const {
  return mesh_.face_stride_ == 3 ? CheckPrimaryFaceKeys<2>() : CheckPrimaryFaceKeys<3>();
}

// Where every vertex pair has one primary edge, a face's edges say which cycle it is.
template <int Words>
absl::Status Rebuilder::CheckPrimaryFaceKeys() const {
  const Slot num_faces = Limit(EntityKind::kFace);
  const auto is_primary = [&](Slot f) { return Lives(FaceId(f)) && !mesh_.IsDuplicate(FaceId(f)); };
  const auto key = [&](Slot f) { return KeyOf<Words>(mesh_.Edges(FaceId(f))); };
  FirstEqual<Words> first(num_faces, Limit(EntityKind::kEdge));
  for (Slot f = 0; f < num_faces; ++f) {
    if (is_primary(f)) first.Count(key(f).lowest);
  }
  first.EndCount();
  for (Slot f = 0; f < num_faces; ++f) {
    if (is_primary(f)) first.Put(f, key(f));
  }
  const std::vector<uint32_t> firsts = std::move(first).Take();
  for (Slot f = 0; f < num_faces; ++f) {
    if (is_primary(f) && firsts[f] != f) return EntityDamaged(FaceId(f), "is there twice");
  }
  return absl::OkStatus();
}

absl::Status Rebuilder::IndexDuplicates(EntityKind kind) {
  const Slot limit = Limit(kind);
  for (EntityId id(kind, 0); id.slot < limit; ++id.slot) {
    if (!Lives(id) || !mesh_.IsDuplicate(id)) continue;
    const auto vertices = mesh_.VerticesOf(id);
    const bool has_primary = kind == EntityKind::kEdge ? mesh_.FindEdge(vertices[0], vertices[1]).valid()
                                                       : mesh_.FindFace(vertices).valid();
    if (!has_primary) return EntityDamaged(id, "is a duplicate of nothing");
    mesh_.CountDuplicate(id, +1);
  }
  return absl::OkStatus();
}

absl::Status Rebuilder::CheckFit() const {
  const BatchImage::Fit actual = mesh_.FitNow();
  if (actual == fit_) return absl::OkStatus();
  return ArchiveDamaged(
      absl::StrCat("the mesh at revision ", revision(), " is not the one whose checksum the archive tells"),
      {{"revision", absl::StrCat(revision())},
       {"topology", absl::StrCat(actual.checksum.topology)},
       {"geometry", absl::StrCat(actual.checksum.geometry)},
       {"counts", JoinSlots(actual.num_live)}});
}

}  // namespace dynmesh
