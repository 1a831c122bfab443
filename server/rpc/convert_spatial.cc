#include "server/rpc/convert_spatial.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/rpc/convert.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

bool IsFinite(const Point& point) {
  return std::all_of(point.begin(), point.end(), [](double x) { return std::isfinite(x); });
}

absl::Status NonFinite(absl::string_view field, size_t index) {
  return InvalidArgument(reason::kNonFinite, absl::StrCat(field, " has a number that is NaN or infinite"),
                         {{"field", std::string(field)}, {"index", absl::StrCat(index)}});
}

absl::StatusOr<std::vector<Point>> ToPoints(const std::string& bytes, absl::string_view field) {
  DYNMESH_ASSIGN_OR_RETURN(std::vector<Point> points, ToArray<Point>(bytes, field));
  const auto bad = std::find_if_not(points.begin(), points.end(), IsFinite);
  if (bad != points.end()) return NonFinite(field, bad - points.begin());
  return points;
}

absl::StatusOr<Point> ToCorner(const std::string& bytes, absl::string_view field) {
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Point> points, ToPoints(bytes, field));
  if (points.size() == 1) return points[0];
  return InvalidArgument(reason::kBadArrayLength,
                         absl::StrCat(field, " has ", points.size(), " points where one is wanted"),
                         {{"field", std::string(field)}, {"index", points.empty() ? "0" : "1"}});
}

absl::StatusOr<RayHits> ToRayHits(v1::RayHits hits) {
  if (hits == v1::RAY_HITS_UNSPECIFIED || hits == v1::RAY_HITS_FIRST) return RayHits::kFirst;
  if (hits == v1::RAY_HITS_ALL) return RayHits::kAll;
  return BadField("hits", "there is no such hits");
}

absl::StatusOr<RayTargets> ToRayTargets(v1::RayTargets targets) {
  if (targets == v1::RAY_TARGETS_UNSPECIFIED || targets == v1::RAY_TARGETS_SURFACE)
    return RayTargets::kSurface;
  if (targets == v1::RAY_TARGETS_ANY_FACE) return RayTargets::kAnyFace;
  return BadField("targets", "there are no such targets");
}

absl::Status CheckRays(const std::vector<Point>& origins, const std::vector<Point>& directions) {
  if (origins.size() != directions.size()) {
    return InvalidArgument(
        reason::kBadArrayLength,
        absl::StrCat("there are ", origins.size(), " origins and ", directions.size(), " directions"),
        {{"field", "directions"}, {"index", absl::StrCat(std::min(origins.size(), directions.size()))}});
  }
  const auto zero = std::find(directions.begin(), directions.end(), Point{});
  if (zero == directions.end()) return absl::OkStatus();
  return WithMetadata(BadField("directions", "a direction is zero"), "index",
                      absl::StrCat(zero - directions.begin()));
}

}  // namespace

absl::StatusOr<Box> ToBox(const v1::Box& message, absl::string_view field) {
  Box box;
  DYNMESH_ASSIGN_OR_RETURN(box.low, ToCorner(message.low(), absl::StrCat(field, ".low")));
  DYNMESH_ASSIGN_OR_RETURN(box.high, ToCorner(message.high(), absl::StrCat(field, ".high")));
  for (int axis = 0; axis < 3; ++axis) {
    if (box.low[axis] > box.high[axis]) return BadField(field, "a box has low above high");
  }
  return box;
}

absl::StatusOr<NearestQuestion> ToNearestQuestion(const v1::FindNearestVerticesRequest& request) {
  NearestQuestion question;
  DYNMESH_ASSIGN_OR_RETURN(question.points, ToPoints(request.points(), "points"));
  question.count = request.count() == 0 ? 1 : request.count();
  return question;
}

absl::StatusOr<LocateQuestion> ToLocateQuestion(const v1::LocatePointsRequest& request) {
  LocateQuestion question;
  DYNMESH_ASSIGN_OR_RETURN(question.kind, ToEntityKind(request.kind(), "kind"));
  DYNMESH_ASSIGN_OR_RETURN(question.points, ToPoints(request.points(), "points"));
  question.tolerance = request.tolerance();
  if (!std::isfinite(question.tolerance)) {
    return InvalidArgument(reason::kNonFinite, "tolerance is NaN or infinite", {{"field", "tolerance"}});
  }
  return question;
}

absl::StatusOr<RaysQuestion> ToRaysQuestion(const v1::CastRaysRequest& request) {
  RaysQuestion question;
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Point> origins, ToPoints(request.origins(), "origins"));
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Point> directions, ToPoints(request.directions(), "directions"));
  DYNMESH_RETURN_IF_ERROR(CheckRays(origins, directions));
  DYNMESH_ASSIGN_OR_RETURN(question.options.hits, ToRayHits(request.hits()));
  DYNMESH_ASSIGN_OR_RETURN(question.options.targets, ToRayTargets(request.targets()));
  question.rays.reserve(origins.size());
  for (size_t i = 0; i < origins.size(); ++i) question.rays.push_back({origins[i], directions[i]});
  return question;
}

void FromScoredChunk(const ScoredChunk& chunk, v1::FindNearestVerticesResponse* response) {
  response->set_offsets(FromArray(chunk.offsets));
  response->set_ids(FromArray(chunk.ids));
  response->set_distances(FromArray(chunk.scores));
}

void FromScoredChunk(const ScoredChunk& chunk, v1::CastRaysResponse* response) {
  response->set_offsets(FromArray(chunk.offsets));
  response->set_ids(FromArray(chunk.ids));
  response->set_parameters(FromArray(chunk.scores));
}

}  // namespace dynmesh
