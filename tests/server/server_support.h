#ifndef DYNMESH_TESTS_SERVER_SERVER_SUPPORT_H_
#define DYNMESH_TESTS_SERVER_SERVER_SUPPORT_H_

#include <gmock/gmock.h>
#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/mesh/error.h"
#include "core/mesh/mesh.h"
#include "dynmesh/v1/checks.grpc.pb.h"
#include "dynmesh/v1/edits.grpc.pb.h"
#include "dynmesh/v1/queries.grpc.pb.h"
#include "dynmesh/v1/sessions.grpc.pb.h"
#include "dynmesh/v1/subscriptions.grpc.pb.h"
#include "server/server.h"

/// What the tests over gRPC share.
namespace dynmesh::testing {

inline constexpr absl::Duration kPatience = absl::Seconds(60);

/// A status as a client sees it: code, and the ErrorInfo in its details.
struct RpcError {
  grpc::StatusCode code = grpc::StatusCode::OK;
  std::string reason;
  std::map<std::string, std::string> metadata;
};

/// Parses the details; fails the test when an error has none, or not those of dynmesh.
RpcError ErrorOf(const grpc::Status& status);

/// Fails the test unless `status` has this code and reason, and a metadata pair if `key` is given.
void ExpectError(const grpc::Status& status, grpc::StatusCode code, const std::string& reason,
                 const std::string& key = "", const std::string& value = "");

/// Bytes of an array as they travel, and back.
template <typename T>
std::string Bytes(const std::vector<T>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}
template <typename T>
std::vector<T> Array(const std::string& bytes) {
  EXPECT_EQ(bytes.size() % sizeof(T), 0u);
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

/// Points on no line and no plane.
std::vector<Point> SomePoints(int n);

/// A server of the test's own, and stubs to it.
class ServerTest : public ::testing::Test {
 protected:
  ServerTest() { StartServer({}); }

  /// Replaces the server by a new one.
  void StartServer(const Limits& limits, const std::string& data_dir = "");
  /// The same; listens on a port of its own, whatever the options say.
  void StartServerWith(ServerOptions options);
  Server& server() { return *server_; }
  const std::string& address() const { return server_->addresses()[0]; }
  /// A channel that shares no connection with others.
  std::shared_ptr<grpc::Channel> NewChannel() const;

  v1::SessionService::Stub& sessions() { return *sessions_; }
  v1::EditService::Stub& edits() { return *edits_; }
  v1::QueryService::Stub& queries() { return *queries_; }
  v1::CheckService::Stub& checks() { return *checks_; }
  v1::SubscriptionService::Stub& subscriptions() { return *subscriptions_; }

  grpc::Status CreateSession(const std::string& name,
                             v1::DuplicatePolicy duplicates = v1::DUPLICATE_POLICY_UNSPECIFIED);
  v1::Session GetSession(const std::string& name);
  grpc::Status Apply(const v1::ApplyEditsRequest& request, v1::ApplyEditsResponse* response = nullptr);
  /// Fails the test when refused.
  v1::ApplyEditsResponse MustApply(const v1::ApplyEditsRequest& request);
  /// Fails the test unless the session is at revision 0.
  void ExpectStillEmpty(const std::string& name);
  grpc::Status DeleteSession(const std::string& name, const std::string& etag = "");

  /// Imports vertices and elements as they stand in `mesh`, by ascending dimension.
  grpc::Status Import(const std::string& session, const Mesh& mesh, v1::ImportResult* result = nullptr,
                      size_t chunk_items = 1000);
  /// Sends `requests` and half-closes.
  grpc::Status ImportRequests(const std::vector<v1::ImportMeshRequest>& requests,
                              v1::ImportResult* result = nullptr);

 private:
  std::unique_ptr<Server> server_;
  std::unique_ptr<v1::SessionService::Stub> sessions_;
  std::unique_ptr<v1::EditService::Stub> edits_;
  std::unique_ptr<v1::QueryService::Stub> queries_;
  std::unique_ptr<v1::CheckService::Stub> checks_;
  std::unique_ptr<v1::SubscriptionService::Stub> subscriptions_;
};

/// A context that gives up after kPatience, so that no test hangs.
class PatientContext : public grpc::ClientContext {
 public:
  PatientContext();
};

/// Sends `requests` and half-closes.
grpc::Status SendImport(v1::SessionService::Stub& sessions,
                        const std::vector<v1::ImportMeshRequest>& requests,
                        v1::ImportResult* result = nullptr);

/// Builders of requests.
/// What imports vertices and elements as they stand in `mesh`, by ascending dimension.
std::vector<v1::ImportMeshRequest> ImportOf(const std::string& session, const Mesh& mesh,
                                            size_t chunk_items = 1000);
v1::ApplyEditsRequest Batch(const std::string& session);
v1::AddVertices AddVerticesMessage(const std::vector<Point>& points);
v1::ElementBlock Block(v1::ElementType type, const std::vector<Slot>& vertices);
/// `n` triangles that share the edge between vertices 0 and 1, and no cell.
v1::ApplyEditsRequest BookBatch(const std::string& session, int n);
/// The cells of one edge, over and over: hours of work for an empty answer, in a book of many pages.
v1::GetNeighborsRequest CellsOfEdges(const std::string& session, Slot edge, int times);
/// Four vertices and the tetrahedron over them.
v1::ApplyEditsRequest TetBatch(const std::string& session);
v1::AttributeSpec Spec(const std::string& name, v1::EntityKind kind, v1::AttributeType type, int components);
v1::ImportMeshRequest ImportHead(const std::string& session, uint64_t num_vertices = 0,
                                 uint64_t num_elements = 0);
v1::ImportMeshRequest ImportPositions(const std::vector<Point>& points);
v1::ImportMeshRequest ImportElements(v1::ElementType type, const std::vector<Slot>& vertices);
v1::Selection SelectAll();
v1::Selection SelectIds(const std::vector<Slot>& ids);

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SERVER_SERVER_SUPPORT_H_
