// What an attribute column is: specs, default rows, and what roll-back and new occupants leave of rows.

#include "core/mesh/attributes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/mesh/validate.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/rows.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

constexpr AttributeType kTypes[] = {AttributeType::kFloat64, AttributeType::kInt32, AttributeType::kFloat32,
                                    AttributeType::kInt64, AttributeType::kUint8};

AttributeSpec Valid() {
  return {"a", EntityKind::kVertex, AttributeType::kFloat32, 2, AttributePolicy::kMax, RowOf<float>({1, -2})};
}

/// The refusal of a spec, as reason and field; and that a mesh refuses it too.
std::pair<std::string, std::string> RefusalOf(const AttributeSpec& spec) {
  const absl::Status status = CheckAttributeSpec(spec);
  EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
  Mesh mesh = OneTet();
  const std::string before = Describe(mesh);
  EXPECT_EQ(mesh.AddAttribute(spec), status);
  EXPECT_EQ(Describe(mesh), before);
  const auto detail = GetErrorDetail(status);
  return {detail->reason, std::string(detail->Find("field"))};
}

template <typename Change>
std::pair<std::string, std::string> RefusalAfter(Change change) {
  AttributeSpec spec = Valid();
  change(spec);
  return RefusalOf(spec);
}

TEST(AttributeSpecTest, EachFieldThatIsWrongIsNamed) {
  using Refusal = std::pair<std::string, std::string>;
  const std::string bad = reason::kBadArgument;
  ASSERT_TRUE(CheckAttributeSpec(Valid()).ok());
  EXPECT_EQ(RefusalAfter([](auto& s) { s.name = ""; }), Refusal(bad, "name"));
  EXPECT_EQ(RefusalAfter([](auto& s) { s.name = std::string(65, 'a'); }), Refusal(bad, "name"));
  EXPECT_EQ(RefusalAfter([](auto& s) { s.name = "a b"; }), Refusal(bad, "name"));
  EXPECT_EQ(RefusalAfter([](auto& s) { s.kind = static_cast<EntityKind>(4); }), Refusal(bad, "kind"));
  for (int type : {0, 6, 255}) {
    EXPECT_EQ(RefusalAfter([=](auto& s) { s.type = static_cast<AttributeType>(type); }),
              Refusal(bad, "type"));
  }
  for (int components : {-1, 0, 17}) {
    EXPECT_EQ(RefusalAfter([=](auto& s) { s.components = components; }), Refusal(bad, "components"));
  }
  for (int policy : {5, 255}) {
    EXPECT_EQ(RefusalAfter([=](auto& s) { s.policy = static_cast<AttributePolicy>(policy); }),
              Refusal(bad, "policy"));
  }
  for (size_t size : {1, 7, 9, 16}) {
    EXPECT_EQ(RefusalAfter([=](auto& s) { s.default_row.assign(size, 0); }),
              Refusal(reason::kBadArrayLength, "default_row"));
  }
  for (float value : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    EXPECT_EQ(RefusalAfter([=](auto& s) {
                s.default_row = RowOf<float>({0, value});
              }),
              Refusal(reason::kNonFinite, "default_row"));
  }
}

TEST(AttributeSpecTest, SpecsAreEqualWhenTheyMeanTheSame) {
  const AttributeSpec plain{"a", EntityKind::kVertex, AttributeType::kInt32, 1};
  AttributeSpec other = plain;
  other.policy = AttributePolicy::kCopy;
  EXPECT_EQ(plain, other);
  other.default_row = RowOf<int32_t>({0});
  EXPECT_EQ(plain, other);
  other.default_row = RowOf<int32_t>({1});
  EXPECT_NE(plain, other);
  other = plain;
  other.policy = AttributePolicy::kInterpolate;
  EXPECT_NE(plain, other);
}

TEST(AttributeSpecTest, FloatsMustBeFiniteAndTheFirstRowThatIsNotIsNamed) {
  AttributeSpec spec{"a", EntityKind::kVertex, AttributeType::kFloat32, 2};
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(CheckFinite(spec, RowOf<float>({1, 2, 3, 4})).ok());
  const absl::Status status = CheckFinite(spec, RowOf<float>({1, 2, 3, 4, 5, nan, nan, 8}));
  EXPECT_EQ(ErrorReason(status), reason::kNonFinite);
  EXPECT_EQ(GetErrorDetail(status)->Find("index"), "2");
  spec.type = AttributeType::kInt64;
  EXPECT_TRUE(CheckFinite(spec, RowOf<double>({nan, nan})).ok());
}

TEST(AttributeColumnTest, RowsNeverSetAreTheDefault) {
  for (AttributeType type : kTypes) {
    AttributeSpec spec{"a", EntityKind::kVertex, type, 3};
    spec.default_row.assign(spec.row_bytes(), 7);
    const std::vector<uint8_t> set(spec.row_bytes(), 1);
    AttributeColumn column(spec);
    EXPECT_EQ(column.Row(0), absl::MakeConstSpan(spec.default_row));
    column.SetRow(5, set, 1);
    EXPECT_EQ(column.Row(5), absl::MakeConstSpan(set));
    for (Slot slot : {0u, 4u, 6u, StampColumn::kPageSlots - 1, StampColumn::kPageSlots, 1'000'000u}) {
      EXPECT_EQ(column.Row(slot), absl::MakeConstSpan(spec.default_row)) << slot;
    }
  }
}

TEST(AttributesTest, ANewOccupantHasTheDefaultAndRollbackTheRowsBefore) {
  Mesh mesh = OneTet();
  ASSERT_TRUE(mesh.AddAttribute({"id", EntityKind::kCell, AttributeType::kInt64, 1, AttributePolicy::kCopy,
                                 RowOf<int64_t>({-1})})
                  .ok());
  ASSERT_TRUE(mesh.SetAttribute(0, 0, RowOf<int64_t>({int64_t{1} << 60})).ok());
  Commit(mesh);
  const std::string before = Describe(mesh);
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok());
  ASSERT_TRUE(mesh.AddAttribute({"b", EntityKind::kFace, AttributeType::kUint8, 1}).ok());
  ASSERT_TRUE(
      mesh.SetAttribute(0, Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3}).slot, RowOf<int64_t>({5}))
          .ok());
  mesh.Rollback();
  EXPECT_EQ(Describe(mesh), before);
  ASSERT_TRUE(mesh.RemoveElement(CellId(0)).ok());
  Commit(mesh);
  const EntityId again = Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  EXPECT_EQ(again.slot, 0u);
  EXPECT_EQ(ValuesAt<int64_t>(mesh, 0, 0), std::vector<int64_t>{-1});
  EXPECT_THAT(Validate(mesh), IsEmpty());
}

}  // namespace
}  // namespace dynmesh::testing
