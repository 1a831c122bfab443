#include "server/session/spatial_queries.h"

#include <algorithm>
#include <utility>

#include "absl/functional/function_ref.h"
#include "core/mesh/error.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

struct Scored {
  Slot id;
  double score;
};

Scored ToScored(const NearVertex& near) { return {near.vertex.slot(), near.distance}; }
Scored ToScored(const RayHit& hit) { return {hit.face.slot(), hit.t}; }

/// Cuts rows into chunks.
class ScoredBuilder {
 public:
  ScoredBuilder() { chunks_.emplace_back(); }

  template <typename Item>
  void AddRow(const std::vector<Item>& row) {
    size_t begin = 0;
    if (row.size() > kPieceItems) {
      for (; row.size() - begin > kPieceItems; begin += kPieceItems) {
        StartChunk(0);
        Append(row, begin, begin + kPieceItems);
      }
      StartChunk(begin);
    } else if (BytesOf(chunks_.back()) + row.size() * kItemBytes + sizeof(uint32_t) > kChunkBytes) {
      StartChunk(0);
    }
    Append(row, begin, row.size());
    ScoredChunk& chunk = chunks_.back();
    chunk.offsets.push_back(first_offset_ + chunk.ids.size());
  }

  std::vector<ScoredChunk> Take() && { return std::move(chunks_); }

 private:
  static constexpr size_t kItemBytes = sizeof(Slot) + sizeof(double);
  static constexpr size_t kPieceItems = kChunkBytes / kItemBytes / 2;

  static size_t BytesOf(const ScoredChunk& chunk) {
    return chunk.offsets.size() * sizeof(uint32_t) + chunk.ids.size() * kItemBytes;
  }

  void StartChunk(size_t first_offset) {
    if (chunks_.back().offsets.size() > 1 || !chunks_.back().ids.empty()) chunks_.emplace_back();
    first_offset_ = first_offset;
  }

  template <typename Item>
  void Append(const std::vector<Item>& row, size_t begin, size_t end) {
    ScoredChunk& chunk = chunks_.back();
    for (size_t i = begin; i < end; ++i) {
      const Scored scored = ToScored(row[i]);
      chunk.ids.push_back(scored.id);
      chunk.scores.push_back(scored.score);
    }
  }

  size_t first_offset_ = 0;  ///< items of the last chunk's first row that earlier chunks hold
  std::vector<ScoredChunk> chunks_;
};

/// Calls fn(search, budget, revision) with the index of a kind, under the session's reader lock.
absl::Status Search(const Session& session, EntityKind kind, const QueryTerms& terms,
                    absl::FunctionRef<absl::Status(SpatialSearch&, QueryBudget&, int64_t)> fn) {
  return session.Read([&](const SessionView& view) {
    QueryBudget budget(session.limits(), terms);
    return session.spatial().Read(view.mesh, kind, budget, [&](const SpatialIndex& index) {
      SpatialSearch search(view.mesh, index, budget);
      return fn(search, budget, view.mesh.revision());
    });
  });
}

/// What `bytes` of an answer and the question itself cost, whatever is found.
absl::Status ChargeItem(QueryBudget& budget, uint64_t bytes) {
  DYNMESH_RETURN_IF_ERROR(budget.ChargeSteps(1));
  return budget.ChargeBytes(bytes);
}

absl::Status CheckLocate(const LocateQuestion& question) {
  if (question.kind != EntityKind::kCell && question.kind != EntityKind::kFace) {
    return InvalidArgument(reason::kBadEntityKind, "points are located in cells or in faces",
                           {{"field", "kind"}});
  }
  if (!(question.tolerance >= 0)) return BadField("tolerance", "tolerance is negative");
  if (question.tolerance == 0 || question.kind == EntityKind::kFace) return absl::OkStatus();
  return BadField("tolerance", "a tolerance is for faces: cells contain a point or do not");
}

}  // namespace

absl::StatusOr<IdsAnswer> QueryInBox(const Session& session, EntityKind kind, const Box& box,
                                     const QueryTerms& terms) {
  IdsAnswer answer;
  const auto gather = [&](SpatialSearch& search, QueryBudget&, int64_t revision) -> absl::Status {
    answer.revision = revision;
    DYNMESH_ASSIGN_OR_RETURN(answer.ids, search.InBox(box));
    return absl::OkStatus();
  };
  DYNMESH_RETURN_IF_ERROR(Search(session, kind, terms, gather));
  return answer;
}

absl::StatusOr<ScoredAnswer> QueryNearestVertices(const Session& session, const NearestQuestion& question,
                                                  const QueryTerms& terms) {
  if (question.count < 1 || question.count > kMaxNearest)
    return BadField("count", "count is outside 1-10000");
  ScoredAnswer answer;
  const auto gather = [&](SpatialSearch& search, QueryBudget& budget, int64_t revision) -> absl::Status {
    const uint64_t of_each = std::min(question.count, session.num_live(EntityKind::kVertex));
    DYNMESH_RETURN_IF_ERROR(budget.CheckBytes(question.points.size() * of_each * sizeof(NearVertex)));
    ScoredBuilder builder;
    for (const Point& point : question.points) {
      DYNMESH_RETURN_IF_ERROR(ChargeItem(budget, sizeof(uint32_t)));
      DYNMESH_ASSIGN_OR_RETURN(const auto row, search.NearestVertices(point, question.count));
      builder.AddRow(row);
    }
    answer = {revision, std::move(builder).Take()};
    return absl::OkStatus();
  };
  DYNMESH_RETURN_IF_ERROR(Search(session, EntityKind::kVertex, terms, gather));
  return answer;
}

absl::StatusOr<IdsAnswer> QueryLocate(const Session& session, const LocateQuestion& question,
                                      const QueryTerms& terms) {
  DYNMESH_RETURN_IF_ERROR(CheckLocate(question));
  IdsAnswer answer;
  const auto gather = [&](SpatialSearch& search, QueryBudget& budget, int64_t revision) -> absl::Status {
    answer.revision = revision;
    for (const Point& point : question.points) {
      DYNMESH_RETURN_IF_ERROR(ChargeItem(budget, sizeof(Slot)));
      if (question.kind == EntityKind::kCell) {
        DYNMESH_ASSIGN_OR_RETURN(const CellId c, search.FindCell(point));
        answer.ids.push_back(c.slot());
      } else {
        DYNMESH_ASSIGN_OR_RETURN(const FaceId f, search.FindFace(point, question.tolerance));
        answer.ids.push_back(f.slot());
      }
    }
    return absl::OkStatus();
  };
  DYNMESH_RETURN_IF_ERROR(Search(session, question.kind, terms, gather));
  return answer;
}

absl::StatusOr<ScoredAnswer> QueryRays(const Session& session, const RaysQuestion& question,
                                       const QueryTerms& terms) {
  ScoredAnswer answer;
  const auto gather = [&](SpatialSearch& search, QueryBudget& budget, int64_t revision) -> absl::Status {
    ScoredBuilder builder;
    for (const Ray& ray : question.rays) {
      DYNMESH_RETURN_IF_ERROR(ChargeItem(budget, sizeof(uint32_t)));
      DYNMESH_ASSIGN_OR_RETURN(const auto row, search.CastRay(ray, question.options));
      builder.AddRow(row);
    }
    answer = {revision, std::move(builder).Take()};
    return absl::OkStatus();
  };
  DYNMESH_RETURN_IF_ERROR(Search(session, EntityKind::kFace, terms, gather));
  return answer;
}

}  // namespace dynmesh
