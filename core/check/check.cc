#include "core/check/check.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

constexpr uint8_t kVertices = 1, kEdges = 2, kFaces = 4, kCells = 8;
constexpr double kManyTimes = 1e12;
constexpr double kMany = 1e9;

constexpr BadSide kBelow = BadSide::kBelow, kAbove = BadSide::kAbove;

constexpr CheckTraits kTraits[kNumChecks] = {
    {CheckKind::kZeroMeasure, "zero_measure", kBelow, 1e-9, 0, 1, kEdges | kFaces | kCells},
    {CheckKind::kInverted, "inverted", kBelow, -1e-9, -1, 1, kCells},
    {CheckKind::kMinFaceAngle, "min_face_angle", kBelow, 5, 0, 360, kFaces},
    {CheckKind::kMaxFaceAngle, "max_face_angle", kAbove, 170, 0, 360, kFaces},
    {CheckKind::kMinDihedral, "min_dihedral", kBelow, 5, 0, 360, kCells},
    {CheckKind::kMaxDihedral, "max_dihedral", kAbove, 175, 0, 360, kCells},
    {CheckKind::kAspectRatio, "aspect_ratio", kAbove, 20, 1, kManyTimes, kFaces | kCells},
    {CheckKind::kCondition, "condition", kAbove, 20, 1, kManyTimes, kFaces | kCells},
    {CheckKind::kQuality, "quality", kBelow, 0.05, 0, 1, kFaces | kCells},
    {CheckKind::kEdgeFaces, "edge_faces", kAbove, 2, 0, kMany, kEdges},
    {CheckKind::kFaceCells, "face_cells", kAbove, 2, 0, kMany, kFaces},
    {CheckKind::kEdgeLink, "edge_link", kAbove, 1, 0, kMany, kEdges},
    {CheckKind::kVertexLink, "vertex_link", kAbove, 1, 0, kMany, kVertices},
    {CheckKind::kOrientation, "orientation", kAbove, 0, 0, 0, kEdges | kFaces},
    {CheckKind::kDuplicate, "duplicate", kAbove, 0, 0, 0, kEdges | kFaces | kCells},
    {CheckKind::kDegenerate, "degenerate", kAbove, 0, 0, 0, kEdges | kFaces | kCells},
    {CheckKind::kIsolatedVertex, "isolated_vertex", kAbove, 0, 0, 0, kVertices},
    {CheckKind::kHoles, "holes", kAbove, 0, 0, kMany, 0},
    {CheckKind::kNonOrientable, "non_orientable", kAbove, 0, 0, kMany, 0},
    {CheckKind::kShells, "shells", kAbove, 1, 0, kMany, 0},
    {CheckKind::kComponents, "components", kAbove, 1, 0, kMany, 0},
    {CheckKind::kGenus, "genus", kAbove, 0, 0, kMany, 0},
};

}  // namespace

const CheckTraits& TraitsOf(CheckKind check) { return kTraits[static_cast<int>(check) - 1]; }

CheckKind FindCheck(absl::string_view name) {
  const auto found = std::find_if(std::begin(kTraits), std::end(kTraits),
                                  [name](const CheckTraits& traits) { return traits.name == name; });
  return found == std::end(kTraits) ? CheckKind::kUnspecified : found->check;
}

CheckSettings::CheckSettings() {
  for (const CheckTraits& traits : kTraits) {
    settings_[static_cast<int>(traits.check) - 1].threshold = traits.default_threshold;
  }
}

absl::Status CheckSettings::Set(CheckKind check, const CheckSetting& setting) {
  const CheckTraits& traits = TraitsOf(check);
  if (!(setting.threshold >= traits.min_threshold && setting.threshold <= traits.max_threshold)) {
    return InvalidArgument(reason::kBadArgument,
                           absl::StrCat("the threshold of ", traits.name, " is from ", traits.min_threshold,
                                        " to ", traits.max_threshold, ", not ", setting.threshold),
                           {{"field", "checks"}, {"check", std::string(traits.name)}});
  }
  settings_[static_cast<int>(check) - 1] = setting;
  return absl::OkStatus();
}

bool CheckSettings::AnyOn() const {
  return std::any_of(settings_.begin(), settings_.end(),
                     [](const CheckSetting& setting) { return setting.severity != Severity::kOff; });
}

bool Fails(CheckKind check, double value, double threshold) {
  return TraitsOf(check).bad == BadSide::kBelow ? !(value >= threshold) : !(value <= threshold);
}

}  // namespace dynmesh
