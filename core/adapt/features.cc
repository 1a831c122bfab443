#include "core/adapt/features.h"

#include <array>
#include <cmath>

#include "absl/container/inlined_vector.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

VertexId OtherEnd(const Mesh& mesh, EdgeId e, VertexId v) {
  const auto ends = mesh.Vertices(e);
  return ends[0] == v ? ends[1] : ends[0];
}

/// The cosine of the angle between two vectors; 1 when one is zero.
double CosBetween(const Point& a, const Point& b) {
  const double squares = Dot(a, a) * Dot(b, b);
  return squares > 0 ? Dot(a, b) / std::sqrt(squares) : 1;
}

/// From the line through an edge to the corner of a triangle that is not on it.
Point ToApex(const Mesh& mesh, EdgeId e, FaceId f) {
  const auto ends = mesh.Vertices(e);
  const Point from = mesh.Position(ends[0]), along = mesh.Position(ends[1]) - from;
  for (VertexId v : mesh.Vertices(f)) {
    if (v == ends[0] || v == ends[1]) continue;
    const Point to = mesh.Position(v) - from;
    const double length2 = Dot(along, along);
    return length2 > 0 ? to - (Dot(to, along) / length2) * along : to;
  }
  return {0, 0, 0};
}

}  // namespace

Features::Features(const Mesh& mesh, double angle) : cos_angle_(std::cos(angle)) { Refresh(mesh, 0); }

void Features::Refresh(const Mesh& mesh, int64_t since) {
  const Slots& slots = mesh.slots(EntityKind::kEdge);
  BitSet marks;
  slots.live().ForEach([&](Slot slot) {
    const bool known = marks_.Test(slot) && slots.Born(slot) <= since;
    if (known || IsFeature(mesh, EdgeId(slot))) marks.Set(slot);
  });
  marks_ = std::move(marks);
}

bool Features::IsFeature(const Mesh& mesh, EdgeId e) const {
  std::array<FaceId, 2> sides;
  size_t count = 0;
  const auto faces = mesh.IncidentFaces(e);
  for (FaceId f : faces) {
    if (!IsOfSurface(mesh, f)) continue;
    if (count == 2) return true;
    sides[count++] = f;
  }
  if (count == 0) return faces.empty();  // a wire; else inside a volume
  if (count == 1) return true;
  return CosBetween(ToApex(mesh, e, sides[0]), -1.0 * ToApex(mesh, e, sides[1])) < cos_angle_;
}

Stratum Features::StratumOf(const Mesh& mesh, VertexId v) const {
  absl::InlinedVector<VertexId, 4> on_line;
  bool on_surface = false;
  for (EdgeId e : mesh.IncidentEdges(v)) {
    if (Has(e)) on_line.push_back(OtherEnd(mesh, e, v));
    if (on_surface) continue;
    const auto faces = mesh.IncidentFaces(e);
    on_surface = !faces.empty() && (mesh.IsOnBoundary(e) || mesh.IncidentCells(faces[0]).empty());
  }
  if (on_line.empty()) return on_surface ? Stratum::kSurface : Stratum::kVolume;
  if (on_line.size() != 2) return Stratum::kCorner;
  const Point at = mesh.Position(v);
  const double straight = CosBetween(at - mesh.Position(on_line[0]), mesh.Position(on_line[1]) - at);
  return straight < cos_angle_ ? Stratum::kCorner : Stratum::kLine;
}

VertexId Features::NextOnLine(const Mesh& mesh, VertexId v, VertexId other) const {
  VertexId next;
  for (EdgeId e : mesh.IncidentEdges(v)) {
    const VertexId end = OtherEnd(mesh, e, v);
    if (!Has(e) || end == other) continue;
    if (next.valid()) return VertexId();
    next = end;
  }
  return next;
}

void Features::Split(const Mesh& mesh, EdgeId e, const std::array<VertexId, 2>& ends, VertexId middle) {
  if (!Has(e)) return;
  marks_.Clear(e.slot());
  Mark(mesh, middle, {ends[0], ends[1]});
}

std::vector<VertexId> Features::TakeFrom(const Mesh& mesh, VertexId v) {
  std::vector<VertexId> others;
  for (EdgeId e : mesh.IncidentEdges(v)) {
    if (!Has(e)) continue;
    marks_.Clear(e.slot());
    others.push_back(OtherEnd(mesh, e, v));
  }
  return others;
}

void Features::Mark(const Mesh& mesh, VertexId v, const std::vector<VertexId>& others) {
  for (VertexId other : others) {
    const EdgeId e = other == v ? EdgeId() : mesh.FindEdge(v, other);
    if (e.valid()) marks_.Set(e.slot());
  }
}

}  // namespace dynmesh
