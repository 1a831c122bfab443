#ifndef DYNMESH_CORE_ADAPT_ADAPTER_H_
#define DYNMESH_CORE_ADAPT_ADAPTER_H_

#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/adapt/adapt.h"
#include "core/adapt/operations.h"
#include "core/adapt/phases.h"
#include "core/adapt/work_list.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Brings a mesh of triangles or of tetrahedra to a target edge length and a least quality.
///
///     auto adapter = Adapter::Start(mesh, {.target_length = 0.1});
///     while (!(*adapter)->done()) {
///       mesh.BeginBatch();
///       (*adapter)->Step(mesh);
///       mesh.Commit();
///     }
///     (*adapter)->Finish(mesh)
///
/// A pass collapses short edges, splits long ones, swaps and moves what makes bad shapes better; after the
/// last one the worst elements are worked on. A step is a pass, or max_attempts operations of it, so that
/// others can have the mesh in between: they may edit it, and what they have changed is then looked at, too.
///
/// What every operation keeps: topology and orientation; feature edges and corners, and the form of surfaces
/// up to half the feature angle (features.h); and that no angle of an element gets smaller than the smallest
/// one at the start, or than kSafeAngle where that was more. So a mesh is never worse than at the start when
/// this stops early. Flat parts and straight features keep their places up to rounding.
///
/// Thread safety: that of std::vector.
class Adapter {
 public:
  /// Smallest angle of an element that counts as harmless: 12 degrees.
  static constexpr double kSafeAngle = 0.20943951023931953;

  /// Errors: INVALID_ARGUMENT BAD_ARGUMENT (metadata field); those of Sizing::Make and CheckAdaptable. Cost:
  /// linear in the mesh.
  static absl::StatusOr<std::unique_ptr<Adapter>> Start(const Mesh& mesh, const AdaptOptions& options);

  bool done() const { return phase_ == AdaptPhase::kDone; }

  /// Does the next piece of work. REQUIRES: !done(); a batch is open on the mesh of Start(), whose edits are
  /// committed if there are any. Errors: RESOURCE_EXHAUSTED; FAILED_PRECONDITION NOT_SIMPLEX,
  /// ELEMENT_IN_THE_WAY when others have added what cannot be adapted. After an error the batch is rolled
  /// back, and this is not used any more.
  absl::Status Step(Mesh& mesh);

  AdaptProgress progress() const;

  /// Measures what came of it. Cost: linear in the mesh.
  AdaptResult Finish(const Mesh& mesh);

 private:
  Adapter(const Mesh& mesh, const AdaptOptions& options, const Sizing& sizing, const MeshShape& before);

  absl::Status LookAgain(const Mesh& mesh);
  void Enter(AdaptPhase phase, const Mesh& mesh);
  bool GoesInCircles(const Mesh& mesh) const;
  void Advance(const Mesh& mesh);
  void EndPass(const Mesh& mesh);
  const Phase& current() const { return *phases_[static_cast<int>(phase_)]; }

  AdaptState state_;
  std::array<std::unique_ptr<Phase>, 5> phases_;  ///< by AdaptPhase
  std::array<uint32_t, 5> looked_at_ = {};        ///< when the last Fill() of each began
  AdaptPhase phase_ = AdaptPhase::kCollapse;
  WorkList work_;
  int64_t revision_;  ///< that the mesh is to have at the next step
  uint64_t num_elements_;
  double smallest_angle_;
  uint64_t resized_before_ = 0;  ///< splits and collapses of the passes before
  uint64_t improved_before_ = 0;
  int rounds_ = 0;  ///< of kImprove
};

/// OK for a mesh that has triangles or tetrahedra and nothing else. Errors: FAILED_PRECONDITION NOT_SIMPLEX
/// (other elements), ELEMENT_IN_THE_WAY (wires; faces that are elements beside cells), each with metadata
/// kind and up to 16 ids. Cost: elements.
absl::Status CheckAdaptable(const Mesh& mesh);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ADAPT_ADAPTER_H_
