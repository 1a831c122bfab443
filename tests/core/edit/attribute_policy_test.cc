// What becomes of attributes where operators make entities of others: the policies one by one, then on a
// split, a collapse, a merger and a split of elements, and for edges and faces below them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/edit/convert_rows.h"
#include "core/edit/mix_rows.h"
#include "core/edit/transaction.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/rows.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

constexpr EntityKind V = EntityKind::kVertex, E = EntityKind::kEdge, F = EntityKind::kFace,
                     C = EntityKind::kCell;

template <typename Scalar>
constexpr AttributeType TypeOf() {
  if (std::is_same_v<Scalar, double>) return AttributeType::kFloat64;
  if (std::is_same_v<Scalar, float>) return AttributeType::kFloat32;
  if (std::is_same_v<Scalar, int64_t>) return AttributeType::kInt64;
  return std::is_same_v<Scalar, int32_t> ? AttributeType::kInt32 : AttributeType::kUint8;
}

// ---- Policies ----

template <typename Scalar>
struct Parent {
  Scalar value;
  double weight;
};

/// One component, by a policy whose default row is 99.
template <typename Scalar>
Scalar Mix(AttributePolicy policy, std::initializer_list<Parent<Scalar>> parents) {
  const AttributeColumn column({"a", V, TypeOf<Scalar>(), 1, policy, RowOf<Scalar>({99})});
  std::vector<std::vector<uint8_t>> rows;
  for (const auto& parent : parents) rows.push_back(RowOf<Scalar>({parent.value}));
  std::vector<RowShare> shares;
  for (const auto& parent : parents) shares.push_back({rows[shares.size()], parent.weight});
  return ValuesOf<Scalar>(MixRows(column, shares))[0];
}

template <typename Scalar>
class MixRowsTest : public ::testing::Test {};
using Scalars = ::testing::Types<double, int32_t, float, int64_t, uint8_t>;
TYPED_TEST_SUITE(MixRowsTest, Scalars);

TYPED_TEST(MixRowsTest, EachPolicyDoesWhatItSays) {
  using P = AttributePolicy;
  const bool is_float = std::is_floating_point_v<TypeParam>;
  EXPECT_EQ(Mix<TypeParam>(P::kInterpolate, {{10, 0.75}, {20, 0.25}}), is_float ? TypeParam(12.5) : 13);
  EXPECT_EQ(Mix<TypeParam>(P::kInterpolate, {{20, 0.25}, {10, 0.75}}), is_float ? TypeParam(12.5) : 13);
  EXPECT_EQ(Mix<TypeParam>(P::kInterpolate, {{10, 0.8}, {20, 0.2}}), 12);
  EXPECT_EQ(Mix<TypeParam>(P::kCopy, {{10, 0.25}, {20, 0.75}}), 20);
  EXPECT_EQ(Mix<TypeParam>(P::kCopy, {{10, 0.5}, {20, 0.5}}), 10);
  EXPECT_EQ(Mix<TypeParam>(P::kMax, {{10, 1}, {20, 0}}), 20);
  EXPECT_EQ(Mix<TypeParam>(P::kDrop, {{10, 0.5}, {20, 0.5}}), 99);
  EXPECT_EQ(Mix<TypeParam>(P::kUnspecified, {{10, 0.25}, {20, 0.75}}), is_float ? TypeParam(17.5) : 20);
}

TYPED_TEST(MixRowsTest, ExtremesStayWithinTheirParents) {
  using P = AttributePolicy;
  const TypeParam high = std::numeric_limits<TypeParam>::max(),
                  low = std::numeric_limits<TypeParam>::lowest();
  EXPECT_EQ(Mix<TypeParam>(P::kInterpolate, {{high, 0.1}, {high, 0.2}, {high, 0.7}}), high);
  EXPECT_EQ(Mix<TypeParam>(P::kInterpolate, {{low, 0.1}, {low, 0.2}, {low, 0.7}}), low);
  EXPECT_EQ(Mix<TypeParam>(P::kInterpolate, {{low, 1}, {high, 0}}), low);
  EXPECT_EQ(Mix<TypeParam>(P::kInterpolate, {{low, 0}, {high, 1}}), high);
  EXPECT_EQ(Mix<TypeParam>(P::kMax, {{low, 0.5}, {high, 0.5}}), high);
  const double middle = 0.5 * low + 0.5 * high;
  EXPECT_NEAR(Mix<TypeParam>(P::kInterpolate, {{low, 0.5}, {high, 0.5}}), middle, 0.5);
}

TYPED_TEST(MixRowsTest, RandomRowsInterpolateBetweenTheirParents) {
  std::mt19937_64 rng(31);
  for (int round = 0; round < 1000; ++round) {
    TypeParam values[3];
    const uint64_t bits[3] = {rng(), rng(), rng()};
    for (int i = 0; i < 3; ++i) std::memcpy(&values[i], &bits[i], sizeof(values[i]));
    if (!std::all_of(values, values + 3, [](TypeParam v) { return std::isfinite(static_cast<double>(v)); }))
      continue;
    const double a = std::uniform_real_distribution<>(0, 0.5)(rng),
                 b = std::uniform_real_distribution<>(0, 0.5)(rng);
    const TypeParam mixed = Mix<TypeParam>(AttributePolicy::kInterpolate,
                                           {{values[0], a}, {values[1], b}, {values[2], 1 - a - b}});
    EXPECT_GE(mixed, *std::min_element(values, values + 3)) << "round " << round;
    EXPECT_LE(mixed, *std::max_element(values, values + 3)) << "round " << round;
  }
}

TEST(ConvertRowsTest, ValuesStayExactlyWhatTheyAreOrAreRefused) {
  const auto convert = [](const std::vector<uint8_t>& rows, AttributeType from, AttributeType to) {
    return ConvertRows(rows, from, {"a", V, to, 1});
  };
  using T = AttributeType;
  EXPECT_EQ(*convert(RowOf<int64_t>({-5, 7}), T::kInt64, T::kInt32), RowOf<int32_t>({-5, 7}));
  EXPECT_EQ(*convert(RowOf<int64_t>({int64_t{1} << 53}), T::kInt64, T::kFloat64),
            RowOf<double>({9007199254740992.0}));
  EXPECT_EQ(*convert(RowOf<double>({0.5, -1e300}), T::kFloat64, T::kFloat64), RowOf<double>({0.5, -1e300}));
  EXPECT_EQ(*convert(RowOf<double>({0.5, 255}), T::kFloat64, T::kFloat32), RowOf<float>({0.5, 255}));
  EXPECT_EQ(*convert(RowOf<float>({3, 255}), T::kFloat32, T::kUint8), RowOf<uint8_t>({3, 255}));
  const auto index = [&](const std::vector<uint8_t>& rows, T from, T to) {
    const absl::Status status = convert(rows, from, to).status();
    EXPECT_EQ(ErrorReason(status), reason::kInexactValue);
    return std::string(GetErrorDetail(status)->Find("index"));
  };
  EXPECT_EQ(index(RowOf<int64_t>({1, int64_t{1} << 31}), T::kInt64, T::kInt32), "1");
  EXPECT_EQ(index(RowOf<int64_t>({std::numeric_limits<int64_t>::max()}), T::kInt64, T::kFloat64), "0");
  EXPECT_EQ(index(RowOf<double>({1, 2, 0.1}), T::kFloat64, T::kFloat32), "2");
  EXPECT_EQ(index(RowOf<double>({1e300}), T::kFloat64, T::kFloat32), "0");
  EXPECT_EQ(index(RowOf<double>({9223372036854775808.0}), T::kFloat64, T::kInt64), "0");
  EXPECT_EQ(index(RowOf<double>({1, 0.5}), T::kFloat64, T::kInt64), "1");
  EXPECT_EQ(index(RowOf<double>({std::nan("")}), T::kFloat64, T::kUint8), "0");
  EXPECT_EQ(index(RowOf<int32_t>({-1}), T::kInt32, T::kUint8), "0");
}

// ---- Operators ----

constexpr AttributePolicy kPolicies[] = {AttributePolicy::kInterpolate, AttributePolicy::kCopy,
                                         AttributePolicy::kMax, AttributePolicy::kDrop};
const char* const kNames[] = {"interpolate", "copy", "max", "drop"};

/// Columns of int32 of one kind, one for each policy, all rows -1 by default; the i-th live entity has 10 +
/// i.
void AddColumns(Mesh& mesh, EntityKind kind) {
  for (int i = 0; i < 4; ++i) {
    ASSERT_TRUE(
        mesh.AddAttribute({kNames[i], kind, AttributeType::kInt32, 1, kPolicies[i], RowOf<int32_t>({-1})})
            .ok());
    const int column = mesh.FindAttribute(kNames[i], kind);
    int32_t value = 10;
    mesh.slots(kind).live().ForEach(
        [&](Slot slot) { ASSERT_TRUE(mesh.SetAttribute(column, slot, RowOf<int32_t>({value++})).ok()); });
  }
  Commit(mesh);
}

int32_t ValueAt(const Mesh& mesh, int policy, EntityId id) {
  EXPECT_TRUE(mesh.IsLive(id));
  return ValuesAt<int32_t>(mesh, mesh.FindAttribute(kNames[policy], id.kind), id.slot)[0];
}

std::vector<int32_t> ByPolicy(const Mesh& mesh, EntityId id) {
  std::vector<int32_t> values;
  for (int i = 0; i < 4; ++i) values.push_back(ValueAt(mesh, i, id));
  return values;
}

BatchResult Apply(Mesh& mesh, const Edit& edit) {
  const auto result = ApplyBatch(mesh, {edit}, {});
  EXPECT_TRUE(result.ok()) << result.status();
  ExpectEqualsOracle(mesh, ModelOf(mesh));
  return result.ok() ? *result : BatchResult();
}

TEST(PolicyTest, TheNewVertexOfASplitEdge) {
  Mesh mesh = OneTet();
  AddColumns(mesh, V);  // 10 and 13 at the ends
  const BatchResult result = Apply(mesh, SplitEdgesEdit{{{}, {0, 3}}, {0.75}, {}, {}});
  EXPECT_THAT(ByPolicy(mesh, VertexId(result.results[0].new_slots[0])), ElementsAre(12, 13, 13, -1));
  EXPECT_THAT(ByPolicy(mesh, VertexId(0)), ElementsAre(10, 10, 10, 10)) << "parents keep theirs";
}

TEST(PolicyTest, TheNewVertexOfASplitElement) {
  Mesh mesh = OneTet();
  AddColumns(mesh, V);  // 10, 11, 12, 13
  const BatchResult result = Apply(mesh, SplitElementsEdit{C, {0}, {}, {}});
  EXPECT_THAT(ByPolicy(mesh, VertexId(result.results[0].new_slots[0])), ElementsAre(12, 10, 13, -1));
}

TEST(PolicyTest, TheKeptVertexOfACollapse) {
  for (double t : {0.0, 0.25}) {
    Mesh mesh = Disk(6);
    AddColumns(mesh, V);
    Apply(mesh, CollapseEdgesEdit{{{}, {3, 0}}, {t}, {}, {.keep_orientation = false}});
    ASSERT_FALSE(mesh.IsLive(VertexId(0)));  // 13 stays, 10 goes
    EXPECT_THAT(ByPolicy(mesh, VertexId(3)), ElementsAre(t == 0 ? 13 : 12, 13, 13, -1)) << t;
  }
}

TEST(PolicyTest, TheKeptVertexOfAMergerAndTheEdgesThatItTakesOver) {
  Mesh mesh;
  AddVertices(mesh, 6);
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Add(mesh, ElementType::kTriangle, {3, 4, 5});
  Commit(mesh);
  AddColumns(mesh, V);
  AddColumns(mesh, E);
  const int32_t edge = ValueAt(mesh, 0, mesh.FindEdge(VertexId(4), VertexId(5)));
  Apply(mesh, MergeVerticesEdit{{1, 4}, {}, {.keep_orientation = false}});
  EXPECT_THAT(ByPolicy(mesh, VertexId(1)), ElementsAre(11, 11, 14, -1));
  EXPECT_THAT(ByPolicy(mesh, mesh.FindEdge(VertexId(1), VertexId(5))), ElementsAre(edge, edge, edge, -1));
}

TEST(PolicyTest, ElementsTakeTheRowOfTheOneWhosePlaceTheyTake) {
  Mesh mesh = TetWheel(4);
  AddColumns(mesh, C);
  Apply(mesh, SplitEdgesEdit{{{}, {0, 1}}, {}, {}, {}});
  std::vector<int32_t> by_policy[4];
  mesh.slots(C).live().ForEach([&](Slot c) {
    for (int i = 0; i < 4; ++i) by_policy[i].push_back(ValueAt(mesh, i, CellId(c)));
  });
  for (int i = 0; i < 3; ++i) EXPECT_THAT(by_policy[i], UnorderedElementsAre(10, 10, 11, 11, 12, 12, 13, 13));
  EXPECT_THAT(by_policy[3], ::testing::Each(-1));
}

TEST(PolicyTest, HalvesOfAnEdgeAndPartsOfAFaceTakeTheirs) {
  for (auto& [name, mesh] : AllMeshes()) {
    if (!mesh.IsLive(EdgeId(0)) || !mesh.IsPlain()) continue;
    SCOPED_TRACE(name);
    AddColumns(mesh, E);
    AddColumns(mesh, F);
    const EdgeId cut(0);
    const auto ends = mesh.Vertices(cut);
    const VertexId a = ends[0], b = ends[1];
    const auto of_edge = ByPolicy(mesh, EntityId(cut));
    std::vector<std::pair<std::vector<VertexId>, int32_t>> faces;
    for (FaceId f : mesh.IncidentFaces(cut)) {
      faces.push_back({{mesh.Vertices(f).begin(), mesh.Vertices(f).end()}, ValueAt(mesh, 0, f)});
    }
    const BatchResult result =
        Apply(mesh, SplitEdgesEdit{{{cut.slot()}, {}}, {}, {}, {.keep_orientation = false}});
    ASSERT_FALSE(result.results.empty());
    const VertexId m(result.results[0].new_slots[0]);
    for (VertexId end : {a, b}) {
      EXPECT_THAT(ByPolicy(mesh, mesh.FindEdge(end, m)), ElementsAre(of_edge[0], of_edge[0], of_edge[0], -1));
    }
    size_t with_rows = 0;
    for (const auto& [cycle, value] : faces) {
      for (size_t k = 0; k < cycle.size(); ++k) {
        const FaceId part = mesh.FindFace({cycle[k], cycle[(k + 1) % cycle.size()], m});
        if (!part.valid()) continue;
        ++with_rows;
        EXPECT_THAT(ByPolicy(mesh, part), ElementsAre(value, value, value, -1));
      }
      with_rows -= cycle.size() - 1;
    }
    EXPECT_EQ(with_rows, 0u) << "each face becomes as many parts as it has other sides";
    for (FaceId f : mesh.IncidentFaces(mesh.FindEdge(a, m))) EXPECT_NE(ValueAt(mesh, 0, f), -1);
  }
}

TEST(PolicyTest, EdgesAndFacesFollowAVertexThatBecomesAnother) {
  Mesh mesh = Disk(6);
  AddColumns(mesh, E);
  AddColumns(mesh, F);
  const VertexId hub(0), kept(1);
  const auto edge_of = [&](VertexId v, VertexId w) { return ValueAt(mesh, 0, mesh.FindEdge(v, w)); };
  const VertexId side(2), far(3);
  ASSERT_TRUE(mesh.FindEdge(kept, side).valid() && !mesh.FindEdge(kept, far).valid());
  const int32_t of_far = edge_of(hub, far), of_side = edge_of(hub, side), there = edge_of(kept, side);
  const int32_t face = ValueAt(mesh, 0, mesh.FindFace({hub, side, far}));
  Apply(mesh, CollapseEdgesEdit{{{}, {1, 0}}, {0}, {}, {.keep_orientation = false}});
  EXPECT_THAT(ByPolicy(mesh, mesh.FindEdge(kept, far)), ElementsAre(of_far, of_far, of_far, -1));
  EXPECT_THAT(ByPolicy(mesh, mesh.FindEdge(kept, side)),
              ElementsAre(there, there, std::max(there, of_side), -1));
  EXPECT_THAT(ByPolicy(mesh, mesh.FindFace({kept, side, far})), ElementsAre(face, face, face, -1));
}

TEST(PolicyTest, RefusedOperatorsLeaveRowsAlone) {
  Mesh mesh = Octahedron();
  for (EntityKind kind : {V, E, F}) AddColumns(mesh, kind);
  const std::string before = Describe(mesh);
  const auto result =
      ApplyBatch(mesh,
                 {SplitEdgesEdit{{{0}, {}}, {}, {}, {}}, CollapseEdgesEdit{{{1}, {}}, {}, {}, {}},
                  SplitElementsEdit{F, {999}, {}, {}}},
                 {});
  EXPECT_FALSE(result.ok());
  EXPECT_EQ(Describe(mesh), before);
}

TEST(PolicyTest, RowsAreSetInTheColumnsTypeWhateverTypeTheyComeIn) {
  Mesh mesh = OneTet();
  const AttributeSpec spec{"t", V, AttributeType::kFloat32, 1, AttributePolicy::kMax, RowOf<float>({2})};
  ASSERT_TRUE(ApplyBatch(mesh, {AddAttributeEdit{spec}}, {}).ok());
  const auto set = [&](AttributeType type, std::vector<uint8_t> row) {
    return ApplyBatch(mesh, {SetAttributeEdit{{"t", V, type, 1}, {2}, std::move(row)}}, {}).status();
  };
  EXPECT_TRUE(set(AttributeType::kInt64, RowOf<int64_t>({7})).ok());
  EXPECT_THAT(ValuesAt<float>(mesh, 0, 2), ElementsAre(7));
  EXPECT_TRUE(set(AttributeType::kFloat32, RowOf<float>({0.1f})).ok());
  EXPECT_THAT(ValuesAt<float>(mesh, 0, 2), ElementsAre(0.1f));
  const std::string before = Describe(mesh);
  EXPECT_EQ(ErrorReason(set(AttributeType::kFloat64, RowOf<double>({0.1}))), reason::kInexactValue);
  EXPECT_EQ(ErrorReason(set(AttributeType::kUnspecified, {})), reason::kBadArgument);
  EXPECT_EQ(ErrorReason(set(AttributeType::kUint8, {1, 2})), reason::kBadArrayLength);
  EXPECT_EQ(Describe(mesh), before);
}

}  // namespace
}  // namespace dynmesh::testing
