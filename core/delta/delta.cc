#include "core/delta/delta.h"

#include <algorithm>
#include <set>
#include <utility>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

absl::Status Broken(absl::string_view list, absl::string_view what) {
  return MakeError(absl::StatusCode::kDataLoss, reason::kCorruptPayload,
                   absl::StrCat("the ", list, " ", what), {{"list", std::string(list)}});
}

absl::Status CheckSlots(absl::string_view list, const std::vector<Slot>& slots) {
  const auto stops_ascending = [](Slot a, Slot b) { return a >= b; };
  if (std::adjacent_find(slots.begin(), slots.end(), stops_ascending) != slots.end()) {
    return Broken(list, "do not ascend strictly");
  }
  if (!slots.empty() && slots.back() == kNoSlot) return Broken(list, "hold the slot that stands for none");
  return absl::OkStatus();
}

bool Intersect(const std::vector<Slot>& a, const std::vector<Slot>& b) {
  auto i = a.begin();
  auto j = b.begin();
  while (i != a.end() && j != b.end()) {
    if (*i == *j) return true;
    *i < *j ? ++i : ++j;
  }
  return false;
}

absl::Status CheckChangedSlots(absl::string_view kind, const std::vector<Slot>& removed,
                               const std::vector<Slot>& upserted) {
  DYNMESH_RETURN_IF_ERROR(CheckSlots(absl::StrCat("removed ", kind, " slots"), removed));
  DYNMESH_RETURN_IF_ERROR(CheckSlots(absl::StrCat(kind, " slots"), upserted));
  if (Intersect(removed, upserted)) {
    return Broken(absl::StrCat(kind, " slots"), "name one that is removed as well");
  }
  return absl::OkStatus();
}

bool IsFinite(const Point& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }

absl::Status CheckVertices(const Delta& delta) {
  DYNMESH_RETURN_IF_ERROR(CheckChangedSlots("vertex", delta.removed_vertices, delta.vertex_slots));
  if (delta.positions.size() != delta.vertex_slots.size()) {
    return Broken("positions", "are not one for each vertex slot");
  }
  if (!std::all_of(delta.positions.begin(), delta.positions.end(), IsFinite)) {
    return Broken("positions", "are not all finite");
  }
  return absl::OkStatus();
}

absl::Status CheckElements(EntityKind kind, const ElementChanges& changes) {
  const absl::string_view name = EntityKindName(kind);
  DYNMESH_RETURN_IF_ERROR(CheckChangedSlots(name, changes.removed, changes.slots));
  const std::string types = absl::StrCat(name, " types");
  if (changes.types.size() != changes.slots.size()) return Broken(types, "are not one for each slot");
  size_t corners = 0;
  for (ElementType type : changes.types) {
    if (!IsElementType(static_cast<int>(type)) || KindOf(type) != kind) {
      return Broken(types, "are not all of this dimension");
    }
    corners += NumVertices(type);
  }
  const std::string vertices = absl::StrCat(name, " vertices");
  if (changes.vertices.size() != corners) return Broken(vertices, "are not as many as the types ask for");
  const bool valid =
      std::all_of(changes.vertices.begin(), changes.vertices.end(), [](VertexId v) { return v.valid(); });
  return valid ? absl::OkStatus() : Broken(vertices, "hold the slot that stands for none");
}

absl::Status CheckAttribute(const AttributeChanges& changes) {
  if (!CheckAttributeSpec(changes.spec).ok()) return Broken("attributes", "hold a column that cannot exist");
  const std::string list = absl::StrCat("rows of attribute ", changes.spec.name);
  DYNMESH_RETURN_IF_ERROR(CheckSlots(absl::StrCat("slots of attribute ", changes.spec.name), changes.slots));
  if (changes.rows.size() != changes.slots.size() * changes.spec.row_bytes()) {
    return Broken(list, "are not one for each slot");
  }
  if (!CheckFinite(changes.spec, changes.rows).ok()) return Broken(list, "are not all finite");
  return absl::OkStatus();
}

absl::Status CheckAttributes(const std::vector<AttributeChanges>& attributes) {
  if (attributes.size() > kMaxAttributeColumns) return Broken("attributes", "are more than a session may have");
  std::set<std::pair<EntityKind, absl::string_view>> seen;
  for (const AttributeChanges& changes : attributes) {
    DYNMESH_RETURN_IF_ERROR(CheckAttribute(changes));
    if (!seen.emplace(changes.spec.kind, changes.spec.name).second) return Broken("attributes", "hold a column twice");
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckDelta(const Delta& delta) {
  if (delta.from_revision < 0 || delta.from_revision > delta.to_revision) {
    return Broken("revisions", "do not ascend from 0");
  }
  DYNMESH_RETURN_IF_ERROR(CheckVertices(delta));
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    DYNMESH_RETURN_IF_ERROR(CheckElements(kind, delta.OfKind(kind)));
  }
  return CheckAttributes(delta.attributes);
}

}  // namespace dynmesh
