// Adaptations of a session: revisions, limits, and others in between.

#include "server/session/adaptation.h"

#include "core/mesh/validate.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

class AdaptationTest : public ::testing::Test {
 protected:
  SessionPtr NewGrid(int n) {
    const SessionPtr session = daemon_.NewSession();
    MustApply(*session, EditsOf(TetGrid(n, n, n)));
    return session;
  }

  absl::StatusOr<std::unique_ptr<Adaptation>> Start(const SessionPtr& session, const AdaptOptions& options) {
    return Adaptation::Start(session, daemon_.registry().adaptation_budget(), options);
  }

  static void ExpectSound(Session& session) {
    EXPECT_TRUE(session
                    .Read([](const SessionView& view) {
                      EXPECT_THAT(Validate(view.mesh), IsEmpty());
                      ExpectEqualsOracle(view.mesh, ModelOf(view.mesh));
                      return absl::OkStatus();
                    })
                    .ok());
  }

  Daemon daemon_;
};

TEST_F(AdaptationTest, AStepThatDoesNothingIsNoRevision) {
  const SessionPtr session = NewGrid(1);
  auto adaptation = Start(session, {.target_length = 1.3});
  ASSERT_TRUE(adaptation.ok());
  while (!(*adaptation)->done()) ASSERT_TRUE((*adaptation)->Step().ok());
  EXPECT_EQ(session->revision(), 1);
}

TEST_F(AdaptationTest, AStepThatTakesTooMuchMemoryIsTakenBack) {
  Limits limits;
  limits.max_session_bytes = 1 << 20;
  Daemon small(limits);
  const SessionPtr session = small.NewSession();
  MustApply(*session, EditsOf(TetGrid(2, 2, 2)));
  auto adaptation = Adaptation::Start(session, small.registry().adaptation_budget(), {.target_length = 0.05});
  ASSERT_TRUE(adaptation.ok()) << adaptation.status();
  const Checksum before = ChecksumOf(*session);
  const absl::Status status = (*adaptation)->Step();
  EXPECT_EQ(RefusalOf(status), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(status, "limit"), "max_session_bytes");
  EXPECT_EQ(ChecksumOf(*session), before);
  ExpectSound(*session);
}

TEST_F(AdaptationTest, WhatWasCommittedStaysWhenItEndsEarly) {
  const SessionPtr session = NewGrid(3);
  {
    auto adaptation = Start(session, {.target_length = 0.5, .max_attempts = 100});
    ASSERT_TRUE(adaptation.ok());
    for (int steps = 0; steps < 3; ++steps) ASSERT_TRUE((*adaptation)->Step().ok());
    EXPECT_FALSE((*adaptation)->done());
  }
  EXPECT_EQ(session->revision(), 4);
  ExpectSound(*session);
}

TEST_F(AdaptationTest, OthersEditInBetween) {
  const SessionPtr session = NewGrid(2);
  auto adaptation = Start(session, {.target_length = 0.5, .max_attempts = 200});
  ASSERT_TRUE(adaptation.ok());
  for (int steps = 0; !(*adaptation)->done(); ++steps) {
    ASSERT_TRUE((*adaptation)->Step().ok());
    if (steps < 20) MustApply(*session, AddTet());
  }
  const absl::StatusOr<AdaptResult> result = (*adaptation)->Finish();
  ASSERT_TRUE(result.ok());
  EXPECT_GT(result->after.share_in_band, result->before.share_in_band);
  ExpectSound(*session);
}

TEST_F(AdaptationTest, TwoOfOneSessionComeToTheirEnds) {
  const SessionPtr session = NewGrid(2);
  auto fine = Start(session, {.target_length = 0.5, .max_passes = 3, .max_attempts = 300});
  auto coarse = Start(session, {.target_length = 1.5, .max_passes = 3, .max_attempts = 300});
  ASSERT_TRUE(fine.ok() && coarse.ok());
  while (!(*fine)->done() || !(*coarse)->done()) {
    for (auto* adaptation : {&fine, &coarse}) {
      if ((**adaptation)->done()) continue;
      ASSERT_TRUE((**adaptation)->Step().ok());
    }
  }
  ExpectSound(*session);
}

TEST_F(AdaptationTest, OnlySoManyAtOnce) {
  const SessionPtr session = NewGrid(1);
  std::vector<std::unique_ptr<Adaptation>> running;
  for (uint32_t i = 0; i < Limits().max_concurrent_adaptations; ++i) {
    auto adaptation = Start(session, {.target_length = 1});
    ASSERT_TRUE(adaptation.ok());
    running.push_back(*std::move(adaptation));
  }
  const auto refused = Start(session, {.target_length = 1});
  EXPECT_EQ(MetadataOf(refused.status(), "limit"), "max_concurrent_adaptations");
  running.pop_back();
  EXPECT_TRUE(Start(session, {.target_length = 1}).ok());
}

TEST_F(AdaptationTest, ADeletedSessionEndsIt) {
  const SessionPtr session = NewGrid(2);
  auto adaptation = Start(session, {.target_length = 0.5, .max_attempts = 10});
  ASSERT_TRUE(adaptation.ok());
  ASSERT_TRUE(session->Delete("").ok());
  EXPECT_EQ(RefusalOf((*adaptation)->Step()),
            (Refusal{absl::StatusCode::kNotFound, reason::kSessionDeleted}));
}

}  // namespace
}  // namespace dynmesh::testing
