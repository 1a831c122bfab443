// The bulk build gives what adding one by one gives.

#include "core/mesh/bulk_build.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/validate.h"
#include "tests/support/meshes.h"
#include "tests/support/random_edits.h"

namespace dynmesh::testing {
namespace {

/// What a user would put in: vertices, and elements in the order of their ids.
struct Input {
  std::vector<Point> positions;
  std::vector<ElementModel::Element> elements;
};

/// The vertices and elements of a mesh, numbered densely: ids of removed ones are gone.
Input InputOf(const ElementModel& model) {
  Input input;
  std::map<VertexId, VertexId> renumbered;
  for (const auto& [v, position] : model.vertices) {
    renumbered[v] = VertexId(input.positions.size());
    input.positions.push_back(position);
  }
  for (const auto& [id, element] : model.elements) {
    input.elements.push_back(element);
    for (VertexId& v : input.elements.back().vertices) v = renumbered.at(v);
  }
  return input;
}

/// Adds elements by ascending dimension; returns the model, and the ids of what was reported.
struct OneByOne {
  Mesh mesh;
  ElementModel model;
  std::vector<EntityId> degenerate;
  std::vector<EntityId> duplicate;
};

OneByOne AddOneByOne(const Input& input) {
  OneByOne result;
  for (const Point& p : input.positions) result.model.vertices[*result.mesh.AddVertex(p)] = p;
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    for (const auto& element : input.elements) {
      if (KindOf(element.type) != kind) continue;
      const EntityId id = *result.mesh.AddElement(element.type, element.vertices);
      result.model.elements[id] = element;
      if (result.mesh.IsDegenerate(id)) result.degenerate.push_back(id);
      const bool twin = kind == EntityKind::kCell && result.mesh.FindTwin(CellId(id.slot)).valid();
      if (twin || result.mesh.IsDuplicate(id)) result.duplicate.push_back(id);
    }
  }
  Commit(result.mesh);
  return result;
}

absl::StatusOr<BulkResult> TryBuild(const Input& input, const BulkOptions& options) {
  BulkBuilder builder(options);
  DYNMESH_RETURN_IF_ERROR(builder.AddVertices(input.positions));
  for (const auto& element : input.elements) {
    DYNMESH_RETURN_IF_ERROR(builder.AddElements(element.type, element.vertices));
  }
  return std::move(builder).Finish();
}

BulkResult Build(const Input& input, SlotOrder order = SlotOrder::kCaller) {
  BulkOptions options;
  options.order = order;
  absl::StatusOr<BulkResult> result = TryBuild(input, options);
  EXPECT_TRUE(result.ok()) << result.status();
  Commit(result->mesh);
  return *std::move(result);
}

/// The input that a build with SlotOrder::kHilbert made the mesh of.
Input Reordered(const Input& input, const BulkResult& result) {
  Input sorted;
  sorted.positions.resize(input.positions.size());
  for (size_t i = 0; i < input.positions.size(); ++i)
    sorted.positions[result.slots[0][i]] = input.positions[i];
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    const Permutation& slots = result.slots[Dimension(kind)];
    std::vector<ElementModel::Element> elements(slots.size());
    size_t i = 0;
    for (ElementModel::Element element : input.elements) {
      if (KindOf(element.type) != kind) continue;
      for (VertexId& v : element.vertices) v = VertexId(result.slots[0][v.slot()]);
      elements[slots[i++]] = element;
    }
    sorted.elements.insert(sorted.elements.end(), elements.begin(), elements.end());
  }
  return sorted;
}

void ExpectSameAsOneByOne(const Input& input) {
  const OneByOne expected = AddOneByOne(input);
  const BulkResult bulk = Build(input);
  EXPECT_EQ(Describe(bulk.mesh), Describe(expected.mesh));
  EXPECT_EQ(bulk.degenerate, expected.degenerate);
  EXPECT_EQ(bulk.duplicate, expected.duplicate);
  ExpectEqualsOracle(bulk.mesh, expected.model);

  const BulkResult sorted = Build(input, SlotOrder::kHilbert);
  EXPECT_EQ(Describe(sorted.mesh), Describe(AddOneByOne(Reordered(input, sorted)).mesh));
  EXPECT_EQ(sorted.degenerate.size(), expected.degenerate.size());
  EXPECT_EQ(sorted.duplicate.size(), expected.duplicate.size());
  EXPECT_THAT(Validate(sorted.mesh), ::testing::IsEmpty());
}

TEST(BulkBuildTest, EveryTestMeshIsAsAddedOneByOne) {
  for (const NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    ExpectSameAsOneByOne(InputOf(ModelOf(named.mesh)));
  }
}

class BulkBuildRandomTest : public ::testing::TestWithParam<std::vector<ElementType>> {};

TEST_P(BulkBuildRandomTest, RandomMeshesAreAsAddedOneByOne) {
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    RandomEditOptions options;
    options.types = GetParam();
    options.duplicate_rate = 0.02 * (seed % 10);
    options.max_vertices = 4 + seed % 20;
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed, options);
    for (int i = editor.Uniform(200); i >= 0; --i) editor.Edit();
    ExpectSameAsOneByOne(InputOf(model));
    if (HasFailure()) FAIL() << "seed " << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Mixes, BulkBuildRandomTest,
    ::testing::Values(std::vector<ElementType>(std::begin(kElementTypes), std::end(kElementTypes)),
                      std::vector<ElementType>{ElementType::kTetrahedron},
                      std::vector<ElementType>{ElementType::kHexahedron},
                      std::vector<ElementType>{ElementType::kTriangle, ElementType::kQuad},
                      std::vector<ElementType>{ElementType::kTetrahedron, ElementType::kTriangle,
                                               ElementType::kWireEdge}));

/// The same vertices and cells in an order without any locality.
Input Scattered(Input input) {
  std::mt19937 rng(11);
  Permutation order(input.positions.size());
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), rng);
  Input result;
  for (uint32_t from : order) result.positions.push_back(input.positions[from]);
  const Permutation ranks = Inverse(order);
  for (auto& element : input.elements) {
    for (VertexId& v : element.vertices) v = VertexId(ranks[v.slot()]);
  }
  std::shuffle(input.elements.begin(), input.elements.end(), rng);
  result.elements = std::move(input.elements);
  return result;
}

TEST(BulkBuildTest, ScatteredInputIsMatchedInAnotherOrderWithTheSameResult) {
  const Input input = Scattered(InputOf(ModelOf(TetGrid(22, 22, 22))));
  ASSERT_GT(input.elements.size(), 60'000u);  // so many that the order of the walk matters
  const OneByOne expected = AddOneByOne(input);
  const BulkResult bulk = Build(input);
  EXPECT_TRUE(Describe(bulk.mesh) == Describe(expected.mesh));
  EXPECT_THAT(Validate(bulk.mesh), ::testing::IsEmpty());
}

TEST(BulkBuildTest, HilbertOrderKeepsNeighboursTogether) {
  const Input input = Scattered(InputOf(ModelOf(TetGrid(12, 12, 12))));
  const auto jumps = [](const Mesh& mesh) {
    double sum = 0;
    mesh.slots(EntityKind::kEdge).live().ForEach([&](Slot e) {
      const auto ends = mesh.Vertices(EdgeId(e));
      sum += std::abs(double(ends[0].slot()) - double(ends[1].slot()));
    });
    return sum;
  };
  EXPECT_LT(jumps(Build(input, SlotOrder::kHilbert).mesh), jumps(Build(input).mesh) / 4);
}

TEST(BulkBuildTest, EditsAfterABulkBuildWorkAsAfterAnyOther) {
  for (uint32_t seed = 1; seed <= 8; ++seed) {
    Mesh first;
    ElementModel model;
    RandomEditor before(first, model, seed);
    for (int i = 0; i < 120; ++i) before.Edit();
    const Input input = InputOf(model);
    BulkResult bulk = Build(input);
    OneByOne straight = AddOneByOne(input);
    ElementModel bulk_model = straight.model;
    RandomEditor edit_bulk(bulk.mesh, bulk_model, seed), edit_straight(straight.mesh, straight.model, seed);
    for (int batch = 0; batch < 20; ++batch) {
      for (int i = 0; i < 6; ++i) edit_bulk.Edit();
      for (int i = 0; i < 6; ++i) edit_straight.Edit();
      Commit(bulk.mesh);
      Commit(straight.mesh);
      ASSERT_EQ(Describe(bulk.mesh), Describe(straight.mesh)) << "seed " << seed << " batch " << batch;
    }
    ExpectEqualsOracle(bulk.mesh, bulk_model);
  }
}

// ---- Refusals ----

absl::Status RefusedWith(const Input& input, const BulkOptions& options) {
  return TryBuild(input, options).status();
}

TEST(BulkBuildTest, ARefusedDuplicateIsNamed) {
  BulkOptions options;
  options.mesh.duplicates = DuplicatePolicy::kRefuse;
  Input input = InputOf(ModelOf(OneTet()));
  input.elements.push_back({ElementType::kTetrahedron, {VertexId(1), VertexId(0), VertexId(2), VertexId(3)}});
  const absl::Status status = RefusedWith(input, options);
  EXPECT_EQ(ErrorReason(status), reason::kDuplicateElement);
  EXPECT_EQ(GetErrorDetail(status)->Find("position"), "1");
  EXPECT_EQ(GetErrorDetail(status)->Find("ids"), "0");
}

TEST(BulkBuildTest, BadInputIsRefusedBeforeAnythingIsBuilt) {
  BulkBuilder builder({});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Point points[] = {{0, 0, 0}, {0, nan, 0}};
  EXPECT_EQ(GetErrorDetail(builder.AddVertices(points))->Find("position"), "1");
  ASSERT_TRUE(builder.AddVertices({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}).ok());
  EXPECT_EQ(ErrorReason(builder.AddElements(ElementType::kTriangle, {VertexId(0), VertexId(1), VertexId(3)})),
            reason::kUnknownEntity);
  EXPECT_EQ(ErrorReason(builder.AddElements(ElementType::kTriangle, {VertexId(0), VertexId(1)})),
            reason::kBadArrayLength);
  EXPECT_EQ(ErrorReason(builder.AddElements(static_cast<ElementType>(9), {})), reason::kBadElementType);
  const BulkResult result = *std::move(builder).Finish();
  EXPECT_EQ(result.mesh.NumLive(EntityKind::kVertex), 3u);
  EXPECT_EQ(result.mesh.NumLive(EntityKind::kFace), 0u);
}

TEST(BulkBuildTest, LimitsOfEachKindHold) {
  const Input input = InputOf(ModelOf(TetGrid(1, 1, 1)));
  const Mesh mesh = Build(input).mesh;
  for (EntityKind kind : kEntityKinds) {
    BulkOptions options;
    options.mesh.limits.max_slots[Dimension(kind)] = mesh.NumLive(kind);
    EXPECT_TRUE(TryBuild(input, options).ok());
    options.mesh.limits.max_slots[Dimension(kind)] = mesh.NumLive(kind) - 1;
    EXPECT_EQ(RefusedWith(input, options).code(), absl::StatusCode::kResourceExhausted);
  }
}

TEST(BulkBuildTest, ProgressGrowsToTheTotalAndCanEndTheBuild) {
  const Input input = InputOf(ModelOf(TetGrid(18, 18, 18)));
  uint64_t last = 0, total = 0;
  int calls = 0;
  BulkOptions options;
  options.progress = [&](uint64_t done, uint64_t all) {
    EXPECT_GE(done, last);
    last = done;
    total = all;
    ++calls;
    return absl::OkStatus();
  };
  ASSERT_TRUE(TryBuild(input, options).ok());
  EXPECT_GT(calls, 3);
  EXPECT_EQ(last, total);
  int left = 2;
  options.progress = [&](uint64_t, uint64_t) {
    return --left > 0 ? absl::OkStatus() : absl::CancelledError();
  };
  EXPECT_EQ(RefusedWith(input, options).code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace dynmesh::testing
