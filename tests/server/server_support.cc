#include "tests/server/server_support.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "absl/time/clock.h"
#include "dynmesh/v1/error_details.pb.h"

namespace dynmesh::testing {

RpcError ErrorOf(const grpc::Status& status) {
  RpcError error;
  error.code = status.error_code();
  if (status.ok()) return error;
  v1::StatusDetails details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  EXPECT_EQ(details.code(), status.error_code());
  EXPECT_EQ(details.message(), status.error_message());
  if (details.details_size() != 1) {
    ADD_FAILURE() << "no details: " << status.error_code() << " " << status.error_message();
    return error;
  }
  EXPECT_EQ(details.details(0).type_url(), "type.googleapis.com/google.rpc.ErrorInfo");
  v1::ErrorInfo info;
  EXPECT_TRUE(info.ParseFromString(details.details(0).value()));
  EXPECT_EQ(info.domain(), "dynmesh");
  error.reason = info.reason();
  error.metadata = {info.metadata().begin(), info.metadata().end()};
  return error;
}

void ExpectError(const grpc::Status& status, grpc::StatusCode code, const std::string& reason,
                 const std::string& key, const std::string& value) {
  const RpcError error = ErrorOf(status);
  EXPECT_EQ(error.code, code) << status.error_message();
  EXPECT_EQ(error.reason, reason) << status.error_message();
  if (key.empty()) return;
  const auto found = error.metadata.find(key);
  EXPECT_EQ(found == error.metadata.end() ? "(absent)" : found->second, value) << key;
}

std::vector<Point> SomePoints(int n) {
  std::vector<Point> points;
  for (int i = 0; i < n; ++i) points.push_back({std::sin(1.0 * i), std::cos(1.7 * i), 0.3 * i});
  return points;
}

PatientContext::PatientContext() { set_deadline(absl::ToChronoTime(absl::Now() + kPatience)); }

void ServerTest::StartServer(const Limits& limits, const std::string& data_dir) {
  ServerOptions options;
  options.limits = limits;
  options.data_dir = data_dir;
  StartServerWith(options);
}

void ServerTest::StartServerWith(ServerOptions options) {
  spdlog::set_level(spdlog::level::err);
  server_ = nullptr;
  options.listen = {"127.0.0.1:0"};
  auto started = Server::Start(options);
  ASSERT_TRUE(started.ok()) << started.status();
  server_ = *std::move(started);
  const auto channel = NewChannel();
  sessions_ = v1::SessionService::NewStub(channel);
  edits_ = v1::EditService::NewStub(channel);
  queries_ = v1::QueryService::NewStub(channel);
  checks_ = v1::CheckService::NewStub(channel);
  subscriptions_ = v1::SubscriptionService::NewStub(channel);
}

std::shared_ptr<grpc::Channel> ServerTest::NewChannel() const {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address(), grpc::InsecureChannelCredentials(), arguments);
}

grpc::Status ServerTest::CreateSession(const std::string& name, v1::DuplicatePolicy duplicates) {
  PatientContext context;
  v1::CreateSessionRequest request;
  request.set_name(name);
  request.mutable_settings()->set_duplicate_policy(duplicates);
  v1::CreateSessionResponse response;
  return sessions().CreateSession(&context, request, &response);
}

v1::Session ServerTest::GetSession(const std::string& name) {
  PatientContext context;
  v1::GetSessionRequest request;
  request.set_name(name);
  v1::GetSessionResponse response;
  const grpc::Status status = sessions().GetSession(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(response.revision(), response.session().revision());
  return response.session();
}

grpc::Status ServerTest::Apply(const v1::ApplyEditsRequest& request, v1::ApplyEditsResponse* response) {
  PatientContext context;
  v1::ApplyEditsResponse ignored;
  return edits().ApplyEdits(&context, request, response == nullptr ? &ignored : response);
}

v1::ApplyEditsResponse ServerTest::MustApply(const v1::ApplyEditsRequest& request) {
  v1::ApplyEditsResponse response;
  const grpc::Status status = Apply(request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response;
}

void ServerTest::ExpectStillEmpty(const std::string& name) {
  const v1::Session session = GetSession(name);
  EXPECT_EQ(session.revision(), 0);
  EXPECT_EQ(session.counts().vertices(), 0u);
  EXPECT_EQ(session.checksum().topology(), 0u);
}

grpc::Status ServerTest::DeleteSession(const std::string& name, const std::string& etag) {
  PatientContext context;
  v1::DeleteSessionRequest request;
  request.set_name(name);
  request.set_etag(etag);
  v1::DeleteSessionResponse response;
  return sessions().DeleteSession(&context, request, &response);
}

grpc::Status ServerTest::Import(const std::string& session, const Mesh& mesh, v1::ImportResult* result,
                                size_t chunk_items) {
  return ImportRequests(ImportOf(session, mesh, chunk_items), result);
}

grpc::Status ServerTest::ImportRequests(const std::vector<v1::ImportMeshRequest>& requests,
                                        v1::ImportResult* result) {
  return SendImport(sessions(), requests, result);
}

std::vector<v1::ImportMeshRequest> ImportOf(const std::string& session, const Mesh& mesh,
                                            size_t chunk_items) {
  std::vector<v1::ImportMeshRequest> requests = {ImportHead(session)};
  std::vector<Point> points;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    points.push_back(mesh.Position(VertexId(slot)));
  });
  for (size_t begin = 0; begin < points.size(); begin += chunk_items) {
    const size_t end = std::min(points.size(), begin + chunk_items);
    requests.push_back(ImportPositions({points.begin() + begin, points.begin() + end}));
  }
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    ElementType type = ElementType::kUnspecified;
    std::vector<Slot> ids;
    size_t count = 0;
    const auto flush = [&] {
      if (count > 0) requests.push_back(ImportElements(static_cast<v1::ElementType>(type), ids));
      ids.clear();
      count = 0;
    };
    mesh.slots(kind).live().ForEach([&](Slot slot) {
      const EntityId id(kind, slot);
      if (!mesh.IsElement(id)) return;
      if (mesh.Type(id) != type || count == chunk_items) flush();
      type = mesh.Type(id);
      for (VertexId v : mesh.VerticesOf(id)) ids.push_back(v.slot());
      ++count;
    });
    flush();
  }
  return requests;
}

grpc::Status SendImport(v1::SessionService::Stub& sessions,
                        const std::vector<v1::ImportMeshRequest>& requests, v1::ImportResult* result) {
  PatientContext context;
  const auto stream = sessions.ImportMesh(&context);
  for (const v1::ImportMeshRequest& request : requests) {
    if (!stream->Write(request)) break;
  }
  stream->WritesDone();
  v1::ImportMeshResponse response;
  bool has_result = false;
  while (stream->Read(&response)) {
    EXPECT_FALSE(has_result) << "something after the result";
    has_result = response.has_result();
    if (has_result && result != nullptr) *result = response.result();
  }
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.ok(), has_result);
  return status;
}

v1::ApplyEditsRequest Batch(const std::string& session) {
  v1::ApplyEditsRequest request;
  request.set_session(session);
  return request;
}

v1::AddVertices AddVerticesMessage(const std::vector<Point>& points) {
  v1::AddVertices message;
  message.set_positions(Bytes(points));
  return message;
}

v1::ElementBlock Block(v1::ElementType type, const std::vector<Slot>& vertices) {
  v1::ElementBlock block;
  block.set_type(type);
  block.set_vertices(Bytes(vertices));
  return block;
}

v1::ApplyEditsRequest BookBatch(const std::string& session, int n) {
  v1::ApplyEditsRequest request = Batch(session);
  *request.add_edits()->mutable_add_vertices() = AddVerticesMessage(SomePoints(n + 2));
  std::vector<Slot> pages;
  for (int i = 0; i < n; ++i) pages.insert(pages.end(), {kNewVertex, kNewVertex | 1, kNewVertex | (2 + i)});
  *request.add_edits()->mutable_add_elements() = Block(v1::ELEMENT_TYPE_TRIANGLE, pages);
  return request;
}

v1::GetNeighborsRequest CellsOfEdges(const std::string& session, Slot edge, int times) {
  v1::GetNeighborsRequest request;
  request.set_session(session);
  request.set_from(v1::ENTITY_KIND_EDGE);
  request.set_to(v1::ENTITY_KIND_CELL);
  *request.mutable_selection() = SelectIds(std::vector<Slot>(times, edge));
  return request;
}

v1::ApplyEditsRequest TetBatch(const std::string& session) {
  constexpr Slot kNew = 0x80000000u;
  v1::ApplyEditsRequest request = Batch(session);
  *request.add_edits()->mutable_add_vertices() = AddVerticesMessage(SomePoints(4));
  *request.add_edits()->mutable_add_elements() =
      Block(v1::ELEMENT_TYPE_TETRAHEDRON, {kNew, kNew + 1, kNew + 2, kNew + 3});
  return request;
}

v1::AttributeSpec Spec(const std::string& name, v1::EntityKind kind, v1::AttributeType type, int components) {
  v1::AttributeSpec spec;
  spec.set_name(name);
  spec.set_kind(kind);
  spec.set_type(type);
  spec.set_components(components);
  return spec;
}

v1::ImportMeshRequest ImportHead(const std::string& session, uint64_t num_vertices, uint64_t num_elements) {
  v1::ImportMeshRequest request;
  request.mutable_header()->set_session(session);
  request.mutable_header()->set_num_vertices(num_vertices);
  request.mutable_header()->set_num_elements(num_elements);
  return request;
}

v1::ImportMeshRequest ImportPositions(const std::vector<Point>& points) {
  v1::ImportMeshRequest request;
  request.set_positions(Bytes(points));
  return request;
}

v1::ImportMeshRequest ImportElements(v1::ElementType type, const std::vector<Slot>& vertices) {
  v1::ImportMeshRequest request;
  *request.mutable_elements() = Block(type, vertices);
  return request;
}

v1::Selection SelectAll() {
  v1::Selection selection;
  selection.set_all(true);
  return selection;
}

v1::Selection SelectIds(const std::vector<Slot>& ids) {
  v1::Selection selection;
  selection.set_ids(Bytes(ids));
  return selection;
}

}  // namespace dynmesh::testing
