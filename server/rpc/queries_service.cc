#include "server/rpc/queries_service.h"

#include <algorithm>
#include <utility>

#include "core/mesh/error.h"
#include "dynmesh/v1/queries.grpc.pb.h"
#include "server/rpc/chunk_stream.h"
#include "server/rpc/convert.h"
#include "server/rpc/convert_queries.h"
#include "server/rpc/query_weight.h"
#include "server/rpc/spatial_reactors.h"
#include "server/rpc/unary.h"
#include "server/session/queries.h"

namespace dynmesh {
namespace {

constexpr int kDefaultSurfaceBits = 14;
constexpr int kMaxPositionBits = 30;

bool IsHeavySelection(const v1::Selection& selection, v1::EntityKind kind, const Session& session) {
  const absl::StatusOr<EntityKind> known = ToEntityKind(kind, "kind");
  return known.ok() && CountSelected(selection, session.num_live(*known)) > kManyRows;
}

class GetNeighborsReactor final : public ChunkStreamReactor<v1::GetNeighborsResponse> {
 public:
  GetNeighborsReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                      const v1::GetNeighborsRequest* request)
      : ChunkStreamReactor("GetNeighbors", context, services), request_(*request) {}

 private:
  bool IsHeavy(const Session& session) const override {
    return IsHeavySelection(request_.selection(), request_.from(), session) || HasHeavyRings(session);
  }

  bool HasHeavyRings(const Session& session) const {
    const absl::StatusOr<EntityKind> kind = ToEntityKind(request_.from(), "from");
    if (!kind.ok()) return false;
    const uint64_t num_live = session.num_live(*kind);
    return IsHeavyRingQuery(CountSelected(request_.selection(), num_live), request_.rings(), num_live);
  }

  absl::Status Gather(const Session& session, const QueryTerms& terms, AccessGrant&) override {
    DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
    DYNMESH_ASSIGN_OR_RETURN(const Neighborhood neighborhood, ToNeighborhood(request_));
    DYNMESH_ASSIGN_OR_RETURN(const Selection selection,
                             ToSelection(request_.selection(), request_.as_of_revision()));
    DYNMESH_ASSIGN_OR_RETURN(answer_, QueryNeighbors(session, neighborhood, selection, terms));
    return absl::OkStatus();
  }

  absl::StatusOr<bool> NextChunk(v1::GetNeighborsResponse* response) override {
    if (next_ == answer_.chunks.size()) return false;
    response->set_revision(answer_.revision);
    FromNeighborsChunk(std::exchange(answer_.chunks[next_++], {}), response);
    return true;
  }

  const v1::GetNeighborsRequest request_;
  NeighborsAnswer answer_;
  size_t next_ = 0;
};

class GetEntitiesReactor final : public ChunkStreamReactor<v1::GetEntitiesResponse> {
 public:
  GetEntitiesReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                     const v1::GetEntitiesRequest* request)
      : ChunkStreamReactor("GetEntities", context, services), request_(*request) {}

 private:
  bool IsHeavy(const Session& session) const override {
    return IsHeavySelection(request_.selection(), request_.kind(), session);
  }

  absl::Status Gather(const Session& session, const QueryTerms& terms, AccessGrant&) override {
    DYNMESH_RETURN_IF_ERROR(CheckMessageSize(request_, services_.limits()));
    DYNMESH_ASSIGN_OR_RETURN(const EntityKind kind, ToEntityKind(request_.kind(), "kind"));
    DYNMESH_ASSIGN_OR_RETURN(const Selection selection,
                             ToSelection(request_.selection(), request_.as_of_revision()));
    DYNMESH_ASSIGN_OR_RETURN(answer_, QueryEntities(session, kind, selection, terms));
    return absl::OkStatus();
  }

  absl::StatusOr<bool> NextChunk(v1::GetEntitiesResponse* response) override {
    if (next_ == answer_.chunks.size()) return false;
    response->set_revision(answer_.revision);
    FromEntitiesChunk(std::exchange(answer_.chunks[next_++], {}), response);
    return true;
  }

  const v1::GetEntitiesRequest request_;
  EntitiesAnswer answer_;
  size_t next_ = 0;
};

class GetBoundaryReactor final : public ChunkStreamReactor<v1::GetBoundaryResponse> {
 public:
  GetBoundaryReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                     const v1::GetBoundaryRequest* request)
      : ChunkStreamReactor("GetBoundary", context, services), request_(*request) {}

 private:
  bool IsHeavy(const Session&) const override { return false; }  // a list that is there already

  absl::Status Gather(const Session& session, const QueryTerms& terms, AccessGrant&) override {
    DYNMESH_ASSIGN_OR_RETURN(const EntityKind kind, ToEntityKind(request_.kind(), "kind"));
    DYNMESH_ASSIGN_OR_RETURN(answer_, QueryBoundary(session, kind, terms));
    return absl::OkStatus();
  }

  absl::StatusOr<bool> NextChunk(v1::GetBoundaryResponse* response) override {
    std::pair<size_t, size_t> piece;
    if (!TakePiece(answer_.ids, kChunkBytes / sizeof(Slot), next_, piece)) return false;
    response->set_revision(answer_.revision);
    response->set_ids(answer_.ids.data() + piece.first, piece.second * sizeof(Slot));
    return true;
  }

  const v1::GetBoundaryRequest request_;
  IdsAnswer answer_;
  size_t next_ = 0;
};

class GetBoundarySurfaceReactor final : public ChunkStreamReactor<v1::GetBoundarySurfaceResponse> {
 public:
  GetBoundarySurfaceReactor(const ServiceContext& services, grpc::CallbackServerContext* context,
                            const v1::GetBoundarySurfaceRequest* request)
      : ChunkStreamReactor("GetBoundarySurface", context, services), request_(*request) {}

 private:
  bool IsHeavy(const Session&) const override { return true; }

  absl::Status Gather(const Session& session, const QueryTerms& terms, AccessGrant& grant) override {
    const int bits = request_.position_bits() == 0 ? kDefaultSurfaceBits : request_.position_bits();
    if (bits < 1 || bits > kMaxPositionBits)
      return BadField("position_bits", "position_bits is outside 0-30");
    DYNMESH_ASSIGN_OR_RETURN(SurfaceAnswer answer, QuerySurface(session, terms));
    grant.Release();
    DYNMESH_RETURN_IF_ERROR(terms.stop.Check());
    revision_ = answer.revision;
    DYNMESH_ASSIGN_OR_RETURN(drc_, EncodeSurface(answer.surface, bits));
    return absl::OkStatus();
  }

  absl::StatusOr<bool> NextChunk(v1::GetBoundarySurfaceResponse* response) override {
    std::pair<size_t, size_t> piece;
    if (!TakePiece(drc_, kChunkBytes, next_, piece)) return false;
    response->set_revision(revision_);
    response->set_drc(drc_.data() + piece.first, piece.second);
    return true;
  }

  const v1::GetBoundarySurfaceRequest request_;
  int64_t revision_ = 0;
  std::string drc_;
  size_t next_ = 0;
};

class QueriesService final : public v1::QueryService::CallbackService {
 public:
  explicit QueriesService(const ServiceContext& services) : services_(services) {}

  grpc::ServerWriteReactor<v1::GetNeighborsResponse>* GetNeighbors(
      grpc::CallbackServerContext* context, const v1::GetNeighborsRequest* request) override {
    return (new GetNeighborsReactor(services_, context, request))
        ->Start(request->session(), request->ByteSizeLong());
  }

  grpc::ServerWriteReactor<v1::GetEntitiesResponse>* GetEntities(
      grpc::CallbackServerContext* context, const v1::GetEntitiesRequest* request) override {
    return (new GetEntitiesReactor(services_, context, request))
        ->Start(request->session(), request->ByteSizeLong());
  }

  grpc::ServerWriteReactor<v1::GetBoundaryResponse>* GetBoundary(
      grpc::CallbackServerContext* context, const v1::GetBoundaryRequest* request) override {
    return (new GetBoundaryReactor(services_, context, request))
        ->Start(request->session(), request->ByteSizeLong());
  }

  grpc::ServerWriteReactor<v1::GetBoundarySurfaceResponse>* GetBoundarySurface(
      grpc::CallbackServerContext* context, const v1::GetBoundarySurfaceRequest* request) override {
    return (new GetBoundarySurfaceReactor(services_, context, request))
        ->Start(request->session(), request->ByteSizeLong());
  }

  grpc::ServerWriteReactor<v1::FindInBoxResponse>* FindInBox(grpc::CallbackServerContext* context,
                                                             const v1::FindInBoxRequest* request) override {
    return StartFindInBox(services_, context, *request);
  }

  grpc::ServerWriteReactor<v1::FindNearestVerticesResponse>* FindNearestVertices(
      grpc::CallbackServerContext* context, const v1::FindNearestVerticesRequest* request) override {
    return StartFindNearestVertices(services_, context, *request);
  }

  grpc::ServerWriteReactor<v1::LocatePointsResponse>* LocatePoints(
      grpc::CallbackServerContext* context, const v1::LocatePointsRequest* request) override {
    return StartLocatePoints(services_, context, *request);
  }

  grpc::ServerWriteReactor<v1::CastRaysResponse>* CastRays(grpc::CallbackServerContext* context,
                                                           const v1::CastRaysRequest* request) override {
    return StartCastRays(services_, context, *request);
  }

 private:
  const ServiceContext services_;
};

}  // namespace

std::unique_ptr<grpc::Service> MakeQueriesService(const ServiceContext& context) {
  return std::make_unique<QueriesService>(context);
}

}  // namespace dynmesh
