#include "server/session/session.h"

#include <unistd.h>

#include "core/mesh/validate.h"
#include "server/session/fingerprint.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class SessionTest : public ::testing::Test {
 protected:
  /// Fails unless `call` is refused with this code and reason, and changes nothing.
  template <typename Fn>
  ErrorDetail ExpectRefused(Session& session, absl::StatusCode code, const char* why, Fn call) {
    const int64_t revision = session.revision();
    const Checksum checksum = ChecksumOf(session);
    const absl::Status status = call();
    EXPECT_EQ(RefusalOf(status), (Refusal{code, why})) << status;
    EXPECT_EQ(session.revision(), revision);
    EXPECT_EQ(ChecksumOf(session), checksum);
    return GetErrorDetail(status).value_or(ErrorDetail());
  }

  ErrorDetail ExpectApplyRefused(Session& session, absl::StatusCode code, const char* why,
                                 const std::vector<Edit>& edits, const ApplyOptions& options = {}) {
    return ExpectRefused(session, code, why, [&] { return session.Apply(edits, options).status(); });
  }

  Daemon daemon_;
};

TEST_F(SessionTest, EachBatchIsOneRevision) {
  const SessionPtr session = daemon_.NewSession();
  EXPECT_EQ(session->revision(), 0);
  const auto first = MustApply(*session, AddTet());
  EXPECT_EQ(first->revision, 1);
  EXPECT_THAT(first->results[0].new_slots, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(first->checksum, ChecksumOf(*session));
  EXPECT_EQ(MustApply(*session, AddTet())->revision, 2);
  EXPECT_EQ(session->revision(), 2);
}

TEST_F(SessionTest, RelationsAreSwitchedAtAnyMomentWithoutARevision) {
  const SessionPtr session = daemon_.NewSession();
  const Relation vertex_cells{EntityKind::kVertex, EntityKind::kCell};
  const Relation cell_cells{EntityKind::kCell, EntityKind::kCell};
  const auto stored = [&] { return session->Info()->settings.stored_relations; };
  MustApply(*session, AddTet());
  const uint64_t before = session->Info()->memory_bytes;
  ASSERT_TRUE(session->StoreRelations({cell_cells, vertex_cells}, "").ok());
  EXPECT_THAT(stored(), ElementsAre(vertex_cells, cell_cells));
  MustApply(*session, AddTet());
  const absl::StatusOr<SessionInfo> info = session->Info();
  EXPECT_EQ(info->revision, 2);
  uint64_t tables = 0;
  for (const StoredRelation& relation : info->stored_relations) tables += relation.memory_bytes;
  EXPECT_GT(tables, 0u);
  EXPECT_GE(info->memory_bytes, before + tables);
  ASSERT_TRUE(session->StoreRelations({cell_cells}, info->etag).ok());
  EXPECT_THAT(stored(), ElementsAre(cell_cells));
  ASSERT_TRUE(session->StoreRelations({}, "").ok());
  EXPECT_THAT(stored(), IsEmpty());
  EXPECT_EQ(session->revision(), 2);
}

TEST_F(SessionTest, ASwitchThatIsRefusedChangesNothing) {
  const Relation first{EntityKind::kCell, EntityKind::kEdge};
  const auto fill = [&](Session& session) {
    MustApply(session, AddTet());
    MustApply(session, {AddSomeVertices(20'000)});
    ASSERT_TRUE(session.StoreRelations({first}, "").ok());
  };
  const SessionPtr probe = daemon_.NewSession();
  fill(*probe);
  Daemon daemon(Limits{.max_session_bytes = probe->Info()->memory_bytes + 1000});
  const SessionPtr session = daemon.NewSession();
  fill(*session);
  ExpectRefused(*session, absl::StatusCode::kAborted, reason::kEtagMismatch,
                [&] { return session->StoreRelations({}, "another"); });
  const ErrorDetail limit =
      ExpectRefused(*session, absl::StatusCode::kResourceExhausted, reason::kLimitExceeded,
                    [&] { return session->StoreRelations(kStorableRelations, ""); });
  EXPECT_EQ(limit.Find("limit"), "max_session_bytes");
  EXPECT_THAT(session->Info()->settings.stored_relations, ElementsAre(first));
  ASSERT_TRUE(daemon.registry().Delete(session->name(), "").ok());
  EXPECT_EQ(session->StoreRelations({}, "").code(), absl::StatusCode::kNotFound);
}

/// Says no after so many questions.
class StopAfter final : public StopSignal {
 public:
  explicit StopAfter(int questions) : questions_(questions) {}
  absl::Status Check() const override { return --questions_ < 0 ? absl::CancelledError() : absl::OkStatus(); }

 private:
  mutable int questions_;
};

TEST_F(SessionTest, ASwitchThatNobodyWaitsForEndsAndChangesNothing) {
  const SessionPtr session = daemon_.NewSession();
  Mesh mesh = TetGrid(9, 9, 9);
  ASSERT_TRUE(session->Adopt(mesh).ok());
  const Relation first{EntityKind::kCell, EntityKind::kEdge}, second{EntityKind::kCell, EntityKind::kCell};
  for (int questions : {0, 1, 5, 19}) {
    const absl::Status stopped = session->StoreRelations({first, second}, "", StopAfter(questions));
    EXPECT_EQ(stopped.code(), absl::StatusCode::kCancelled) << questions;
    EXPECT_THAT(session->Info()->settings.stored_relations, IsEmpty());
  }
  EXPECT_TRUE(session->StoreRelations({first, second}, "", StopAfter(1000)).ok());
}

TEST_F(SessionTest, TablesThatWouldNotFitAreRefusedBeforeTheyTakeMemory) {
  Mesh crowd;  // every tetrahedron on the face is across it from every other
  AddVertices(crowd, 403);
  for (Slot apex = 3; apex < 403; ++apex) Add(crowd, ElementType::kTetrahedron, {0, 1, 2, apex});
  Commit(crowd);
  const uint64_t bytes = crowd.memory_bytes();
  Daemon daemon(Limits{.max_session_bytes = bytes + 400 * 399 * sizeof(Slot)});
  const SessionPtr session = daemon.NewSession();
  ASSERT_TRUE(session->Adopt(crowd).ok());
  const Relation cells{EntityKind::kCell, EntityKind::kCell};
  EXPECT_EQ(RefusalOf(session->StoreRelations({cells}, "")),
            (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(session->Info()->memory_bytes, bytes);
}

TEST_F(SessionTest, AnUpdateChangesTheEtag) {
  const SessionPtr session = daemon_.NewSession();
  const std::string before = session->Info()->etag;
  ASSERT_TRUE(session->StoreRelations({kStorableRelations[0]}, before).ok());
  EXPECT_NE(session->Info()->etag, before);
  ExpectRefused(*session, absl::StatusCode::kAborted, reason::kEtagMismatch,
                [&] { return session->StoreRelations({kStorableRelations[1]}, before); });
}

TEST_F(SessionTest, ABatchWithoutEditsAnswersWithTheCurrentState) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  const auto answer = MustApply(*session, {});
  EXPECT_EQ(answer->revision, 1);
  EXPECT_EQ(answer->checksum, ChecksumOf(*session));
  EXPECT_THAT(answer->counts, ElementsAre(4, 6, 4, 1));
  EXPECT_EQ(session->revision(), 1);
}

TEST_F(SessionTest, IfRevisionRefusesWhenSomebodyWasFaster) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet(), {.if_revision = 0});
  const ErrorDetail detail = ExpectApplyRefused(*session, absl::StatusCode::kAborted,
                                                reason::kRevisionMismatch, AddTet(), {.if_revision = 0});
  EXPECT_EQ(detail.Find("expected"), "0");
  EXPECT_EQ(detail.Find("actual"), "1");
  ExpectApplyRefused(*session, absl::StatusCode::kAborted, reason::kRevisionMismatch, AddTet(),
                     {.if_revision = -7});
}

TEST_F(SessionTest, AsOfRevisionRefusesIdsWhoseOccupantIsYounger) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  MustApply(*session, {RemoveElementsEdit{EntityKind::kCell, {0}}});
  MustApply(*session, {AddElementsEdit{ElementType::kTetrahedron, {0, 1, 2, 3}}});
  const std::vector<Edit> remove = {RemoveElementsEdit{EntityKind::kCell, {0}}};
  const ErrorDetail detail = ExpectApplyRefused(*session, absl::StatusCode::kNotFound, reason::kEntityRemoved,
                                                remove, {.as_of_revision = 1});
  EXPECT_EQ(detail.Find("ids"), "0");
  EXPECT_EQ(detail.Find("edit"), "0");
  EXPECT_EQ(detail.Find("index"), "0");
  MustApply(*session, remove, {.as_of_revision = 3});
}

TEST_F(SessionTest, AsOfRevisionMustNotLieInTheFuture) {
  const SessionPtr session = daemon_.NewSession();
  const ErrorDetail detail = ExpectApplyRefused(*session, absl::StatusCode::kOutOfRange,
                                                reason::kRevisionInFuture, AddTet(), {.as_of_revision = 1});
  EXPECT_EQ(detail.Find("requested"), "1");
  EXPECT_EQ(detail.Find("actual"), "0");
  ExpectApplyRefused(*session, absl::StatusCode::kInvalidArgument, reason::kBadArgument, AddTet(),
                     {.as_of_revision = -1});
}

TEST_F(SessionTest, ValidateOnlyTellsTheResultAndChangesNothing) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  const Checksum before = ChecksumOf(*session);
  const auto would_be = MustApply(*session, AddTet(), {.validate_only = true});
  EXPECT_EQ(would_be->revision, 1);
  EXPECT_EQ(ChecksumOf(*session), before);
  EXPECT_EQ(session->revision(), 1);
  const auto is = MustApply(*session, AddTet());
  EXPECT_EQ(is->checksum, would_be->checksum);
  EXPECT_EQ(is->results[1].new_slots, would_be->results[1].new_slots);
}

TEST_F(SessionTest, ARetryGetsTheFirstAnswer) {
  const SessionPtr session = daemon_.NewSession();
  const ApplyOptions options{.if_revision = 0, .request_id = "one"};
  const auto first = MustApply(*session, AddTet(), options);
  MustApply(*session, AddTet());
  const auto again = MustApply(*session, AddTet(), options);
  EXPECT_EQ(again->revision, first->revision);
  EXPECT_EQ(again->checksum, first->checksum);
  EXPECT_EQ(session->revision(), 2);
}

TEST_F(SessionTest, ARequestIdWithOtherContentIsRefused) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet(), {.request_id = "one"});
  ExpectApplyRefused(*session, absl::StatusCode::kInvalidArgument, reason::kRequestIdReused,
                     {AddSomeVertices(1)}, {.request_id = "one"});
  ExpectApplyRefused(*session, absl::StatusCode::kInvalidArgument, reason::kRequestIdReused, AddTet(),
                     {.as_of_revision = 1, .request_id = "one"});
}

TEST_F(SessionTest, ARefusedBatchDoesNotUseUpItsRequestId) {
  const SessionPtr session = daemon_.NewSession();
  ExpectApplyRefused(*session, absl::StatusCode::kAborted, reason::kRevisionMismatch, AddTet(),
                     {.if_revision = 5, .request_id = "one"});
  MustApply(*session, AddTet(), {.validate_only = true});
  EXPECT_EQ(MustApply(*session, AddTet(), {.request_id = "one"})->revision, 1);
}

TEST_F(SessionTest, OldAnswersAreForgotten) {
  const SessionPtr session = daemon_.NewSession();
  const std::vector<Edit> edits = {AddSomeVertices(1)};
  for (size_t i = 0; i <= kRememberedAnswers; ++i) {
    MustApply(*session, edits, {.request_id = "id" + std::to_string(i)});
  }
  const int64_t revision = session->revision();
  MustApply(*session, edits, {.request_id = "id1"});
  EXPECT_EQ(session->revision(), revision);
  MustApply(*session, edits, {.request_id = "id0"});
  EXPECT_EQ(session->revision(), revision + 1);
}

TEST_F(SessionTest, ALongRequestIdIsRefused) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet(), {.request_id = std::string(128, 'x')});
  ExpectApplyRefused(*session, absl::StatusCode::kInvalidArgument, reason::kBadArgument, AddTet(),
                     {.request_id = std::string(129, 'x')});
}

TEST(FingerprintTest, TellsEditsApart) {
  const auto of = [](const std::vector<Edit>& edits) {
    Fingerprint fingerprint;
    for (const Edit& edit : edits) fingerprint.AddEdit(edit);
    return fingerprint.value();
  };
  const AttributeSpec spec{"a", EntityKind::kVertex, AttributeType::kInt32, 1};
  const std::vector<std::vector<Edit>> all = {
      {},
      {AddSomeVertices(1)},
      {AddSomeVertices(1), AddSomeVertices(1)},
      {AddSomeVertices(2)},
      {RemoveVerticesEdit{{1, 2}}},
      {RemoveVerticesEdit{{1}}, RemoveVerticesEdit{{2}}},
      {MoveVerticesEdit{{1}, {{0, 0, 0}}}},
      {AddElementsEdit{ElementType::kTriangle, {1, 2, 3}}},
      {RemoveElementsEdit{EntityKind::kFace, {1, 2}}},
      {RemoveElementsEdit{EntityKind::kCell, {1, 2}}},
      {AddAttributeEdit{spec}},
      {AddAttributeEdit{{"a", EntityKind::kVertex, AttributeType::kInt32, 1, AttributePolicy::kMax}}},
      {AddAttributeEdit{
          {"a", EntityKind::kVertex, AttributeType::kInt32, 1, AttributePolicy::kCopy, {1, 0, 0, 0}}}},
      {SetAttributeEdit{spec, {1}, {0, 0, 0, 1}}},
  };
  for (size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(of(all[i]), of(all[i]));
    for (size_t j = 0; j < i; ++j) EXPECT_NE(of(all[i]), of(all[j])) << i << " " << j;
  }
}

TEST_F(SessionTest, RefusalsOfTheMeshNameTheEditAndTheItem) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  const ErrorDetail detail =
      ExpectApplyRefused(*session, absl::StatusCode::kFailedPrecondition, reason::kVertexInUse,
                         {AddSomeVertices(2), RemoveVerticesEdit{{kNewVertex | 1, 2}}});
  EXPECT_EQ(detail.Find("edit"), "1");
  EXPECT_EQ(detail.Find("index"), "1");
  EXPECT_EQ(detail.Find("ids"), "2");
}

TEST_F(SessionTest, BatchLimitsAreNamed) {
  Limits limits;
  limits.max_batch_edits = 2;
  limits.max_batch_items = 10;
  limits.max_vertices = 20;
  Daemon daemon(limits);
  const SessionPtr session = daemon.NewSession();
  const auto expect_limit = [&](const char* limit, const std::vector<Edit>& edits) {
    const ErrorDetail detail =
        ExpectApplyRefused(*session, absl::StatusCode::kResourceExhausted, reason::kLimitExceeded, edits);
    EXPECT_EQ(detail.Find("limit"), limit);
  };
  expect_limit("max_batch_edits", {AddSomeVertices(1), AddSomeVertices(1), AddSomeVertices(1)});
  expect_limit("max_batch_items", {AddSomeVertices(6), AddSomeVertices(5)});
  MustApply(*session, {AddSomeVertices(10)});
  MustApply(*session, {AddSomeVertices(9)});
  expect_limit("max_vertices", {AddSomeVertices(2)});
}

TEST_F(SessionTest, ASessionThatGrewTooLargeTakesRemovalsOnly) {
  Limits limits;
  limits.max_session_bytes = 100'000;
  Daemon daemon(limits);
  const SessionPtr session = daemon.NewSession();
  absl::Status status;
  for (int i = 0; i < 10'000 && status.ok(); ++i)
    status = session->Apply({AddSomeVertices(500)}, {}).status();
  EXPECT_EQ(RefusalOf(status), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(status, "limit"), "max_session_bytes");
  MustApply(*session, {RemoveVerticesEdit{{0, 1, 2}}});
}

TEST_F(SessionTest, FewRowsOfManyPagesAreForeseen) {
  Limits limits;
  limits.max_session_bytes = 40 << 20;
  Daemon daemon(limits);
  const SessionPtr session = daemon.NewSession();
  MustApply(*session, {AddSomeVertices(300'000)});
  const AttributeSpec spec{"wide", EntityKind::kVertex, AttributeType::kFloat64, 16};
  MustApply(*session, {AddAttributeEdit{spec}});
  std::vector<Edit> near, far;
  for (Slot slot = 0; slot < 500; ++slot) {
    near.push_back(SetAttributeEdit{spec, {slot}, std::vector<uint8_t>(spec.row_bytes())});
    far.push_back(SetAttributeEdit{spec, {slot * 600}, std::vector<uint8_t>(spec.row_bytes())});
  }
  const auto refused = session->Apply(far, {});
  EXPECT_EQ(RefusalOf(refused), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(refused.status(), "limit"), "max_session_bytes");
  MustApply(*session, near);  // one page, however many edits
  EXPECT_LT(session->Info()->memory_bytes, limits.max_session_bytes);
  far.resize(100);
  const uint64_t before = session->Info()->memory_bytes;
  MustApply(*session, far);
  EXPECT_GE(session->Info()->memory_bytes, before + 99 * 64 * 1024);  // what was foreseen
}

TEST_F(SessionTest, DefaultsFitTheMachine) {
  EXPECT_LE(Limits().max_session_bytes, uint64_t{64} << 30);
  EXPECT_LE(Limits().max_session_bytes,
            static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGESIZE) / 4 * 3);
}

TEST_F(SessionTest, DeleteEndsEverything) {
  const SessionPtr session = daemon_.NewSession();
  MustApply(*session, AddTet());
  const auto info = session->Info();
  ASSERT_TRUE(info.ok());
  MustApply(*session, AddTet());
  const auto stale = session->Delete(info->etag);
  EXPECT_EQ(RefusalOf(stale), (Refusal{absl::StatusCode::kAborted, reason::kEtagMismatch}));
  const auto deleted = session->Delete(session->Info()->etag);
  ASSERT_TRUE(deleted.ok());
  EXPECT_EQ(*deleted, 2);
  const Refusal gone{absl::StatusCode::kNotFound, reason::kSessionDeleted};
  EXPECT_EQ(RefusalOf(session->Apply(AddTet(), {})), gone);
  EXPECT_EQ(RefusalOf(session->Info()), gone);
  EXPECT_EQ(RefusalOf(session->Delete("")), gone);
}

TEST_F(SessionTest, InfoDescribesTheMesh) {
  const SessionPtr session = daemon_.NewSession("cube");
  MustApply(*session, EditsOf(TetGrid(2, 2, 2)));
  MustApply(*session, {AddAttributeEdit{{"t", EntityKind::kCell, AttributeType::kInt32, 1}}});
  const auto info = session->Info();
  ASSERT_TRUE(info.ok()) << info.status();
  EXPECT_EQ(info->name, "cube");
  EXPECT_EQ(info->revision, 2);
  EXPECT_THAT(info->counts, ElementsAre(27, 98, 120, 48));
  EXPECT_THAT(info->element_counts, ElementsAre(0, 0, 0, 48));
  EXPECT_THAT(info->boundary_counts, ElementsAre(26, 72, 48, 0));
  EXPECT_EQ(info->euler_characteristic, 1);
  EXPECT_EQ(info->estimated_counts[0], 27u);
  EXPECT_GT(info->estimated_counts[1], 50u);
  EXPECT_EQ(info->checksum, ChecksumOf(*session));
  EXPECT_GT(info->memory_bytes, 1000u);
  EXPECT_EQ(info->attributes.size(), 1u);
  EXPECT_EQ(info->bounds->low, (Point{0, 0, 0}));
  EXPECT_EQ(info->bounds->high, (Point{2, 2, 2}));
  EXPECT_GE(info->update_time, info->create_time);
}

TEST_F(SessionTest, AnEmptySessionHasNoBounds) {
  EXPECT_FALSE(daemon_.NewSession()->Info()->bounds.has_value());
}

TEST_F(SessionTest, RandomBatchesLeaveASoundMesh) {
  const uint32_t seed = 20240611;
  SCOPED_TRACE(seed);
  const SessionPtr session = daemon_.NewSession();
  RandomBatches batches(seed);
  int applied = 0;
  for (int i = 0; i < 400; ++i) {
    const auto result = session->Apply(batches.Next(), {.as_of_revision = session->revision()});
    result.ok() ? batches.Applied(**result) : batches.Refused();
    applied += result.ok();
  }
  EXPECT_EQ(session->revision(), applied);
  EXPECT_GT(applied, 200);
  EXPECT_TRUE(session
                  ->Read([](const SessionView& view) {
                    EXPECT_THAT(Validate(view.mesh), IsEmpty());
                    return absl::OkStatus();
                  })
                  .ok());
}

}  // namespace
}  // namespace dynmesh::testing
