#include "server/rpc/spatial_reactors.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/mesh/error.h"
#include "server/rpc/chunk_stream.h"
#include "server/rpc/convert.h"
#include "server/rpc/convert_spatial.h"
#include "server/rpc/query_weight.h"
#include "server/rpc/unary.h"
#include "server/session/spatial_queries.h"

namespace dynmesh {
namespace {

uint64_t CountPoints(const std::string& points) { return points.size() / sizeof(Point); }

/// Base of those that answer with a list of ids.
template <typename Response>
class IdsReactor : public ChunkStreamReactor<Response> {
 public:
  using ChunkStreamReactor<Response>::ChunkStreamReactor;

 protected:
  absl::StatusOr<bool> NextChunk(Response* response) final {
    std::pair<size_t, size_t> piece;
    if (!TakePiece(answer_.ids, kChunkBytes / sizeof(Slot), next_, piece)) return false;
    response->set_revision(answer_.revision);
    response->set_ids(answer_.ids.data() + piece.first, piece.second * sizeof(Slot));
    return true;
  }

  IdsAnswer answer_;

 private:
  size_t next_ = 0;
};

/// Base of those that answer with rows of ids and numbers.
template <typename Response>
class ScoredReactor : public ChunkStreamReactor<Response> {
 public:
  using ChunkStreamReactor<Response>::ChunkStreamReactor;

 protected:
  absl::StatusOr<bool> NextChunk(Response* response) final {
    if (next_ == answer_.chunks.size()) return false;
    response->set_revision(answer_.revision);
    FromScoredChunk(std::exchange(answer_.chunks[next_++], {}), response);
    return true;
  }

  ScoredAnswer answer_;

 private:
  size_t next_ = 0;
};

class FindInBoxReactor final : public IdsReactor<v1::FindInBoxResponse> {
 public:
  FindInBoxReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                   const v1::FindInBoxRequest& request)
      : IdsReactor("FindInBox", context, services), request_(request) {}

 private:
  bool IsHeavy(const Session& session) const override {
    const absl::StatusOr<EntityKind> kind = ToEntityKind(request_.kind(), "kind");
    return kind.ok() && IsHeavyPlaceQuery(1, session.num_live(*kind));
  }

  absl::Status Gather(const Session& session, const QueryTerms& terms, AccessGrant&) override {
    DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
    DYNMESH_ASSIGN_OR_RETURN(const EntityKind kind, ToEntityKind(request_.kind(), "kind"));
    DYNMESH_ASSIGN_OR_RETURN(const Box box, ToBox(request_.box(), "box"));
    DYNMESH_ASSIGN_OR_RETURN(answer_, QueryInBox(session, kind, box, terms));
    return absl::OkStatus();
  }

  const v1::FindInBoxRequest request_;
};

class FindNearestVerticesReactor final : public ScoredReactor<v1::FindNearestVerticesResponse> {
 public:
  FindNearestVerticesReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                             const v1::FindNearestVerticesRequest& request)
      : ScoredReactor("FindNearestVertices", context, services), request_(request) {}

 private:
  bool IsHeavy(const Session& session) const override {
    const uint64_t rows = CountPoints(request_.points());
    const uint64_t found = rows * std::min(request_.count(), kMaxNearest);
    return found > kManyRows || IsHeavyPlaceQuery(rows, session.num_live(EntityKind::kVertex));
  }

  absl::Status Gather(const Session& session, const QueryTerms& terms, AccessGrant&) override {
    DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
    DYNMESH_ASSIGN_OR_RETURN(const NearestQuestion question, ToNearestQuestion(request_));
    DYNMESH_ASSIGN_OR_RETURN(answer_, QueryNearestVertices(session, question, terms));
    return absl::OkStatus();
  }

  const v1::FindNearestVerticesRequest request_;
};

class LocatePointsReactor final : public IdsReactor<v1::LocatePointsResponse> {
 public:
  LocatePointsReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                      const v1::LocatePointsRequest& request)
      : IdsReactor("LocatePoints", context, services), request_(request) {}

 private:
  bool IsHeavy(const Session& session) const override {
    const absl::StatusOr<EntityKind> kind = ToEntityKind(request_.kind(), "kind");
    return kind.ok() && IsHeavyPlaceQuery(CountPoints(request_.points()), session.num_live(*kind));
  }

  absl::Status Gather(const Session& session, const QueryTerms& terms, AccessGrant&) override {
    DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
    DYNMESH_ASSIGN_OR_RETURN(const LocateQuestion question, ToLocateQuestion(request_));
    DYNMESH_ASSIGN_OR_RETURN(answer_, QueryLocate(session, question, terms));
    return absl::OkStatus();
  }

  const v1::LocatePointsRequest request_;
};

class CastRaysReactor final : public ScoredReactor<v1::CastRaysResponse> {
 public:
  CastRaysReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                  const v1::CastRaysRequest& request)
      : ScoredReactor("CastRays", context, services), request_(request) {}

 private:
  bool IsHeavy(const Session& session) const override {
    return IsHeavyPlaceQuery(CountPoints(request_.origins()), session.num_live(EntityKind::kFace));
  }

  absl::Status Gather(const Session& session, const QueryTerms& terms, AccessGrant&) override {
    DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
    DYNMESH_ASSIGN_OR_RETURN(const RaysQuestion question, ToRaysQuestion(request_));
    DYNMESH_ASSIGN_OR_RETURN(answer_, QueryRays(session, question, terms));
    return absl::OkStatus();
  }

  const v1::CastRaysRequest request_;
};

template <typename Reactor, typename Request>
auto* Start(const ServiceContext& services, grpc::CallbackServerContext* context, const Request& request) {
  return (new Reactor(services, context, request))->Start(request.session(), request.ByteSizeLong());
}

}  // namespace

grpc::ServerWriteReactor<v1::FindInBoxResponse>* StartFindInBox(const ServiceContext& services,
                                                                grpc::CallbackServerContext* context,
                                                                const v1::FindInBoxRequest& request) {
  return Start<FindInBoxReactor>(services, context, request);
}

grpc::ServerWriteReactor<v1::FindNearestVerticesResponse>* StartFindNearestVertices(
    const ServiceContext& services, grpc::CallbackServerContext* context,
    const v1::FindNearestVerticesRequest& request) {
  return Start<FindNearestVerticesReactor>(services, context, request);
}

grpc::ServerWriteReactor<v1::LocatePointsResponse>* StartLocatePoints(
    const ServiceContext& services, grpc::CallbackServerContext* context,
    const v1::LocatePointsRequest& request) {
  return Start<LocatePointsReactor>(services, context, request);
}

grpc::ServerWriteReactor<v1::CastRaysResponse>* StartCastRays(const ServiceContext& services,
                                                              grpc::CallbackServerContext* context,
                                                              const v1::CastRaysRequest& request) {
  return Start<CastRaysReactor>(services, context, request);
}

}  // namespace dynmesh
