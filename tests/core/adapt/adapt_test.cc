// Adaptation: edges come to their length, and nothing that is to be kept is lost.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/adapt/adapter.h"
#include "core/edit/geometry.h"
#include "core/edit/transaction.h"
#include "core/mesh/validate.h"
#include "core/mesh/vector.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/shaped_meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

/// What an adaptation keeps.
struct Form {
  double measure = 0;   ///< sum of areas or volumes
  int num_turned = 0;   ///< cells that are not oriented as their template
  double boundary = 0;  ///< sum of the areas of boundary faces
  double features = 0;  ///< sum of the lengths of feature edges
  std::vector<Point> corners;
};

Form FormOf(const Mesh& mesh) {
  Form form;
  ForEachAdaptable(mesh, [&](EntityId element) {
    form.measure += WithPoints(mesh, element, Measure);
    form.num_turned += element.kind == EntityKind::kCell && WithPoints(mesh, element, Orientation) != 1;
  });
  mesh.Boundary(EntityKind::kFace).ForEach([&](Slot f) {
    form.boundary += WithPoints(mesh, EntityId(EntityKind::kFace, f), Measure);
  });
  const Features features(mesh, AdaptOptions().feature_angle);
  mesh.slots(EntityKind::kEdge).live().ForEach([&](Slot e) {
    if (features.Has(EdgeId(e))) form.features += WithPoints(mesh, EdgeId(e), Measure);
  });
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
    if (features.StratumOf(mesh, VertexId(v)) == Stratum::kCorner) {
      form.corners.push_back(mesh.Position(VertexId(v)));
    }
  });
  std::sort(form.corners.begin(), form.corners.end());
  return form;
}

void ExpectSameForm(const Mesh& mesh, const Form& before) {
  const Form after = FormOf(mesh);
  EXPECT_NEAR(after.measure, before.measure, 1e-12 * std::abs(before.measure));
  EXPECT_NEAR(after.boundary, before.boundary, 1e-12 * before.boundary);
  EXPECT_NEAR(after.features, before.features, 1e-12 * before.features);
  EXPECT_EQ(after.corners, before.corners);
  EXPECT_EQ(after.num_turned, 0);
}

/// One step as one revision.
absl::Status Step(Adapter& adapter, Mesh& mesh) {
  mesh.BeginBatch();
  const absl::Status status = adapter.Step(mesh);
  if (!status.ok()) {
    mesh.Rollback();
    return status;
  }
  return mesh.Commit();
}

/// Adapts to the end; after each step the mesh is sound.
AdaptResult Adapt(Mesh& mesh, const AdaptOptions& options) {
  auto adapter = Adapter::Start(mesh, options);
  EXPECT_TRUE(adapter.ok()) << adapter.status();
  if (!adapter.ok()) return {};
  while (!(*adapter)->done()) {
    const absl::Status status = Step(**adapter, mesh);
    EXPECT_TRUE(status.ok()) << status;
    EXPECT_THAT(Validate(mesh), IsEmpty());
    if (::testing::Test::HasFailure()) break;
  }
  return (*adapter)->Finish(mesh);
}

double MeanLength(const Mesh& mesh) {
  return MeasureShape(mesh, *Sizing::Make(mesh, {.target_length = 1})).mean_length;
}

TEST(AdaptTest, ACubeComesToHalfAndDoubleItsMeanLengthWithoutAChangeOfItsForm) {
  for (double factor : {0.5, 2.0}) {
    for (uint32_t seed = 1; seed <= 2; ++seed) {
      SCOPED_TRACE(::testing::Message() << "factor " << factor << " seed " << seed);
      Mesh mesh = GradedCube(factor < 1 ? 3 : 7);
      Shake(mesh, 0.25, seed);
      const Form before = FormOf(mesh);
      const AdaptResult result = Adapt(mesh, {.target_length = factor * MeanLength(mesh)});
      ExpectSameForm(mesh, before);
      ExpectEqualsOracle(mesh, ModelOf(mesh));
      EXPECT_GE(result.after.smallest_angle, std::min(result.before.smallest_angle, Adapter::kSafeAngle));
      EXPECT_GT(result.after.share_in_band, factor < 1 ? 0.8 : 0.6);
      EXPECT_GT(result.after.share_in_band, result.before.share_in_band);
      EXPECT_EQ(result.before.num_elements < result.after.num_elements, factor < 1);
    }
  }
}

TEST(AdaptTest, AnglesAreNoWorseThanAtTheStart) {
  for (uint32_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    Mesh mesh = GradedCube(4);
    Shake(mesh, 0.6, seed);
    const double start = SmallestAngleOf(mesh);
    ASSERT_LT(start, Adapter::kSafeAngle);
    auto adapter = Adapter::Start(mesh, {.target_length = 0.2});
    ASSERT_TRUE(adapter.ok());
    while (!(*adapter)->done()) {
      ASSERT_TRUE(Step(**adapter, mesh).ok());
      EXPECT_GE(SmallestAngleOf(mesh), start);
    }
    EXPECT_GT(SmallestAngleOf(mesh), start);
  }
}

TEST(AdaptTest, SharpEdgesAndCornersOfABlockStay) {
  for (double length : {0.3, 1.0}) {
    SCOPED_TRACE(length);
    Mesh mesh = LBlock(2);
    Shake(mesh, 0.2, 5);
    const Form before = FormOf(mesh);
    EXPECT_EQ(before.corners.size(), 14);
    EXPECT_NEAR(before.measure, 7, 1e-12);
    EXPECT_NEAR(before.features, 30, 1e-12);
    Adapt(mesh, {.target_length = length});
    ExpectSameForm(mesh, before);
    ExpectEqualsOracle(mesh, ModelOf(mesh));
  }
}

TEST(AdaptTest, ASphereStaysRound) {
  for (double factor : {0.6, 2.0}) {
    SCOPED_TRACE(factor);
    Mesh mesh = Sphere(factor < 1 ? 3 : 4);
    const AdaptResult result = Adapt(mesh, {.target_length = factor * MeanLength(mesh)});
    EXPECT_GT(result.after.share_in_band, 0.9);
    EXPECT_GT(result.after.least_quality, 0.5);
    EXPECT_NEAR(FormOf(mesh).measure, 4 * std::acos(-1), 0.5);
    mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
      const Point p = mesh.Position(VertexId(v));
      EXPECT_NEAR(std::sqrt(Dot(p, p)), 1, 0.05);
    });
    const int64_t euler = int64_t{mesh.NumLive(EntityKind::kVertex)} - mesh.NumLive(EntityKind::kEdge) +
                          mesh.NumLive(EntityKind::kFace);
    EXPECT_EQ(euler, 2);
    ExpectEqualsOracle(mesh, ModelOf(mesh));
  }
}

/// A vertex attribute that holds how long edges shall be.
void SetSizes(Mesh& mesh, double (*size)(const Point&)) {
  ASSERT_TRUE(mesh.AddAttribute({"size", EntityKind::kVertex, AttributeType::kFloat64, 1}).ok());
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
    const double value = size(mesh.Position(VertexId(v)));
    std::array<uint8_t, sizeof(value)> row;
    std::memcpy(row.data(), &value, sizeof(value));
    ASSERT_TRUE(mesh.SetAttribute(0, v, row).ok());
  });
  Commit(mesh);
}

TEST(AdaptTest, AnAttributeSaysWhereEdgesAreShort) {
  Mesh mesh = GradedCube(4);
  SetSizes(mesh, [](const Point& p) { return 0.1 + 0.4 * p[2]; });
  const AdaptResult result = Adapt(mesh, {.size_attribute = "size"});
  EXPECT_GT(result.after.share_in_band, 0.7);
  double sums[2] = {0, 0}, counts[2] = {0, 0};
  mesh.slots(EntityKind::kEdge).live().ForEach([&](Slot e) {
    const auto ends = mesh.Vertices(EdgeId(e));
    const double height = (mesh.Position(ends[0])[2] + mesh.Position(ends[1])[2]) / 2;
    if (height > 0.25 && height < 0.75) return;
    sums[height > 0.5] += WithPoints(mesh, EdgeId(e), Measure);
    ++counts[height > 0.5];
  });
  EXPECT_LT(2 * sums[0] / counts[0], sums[1] / counts[1]);
}

TEST(AdaptTest, TheSameMeshGivesTheSameResult) {
  std::string first;
  for (int time = 0; time < 2; ++time) {
    Mesh mesh = GradedCube(3);
    Adapt(mesh, {.target_length = 0.2});
    if (time == 0) first = Describe(mesh);
    EXPECT_EQ(Describe(mesh), first);
  }
}

TEST(AdaptTest, APassIsARevisionUnlessItIsLarge) {
  Mesh mesh = GradedCube(4);
  const AdaptResult result = Adapt(mesh, {.target_length = 0.4});
  EXPECT_LE(mesh.revision(), 2 + result.passes + 1);
  Mesh other = GradedCube(4);
  auto adapter = Adapter::Start(other, {.target_length = 0.4, .max_attempts = 10});
  ASSERT_TRUE(adapter.ok());
  ASSERT_TRUE(Step(**adapter, other).ok());
  EXPECT_FALSE((*adapter)->done());
  EXPECT_LE((*adapter)->progress().done, 10);
}

TEST(AdaptTest, OthersMayEditBetweenSteps) {
  Mesh mesh = GradedCube(4);
  auto adapter = Adapter::Start(mesh, {.target_length = 0.15, .max_attempts = 200});
  ASSERT_TRUE(adapter.ok());
  for (int steps = 0; !(*adapter)->done(); ++steps) {
    ASSERT_TRUE(Step(**adapter, mesh).ok());
    if (steps < 30 && steps % 3 == 0) {
      const Slot cell = mesh.slots(EntityKind::kCell).live().Next(steps);
      const auto removed = ApplyBatch(mesh, {Edit(RemoveElementsEdit{EntityKind::kCell, {cell}})}, {});
      ASSERT_TRUE(removed.ok()) << removed.status();
    }
    EXPECT_THAT(Validate(mesh), IsEmpty());
  }
  EXPECT_EQ(FormOf(mesh).num_turned, 0);
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

TEST(AdaptTest, AnElementOfOthersThatIsNoSimplexEndsIt) {
  Mesh mesh = GradedCube(3);
  auto adapter = Adapter::Start(mesh, {.target_length = 0.15, .max_attempts = 50});
  ASSERT_TRUE(adapter.ok());
  ASSERT_TRUE(Step(**adapter, mesh).ok());
  Add(mesh, ElementType::kWireEdge, {0, 1});
  Commit(mesh);
  EXPECT_EQ(ErrorReason(Step(**adapter, mesh)), reason::kElementInTheWay);
}

TEST(AdaptTest, NoMoreElementsThanPermitted) {
  Mesh mesh = GradedCube(3);
  const AdaptResult result = Adapt(mesh, {.target_length = 1e-6, .max_elements = 1000});
  EXPECT_EQ(result.end, AdaptEnd::kMaxElements);
  EXPECT_LT(result.after.num_elements, 1200);
  EXPECT_GE(result.after.num_elements, 900);
}

TEST(AdaptTest, AMeshThatIsAsItShallBeIsLeftAlone) {
  Mesh mesh = Sphere(3);
  Adapt(mesh, {.target_length = MeanLength(mesh)});
  Mesh again = mesh.Clone();
  const AdaptResult result = Adapt(again, {.target_length = MeanLength(mesh), .max_passes = 1});
  EXPECT_LT(result.counts.splits + result.counts.collapses, mesh.NumLive(EntityKind::kEdge) / 100);
}

TEST(AdaptTest, OtherElementsAreRefusedByTheirIds) {
  EXPECT_EQ(ErrorReason(CheckAdaptable(HexGrid(1, 1, 1))), reason::kNotSimplex);
  EXPECT_EQ(ErrorReason(CheckAdaptable(HybridOfFour())), reason::kNotSimplex);
  EXPECT_EQ(ErrorReason(CheckAdaptable(MoebiusStrip(5))), reason::kNotSimplex);
  const absl::Status danglers = CheckAdaptable(TetWithDanglers());
  EXPECT_EQ(ErrorReason(danglers), reason::kElementInTheWay);
  EXPECT_EQ(GetErrorDetail(danglers)->Find("kind"), "face");
  EXPECT_FALSE(GetErrorDetail(danglers)->Find("ids").empty());
}

TEST(AdaptTest, FlatElementsDoNotKeepItFromItsEnd) {
  struct Flat {
    std::vector<Point> points;
    std::vector<std::array<VertexId, 3>> triangles;
  };
  const auto triangle = [](Slot a, Slot b, Slot c) {
    return std::array<VertexId, 3>{VertexId(a), VertexId(b), VertexId(c)};
  };
  const Flat flats[] = {
      {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}}, {triangle(0, 1, 2), triangle(0, 3, 1)}},
      {{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1, 0}, {1, -1, 0}},
       {triangle(0, 1, 2), triangle(0, 2, 3), triangle(0, 4, 2)}},
      {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0, 0}},
       {triangle(0, 2, 3), triangle(0, 1, 2), triangle(0, 4, 1)}}};
  for (const Flat& flat : flats) {
    Mesh mesh;
    for (const Point& p : flat.points) ASSERT_TRUE(mesh.AddVertex(p).ok());
    for (const auto& corners : flat.triangles) {
      ASSERT_TRUE(mesh.AddElement(ElementType::kTriangle, corners).ok());
    }
    Commit(mesh);
    const AdaptResult result = Adapt(mesh, {.target_length = 0.3, .max_passes = 3});
    EXPECT_LE(result.passes, 3);
    EXPECT_LT(mesh.NumElements(EntityKind::kFace), 1000u);
  }
}

TEST(AdaptTest, ElementsThatNameAVertexTwiceAreRefusedByTheirIds) {
  Mesh mesh;
  AddVertices(mesh, 3);
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  const EntityId degenerate = Add(mesh, ElementType::kTriangle, {0, 0, 1});
  Commit(mesh);
  const absl::Status refused = CheckAdaptable(mesh);
  EXPECT_EQ(ErrorReason(refused), reason::kDegenerateElement);
  EXPECT_EQ(GetErrorDetail(refused)->Find("ids"), std::to_string(degenerate.slot));
}

TEST(AdaptTest, OptionsThatMakeNoSenseAreRefused) {
  const double nan = std::nan("");
  Mesh mesh = GradedCube(1);
  SetSizes(mesh, [](const Point& p) { return p[0]; });
  const AdaptOptions bad[] = {{},
                              {.target_length = -1},
                              {.target_length = nan},
                              {.target_length = 1, .size_attribute = "size"},
                              {.size_attribute = "size"},
                              {.size_attribute = "none"},
                              {.target_length = 1, .min_quality = 2},
                              {.target_length = 1, .min_quality = nan},
                              {.target_length = 1, .feature_angle = 4},
                              {.target_length = 1, .max_passes = 0}};
  for (const AdaptOptions& options : bad) EXPECT_FALSE(Adapter::Start(mesh, options).ok());
}

TEST(AdaptTest, BrokenMeshesStaySound) {
  for (NamedMesh& named : AllMeshes()) {
    if (!CheckAdaptable(named.mesh).ok()) continue;
    SCOPED_TRACE(named.name);
    for (double length : {0.4, 3.0}) {
      Mesh mesh = named.mesh.Clone();
      Adapt(mesh, {.target_length = length, .max_passes = 3});
      ExpectEqualsOracle(mesh, ModelOf(mesh));
    }
  }
  Mesh empty;
  EXPECT_EQ(Adapt(empty, {.target_length = 1}).counts.all(), 0);
}

}  // namespace
}  // namespace dynmesh::testing
