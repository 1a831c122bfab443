#include "server/session/registry.h"

#include "tests/session/session_support.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> NamesAfter(const SessionRegistry& registry, absl::string_view after, size_t max) {
  std::vector<std::string> names;
  for (const SessionPtr& session : registry.ListAfter(after, max)) names.push_back(session->name());
  return names;
}

TEST(RegistryTest, NamesAreChecked) {
  Daemon daemon;
  const Refusal bad{absl::StatusCode::kInvalidArgument, reason::kBadSessionName};
  for (const std::string& name :
       {std::string(), std::string("-a"), std::string(".a"), std::string("a b"), std::string("a/b"),
        std::string("\xc3\xa9"), std::string("a\0b", 3), std::string(65, 'a')}) {
    EXPECT_EQ(RefusalOf(daemon.registry().Create(name, {}, "")), bad) << name;
    EXPECT_EQ(RefusalOf(daemon.registry().Find(name)), bad) << name;
  }
  for (const std::string& name :
       {std::string("a"), std::string("9"), std::string("A_b.c-d"), std::string(64, 'a')}) {
    EXPECT_TRUE(daemon.registry().Create(name, {}, "").ok()) << name;
  }
}

TEST(RegistryTest, ANameIsTakenOnce) {
  Daemon daemon;
  daemon.NewSession("a");
  EXPECT_EQ(RefusalOf(daemon.registry().Create("a", {}, "")),
            (Refusal{absl::StatusCode::kAlreadyExists, reason::kSessionExists}));
  EXPECT_EQ(RefusalOf(daemon.registry().Find("b")),
            (Refusal{absl::StatusCode::kNotFound, reason::kSessionNotFound}));
}

TEST(RegistryTest, ARetriedCreationGetsTheFirstAnswer) {
  Daemon daemon;
  SessionRegistry& registry = daemon.registry();
  const auto first = registry.Create("a", {}, "id");
  ASSERT_TRUE(first.ok());
  MustApply(**registry.Find("a"), AddTet());
  const auto again = registry.Create("a", {}, "id");
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->etag, first->etag);
  EXPECT_EQ(RefusalOf(registry.Create("b", {}, "id")),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kRequestIdReused}));
  EXPECT_EQ(RefusalOf(registry.Create("a", {DuplicatePolicy::kRefuse}, "id")),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kRequestIdReused}));
}

TEST(RegistryTest, ListsInPagesByName) {
  Daemon daemon;
  for (const char* name : {"d", "a", "c", "b"}) daemon.NewSession(name);
  EXPECT_THAT(NamesAfter(daemon.registry(), "", 3), ElementsAre("a", "b", "c"));
  EXPECT_THAT(NamesAfter(daemon.registry(), "c", 3), ElementsAre("d"));
  EXPECT_THAT(NamesAfter(daemon.registry(), "d", 3), IsEmpty());
  EXPECT_THAT(NamesAfter(daemon.registry(), "bb", 1), ElementsAre("c"));  // after one that was deleted
}

TEST(RegistryTest, ADeletedNameIsFreeAndItsSessionAnother) {
  Daemon daemon;
  const SessionPtr old = daemon.NewSession("a");
  const std::string etag = old->Info()->etag;
  EXPECT_EQ(*daemon.registry().Delete("a", etag), 0);
  EXPECT_EQ(RefusalOf(daemon.registry().Delete("a", "")),
            (Refusal{absl::StatusCode::kNotFound, reason::kSessionNotFound}));
  daemon.NewSession("a");
  EXPECT_EQ(RefusalOf(daemon.registry().Delete("a", etag)),
            (Refusal{absl::StatusCode::kAborted, reason::kEtagMismatch}));
}

TEST(RegistryTest, SessionsAreLimited) {
  Limits limits;
  limits.max_sessions = 2;
  Daemon daemon(limits);
  daemon.NewSession("a");
  daemon.NewSession("b");
  const auto refused = daemon.registry().Create("c", {}, "");
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(refused.status(), "limit"), "max_sessions");
  EXPECT_EQ(MetadataOf(refused.status(), "value"), "2");
  EXPECT_TRUE(daemon.registry().Delete("a", "").ok());
  daemon.NewSession("c");
}

TEST(RegistryTest, DrainRefusesNewSessionsAndEndsFollowers) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession("a");
  RecordingSink sink(daemon.workers(), RecordingSink::Acknowledge::kAtOnce);
  ASSERT_TRUE(sink.Follow(session, {}).ok());
  daemon.registry().Drain();
  const Refusal draining{absl::StatusCode::kUnavailable, reason::kShuttingDown};
  EXPECT_EQ(RefusalOf(sink.AwaitEnd()), draining);
  EXPECT_EQ(RefusalOf(daemon.registry().Create("b", {}, "")), draining);
  RecordingSink late(daemon.workers(), RecordingSink::Acknowledge::kAtOnce);
  EXPECT_EQ(RefusalOf(late.Follow(session, {})), draining);
}

}  // namespace
}  // namespace dynmesh::testing
