// Rays against faces.
//
// A ray is followed in pieces: what meets the box round a piece is a candidate. These boxes miss nothing,
// whatever is rounded, which cannot be said of Boost's test of a segment against a box; and a ray that wants
// its first hit only ends with the piece that has it.

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/mesh/error.h"
#include "core/spatial/spatial_search.h"

namespace dynmesh {
namespace {

constexpr double kMaxPieces = 256;
// What a piece takes that meets nothing, and a test of a triangle, next to looking at an entry.
constexpr uint64_t kStepsPerPiece = 10;
constexpr uint64_t kStepsPerTriangle = 10;

/// About as many pieces as a ray crosses entities in a solid of so many.
int NumPieces(size_t num_entries) {
  return static_cast<int>(std::clamp(std::cbrt(static_cast<double>(num_entries)), 1.0, kMaxPieces));
}

bool Before(const RayHit& a, const RayHit& b) { return std::pair(a.t, a.face) < std::pair(b.t, b.face); }

class RayCaster {
 public:
  RayCaster(const Mesh& mesh, const SpatialIndex& index, const RayOptions& options, WorkMeter& meter)
      : mesh_(mesh), index_(index), options_(options), meter_(meter) {}

  /// Collects hits of the whole ray, or until one is certain to be the first.
  absl::Status Run(const RayShear& shear) {
    if (!index_.bounds().has_value()) return absl::OkStatus();
    const auto range = shear.Clip(*index_.bounds());
    if (!range.has_value()) return absl::OkStatus();
    const auto [first, last] = *range;
    const int pieces = NumPieces(index_.num_entries());
    double begin = first;
    for (int i = 1; i <= pieces; ++i) {
      const double end = i == pieces ? last : first + (last - first) * i / pieces;
      DYNMESH_RETURN_IF_ERROR(RunPiece(shear, begin, end));
      if (options_.hits == RayHits::kFirst && !hits_.empty() && hits_.front().t <= end) break;
      begin = end;
    }
    return absl::OkStatus();
  }

  /// What was hit; t is still that of the shear.
  std::vector<RayHit> Take() && {
    std::sort(hits_.begin(), hits_.end(), Before);
    const auto same = [](const RayHit& a, const RayHit& b) { return a.t == b.t && a.face == b.face; };
    hits_.erase(std::unique(hits_.begin(), hits_.end(), same), hits_.end());
    return std::move(hits_);
  }

 private:
  absl::Status RunPiece(const RayShear& shear, double begin, double end) {
    const Box box = shear.Cover(begin, end);
    const FloatBox image = index_.frame().Round(box);
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(kStepsPerPiece));
    DYNMESH_RETURN_IF_ERROR(index_.ForEachNear(box, meter_, [&](const SpatialIndex::Entry& entry) {
      // As the ray never turns round, what meets any earlier piece as well meets the last one.
      if (last_image_.has_value() && Meet(entry.box, *last_image_)) return absl::OkStatus();
      return Try(shear, FaceId(entry.slot));
    }));
    last_image_ = image;
    return absl::OkStatus();
  }

  absl::Status Try(const RayShear& shear, FaceId f) {
    if (!mesh_.IsLive(f) || !IsTarget(f)) return absl::OkStatus();
    const auto vertices = mesh_.Vertices(f);
    absl::optional<double> before;
    for (size_t k = 2; k < vertices.size(); ++k) {
      DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(kStepsPerTriangle));
      const auto t = shear.Hit(
          {mesh_.Position(vertices[0]), mesh_.Position(vertices[k - 1]), mesh_.Position(vertices[k])});
      if (!t.has_value() || IsOnDiagonal(before, *t)) continue;
      DYNMESH_RETURN_IF_ERROR(Add({f, *t}));
      before = t;
    }
    return absl::OkStatus();
  }

  /// Keeps a hit; where the first is wanted, only that of them all.
  absl::Status Add(const RayHit& hit) {
    if (options_.hits == RayHits::kFirst && !hits_.empty()) {
      hits_.front() = std::min(hits_.front(), hit, Before);
      return absl::OkStatus();
    }
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeBytes(sizeof(RayHit)));
    hits_.push_back(hit);
    return absl::OkStatus();
  }

  // Both triangles of a quad are hit at its diagonal; their t differ by rounding there.
  static bool IsOnDiagonal(const absl::optional<double>& before, double t) {
    return before.has_value() && std::abs(*before - t) <= 1e-12 * std::max(*before, t);
  }

  bool IsTarget(FaceId f) const {
    return options_.targets == RayTargets::kAnyFace || mesh_.IsOnBoundary(f) ||
           (mesh_.IsElement(f) && !mesh_.IsDuplicate(f));
  }

  const Mesh& mesh_;
  const SpatialIndex& index_;
  const RayOptions options_;
  WorkMeter& meter_;
  absl::optional<FloatBox> last_image_;
  std::vector<RayHit> hits_;
};

}  // namespace

absl::StatusOr<std::vector<RayHit>> SpatialSearch::CastRay(const Ray& ray, const RayOptions& options) {
  const RayShear shear(ray);
  RayCaster caster(mesh_, index_, options, meter_);
  DYNMESH_RETURN_IF_ERROR(caster.Run(shear));
  std::vector<RayHit> hits = std::move(caster).Take();
  for (RayHit& hit : hits) hit.t = shear.ToRay(hit.t);
  return hits;
}

}  // namespace dynmesh
