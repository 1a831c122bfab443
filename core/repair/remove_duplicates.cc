#include "core/repair/remove_duplicates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/edit/geometry.h"
#include "core/mesh/error.h"
#include "core/repair/distinct_elements.h"

namespace dynmesh {
namespace {

/// Removes the superfluous elements of one kind.
class Remover {
 public:
  Remover(RepairWork& work, const RemoveDuplicatesOptions& options, EntityKind kind, RepairReport& report)
      : work_(work), mesh_(work.mesh()), options_(options), kind_(kind), report_(report) {}

  absl::Status Run() {
    const BitSet& live = mesh_.slots(kind_).live();
    for (Slot slot = live.Next(0); slot != kNoSlot; slot = live.Next(slot + 1)) {
      DYNMESH_RETURN_IF_ERROR(work_.Charge(2));
      const EntityId id(kind_, slot);
      if (!mesh_.IsElement(id)) continue;
      if (IsDegenerate(id)) {
        DYNMESH_RETURN_IF_ERROR(Remove(id, RepairFinding::kDegenerate));
      } else if (HasTwin(id)) {
        DYNMESH_RETURN_IF_ERROR(CheckDuplicate(id));
      }
    }
    return RemoveAll();
  }

 private:
  static constexpr size_t kPiece = 1024;

  bool IsDegenerate(EntityId id) const {
    if (mesh_.IsDegenerate(id)) return true;
    if (!options_.max_measure) return false;
    std::array<Point, kMaxElementVertices> points;
    const auto vertices = mesh_.VerticesOf(id);
    for (size_t k = 0; k < vertices.size(); ++k) points[k] = mesh_.Position(vertices[k]);
    return std::abs(Measure(mesh_.Type(id), points)) <= *options_.max_measure;
  }

  bool HasTwin(EntityId id) const {
    return kind_ == EntityKind::kCell ? mesh_.FindTwin(CellId(id.slot)).valid() : mesh_.IsDuplicate(id);
  }

  /// The entity of the same vertices that others share. REQUIRES: `id` is no cell.
  EntityId PrimaryOf(EntityId id) const {
    const auto vertices = mesh_.VerticesOf(id);
    if (kind_ == EntityKind::kFace) return mesh_.FindFace(vertices);
    return mesh_.FindEdge(vertices[0], vertices[1]);
  }

  /// Of two equal quads one may measure more than the other, as they are cut along different diagonals.
  bool IsPrimaryKept(EntityId id) const {
    if (kind_ == EntityKind::kCell) return false;
    const EntityId primary = PrimaryOf(id);
    return mesh_.IsElement(primary) && !IsDegenerate(primary);
  }

  absl::Status CheckDuplicate(EntityId id) {
    DYNMESH_RETURN_IF_ERROR(work_.ChargeBytes(DistinctElements::kBytesOfElement));
    const bool stays = !IsPrimaryKept(id) && distinct_.Insert({mesh_.Type(id), mesh_.VerticesOf(id)});
    return stays ? absl::OkStatus() : Remove(id, RepairFinding::kDuplicate);
  }

  absl::Status Remove(EntityId id, RepairFinding finding) {
    report_.Add(finding, id);
    removed_.push_back(id.slot);
    return work_.ChargeBytes(sizeof(Slot));
  }

  /// Not while the elements are gone through: what is a duplicate now may be the only one then.
  absl::Status RemoveAll() {
    for (size_t begin = 0; begin < removed_.size(); begin += kPiece) {
      const auto piece = absl::MakeConstSpan(removed_).subspan(begin, kPiece);
      DYNMESH_RETURN_IF_ERROR(work_.Charge(10 * piece.size()));
      DYNMESH_RETURN_IF_ERROR(mesh_.RemoveElements(kind_, piece));
    }
    return absl::OkStatus();
  }

  RepairWork& work_;
  Mesh& mesh_;
  const RemoveDuplicatesOptions& options_;
  const EntityKind kind_;
  RepairReport& report_;
  DistinctElements distinct_;
  std::vector<Slot> removed_;
};

absl::Status RemoveIsolated(RepairWork& work, RepairReport& report) {
  Mesh& mesh = work.mesh();
  const Slot limit = mesh.slots(EntityKind::kVertex).limit();
  for (VertexId v(0); v.slot() < limit; v = VertexId(v.slot() + 1)) {
    DYNMESH_RETURN_IF_ERROR(work.Charge(1));
    if (!mesh.IsLive(v) || !mesh.IncidentEdges(v).empty()) continue;
    DYNMESH_RETURN_IF_ERROR(mesh.RemoveVertex(v));
    report.Add(RepairFinding::kIsolated, v);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<RepairReport> RemoveDuplicates(RepairWork& work, const RemoveDuplicatesOptions& options) {
  if (options.max_measure && !(*options.max_measure >= 0)) {
    return InvalidArgument(reason::kBadArgument,
                           absl::StrCat("a measure is not negative, not ", *options.max_measure),
                           {{"field", "max_measure"}});
  }
  RepairReport report;
  for (EntityKind kind : {EntityKind::kCell, EntityKind::kFace, EntityKind::kEdge}) {
    DYNMESH_RETURN_IF_ERROR(Remover(work, options, kind, report).Run());
  }
  if (options.isolated_vertices) DYNMESH_RETURN_IF_ERROR(RemoveIsolated(work, report));
  return report;
}

}  // namespace dynmesh
