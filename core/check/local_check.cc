#include "core/check/local_check.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/check/incidence.h"
#include "core/check/shape.h"
#include "core/edit/geometry.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

using MaybeValue = absl::optional<double>;

/// A geometric measure takes about as long as so many steps.
uint64_t StepsOfShape(CheckKind check, ElementType type) {
  const bool dihedral = check == CheckKind::kMinDihedral || check == CheckKind::kMaxDihedral;
  return (dihedral ? 15 : 5) * (2 + TemplateOf(type).num_edges);
}

double LargestOf(absl::Span<const Point> points) {
  double largest = 0;
  for (const Point& p : points) {
    for (double x : p) largest = std::max(largest, std::abs(x));
  }
  return largest;
}

/// A power of two that brings `largest` near 1; multiplying by it rounds nothing.
double ScaleOf(double largest) {
  constexpr int kMostBits = 1020;
  return std::ldexp(1.0, -std::clamp(largest > 0 ? std::ilogb(largest) : 0, -kMostBits, kMostBits));
}

/// Moves and scales a shape, which changes no measure, so that products of its lengths stay numbers.
void Normalize(absl::Span<Point> points) {
  const double smaller = ScaleOf(LargestOf(points)) / 2;  // differences, too, are numbers then
  for (Point& p : points) p = smaller * p;
  const Point origin = points[0];
  for (Point& p : points) p = p - origin;
  const double larger = ScaleOf(LargestOf(points));
  for (Point& p : points) p = larger * p;
}

MaybeValue MeasureShape(CheckKind check, ElementType type, absl::Span<const Point> points) {
  switch (check) {
    case CheckKind::kZeroMeasure:
      return RelativeMeasure(type, points);
    case CheckKind::kInverted:
      return SmallestScaledJacobian(type, points);
    case CheckKind::kMinFaceAngle:
      return FaceAngles(type, points).smallest;
    case CheckKind::kMaxFaceAngle:
      return FaceAngles(type, points).largest;
    case CheckKind::kMinDihedral:
      return DihedralAngles(type, points).smallest;
    case CheckKind::kMaxDihedral:
      return DihedralAngles(type, points).largest;
    case CheckKind::kAspectRatio:
      return AspectRatio(type, points);
    case CheckKind::kCondition:
      return ConditionNumber(type, points);
    default:
      return Quality(type, points);
  }
}

bool IsOfAllFaces(CheckKind check) {
  return check == CheckKind::kMinFaceAngle || check == CheckKind::kMaxFaceAngle;
}

absl::StatusOr<MaybeValue> MeasureShape(const Mesh& mesh, CheckKind check, EntityId id, WorkMeter& meter) {
  if (!mesh.IsElement(id) && !IsOfAllFaces(check)) return MaybeValue();
  DYNMESH_RETURN_IF_ERROR(meter.ChargeSteps(StepsOfShape(check, mesh.Type(id))));
  const auto vertices = mesh.VerticesOf(id);
  std::array<Point, kMaxElementVertices> points;
  for (size_t k = 0; k < vertices.size(); ++k) points[k] = mesh.Position(vertices[k]);
  Normalize(absl::MakeSpan(points.data(), vertices.size()));
  return MeasureShape(check, mesh.Type(id), absl::MakeConstSpan(points.data(), vertices.size()));
}

MaybeValue Unless0(uint64_t count) { return count == 0 ? MaybeValue() : MaybeValue(count); }

absl::StatusOr<MaybeValue> MeasureOrientation(const Mesh& mesh, EntityId id, WorkMeter& meter) {
  Agreement agreement;
  if (id.kind == EntityKind::kEdge) {
    DYNMESH_ASSIGN_OR_RETURN(agreement, AgreementAt(mesh, EdgeId(id.slot), meter));
  } else {
    agreement = AgreementAt(mesh, FaceId(id.slot));
  }
  if (agreement == Agreement::kNone) return MaybeValue();
  return MaybeValue(agreement == Agreement::kDisagree);
}

absl::StatusOr<MaybeValue> MeasureDuplicate(const Mesh& mesh, EntityId id, WorkMeter& meter) {
  if (!mesh.IsElement(id)) return MaybeValue();
  if (id.kind != EntityKind::kCell) return MaybeValue(mesh.IsDuplicate(id));
  uint64_t least = std::numeric_limits<uint64_t>::max();  // cells that are compared
  for (OrientedFace oriented : mesh.Faces(CellId(id.slot))) {
    least = std::min<uint64_t>(least, mesh.IncidentCells(oriented.face()).size());
  }
  DYNMESH_RETURN_IF_ERROR(meter.ChargeManySteps(least));
  return MaybeValue(mesh.FindTwin(CellId(id.slot)).valid());
}

}  // namespace

absl::StatusOr<MaybeValue> MeasureEntity(const Mesh& mesh, CheckKind check, EntityId id, WorkMeter& meter) {
  if (!LooksAt(check, id.kind)) return MaybeValue();
  DYNMESH_RETURN_IF_ERROR(meter.ChargeSteps(1));
  switch (check) {
    case CheckKind::kEdgeFaces: {
      DYNMESH_ASSIGN_OR_RETURN(const uint64_t count, CountSurfaceFaces(mesh, EdgeId(id.slot), meter));
      return Unless0(count);
    }
    case CheckKind::kFaceCells:
      return Unless0(mesh.IncidentCells(FaceId(id.slot)).size());
    case CheckKind::kEdgeLink: {
      DYNMESH_ASSIGN_OR_RETURN(const uint64_t count, CountCellFans(mesh, EdgeId(id.slot), meter));
      return Unless0(count);
    }
    case CheckKind::kVertexLink: {
      DYNMESH_ASSIGN_OR_RETURN(const VertexFans fans, CountFans(mesh, VertexId(id.slot), meter));
      return Unless0(std::max(fans.cells, fans.faces));
    }
    case CheckKind::kOrientation:
      return MeasureOrientation(mesh, id, meter);
    case CheckKind::kDuplicate:
      return MeasureDuplicate(mesh, id, meter);
    case CheckKind::kDegenerate:
      return mesh.IsElement(id) ? MaybeValue(mesh.IsDegenerate(id)) : MaybeValue();
    case CheckKind::kIsolatedVertex:
      return MaybeValue(mesh.IncidentEdges(VertexId(id.slot)).empty());
    default:
      return MeasureShape(mesh, check, id, meter);
  }
}

}  // namespace dynmesh
