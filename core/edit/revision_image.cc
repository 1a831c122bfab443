#include "core/edit/revision_image.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/entity_content.h"

namespace dynmesh {
namespace {

bool HasSameBits(const Point& a, const Point& b) { return std::memcmp(&a, &b, sizeof(a)) == 0; }

absl::Status NotReachedYet(const Mesh& mesh, const Mesh& target) {
  return MakeError(
      absl::StatusCode::kOutOfRange, reason::kRevisionInFuture,
      absl::StrCat("revision ", target.revision(), " is not reached yet: the mesh is at ", mesh.revision()),
      {{"revision", absl::StrCat(mesh.revision())}, {"requested", absl::StrCat(target.revision())}});
}

absl::Status OtherEntity(EntityId id) {
  const std::string kind(EntityKindName(id.kind));
  return NotAnEarlierState(absl::StrCat(kind, " ", id.slot, " is another one in the two"),
                           {{"kind", kind}, {"ids", absl::StrCat(id.slot)}});
}

absl::Status OtherColumn(const AttributeSpec& spec) {
  return NotAnEarlierState(absl::StrCat("its column '", spec.name, "' is not in the mesh"),
                           {{"attribute", spec.name}, {"kind", std::string(EntityKindName(spec.kind))}});
}

/// Calls fn(slot) for each slot that was touched after `since` until one fails; charges for them before.
absl::Status ForEachTouched(const StampColumn& stamps, Stamp since, WorkMeter& meter,
                            absl::FunctionRef<absl::Status(Slot)> fn) {
  constexpr Slot kBlock = 8 * StampColumn::kPageSlots;
  absl::Status status;
  for (Slot begin = 0; begin < stamps.size() && status.ok();) {
    const Slot end = begin + std::min(kBlock, stamps.size() - begin);
    DYNMESH_RETURN_IF_ERROR(meter.ChargeSteps(1 + stamps.CountSince(since, begin, end)));
    stamps.ForEachSince(since, begin, end, [&](Slot slot) {
      if (status.ok()) status = fn(slot);
    });
    begin = end;
  }
  return status;
}

/// The same for each member of a set.
absl::Status ForEachMember(const BitSet& members, WorkMeter& meter,
                           absl::FunctionRef<absl::Status(Slot)> fn) {
  std::array<Slot, 1024> slots;
  Slot next = 0;
  while (const size_t count = members.Collect(next, slots.data(), slots.size())) {
    DYNMESH_RETURN_IF_ERROR(meter.ChargeSteps(count));
    for (size_t i = 0; i < count; ++i) DYNMESH_RETURN_IF_ERROR(fn(slots[i]));
    next = slots[count - 1] + 1;
  }
  return absl::OkStatus();
}

/// One ImageOfRevision().
class RevisionComparer {
 public:
  RevisionComparer(const Mesh& mesh, const Mesh& target, WorkMeter& meter)
      : mesh_(mesh), target_(target), meter_(meter), since_(static_cast<Stamp>(target.revision())) {}

  absl::StatusOr<BatchImage> Compare() && {
    DYNMESH_RETURN_IF_ERROR(CheckShape());
    DYNMESH_RETURN_IF_ERROR(CheckColumns());
    DYNMESH_RETURN_IF_ERROR(CompareStamped(EntityKind::kVertex));
    DYNMESH_RETURN_IF_ERROR(CompareAll(EntityKind::kEdge));
    DYNMESH_RETURN_IF_ERROR(CompareAll(EntityKind::kFace));
    DYNMESH_RETURN_IF_ERROR(CompareStamped(EntityKind::kCell));
    for (size_t column = 0; column < mesh_.attributes().size(); ++column) {
      DYNMESH_RETURN_IF_ERROR(CompareRows(static_cast<int>(column)));
    }
    for (EntityKind kind : kEntityKinds) DYNMESH_RETURN_IF_ERROR(CheckCount(kind));
    image_.fit = mesh_.FitNow();
    return std::move(image_);
  }

 private:
  // ---- What an earlier state of the mesh cannot but have ----

  /// Arrays of a mesh never get shorter or narrower.
  absl::Status CheckShape() const {
    if (target_.revision() > mesh_.revision()) return NotReachedYet(mesh_, target_);
    bool fits = target_.FaceStride() <= mesh_.FaceStride() &&
                target_.CellVertexStride() <= mesh_.CellVertexStride() &&
                target_.CellFaceStride() <= mesh_.CellFaceStride();
    for (EntityKind kind : kEntityKinds) {
      fits = fits && target_.slots(kind).limit() <= mesh_.slots(kind).limit();
    }
    return fits ? absl::OkStatus() : NotAnEarlierState("the mesh never had as many or as large elements");
  }

  /// Columns are only ever added behind the others.
  absl::Status CheckColumns() const {
    const auto &ours = mesh_.attributes(), &theirs = target_.attributes();
    for (size_t i = 0; i < theirs.size(); ++i) {
      const bool same =
          i < ours.size() && theirs[i].spec() == ours[i].spec() && theirs[i].born() == ours[i].born();
      if (!same) return OtherColumn(theirs[i].spec());
    }
    return absl::OkStatus();
  }

  absl::Status CheckCount(EntityKind kind) const {
    const int k = Dimension(kind);
    const size_t put_back =
        kind == EntityKind::kVertex ? image_.ended_vertices.slots.size() : image_.ended[k].slots.size();
    if (mesh_.NumLive(kind) - image_.made[k].size() + put_back == target_.NumLive(kind)) {
      return absl::OkStatus();
    }
    return NotAnEarlierState("other entities ended since than those that are gone",
                             {{"kind", std::string(EntityKindName(kind))}});
  }

  // ---- Who goes, who stays, who comes back ----

  bool Stays(EntityId id) const { return mesh_.IsLive(id) && mesh_.slots(id.kind).Born(id.slot) <= since_; }

  bool IsSame(EntityId id) const {
    return target_.IsLive(id) && target_.slots(id.kind).Born(id.slot) == mesh_.slots(id.kind).Born(id.slot);
  }

  /// Of vertices and cells, which are stamped whatever becomes of them.
  absl::Status CompareStamped(EntityKind kind) {
    return ForEachTouched(mesh_.changed(kind), since_, meter_, [this, kind](Slot slot) -> absl::Status {
      const EntityId id(kind, slot);
      if (!Stays(id)) {
        if (mesh_.IsLive(id)) image_.made[Dimension(kind)].push_back(slot);
        if (target_.IsLive(id)) PutBack(id);
        return absl::OkStatus();
      }
      if (!IsSame(id)) return OtherEntity(id);
      if (kind == EntityKind::kVertex) CompareVertex(VertexId(slot));
      return absl::OkStatus();
    });
  }

  absl::Status CompareAll(EntityKind kind) {
    const Slots& slots = mesh_.slots(kind);
    DYNMESH_RETURN_IF_ERROR(ForEachTouched(slots.births(), since_, meter_, [&](Slot slot) {
      if (slots.IsLive(slot)) image_.made[Dimension(kind)].push_back(slot);
      return absl::OkStatus();
    }));
    return ForEachMember(target_.slots(kind).live(), meter_, [this, kind](Slot slot) -> absl::Status {
      const EntityId id(kind, slot);
      if (Stays(id)) return IsSame(id) ? CompareShape(id) : OtherEntity(id);
      PutBack(id);
      return absl::OkStatus();
    });
  }

  void PutBack(EntityId id) {
    if (id.kind != EntityKind::kVertex) {
      return Append(id.slot, ContentOf(target_, id), image_.ended[Dimension(id.kind)]);
    }
    image_.ended_vertices.slots.push_back(id.slot);
    image_.ended_vertices.positions.push_back(target_.Position(VertexId(id.slot)));
  }

  void CompareVertex(VertexId v) {
    if (HasSameBits(mesh_.Position(v), target_.Position(v))) return;
    image_.moved.slots.push_back(v.slot());
    image_.moved.positions.push_back(target_.Position(v));
  }

  absl::Status CompareShape(EntityId id) {
    const bool same_state =
        mesh_.IsElement(id) == target_.IsElement(id) && mesh_.IsDuplicate(id) == target_.IsDuplicate(id);
    if (same_state && mesh_.VerticesOf(id) == target_.VerticesOf(id)) return absl::OkStatus();
    if (!HasSameCycle(id)) return OtherEntity(id);
    EntityContent content = ContentOf(target_, id);
    content.num_parts = 0;
    Append(id.slot, content, image_.reshaped[Dimension(id.kind)]);
    return absl::OkStatus();
  }

  bool HasSameCycle(EntityId id) const {
    const auto ours = mesh_.VerticesOf(id), theirs = target_.VerticesOf(id);
    return ours.size() == theirs.size() && CanonicalCycle(ours) == CanonicalCycle(theirs);
  }

  // ---- Rows ----

  /// Every row that is not as it was has been set since: that of who ended was made a default one.
  absl::Status CompareRows(int index) {
    const AttributeColumn& column = mesh_.attributes()[index];
    const bool is_new = index >= static_cast<int>(target_.attributes().size());
    BatchImage::Rows rows = {index, {}, {}};
    const absl::Status compared = ForEachTouched(column.stamps(), since_, meter_, [&](Slot slot) {
      const EntityId id(column.spec().kind, slot);
      const auto before = Stays(id) ? column.Row(slot) : column.default_row();
      const auto wanted = is_new ? column.default_row() : target_.attributes()[index].Row(slot);
      if (target_.IsLive(id) && before != wanted) {
        rows.slots.push_back(slot);
        rows.bytes.insert(rows.bytes.end(), wanted.begin(), wanted.end());
      }
      return absl::OkStatus();
    });
    if (!rows.slots.empty()) image_.rows.push_back(std::move(rows));
    return compared;
  }

  const Mesh& mesh_;
  const Mesh& target_;
  WorkMeter& meter_;
  const Stamp since_;
  BatchImage image_;
};

}  // namespace

absl::Status NotAnEarlierState(absl::string_view why, ErrorMetadata metadata) {
  return InvalidArgument(reason::kBadArgument,
                         absl::StrCat("the mesh never was what it is to be put back to: ", why),
                         std::move(metadata));
}

absl::StatusOr<BatchImage> ImageOfRevision(const Mesh& mesh, const Mesh& target, WorkMeter& meter) {
  return RevisionComparer(mesh, target, meter).Compare();
}

}  // namespace dynmesh
