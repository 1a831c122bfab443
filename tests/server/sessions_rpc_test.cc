#include "tests/server/server_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class SessionsRpcTest : public ServerTest {
 protected:
  grpc::Status List(int page_size, const std::string& token, v1::ListSessionsResponse* response) {
    PatientContext context;
    v1::ListSessionsRequest request;
    request.set_page_size(page_size);
    request.set_page_token(token);
    return sessions().ListSessions(&context, request, response);
  }

  /// Names on each page.
  std::vector<std::vector<std::string>> Pages(int page_size) {
    std::vector<std::vector<std::string>> pages;
    std::string token;
    do {
      v1::ListSessionsResponse response;
      EXPECT_TRUE(List(page_size, token, &response).ok());
      pages.emplace_back();
      for (const v1::Session& session : response.sessions()) pages.back().push_back(session.name());
      token = response.next_page_token();
    } while (!token.empty());
    return pages;
  }
};

TEST_F(SessionsRpcTest, ANewSessionIsEmptyAtRevision0) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  const v1::Session session = GetSession("mesh");
  EXPECT_EQ(session.name(), "mesh");
  EXPECT_EQ(session.revision(), 0);
  EXPECT_EQ(session.settings().duplicate_policy(), v1::DUPLICATE_POLICY_KEEP);
  EXPECT_EQ(session.counts().vertices(), 0u);
  EXPECT_THAT(session.bounds_low(), IsEmpty());
  EXPECT_GT(session.create_time().seconds(), 1'700'000'000);
}

TEST_F(SessionsRpcTest, StatusDescribesTheMesh) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  ASSERT_TRUE(Import("mesh", HexGrid(2, 2, 2)).ok());
  const v1::Session session = GetSession("mesh");
  EXPECT_EQ(session.revision(), 1);
  EXPECT_EQ(session.counts().vertices(), 27u);
  EXPECT_EQ(session.counts().edges(), 54u);
  EXPECT_EQ(session.counts().faces(), 36u);
  EXPECT_EQ(session.counts().cells(), 8u);
  EXPECT_EQ(session.element_counts().cells(), 8u);
  EXPECT_EQ(session.boundary_counts().faces(), 24u);
  EXPECT_EQ(session.estimated_counts().vertices(), 27u);
  EXPECT_EQ(session.euler_characteristic(), 1);
  EXPECT_GT(session.memory_bytes(), 0u);
  EXPECT_THAT(Array<double>(session.bounds_low()), ElementsAre(0, 0, 0));
  EXPECT_THAT(Array<double>(session.bounds_high()), ElementsAre(2, 2, 2));
}

TEST_F(SessionsRpcTest, CreationIsRefusedWithReasons) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  ExpectError(CreateSession("mesh"), grpc::ALREADY_EXISTS, reason::kSessionExists, "session", "mesh");
  ExpectError(CreateSession(""), grpc::INVALID_ARGUMENT, reason::kBadSessionName, "field", "name");
  ExpectError(CreateSession("a/b"), grpc::INVALID_ARGUMENT, reason::kBadSessionName);
  ExpectError(CreateSession(std::string(1'000'000, 'x')), grpc::INVALID_ARGUMENT, reason::kBadSessionName);
  ExpectError(CreateSession("b", static_cast<v1::DuplicatePolicy>(77)), grpc::INVALID_ARGUMENT,
              reason::kBadArgument, "field", "duplicate_policy");
}

/// A request that stores `relations`, as pairs of kinds.
v1::UpdateSessionRequest StoreRequest(
    const std::string& name, const std::vector<std::pair<v1::EntityKind, v1::EntityKind>>& relations) {
  v1::UpdateSessionRequest request;
  request.mutable_session()->set_name(name);
  for (const auto& [from, to] : relations) {
    v1::Relation* relation = request.mutable_session()->mutable_settings()->add_stored_relations();
    relation->set_from(from);
    relation->set_to(to);
  }
  request.mutable_update_mask()->add_paths("settings.stored_relations");
  return request;
}

TEST_F(SessionsRpcTest, RelationsCanBeSwitchedWhileASessionIsInUse) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  ASSERT_TRUE(Import("mesh", TetGrid(3, 3, 3)).ok());
  const auto update = [&](const v1::UpdateSessionRequest& request) {
    PatientContext context;
    v1::UpdateSessionResponse response;
    EXPECT_TRUE(sessions().UpdateSession(&context, request, &response).ok());
    EXPECT_EQ(response.revision(), 1);
    return response.session();
  };
  const auto pair = std::make_pair(v1::ENTITY_KIND_VERTEX, v1::ENTITY_KIND_CELL);
  const v1::Session stored = update(StoreRequest("mesh", {pair}));
  ASSERT_THAT(stored.stored_relations(), SizeIs(1));
  EXPECT_EQ(stored.stored_relations(0).relation().from(), v1::ENTITY_KIND_VERTEX);
  EXPECT_EQ(stored.stored_relations(0).relation().to(), v1::ENTITY_KIND_CELL);
  EXPECT_GT(stored.stored_relations(0).memory_bytes(), 0u);
  EXPECT_THAT(GetSession("mesh").settings().stored_relations(), SizeIs(1));
  EXPECT_EQ(stored.checksum().SerializeAsString(), GetSession("mesh").checksum().SerializeAsString());
  EXPECT_THAT(update(StoreRequest("mesh", {})).stored_relations(), IsEmpty());
}

TEST_F(SessionsRpcTest, UpdatesAreRefusedWithReasons) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  const auto pair = std::make_pair(v1::ENTITY_KIND_CELL, v1::ENTITY_KIND_CELL);
  const auto update = [&](const v1::UpdateSessionRequest& request) {
    PatientContext context;
    v1::UpdateSessionResponse response;
    return sessions().UpdateSession(&context, request, &response);
  };
  const auto expect_bad = [&](const v1::UpdateSessionRequest& request, const char* field) {
    ExpectError(update(request), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", field);
  };
  expect_bad(StoreRequest("mesh", {pair, pair}), "stored_relations");
  expect_bad(StoreRequest("mesh", {{v1::ENTITY_KIND_EDGE, v1::ENTITY_KIND_EDGE}}), "stored_relations");
  ExpectError(update(StoreRequest("mesh", {{v1::ENTITY_KIND_CELL, static_cast<v1::EntityKind>(77)}})),
              grpc::INVALID_ARGUMENT, reason::kBadEntityKind);
  v1::UpdateSessionRequest request = StoreRequest("mesh", {pair});
  request.mutable_update_mask()->add_paths("settings.duplicate_policy");
  expect_bad(request, "update_mask");
  request.clear_update_mask();
  expect_bad(request, "update_mask");
  request = StoreRequest("mesh", {pair});
  request.mutable_session()->set_etag("another");
  ExpectError(update(request), grpc::ABORTED, reason::kEtagMismatch);
  ExpectError(update(StoreRequest("none", {})), grpc::NOT_FOUND, reason::kSessionNotFound);
  EXPECT_THAT(GetSession("mesh").stored_relations(), IsEmpty());
}

TEST_F(SessionsRpcTest, ASessionStoresFromTheBeginningWhatItWasCreatedWith) {
  const auto pair = std::make_pair(v1::ENTITY_KIND_CELL, v1::ENTITY_KIND_CELL);
  v1::CreateSessionRequest request;
  request.set_name("mesh");
  *request.mutable_settings() = StoreRequest("", {pair}).session().settings();
  PatientContext context;
  v1::CreateSessionResponse response;
  ASSERT_TRUE(sessions().CreateSession(&context, request, &response).ok());
  ASSERT_TRUE(Import("mesh", TetGrid(2, 2, 2)).ok());
  ASSERT_THAT(GetSession("mesh").stored_relations(), SizeIs(1));
  EXPECT_GT(GetSession("mesh").stored_relations(0).memory_bytes(), 0u);
}

TEST_F(SessionsRpcTest, ARetriedCreationGetsTheFirstAnswer) {
  v1::CreateSessionRequest request;
  request.set_name("mesh");
  request.set_request_id("r1");
  v1::CreateSessionResponse first, again;
  {
    PatientContext context;
    ASSERT_TRUE(sessions().CreateSession(&context, request, &first).ok());
  }
  MustApply(TetBatch("mesh"));
  {
    PatientContext context;
    ASSERT_TRUE(sessions().CreateSession(&context, request, &again).ok());
  }
  EXPECT_EQ(again.SerializeAsString(), first.SerializeAsString());
  request.set_name("other");
  PatientContext context;
  ExpectError(sessions().CreateSession(&context, request, &again), grpc::INVALID_ARGUMENT,
              reason::kRequestIdReused);
}

TEST_F(SessionsRpcTest, UnknownSessionsAreNotFound) {
  PatientContext context;
  v1::GetSessionRequest request;
  request.set_name("nobody");
  v1::GetSessionResponse response;
  ExpectError(sessions().GetSession(&context, request, &response), grpc::NOT_FOUND, reason::kSessionNotFound,
              "session", "nobody");
  ExpectError(DeleteSession("nobody"), grpc::NOT_FOUND, reason::kSessionNotFound);
  ExpectError(Apply(TetBatch("nobody")), grpc::NOT_FOUND, reason::kSessionNotFound);
}

TEST_F(SessionsRpcTest, ListsInPages) {
  EXPECT_THAT(Pages(0), ElementsAre(IsEmpty()));
  for (const char* name : {"d", "b", "a", "c", "e"}) ASSERT_TRUE(CreateSession(name).ok());
  EXPECT_THAT(Pages(2), ElementsAre(ElementsAre("a", "b"), ElementsAre("c", "d"), ElementsAre("e")));
  EXPECT_THAT(Pages(5), ElementsAre(SizeIs(5)));
  EXPECT_THAT(Pages(2'000'000'000), ElementsAre(SizeIs(5)));
}

TEST_F(SessionsRpcTest, PagesGoOnWhereASessionWasDeleted) {
  for (const char* name : {"a", "b", "c"}) ASSERT_TRUE(CreateSession(name).ok());
  v1::ListSessionsResponse response;
  ASSERT_TRUE(List(2, "", &response).ok());
  ASSERT_TRUE(DeleteSession("b").ok());
  ASSERT_TRUE(List(2, response.next_page_token(), &response).ok());
  ASSERT_EQ(response.sessions_size(), 1);
  EXPECT_EQ(response.sessions(0).name(), "c");
}

TEST_F(SessionsRpcTest, OddPagesAreRefused) {
  v1::ListSessionsResponse response;
  for (const char* token : {"x", "!!!", "YQ", "MQ"}) {
    ExpectError(List(2, token, &response), grpc::INVALID_ARGUMENT, reason::kBadPageToken, "field",
                "page_token");
  }
  ExpectError(List(-1, "", &response), grpc::INVALID_ARGUMENT, reason::kBadArgument, "field", "page_size");
}

TEST_F(SessionsRpcTest, DeleteAsksForTheEtag) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  const std::string etag = GetSession("mesh").etag();
  MustApply(TetBatch("mesh"));
  const std::string fresh = GetSession("mesh").etag();
  EXPECT_NE(etag, fresh);
  ExpectError(DeleteSession("mesh", etag), grpc::ABORTED, reason::kEtagMismatch, "etag", fresh);
  EXPECT_TRUE(DeleteSession("mesh", fresh).ok());
  ExpectError(DeleteSession("mesh"), grpc::NOT_FOUND, reason::kSessionNotFound);
}

TEST_F(SessionsRpcTest, ValidateFindsNothingInASoundSession) {
  ASSERT_TRUE(CreateSession("mesh").ok());
  ASSERT_TRUE(Import("mesh", HybridOfFour()).ok());
  PatientContext context;
  v1::ValidateSessionRequest request;
  request.set_session("mesh");
  v1::ValidateSessionResponse response;
  ASSERT_TRUE(sessions().ValidateSession(&context, request, &response).ok());
  EXPECT_EQ(response.revision(), 1);
  EXPECT_THAT(response.violations(), IsEmpty());
}

TEST_F(SessionsRpcTest, TheNumberOfSessionsIsLimited) {
  Limits limits;
  limits.max_sessions = 1;
  StartServer(limits);
  ASSERT_TRUE(CreateSession("a").ok());
  ExpectError(CreateSession("b"), grpc::RESOURCE_EXHAUSTED, reason::kLimitExceeded, "limit", "max_sessions");
}

}  // namespace
}  // namespace dynmesh::testing
