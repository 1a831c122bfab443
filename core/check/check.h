#ifndef DYNMESH_CORE_CHECK_CHECK_H_
#define DYNMESH_CORE_CHECK_CHECK_H_

#include <array>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/mesh/ids.h"

/// What can be checked of a mesh: each check measures a number, of an entity or of the mesh, and compares it
/// with a threshold.
namespace dynmesh {

/// The values travel on the wire: never renumber.
enum class CheckKind : uint8_t {
  kUnspecified = 0,

  // Of the shapes of elements, but for angles of faces: of all faces. No units; angles in degrees.
  kZeroMeasure = 1,   ///< length, area or volume over that power of the longest edge
  kInverted = 2,      ///< of cells: the smallest scaled Jacobian of a corner
  kMinFaceAngle = 3,  ///< smallest angle inside of a face, 0 to 360
  kMaxFaceAngle = 4,
  kMinDihedral = 5,  ///< smallest angle between two faces of a cell, inside of it, 0 to 360
  kMaxDihedral = 6,
  kAspectRatio = 7,  ///< AspectRatio(): 1 if regular
  kCondition = 8,    ///< ConditionNumber(): 1 if regular
  kQuality = 9,      ///< Quality(): 1 if regular

  // Of the incidences of entities. Surface faces are faces that are elements.
  kEdgeFaces = 10,       ///< surface faces at an edge
  kFaceCells = 11,       ///< cells at a face
  kEdgeLink = 12,        ///< groups that the cells at an edge fall into, joined through faces there
  kVertexLink = 13,      ///< the same for the cells at a vertex, or its surface faces joined through edges
  kOrientation = 14,     ///< 1: the two surface faces at an edge, or cells at a face, turn differently
  kDuplicate = 15,       ///< 1: an element equals another one; of edges and faces, an older one
  kDegenerate = 16,      ///< 1: an element names a vertex twice
  kIsolatedVertex = 17,  ///< 1: a vertex has no edges

  // Of the whole mesh (summary.h).
  kHoles = 18,          ///< loops of edges of one surface face
  kNonOrientable = 19,  ///< surfaces and bodies that cannot be oriented
  kShells = 20,         ///< surfaces of bodies
  kComponents = 21,     ///< parts that no edge connects
  kGenus = 22,          ///< handles of surfaces and shells
};

inline constexpr int kNumChecks = 22;

/// Whether `value` is a CheckKind but kUnspecified.
constexpr bool IsCheckKind(int value) { return value >= 1 && value <= kNumChecks; }

/// All of them, in order.
constexpr std::array<CheckKind, kNumChecks> AllChecks() {
  std::array<CheckKind, kNumChecks> checks{};
  for (int i = 0; i < kNumChecks; ++i) checks[i] = static_cast<CheckKind>(i + 1);
  return checks;
}

/// Which values of a check are bad.
enum class BadSide : uint8_t { kBelow, kAbove };

/// What is known of a check beforehand.
struct CheckTraits {
  CheckKind check;
  absl::string_view name;  ///< "min_dihedral"
  BadSide bad;             ///< values on that side of the threshold
  double default_threshold;
  double min_threshold;  ///< what may be asked for
  double max_threshold;
  uint8_t kinds;  ///< of entities that it looks at: bits of Dimension(); 0: the whole mesh
};

/// REQUIRES: IsCheckKind(check).
const CheckTraits& TraitsOf(CheckKind check);

/// Whether it measures single entities, so that the neighbourhood of an edit tells.
inline bool IsLocal(CheckKind check) { return TraitsOf(check).kinds != 0; }
inline bool LooksAt(CheckKind check, EntityKind kind) { return TraitsOf(check).kinds >> Dimension(kind) & 1; }

/// The check of that name, or kUnspecified.
CheckKind FindCheck(absl::string_view name);

enum class Severity : uint8_t { kOff, kWarn, kReject };

/// How one check is to be made.
struct CheckSetting {
  Severity severity = Severity::kOff;
  double threshold = 0;

  friend bool operator==(const CheckSetting&, const CheckSetting&) = default;
};

/// A setting for each check; at first all are off, with their default thresholds.
class CheckSettings {
 public:
  CheckSettings();

  const CheckSetting& operator[](CheckKind check) const { return settings_[static_cast<int>(check) - 1]; }
  /// Errors: INVALID_ARGUMENT BAD_ARGUMENT for a threshold that is not in the check's range.
  absl::Status Set(CheckKind check, const CheckSetting& setting);
  bool IsOn(CheckKind check) const { return (*this)[check].severity != Severity::kOff; }
  bool AnyOn() const;

  friend bool operator==(const CheckSettings&, const CheckSettings&) = default;

 private:
  std::array<CheckSetting, kNumChecks> settings_;
};

/// Whether `value` is on the bad side of `threshold`. What is no number is bad.
bool Fails(CheckKind check, double value, double threshold);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CHECK_CHECK_H_
