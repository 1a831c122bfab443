#include "core/adapt/sizing.h"

#include <cmath>
#include <cstring>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/edit/geometry.h"

namespace dynmesh {
namespace {

absl::Status BadTarget(absl::string_view field, absl::string_view why) {
  return InvalidArgument(reason::kBadArgument, why, {{"field", std::string(field)}});
}

}  // namespace

absl::StatusOr<Sizing> Sizing::Make(const Mesh& mesh, const AdaptOptions& options) {
  const bool constant = options.target_length != 0;
  if (constant == !options.size_attribute.empty()) {
    return BadTarget("target_length", "either a target length or an attribute that holds it is needed");
  }
  if (constant) {
    if (options.target_length > 0 && std::isfinite(options.target_length)) {
      return Sizing(options.target_length);
    }
    return BadTarget("target_length", "a target length is positive and finite");
  }
  Sizing sizing(0);
  sizing.column_ = mesh.FindAttribute(options.size_attribute, EntityKind::kVertex);
  if (sizing.column_ < 0) {
    return MakeError(absl::StatusCode::kNotFound, reason::kUnknownAttribute,
                     absl::StrCat("no vertex attribute '", options.size_attribute, "'"),
                     {{"attribute", options.size_attribute}});
  }
  DYNMESH_RETURN_IF_ERROR(sizing.CheckAttribute(mesh));
  return sizing;
}

absl::Status Sizing::CheckAttribute(const Mesh& mesh) const {
  const AttributeSpec& spec = mesh.attributes()[column_].spec();
  if (!IsFloatingPoint(spec.type) || spec.components != 1) {
    return BadTarget("size_attribute", "a target length is one floating-point number");
  }
  std::vector<Slot> bad;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
    const double target = TargetAt(mesh, VertexId(v));
    if (!(target > 0 && std::isfinite(target)) && bad.size() < 16) bad.push_back(v);
  });
  if (bad.empty()) return absl::OkStatus();
  return InvalidArgument(reason::kBadArgument, "a target length is not positive",
                         {{"field", "size_attribute"}, {"kind", "vertex"}, {"ids", JoinSlots(bad)}});
}

double Sizing::TargetAt(const Mesh& mesh, VertexId v) const {
  if (column_ < 0) return length_;
  const AttributeColumn& column = mesh.attributes()[column_];
  return WithScalar(column.spec().type, [&](auto scalar) {
    std::memcpy(&scalar, column.Row(v.slot()).data(), sizeof(scalar));
    return static_cast<double>(scalar);
  });
}

double Sizing::RatioOf(const Mesh& mesh, EdgeId e) const {
  const auto ends = mesh.Vertices(e);
  return RatioBetween(mesh, ends[0], ends[1]);
}

double Sizing::RatioBetween(const Mesh& mesh, VertexId a, VertexId b) const {
  const double first = TargetAt(mesh, a), second = TargetAt(mesh, b);
  if (!(first > 0 && second > 0)) return 1;
  return Measure(ElementType::kWireEdge, {mesh.Position(a), mesh.Position(b)}) / ((first + second) / 2);
}

}  // namespace dynmesh
