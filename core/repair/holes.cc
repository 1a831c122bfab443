#include "core/repair/holes.h"

#include <algorithm>
#include <utility>

#include "core/mesh/error.h"

namespace dynmesh {
namespace {

/// A rim's edge in the direction in which a filling face goes along it: against the face that is there.
struct RimEdge {
  EdgeId edge;
  VertexId from, to;
};

absl::optional<RimEdge> RimEdgeAt(const Mesh& mesh, EdgeId e) {
  const auto faces = mesh.IncidentFaces(e);
  if (faces.size() != 1 || !mesh.IsElement(faces[0]) || !mesh.IncidentCells(faces[0]).empty()) {
    return absl::nullopt;
  }
  const auto edges = mesh.Edges(faces[0]);
  const auto vertices = mesh.Vertices(faces[0]);
  const size_t k = std::find(edges.begin(), edges.end(), e) - edges.begin();
  return RimEdge{e, vertices[(k + 1) % vertices.size()], vertices[k]};
}

class HoleFinder {
 public:
  HoleFinder(RepairWork& work, size_t max_edges) : work_(work), mesh_(work.mesh()), max_edges_(max_edges) {}

  absl::StatusOr<std::vector<Hole>> Find() {
    DYNMESH_RETURN_IF_ERROR(GatherRim());
    std::vector<Hole> holes;
    for (uint32_t i = 0; i < rim_.size(); ++i) {
      if (seen_[i]) continue;
      DYNMESH_RETURN_IF_ERROR(GatherComponent(i));
      holes.push_back(HoleOf(i));
    }
    return holes;
  }

 private:
  /// A vertex, and an edge of the rim that begins or ends there.
  using End = std::pair<VertexId, uint32_t>;

  absl::Status GatherRim() {
    const BitSet& boundary = mesh_.Boundary(EntityKind::kEdge);
    for (Slot slot = boundary.Next(0); slot != kNoSlot; slot = boundary.Next(slot + 1)) {
      DYNMESH_RETURN_IF_ERROR(work_.Charge(1));
      if (const auto edge = RimEdgeAt(mesh_, EdgeId(slot))) rim_.push_back(*edge);
    }
    DYNMESH_RETURN_IF_ERROR(work_.ChargeBytes(rim_.size() * (sizeof(RimEdge) + 2 * sizeof(End))));
    seen_.resize(rim_.size());
    for (uint32_t i = 0; i < rim_.size(); ++i) {
      ends_.emplace_back(rim_[i].from, i);
      ends_.emplace_back(rim_[i].to, i);
    }
    std::sort(ends_.begin(), ends_.end());
    return absl::OkStatus();
  }

  absl::Span<const End> EndsAt(VertexId v) const {
    const auto begin = std::lower_bound(ends_.begin(), ends_.end(), End(v, 0));
    const auto end = std::upper_bound(begin, ends_.end(), End(v, kNoSlot));
    return absl::MakeConstSpan(ends_).subspan(begin - ends_.begin(), end - begin);
  }

  /// All edges of the rim that are connected to one.
  absl::Status GatherComponent(uint32_t first) {
    component_ = {first};
    branches_ = inconsistent_ = false;
    seen_[first] = true;
    for (size_t k = 0; k < component_.size(); ++k) {
      const RimEdge edge = rim_[component_[k]];
      for (VertexId v : {edge.from, edge.to}) {
        const auto ends = EndsAt(v);
        Judge(v, ends);
        const bool again = branchings_.Test(v.slot());
        DYNMESH_RETURN_IF_ERROR(work_.Charge(again ? 1 : 1 + ends.size()));
        if (!again) Follow(ends);
        if (ends.size() != 2) branchings_.Set(v.slot());
      }
    }
    return absl::OkStatus();
  }

  void Judge(VertexId v, absl::Span<const End> ends) {
    if (ends.size() != 2 || ends[0].second == ends[1].second) {
      branches_ = true;
    } else {
      inconsistent_ |= (rim_[ends[0].second].from == v) == (rim_[ends[1].second].from == v);
    }
  }

  void Follow(absl::Span<const End> ends) {
    for (const auto& [v, i] : ends) {
      if (seen_[i]) continue;
      seen_[i] = true;
      component_.push_back(i);
    }
  }

  Hole HoleOf(uint32_t first) const {
    Hole hole{rim_[first].edge, {}, absl::nullopt};
    if (branches_ || component_.size() < 3) {
      hole.problem = RepairFinding::kHoleBranches;
    } else if (inconsistent_) {
      hole.problem = RepairFinding::kHoleInconsistent;
    } else if (component_.size() > max_edges_) {
      hole.problem = RepairFinding::kHoleTooLong;
    } else {
      hole.loop = LoopFrom(first);
    }
    return hole;
  }

  std::vector<VertexId> LoopFrom(uint32_t first) const {
    std::vector<VertexId> loop;
    for (uint32_t at = first; loop.size() < component_.size();) {
      loop.push_back(rim_[at].from);
      const auto ends = EndsAt(rim_[at].to);
      at = ends[0].second == at ? ends[1].second : ends[0].second;
    }
    return loop;
  }

  RepairWork& work_;
  const Mesh& mesh_;
  const size_t max_edges_;
  std::vector<RimEdge> rim_;  ///< by edge
  std::vector<End> ends_;     ///< ascending
  std::vector<bool> seen_;    ///< of rim_
  BitSet branchings_;         ///< vertices of other than two ends that were followed already
  std::vector<uint32_t> component_;
  bool branches_ = false, inconsistent_ = false;
};

}  // namespace

absl::StatusOr<std::vector<Hole>> FindHoles(RepairWork& work, size_t max_edges) {
  return HoleFinder(work, max_edges).Find();
}

}  // namespace dynmesh
