#include "server/session/durability/answer_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/error.h"
#include "server/session/durability/log_record.h"
#include "server/session/durability/manifest.h"

namespace dynmesh::testing {
namespace {

/// One of everything.
BatchResult FullResult() {
  BatchResult result;
  result.revision = 17;
  EditResult edit;
  edit.new_slots = {3, 4, kNoSlot};
  edit.lineage = {{{EntityKind::kCell, 9}, {EntityKind::kCell, 2}},
                  {{EntityKind::kFace, 7}, {EntityKind::kFace, 1}}};
  edit.skipped = {1, 5};
  edit.refusals = {{1, FailedPrecondition(reason::kBoundary, "it is on the boundary", {{"ids", "7"}})},
                   {5, absl::InternalError("without detail")}};
  edit.num_moved = 6;
  result.results = {edit, EditResult()};
  result.checksum.topology = 0x0123456789abcdef;
  result.checksum.geometry = 42;
  result.counts = {1, 2, 3, 4};
  result.num_made = 5;
  result.degenerate = {{EntityKind::kFace, 11}};
  result.duplicate = {{EntityKind::kEdge, 12}, {EntityKind::kCell, 13}};
  result.warnings = {{3, "min_dihedral", EntityKind::kCell, 5.0, {1, 2}, {0.5, 0.25}, 9}};
  return result;
}

RepairOutcome FullOutcome() {
  RepairOutcome outcome;
  outcome.revision = 4;
  outcome.reports.resize(2);
  outcome.reports[0].Add(RepairFinding::kMerged, {EntityKind::kVertex, 5});
  outcome.reports[0].Add(RepairFinding::kMerged, {EntityKind::kVertex, 6});
  outcome.reports[0].Add(RepairFinding::kFilled, {EntityKind::kEdge, 7});
  outcome.counts = {9, 8, 7, 6};
  return outcome;
}

/// Every prefix is refused, and every flipped byte is refused or gives another answer: nothing worse.
template <typename Decode>
void ExpectHarmlessWhenDamaged(const std::string& bytes, Decode decode) {
  for (size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(decode(bytes.substr(0, length))) << length;
  }
  EXPECT_FALSE(decode(bytes + '\0'));
  for (size_t at = 0; at < bytes.size(); ++at) {
    for (const uint8_t mask : {0x01, 0x80, 0xff}) {
      std::string damaged = bytes;
      damaged[at] = static_cast<char>(damaged[at] ^ mask);
      decode(damaged);
    }
  }
}

TEST(AnswerCodecTest, ABatchResultIsTheSameAgain) {
  const BatchResult result = FullResult();
  const std::string bytes = EncodeAnswer(result);
  const auto decoded = DecodeBatchResult(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(EncodeAnswer(*decoded), bytes);
  ASSERT_EQ(decoded->results.size(), 2u);
  const EditResult& edit = decoded->results[0];
  EXPECT_EQ(edit.new_slots, result.results[0].new_slots);
  ASSERT_EQ(edit.lineage.size(), 2u);
  EXPECT_EQ(edit.lineage[1].parent, (EntityId{EntityKind::kFace, 1}));
  EXPECT_EQ(edit.skipped, result.results[0].skipped);
  ASSERT_EQ(edit.refusals.size(), 2u);
  EXPECT_EQ(edit.refusals[0].status, result.results[0].refusals[0].status);
  EXPECT_EQ(ErrorReason(edit.refusals[0].status), reason::kBoundary);
  EXPECT_EQ(edit.refusals[1].status, result.results[0].refusals[1].status);
  EXPECT_EQ(edit.num_moved, 6u);
  EXPECT_EQ(decoded->checksum, result.checksum);
  EXPECT_EQ(decoded->counts, result.counts);
  EXPECT_EQ(decoded->duplicate, result.duplicate);
  ASSERT_EQ(decoded->warnings.size(), 1u);
  EXPECT_EQ(decoded->warnings[0].name, "min_dihedral");
  EXPECT_EQ(decoded->warnings[0].values, result.warnings[0].values);
}

TEST(AnswerCodecTest, ARepairAndAMoveInHistoryAreTheSameAgain) {
  const std::string repair = EncodeAnswer(FullOutcome());
  const auto outcome = DecodeRepairOutcome(repair);
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  EXPECT_EQ(EncodeAnswer(*outcome), repair);
  EXPECT_EQ(outcome->reports[0].Count(RepairFinding::kMerged), 2u);
  EXPECT_EQ(outcome->reports[0].Of(RepairFinding::kFilled).entities[0], (EntityId{EntityKind::kEdge, 7}));
  const std::string history = EncodeAnswer(HistoryResult{8, 2, {}, {1, 2, 3, 4}, 5, 6, 7});
  const auto moved = DecodeHistoryResult(history);
  ASSERT_TRUE(moved.ok()) << moved.status();
  EXPECT_EQ(EncodeAnswer(*moved), history);
  EXPECT_EQ(moved->redoable_batches, 6u);
  EXPECT_EQ(moved->target_revision, 7);
}

TEST(AnswerCodecTest, DamagedAnswersDoNoHarm) {
  ExpectHarmlessWhenDamaged(EncodeAnswer(FullResult()),
                            [](absl::string_view bytes) { return DecodeBatchResult(bytes).ok(); });
  ExpectHarmlessWhenDamaged(EncodeAnswer(FullOutcome()),
                            [](absl::string_view bytes) { return DecodeRepairOutcome(bytes).ok(); });
  ExpectHarmlessWhenDamaged(EncodeAnswer(HistoryResult{}),
                            [](absl::string_view bytes) { return DecodeHistoryResult(bytes).ok(); });
}

TEST(LogRecordTest, ARecordIsTheSameAgainAndADamagedOneDoesNoHarm) {
  const LogRecord record{
      absl::FromUnixMicros(123456789), {LoggedCall::kRepair, "id", 99, "answer", {"ann", "why"}}, "batch"};
  const std::string bytes = EncodeLogRecord(record);
  const auto decoded = DecodeLogRecord(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->commit_time, record.commit_time);
  EXPECT_EQ(decoded->request.call, LoggedCall::kRepair);
  EXPECT_EQ(decoded->request.request_id, "id");
  EXPECT_EQ(decoded->request.fingerprint, 99u);
  EXPECT_EQ(decoded->request.answer, "answer");
  EXPECT_EQ(decoded->request.note, (RevisionNote{"ann", "why"}));
  EXPECT_EQ(decoded->batch, "batch");
  for (size_t length = 0; length + record.batch.size() < bytes.size(); ++length) {
    EXPECT_FALSE(DecodeLogRecord(absl::string_view(bytes).substr(0, length)).ok()) << length;
  }
  std::string newer = bytes;
  newer[0] = 2;
  EXPECT_EQ(DecodeLogRecord(newer).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST(LogRecordTest, AnOriginIsTheSameAgainAndADamagedOneDoesNoHarm) {
  const Origin origin{
      7, 99, absl::FromUnixMicros(5), {LoggedCall::kImport, "id", 3, "answer", {"ann", "why"}}};
  const std::string bytes = EncodeOrigin(origin);
  const auto decoded = DecodeOrigin(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(EncodeOrigin(*decoded), bytes);
  EXPECT_EQ(decoded->revision, 7);
  EXPECT_EQ(decoded->bytes, 99u);
  EXPECT_EQ(decoded->request.answer, "answer");
  ExpectHarmlessWhenDamaged(bytes, [](absl::string_view b) { return DecodeOrigin(b).ok(); });
  EXPECT_FALSE(DecodeOrigin(bytes + "x").ok());
}

ImportOutcome FullImport() {
  ImportOutcome outcome;
  outcome.revision = outcome.info.revision = 1;
  outcome.info.name = "mesh";
  outcome.info.uid = "0123456789abcdef";
  outcome.info.etag = "etag";
  outcome.info.create_time = absl::FromUnixMicros(5);
  outcome.info.update_time = absl::FromUnixMicros(6);
  outcome.info.settings.durability = SessionDurability::kSync;
  outcome.info.settings.stored_relations = {kStorableRelations[1]};
  outcome.info.stored_relations = {{kStorableRelations[1], 1234}};
  outcome.info.counts = {1, 2, 3, 4};
  outcome.info.euler_characteristic = -2;
  outcome.info.attributes = {{.name = "heat", .kind = EntityKind::kCell, .components = 3}};
  outcome.info.bounds = Box{{0, 0, 0}, {1, 2, 3}};
  outcome.warnings = {{WarningKind::kDuplicateElement, EntityKind::kFace, {4, 5}, 9}};
  return outcome;
}

TEST(AnswerCodecTest, AnImportIsAnsweredTheSameAgainAndADamagedAnswerDoesNoHarm) {
  const std::string bytes = EncodeAnswer(FullImport());
  const auto decoded = DecodeImportOutcome(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(EncodeAnswer(*decoded), bytes);
  EXPECT_EQ(decoded->info.stored_relations[0].memory_bytes, 1234u);
  EXPECT_EQ(decoded->info.bounds->high[2], 3);
  EXPECT_EQ(decoded->warnings[0].ids, (std::vector<Slot>{4, 5}));
  ExpectHarmlessWhenDamaged(bytes, [](absl::string_view b) { return DecodeImportOutcome(b).ok(); });
}

TEST(ManifestTest, AnIdentityIsTheSameAgainAndADamagedOneDoesNoHarm) {
  SessionIdentity identity{"0123456789abcdef", absl::FromUnixMicros(5), {}, "create", 77};
  identity.settings.durability = SessionDurability::kAsync;
  identity.settings.duplicates = DuplicatePolicy::kRefuse;
  identity.settings.stored_relations = {kStorableRelations[2], kStorableRelations[0]};
  ASSERT_TRUE(identity.settings.checks.Set(CheckKind::kMinDihedral, {Severity::kReject, 0.25}).ok());
  identity.settings.retention = {7, absl::Microseconds(1500), 1 << 20};
  identity.create_revision = 300;
  const std::string bytes = EncodeIdentity(identity);
  const auto decoded = DecodeIdentity(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(EncodeIdentity(*decoded), bytes);
  EXPECT_EQ(decoded->uid, identity.uid);
  EXPECT_EQ(decoded->request_id, "create");
  EXPECT_TRUE(decoded->settings.checks == identity.settings.checks);
  EXPECT_EQ(decoded->settings.stored_relations, identity.settings.stored_relations);
  EXPECT_EQ(decoded->settings.retention, identity.settings.retention);
  EXPECT_EQ(decoded->create_revision, 300);
  ExpectHarmlessWhenDamaged(bytes, [](absl::string_view b) { return DecodeIdentity(b).ok(); });
}

TEST(ManifestTest, AManifestIsTheSameAgain) {
  const auto decoded = DecodeManifest(EncodeManifest({absl::FromUnixMicros(9), "head", 12}));
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->commit_time, absl::FromUnixMicros(9));
  EXPECT_EQ(decoded->head, "head");
  EXPECT_EQ(decoded->newest, 12);
  EXPECT_FALSE(DecodeManifest("").ok());
}

}  // namespace
}  // namespace dynmesh::testing
