#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>

#include "core/mesh/error.h"
#include "tests/core/codec/delta_samples.h"

namespace dynmesh {
namespace {

Delta Valid() {
  Delta delta = TetBlock(1);
  delta.removed_vertices = {50, 60};
  delta.vertex_slots = {0, 1};
  delta.positions = {{0, 0, 0}, {1, 0, 0}};
  delta.OfKind(EntityKind::kCell).removed = {100, 101};
  delta.attributes.push_back(
      {{"a", EntityKind::kVertex, AttributeType::kFloat64, 1}, {0, 1}, std::vector<uint8_t>(16)});
  return delta;
}

void ExpectBroken(const std::function<void(Delta&)>& change) {
  Delta delta = Valid();
  change(delta);
  const absl::Status status = CheckDelta(delta);
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
  EXPECT_EQ(ErrorReason(status), reason::kCorruptPayload);
}

TEST(CheckDeltaTest, TheSamplesAreValid) {
  EXPECT_TRUE(CheckDelta(Valid()).ok());
  for (const NamedDelta& sample : SmallDeltas()) EXPECT_TRUE(CheckDelta(sample.delta).ok()) << sample.name;
}

TEST(CheckDeltaTest, SlotListsMustAscendStrictly) {
  ExpectBroken([](Delta& d) { d.removed_vertices = {60, 50}; });
  ExpectBroken([](Delta& d) { d.vertex_slots = {1, 1}; });
  ExpectBroken([](Delta& d) { d.OfKind(EntityKind::kCell).removed = {7, 6}; });
  ExpectBroken([](Delta& d) {
    std::swap(d.OfKind(EntityKind::kCell).slots[0], d.OfKind(EntityKind::kCell).slots[1]);
  });
  ExpectBroken([](Delta& d) { d.attributes[0].slots = {1, 0}; });
}

TEST(CheckDeltaTest, NoSlotMayStandForNone) {
  ExpectBroken([](Delta& d) { d.vertex_slots.back() = kNoSlot; });
  ExpectBroken([](Delta& d) { d.OfKind(EntityKind::kCell).vertices[3] = VertexId(); });
  ExpectBroken([](Delta& d) { d.attributes[0].slots.back() = kNoSlot; });
}

TEST(CheckDeltaTest, ASlotIsNotBothRemovedAndUpserted) {
  ExpectBroken([](Delta& d) { d.removed_vertices = {1}; });
  ExpectBroken([](Delta& d) { d.OfKind(EntityKind::kCell).removed = {5}; });
}

TEST(CheckDeltaTest, SizesMustAgree) {
  ExpectBroken([](Delta& d) { d.positions.pop_back(); });
  ExpectBroken([](Delta& d) { d.OfKind(EntityKind::kCell).types.pop_back(); });
  ExpectBroken([](Delta& d) { d.OfKind(EntityKind::kCell).vertices.pop_back(); });
  ExpectBroken([](Delta& d) { d.attributes[0].rows.pop_back(); });
}

TEST(CheckDeltaTest, TypesMustBeOfTheirDimension) {
  for (int type : {0, 1, 2, 3, 8, 255}) {
    ExpectBroken([type](Delta& d) { d.OfKind(EntityKind::kCell).types[2] = static_cast<ElementType>(type); });
  }
}

TEST(CheckDeltaTest, NumbersMustBeFinite) {
  ExpectBroken([](Delta& d) { d.positions[1][2] = NAN; });
  ExpectBroken([](Delta& d) { d.positions[0][0] = -INFINITY; });
  ExpectBroken([](Delta& d) {
    const double infinite = INFINITY;
    std::memcpy(&d.attributes[0].rows[8], &infinite, sizeof(infinite));
  });
}

TEST(CheckDeltaTest, ColumnsMustBePossible) {
  ExpectBroken([](Delta& d) { d.attributes[0].spec.name = ""; });
  ExpectBroken([](Delta& d) { d.attributes[0].spec.components = 17; });
  ExpectBroken([](Delta& d) { d.attributes[0].spec.type = AttributeType::kUnspecified; });
  ExpectBroken([](Delta& d) { d.attributes[0].spec.kind = static_cast<EntityKind>(4); });
  ExpectBroken([](Delta& d) { d.attributes[0].spec.type = static_cast<AttributeType>(6); });
  ExpectBroken([](Delta& d) { d.attributes[0].spec.policy = static_cast<AttributePolicy>(5); });
  ExpectBroken([](Delta& d) { d.attributes[0].spec.default_row.resize(7); });
  ExpectBroken([](Delta& d) { d.attributes[0].spec.default_row.assign(8, 0xff); });
}

}  // namespace
}  // namespace dynmesh
