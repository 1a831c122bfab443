#ifndef DYNMESH_CORE_ADAPT_OPERATIONS_H_
#define DYNMESH_CORE_ADAPT_OPERATIONS_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/adapt/adapt.h"
#include "core/adapt/changes.h"
#include "core/adapt/features.h"
#include "core/adapt/shape.h"
#include "core/adapt/sizing.h"
#include "core/edit/apply_patch.h"
#include "core/edit/patch.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// What an adaptation knows from its beginning to its end.
struct AdaptState {
  const AdaptOptions options;
  const Sizing sizing;
  const Goodness goodness;
  Features features;
  Changes changes = {};
  AdaptResult result = {};
};

/// The operations of which an adaptation is made, each tried on a mesh whose batch is open and carried out
/// only if it keeps topology, orientation, features and form, and lets in no shape below the floor of
/// AdaptState::goodness.
///
/// All return whether they were carried out; what was not is counted in the result's refusals. Errors:
/// RESOURCE_EXHAUSTED; the operation has changed nothing then. Thread safety: that of std::vector.
class Operations {
 public:
  Operations(Mesh& mesh, AdaptState& state) : mesh_(mesh), state_(state) {}

  Mesh& mesh() { return mesh_; }
  AdaptState& state() { return state_; }

  /// In the middle.
  absl::StatusOr<bool> Split(EdgeId e);

  /// What a collapse must reach.
  enum class Aim {
    kSize,   ///< no shape below min_quality that was not there
    kShape,  ///< the least goodness grows
  };
  /// Draws `e` into its end `kept`, if the other end may go: along its stratum, and no edge gets longer than
  /// `longest` of its target.
  absl::StatusOr<bool> Collapse(EdgeId e, VertexId kept, Aim aim, double longest);
  /// If the least goodness grows, and a surface stays as flat as it is.
  absl::StatusOr<bool> SwapEdge(EdgeId e);
  absl::StatusOr<bool> SwapFace(FaceId f);

  /// Towards the mean of the neighbours, if the least goodness does not get worse. Features stay, and surface
  /// vertices stay on their triangles.
  bool Relax(VertexId v);
  /// The same uphill in the least goodness, if it grows.
  bool Climb(VertexId v);

  /// Entities that were looked at so far: more than operations where many elements meet.
  uint64_t work() const { return work_; }

  /// What the last operation made. Of moves: nothing.
  const AppliedPatch& applied() const { return applied_; }

 private:
  absl::StatusOr<bool> Finish(const absl::Status& planned);
  absl::StatusOr<bool> Count(const absl::Status& outcome, uint64_t& counter);
  bool MayMove(VertexId v);
  void Touch();
  absl::Status CheckLengths(EdgeId e, VertexId gone, VertexId kept, double longest) const;
  bool RunsAlong(EdgeId e, Stratum stratum) const;
  absl::Status CheckForm(EdgeId e, VertexId gone, VertexId kept) const;
  absl::Status CheckFlip() const;
  absl::Status CheckGrows() const;
  /// The worst of the new shapes must be good enough, or as good as the worst of the old ones.
  absl::Status CheckPermitted(double enough) const;
  absl::Status CheckCollapsed(VertexId gone, VertexId kept, Aim aim);
  double GoodnessOf(EntityId element) const;
  double GoodnessWith(EntityId element, VertexId gone, VertexId kept) const;
  bool MoveTo(VertexId v, const Point& place);
  double cos_turn() const;  ///< surfaces may turn by half of what would make a feature

  Mesh& mesh_;
  AdaptState& state_;
  Patch patch_;
  AppliedPatch applied_;
  uint64_t work_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ADAPT_OPERATIONS_H_
