#include "server/session/importer/importer.h"

#include <cmath>
#include <limits>
#include <numeric>

#include "core/mesh/validate.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const AttributeSpec kTemperature{"temperature", EntityKind::kVertex, AttributeType::kFloat64, 1};
const AttributeSpec kMaterial{"material", EntityKind::kCell, AttributeType::kInt32, 1};

std::string Positions(int n) {
  std::vector<Point> points;
  for (int i = 0; i < n; ++i) points.push_back({1.0 * i, 1.0 * (i % 3), 1.0 * (i % 2)});
  return BytesOf(points);
}

std::string Ids(const std::vector<Slot>& ids) { return BytesOf(ids); }

class ImporterTest : public ::testing::Test {
 protected:
  std::unique_ptr<Importer> Start(const SessionPtr& session, const ImportOptions& options = {}) {
    auto importer = Importer::Start(session, gate_, options);
    EXPECT_TRUE(importer.ok()) << importer.status();
    return importer.ok() ? *std::move(importer) : nullptr;
  }

  /// One tetrahedron, as staged.
  std::unique_ptr<Importer> StartTet(const SessionPtr& session, const ImportOptions& options = {}) {
    auto importer = Start(session, options);
    EXPECT_TRUE(importer->staged().AddPositions(Positions(4)).ok());
    EXPECT_TRUE(importer->staged().AddElements(ElementType::kTetrahedron, Ids({0, 1, 2, 3})).ok());
    return importer;
  }

  void ExpectStillEmpty(const SessionPtr& session) {
    EXPECT_EQ(session->revision(), 0);
    EXPECT_EQ(ChecksumOf(*session), Checksum());
    MustApply(*session, {AddSomeVertices(1)}, {.validate_only = true});
  }

  Daemon daemon_;
  ImportGate gate_{Limits{.max_concurrent_imports = 2}};
  TestMonitor monitor_;
};

TEST_F(ImporterTest, AnyCutIntoPiecesGivesTheSameSession) {
  const uint32_t seed = 7;
  SCOPED_TRACE(seed);
  std::mt19937 rng(seed);
  int number = 0;
  for (NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    const Mesh expected = ByDimension(named.mesh);
    for (int cut = 0; cut < 4; ++cut) {
      const SessionPtr session = daemon_.NewSession("m" + std::to_string(number++));
      const auto importer = Start(session);
      StageMesh(named.mesh, importer->staged(), rng);
      TestMonitor monitor;
      const auto outcome = importer->Finish(monitor);
      ASSERT_TRUE(outcome.ok()) << outcome.status();
      EXPECT_EQ(outcome->outcome->revision, 1);
      EXPECT_EQ(session->revision(), 1);
      EXPECT_EQ(ChecksumOf(*session), expected.checksum());
      EXPECT_TRUE(session
                      ->Read([&](const SessionView& view) {
                        ExpectEqualsOracle(view.mesh, ModelOf(expected));
                        return absl::OkStatus();
                      })
                      .ok());
    }
  }
}

TEST_F(ImporterTest, ElementIGetsSlotIOfItsKindWhateverOrderTheBlocksHave) {
  const SessionPtr session = daemon_.NewSession();
  const auto importer = Start(session);
  StagedMesh& staged = importer->staged();
  ASSERT_TRUE(staged.AddElements(ElementType::kTetrahedron, Ids({0, 1, 2, 3})).ok());
  ASSERT_TRUE(staged.AddElements(ElementType::kTriangle, Ids({4, 5, 6})).ok());
  ASSERT_TRUE(staged.AddElements(ElementType::kWireEdge, Ids({6, 0})).ok());
  ASSERT_TRUE(staged.AddElements(ElementType::kTriangle, Ids({0, 1, 2})).ok());
  ASSERT_TRUE(staged.AddElements(ElementType::kTetrahedron, Ids({3, 4, 5, 6})).ok());
  ASSERT_TRUE(staged.AddPositions(Positions(7)).ok());
  ASSERT_TRUE(importer->Finish(monitor_).ok());
  ASSERT_TRUE(session
                  ->Read([](const SessionView& view) {
                    const Mesh& mesh = view.mesh;
                    const auto starts_with = [&](EntityId id, Slot first) {
                      return mesh.VerticesOf(id)[0] == VertexId(first);
                    };
                    EXPECT_TRUE(starts_with(EdgeId(0), 6) && mesh.IsElement(EdgeId(0)));
                    EXPECT_TRUE(starts_with(FaceId(0), 4) && mesh.IsElement(FaceId(0)));
                    EXPECT_TRUE(starts_with(FaceId(1), 0) && mesh.IsElement(FaceId(1)));
                    EXPECT_TRUE(starts_with(CellId(0), 0) && starts_with(CellId(1), 3));
                    EXPECT_THAT(Validate(mesh), IsEmpty());
                    return absl::OkStatus();
                  })
                  .ok());
}

TEST_F(ImporterTest, AttributesFollowTheEntities) {
  const SessionPtr session = daemon_.NewSession();
  const auto importer = StartTet(session);
  ASSERT_TRUE(importer->staged().AddRows(kTemperature, BytesOf(std::vector<double>{1, 2})).ok());
  ASSERT_TRUE(importer->staged().AddRows(kMaterial, BytesOf(std::vector<int32_t>{42})).ok());
  ASSERT_TRUE(importer->staged().AddRows(kTemperature, BytesOf(std::vector<double>{3, 4})).ok());
  ASSERT_TRUE(importer->Finish(monitor_).ok());
  ASSERT_TRUE(
      session
          ->Read([](const SessionView& view) {
            const Mesh& mesh = view.mesh;
            const auto row = mesh.attributes()[mesh.FindAttribute("temperature", EntityKind::kVertex)].Row(2);
            const double expected = 3;
            EXPECT_EQ(std::memcmp(row.data(), &expected, 8), 0);
            EXPECT_EQ(mesh.attributes()[mesh.FindAttribute("material", EntityKind::kCell)].Row(0)[0], 42);
            return absl::OkStatus();
          })
          .ok());
}

TEST_F(ImporterTest, HostilePiecesAreRefusedByIndex) {
  const SessionPtr session = daemon_.NewSession();
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const auto expect = [&](const char* why, const char* index, auto stage) {
    const auto importer = StartTet(session);
    const absl::Status status = stage(importer->staged());
    EXPECT_EQ(RefusalOf(status), (Refusal{absl::StatusCode::kInvalidArgument, why})) << status;
    EXPECT_EQ(MetadataOf(status, "index"), index) << status;
    ExpectStillEmpty(session);
  };
  using Doubles = std::vector<double>;
  expect(reason::kNonFinite, "5", [&](StagedMesh& s) {
    return s.AddPositions(BytesOf(Doubles{0, 0, 0, 0, 0, nan}));
  });
  expect(reason::kNonFinite, "4", [&](StagedMesh& s) {
    return s.AddPositions(BytesOf(Doubles{-inf, 0, 0}));
  });
  expect(reason::kBadArrayLength, "5", [](StagedMesh& s) { return s.AddPositions(std::string(25, 0)); });
  expect(reason::kBadArrayLength, "4", [](StagedMesh& s) { return s.AddPositions("x"); });
  expect(reason::kBadArrayLength, "2",
         [](StagedMesh& s) { return s.AddElements(ElementType::kTetrahedron, std::string(20, 0)); });
  expect(reason::kBadArrayLength, "1",
         [](StagedMesh& s) { return s.AddElements(ElementType::kHexahedron, std::string(16, 0)); });
  expect(reason::kBadElementType, "1", [](StagedMesh& s) {
    return s.AddElements(ElementType::kUnspecified, Ids({0, 1}));
  });
  expect(reason::kNonFinite, "1", [&](StagedMesh& s) {
    EXPECT_TRUE(s.AddRows(kTemperature, BytesOf(Doubles{0})).ok());
    return s.AddRows(kTemperature, BytesOf(Doubles{nan}));
  });
  expect(reason::kBadArrayLength, "1",
         [](StagedMesh& s) { return s.AddRows(kTemperature, std::string(9, 0)); });
  expect(reason::kBadArgument, "", [](StagedMesh& s) {
    EXPECT_TRUE(s.AddRows(kTemperature, std::string(8, 0)).ok());
    AttributeSpec other = kTemperature;
    other.components = 2;
    return s.AddRows(other, std::string(16, 0));
  });
  expect(reason::kBadArgument, "", [](StagedMesh& s) {
    EXPECT_TRUE(s.AddRows(kTemperature, std::string(8, 0)).ok());
    AttributeSpec other = kTemperature;
    other.policy = AttributePolicy::kDrop;
    return s.AddRows(other, std::string(8, 0));
  });
}

TEST_F(ImporterTest, HostileWholesAreRefusedByIndex) {
  const SessionPtr session = daemon_.NewSession();
  const auto expect = [&](const char* why, const char* key, const char* value, const ImportOptions& options,
                          auto stage) {
    const auto importer = StartTet(session, options);
    stage(importer->staged());
    const auto outcome = importer->Finish(monitor_);
    EXPECT_EQ(RefusalOf(outcome), (Refusal{absl::StatusCode::kInvalidArgument, why})) << outcome.status();
    EXPECT_EQ(MetadataOf(outcome.status(), key), value) << outcome.status();
    ExpectStillEmpty(session);
  };
  const auto add = [](ElementType type, std::vector<Slot> ids) {
    return [=](StagedMesh& s) { EXPECT_TRUE(s.AddElements(type, Ids(ids)).ok()); };
  };
  const auto nothing = [](StagedMesh&) {};
  expect(reason::kUnknownEntity, "index", "2", {}, add(ElementType::kTriangle, {0, 1, 2, 3, 4, 0}));
  expect(reason::kUnknownEntity, "ids", "4294967295", {}, add(ElementType::kWireEdge, {0, kNoSlot}));
  expect(reason::kUnknownEntity, "ids", "2147483648", {}, add(ElementType::kWireEdge, {0, kNewVertex}));
  expect(reason::kCountMismatch, "field", "num_vertices", {.num_vertices = 5}, nothing);
  expect(reason::kCountMismatch, "actual", "1", {.num_elements = 1'000'000}, nothing);
  expect(reason::kCountMismatch, "attribute", "temperature", {},
         [](StagedMesh& s) { EXPECT_TRUE(s.AddRows(kTemperature, std::string(3 * 8, 0)).ok()); });
  expect(reason::kCountMismatch, "expected", "1", {},
         [](StagedMesh& s) { EXPECT_TRUE(s.AddRows(kMaterial, std::string(2 * 4, 0)).ok()); });
}

TEST_F(ImporterTest, RefusedDuplicatesNameTheElement) {
  const SessionPtr session = daemon_.NewSession("strict", {DuplicatePolicy::kRefuse});
  const auto importer = StartTet(session);
  ASSERT_TRUE(importer->staged().AddElements(ElementType::kTetrahedron, Ids({1, 0, 3, 2})).ok());
  const auto outcome = importer->Finish(monitor_);
  EXPECT_EQ(RefusalOf(outcome), (Refusal{absl::StatusCode::kInvalidArgument, reason::kDuplicateElement}));
  EXPECT_EQ(MetadataOf(outcome.status(), "index"), "1");
  ExpectStillEmpty(session);
}

/// Of the session's vertices and elements, those at the slots that `answer` tells.
void ExpectAtToldSlots(const Session& session, const ImportAnswer& answer, const Mesh& sent) {
  ElementModel expected;
  const auto told = [&](EntityKind kind, Slot item) { return answer.slots[Dimension(kind)].at(item); };
  const ElementModel model = ModelOf(sent);
  for (const auto& [v, position] : model.vertices) {
    expected.vertices[VertexId(told(EntityKind::kVertex, v.slot()))] = position;
  }
  std::array<Slot, kNumEntityKinds> items = {};
  for (const auto& [id, element] : model.elements) {
    auto& at = expected.elements[{id.kind, told(id.kind, items[Dimension(id.kind)]++)}];
    at.type = element.type;
    for (VertexId v : element.vertices) at.vertices.emplace_back(told(EntityKind::kVertex, v.slot()));
  }
  EXPECT_TRUE(session
                  .Read([&](const SessionView& view) {
                    ExpectEqualsOracle(view.mesh, expected);
                    return absl::OkStatus();
                  })
                  .ok());
}

TEST_F(ImporterTest, HilbertOrderGivesSlotsThatTheAnswerTells) {
  std::mt19937 rng(11);
  int number = 0;
  for (NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    const Mesh sent = ByDimension(named.mesh);
    const SessionPtr session = daemon_.NewSession("m" + std::to_string(number++));
    const ImportOptions options{.request_id = "x", .slot_order = SlotOrder::kHilbert};
    const auto importer = Start(session, options);
    StageMesh(sent, importer->staged(), rng);
    TestMonitor monitor, monitor_again;
    const auto answer = importer->Finish(monitor);
    ASSERT_TRUE(answer.ok()) << answer.status();
    ExpectAtToldSlots(*session, *answer, sent);
    const auto retry = Start(session, options);
    StageMesh(sent, retry->staged(), rng);
    const auto again = retry->Finish(monitor_again);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->outcome, answer->outcome);
    EXPECT_EQ(again->slots, answer->slots);
  }
}

TEST_F(ImporterTest, AttributesAndIndicesFollowTheHilbertOrder) {
  const Mesh sent = TetGrid(4, 4, 4);
  const Slot num_vertices = sent.NumLive(EntityKind::kVertex), num_cells = sent.NumLive(EntityKind::kCell);
  std::vector<double> temperatures(num_vertices);
  std::vector<int32_t> materials(num_cells);
  std::iota(temperatures.begin(), temperatures.end(), 0.5);
  std::iota(materials.begin(), materials.end(), 7);
  std::mt19937 rng(1);
  const SessionPtr session = daemon_.NewSession();
  const auto importer = Start(session, {.slot_order = SlotOrder::kHilbert});
  StageMesh(sent, importer->staged(), rng);
  ASSERT_TRUE(importer->staged().AddRows(kTemperature, BytesOf(temperatures)).ok());
  ASSERT_TRUE(importer->staged().AddRows(kMaterial, BytesOf(materials)).ok());
  const auto answer = importer->Finish(monitor_);
  ASSERT_TRUE(answer.ok()) << answer.status();
  EXPECT_FALSE(std::is_sorted(answer->slots[0].begin(), answer->slots[0].end()));
  const auto read = session->Read([&](const SessionView& view) {
    const auto& columns = view.mesh.attributes();
    for (Slot v = 0; v < num_vertices; ++v) {
      EXPECT_EQ(std::memcmp(columns[0].Row(answer->slots[0][v]).data(), &temperatures[v], 8), 0);
    }
    for (Slot c = 0; c < num_cells; ++c) {
      EXPECT_EQ(std::memcmp(columns[1].Row(answer->slots[3][c]).data(), &materials[c], 4), 0);
    }
    return absl::OkStatus();
  });
  EXPECT_TRUE(read.ok());
}

TEST_F(ImporterTest, ARefusedDuplicateIsNamedByItsPlaceInTheImportInAnyOrder) {
  const SessionPtr session = daemon_.NewSession("strict", {DuplicatePolicy::kRefuse});
  std::mt19937 rng(1);
  const auto importer = Start(session, {.slot_order = SlotOrder::kHilbert});
  const Mesh grid = TetGrid(3, 3, 3);
  StageMesh(grid, importer->staged(), rng);
  std::vector<Slot> again;
  for (VertexId v : grid.Vertices(CellId(77))) again.push_back(v.slot());
  ASSERT_TRUE(importer->staged().AddElements(ElementType::kTetrahedron, Ids(again)).ok());
  const auto outcome = importer->Finish(monitor_);
  EXPECT_EQ(RefusalOf(outcome), (Refusal{absl::StatusCode::kInvalidArgument, reason::kDuplicateElement}));
  const std::string count = absl::StrCat(grid.NumLive(EntityKind::kCell));
  EXPECT_EQ(MetadataOf(outcome.status(), "index"), count);
  ExpectStillEmpty(session);
}

TEST_F(ImporterTest, AnImportStoresWhatTheSessionStores) {
  const Relation stored{EntityKind::kVertex, EntityKind::kCell};
  const SessionPtr session = daemon_.NewSession("stored", {.stored_relations = {stored}});
  const auto answer = StartTet(session)->Finish(monitor_);
  ASSERT_TRUE(answer.ok()) << answer.status();
  ASSERT_EQ(answer->outcome->info.stored_relations.size(), 1u);
  EXPECT_EQ(answer->outcome->info.stored_relations[0].relation, stored);
  EXPECT_GT(answer->outcome->info.stored_relations[0].memory_bytes, 0u);
  EXPECT_EQ(session->Info()->settings.stored_relations, std::vector<Relation>{stored});
}

TEST_F(ImporterTest, OddElementsAreKeptWithAWarning) {
  const SessionPtr session = daemon_.NewSession();
  const auto importer = StartTet(session);
  ASSERT_TRUE(importer->staged().AddElements(ElementType::kTetrahedron, Ids({0, 1, 2, 3, 0, 1, 2, 2})).ok());
  ASSERT_TRUE(importer->staged().AddElements(ElementType::kTriangle, Ids({0, 1, 2, 2, 1, 0})).ok());
  const auto outcome = importer->Finish(monitor_);
  ASSERT_TRUE(outcome.ok()) << outcome.status();
  const auto& warnings = outcome->outcome->warnings;
  ASSERT_EQ(warnings.size(), 3u);
  EXPECT_EQ(warnings[0].warning, WarningKind::kDuplicateElement);
  EXPECT_EQ(warnings[0].kind, EntityKind::kFace);
  EXPECT_THAT(warnings[0].ids, ElementsAre(1));
  EXPECT_EQ(warnings[1].kind, EntityKind::kCell);
  EXPECT_THAT(warnings[1].ids, ElementsAre(1));
  EXPECT_EQ(warnings[2].warning, WarningKind::kDegenerateElement);
  EXPECT_THAT(warnings[2].ids, ElementsAre(2));
  EXPECT_EQ(warnings[2].count, 1u);
}

TEST_F(ImporterTest, OnlyANewSessionCanBeFilled) {
  const SessionPtr session = daemon_.NewSession();
  const auto slow = StartTet(session);
  MustApply(*session, {AddSomeVertices(1)});
  const Checksum before = ChecksumOf(*session);
  const Refusal not_empty{absl::StatusCode::kFailedPrecondition, reason::kSessionNotEmpty};
  EXPECT_EQ(RefusalOf(Importer::Start(session, gate_, {})), not_empty);
  EXPECT_EQ(RefusalOf(slow->Finish(monitor_)), not_empty);
  EXPECT_EQ(ChecksumOf(*session), before);
}

TEST_F(ImporterTest, ValidateOnlyTellsTheResultAndLeavesTheSessionEmpty) {
  TestMonitor again;
  const SessionPtr session = daemon_.NewSession();
  const auto outcome = StartTet(session, {.validate_only = true})->Finish(monitor_);
  ASSERT_TRUE(outcome.ok());
  EXPECT_EQ(outcome->outcome->revision, 0);
  EXPECT_EQ(outcome->outcome->info.counts[3], 1u);
  ExpectStillEmpty(session);
  ASSERT_TRUE(StartTet(session)->Finish(again).ok());
  EXPECT_EQ(ChecksumOf(*session), outcome->outcome->info.checksum);
}

TEST_F(ImporterTest, ARetryGetsTheFirstAnswerHoweverItIsCut) {
  const SessionPtr session = daemon_.NewSession();
  const Mesh mesh = HybridOfFour();
  std::mt19937 rng(3);
  std::shared_ptr<const ImportOutcome> first;
  for (int attempt = 0; attempt < 3; ++attempt) {
    const auto importer = Start(session, {.request_id = "x"});
    StageMesh(mesh, importer->staged(), rng);
    const auto outcome = importer->Finish(monitor_);
    ASSERT_TRUE(outcome.ok()) << outcome.status();
    if (first == nullptr) first = outcome->outcome;
    EXPECT_EQ(outcome->outcome, first);
  }
  EXPECT_EQ(RefusalOf(StartTet(session, {.request_id = "x"})->Finish(monitor_)),
            (Refusal{absl::StatusCode::kInvalidArgument, reason::kRequestIdReused}));
  EXPECT_EQ(RefusalOf(StartTet(session, {.request_id = "y"})->Finish(monitor_)),
            (Refusal{absl::StatusCode::kFailedPrecondition, reason::kSessionNotEmpty}));
  EXPECT_EQ(session->revision(), 1);
}

TEST_F(ImporterTest, CancellingABuildLeavesTheSessionEmpty) {
  const SessionPtr session = daemon_.NewSession();
  const Mesh mesh = TetGrid(20, 20, 20);
  std::mt19937 rng(1);
  auto importer = Start(session);
  StageMesh(mesh, importer->staged(), rng);
  TestMonitor monitor;
  monitor.CancelAtReport(2);
  const auto outcome = importer->Finish(monitor);
  EXPECT_EQ(outcome.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(monitor.reports(), 2);
  ExpectStillEmpty(session);
}

TEST_F(ImporterTest, DeletingTheSessionMeanwhileIsSaid) {
  const SessionPtr session = daemon_.NewSession();
  const auto importer = StartTet(session);
  ASSERT_TRUE(daemon_.registry().Delete("mesh", "").ok());
  EXPECT_EQ(RefusalOf(importer->Finish(monitor_)),
            (Refusal{absl::StatusCode::kNotFound, reason::kSessionDeleted}));
}

TEST_F(ImporterTest, ImportsAtOnceAreLimited) {
  const SessionPtr session = daemon_.NewSession();
  auto first = Start(session);
  const auto second = Start(session);
  const auto third = Importer::Start(session, gate_, {});
  EXPECT_EQ(RefusalOf(third), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}));
  EXPECT_EQ(MetadataOf(third.status(), "limit"), "max_concurrent_imports");
  first = nullptr;
  EXPECT_TRUE(Importer::Start(session, gate_, {}).ok());
}

TEST(ImporterLimitsTest, LimitsAreNamedBeforeAndWhileReceiving) {
  Limits limits;
  limits.max_vertices = 10;
  limits.max_edges = limits.max_faces = 100;
  limits.max_cells = 1;
  limits.max_session_bytes = 1 << 20;
  Daemon daemon(limits);
  ImportGate gate(Limits{.max_concurrent_imports = 2});
  const SessionPtr session = daemon.NewSession();
  const auto expect = [](const absl::Status& status, const char* limit) {
    EXPECT_EQ(RefusalOf(status), (Refusal{absl::StatusCode::kResourceExhausted, reason::kLimitExceeded}))
        << status;
    EXPECT_EQ(MetadataOf(status, "limit"), limit);
  };
  expect(Importer::Start(session, gate, {.num_vertices = 11}).status(), "max_vertices");
  expect(Importer::Start(session, gate, {.num_elements = ~uint64_t{0}}).status(), "max_cells");
  const auto importer = Importer::Start(session, gate, {.num_vertices = 10, .num_elements = 201});
  ASSERT_TRUE(importer.ok());
  StagedMesh& staged = (*importer)->staged();
  expect(staged.AddPositions(Positions(11)), "max_vertices");
  expect(staged.AddElements(ElementType::kTetrahedron, Ids({0, 1, 2, 3, 0, 1, 2, 3})), "max_cells");
  expect(staged.AddElements(ElementType::kQuad, std::string(101 * 16, 0)), "max_faces");
  absl::Status status;
  for (int i = 0; i < 100'000 && status.ok(); ++i) status = staged.AddElements(ElementType::kQuad, "");
  expect(status, "max_session_bytes");  // empty pieces are not free
}

}  // namespace
}  // namespace dynmesh::testing
