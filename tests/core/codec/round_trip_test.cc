#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/mesh/error.h"
#include "tests/core/codec/delta_samples.h"

namespace dynmesh {
namespace {

constexpr int kSeeds = 60;

std::string Encode(const Delta& delta, const EncodeOptions& options) {
  absl::StatusOr<std::string> bytes = EncodeDelta(delta, options);
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  return bytes.ok() ? *bytes : std::string();
}

class RoundTripTest : public testing::TestWithParam<Codec> {
 protected:
  void ExpectSurvives(const Delta& delta, const std::string& name) {
    ASSERT_TRUE(CheckDelta(delta).ok()) << name << ": " << CheckDelta(delta);
    const absl::StatusOr<Delta> back = DecodeDelta(Encode(delta, {.codec = GetParam(), .grid = {}}));
    ASSERT_TRUE(back.ok()) << name << ": " << back.status();
    EXPECT_TRUE(SameBits(*back, delta)) << name;
  }
};

TEST_P(RoundTripTest, EverySmallDeltaComesBackToTheBit) {
  for (const NamedDelta& sample : SmallDeltas()) ExpectSurvives(sample.delta, sample.name);
}

TEST_P(RoundTripTest, RandomDeltasComeBackToTheBit) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    Rng rng(seed);
    ExpectSurvives(RandomDelta(rng, 1 << (seed % 11)), "seed " + std::to_string(seed));
  }
}

TEST_P(RoundTripTest, RegularBlocksComeBackToTheBit) {
  ExpectSurvives(HexBlock(12), "hexahedra");
  ExpectSurvives(TetBlock(12), "tetrahedra");
}

TEST_P(RoundTripTest, ManyRemovedSlotsInARowComeBack) {
  Delta delta;
  delta.OfKind(EntityKind::kCell).removed.resize(300000);
  for (Slot slot = 0; slot < 300000; ++slot) delta.OfKind(EntityKind::kCell).removed[slot] = slot;
  ExpectSurvives(delta, "removed");
}

TEST_P(RoundTripTest, QuantisedPositionsAreExactlyOriginPlusIndexTimesStep) {
  Rng rng(3);
  std::uniform_real_distribution<double> coordinate(-7, 5);
  Delta delta;
  for (Slot slot = 0; slot < 2000; ++slot) {
    delta.vertex_slots.push_back(3 * slot);
    delta.positions.push_back({coordinate(rng), coordinate(rng), coordinate(rng)});
  }
  for (int bits : {1, 12, 16, 24, 30}) {
    const QuantizationGrid grid = MakeGrid({-7, -7, -7}, {5, 5, 5}, bits);
    const absl::StatusOr<Delta> back = DecodeDelta(Encode(delta, {.codec = GetParam(), .grid = grid}));
    ASSERT_TRUE(back.ok()) << back.status();
    ASSERT_EQ(back->vertex_slots, delta.vertex_slots);
    for (size_t i = 0; i < delta.positions.size(); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        const double index = std::round((delta.positions[i][axis] - grid.origin[axis]) / grid.step);
        ASSERT_EQ(back->positions[i][axis], grid.origin[axis] + index * grid.step) << bits << " bits";
        ASSERT_LE(std::abs(back->positions[i][axis] - delta.positions[i][axis]), grid.step * 0.5001);
      }
    }
  }
}

TEST_P(RoundTripTest, AQuantisedVertexDecodesToTheSameBitsInEveryMessage) {
  const EncodeOptions options{.codec = GetParam(), .grid = MakeGrid({0, 0, 0}, {1, 2, 3}, 14)};
  Delta alone;
  alone.vertex_slots = {8};
  alone.positions = {{0.3, 0.7, 2.9}};
  Delta among = alone;
  among.vertex_slots = {1, 8, 9};
  among.positions = {{1, 2, 3}, {0.3, 0.7, 2.9}, {0, 0, 0}};
  const absl::StatusOr<Delta> first = DecodeDelta(Encode(alone, options));
  const absl::StatusOr<Delta> second = DecodeDelta(Encode(among, options));
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(first->positions[0], second->positions[1]);
}

TEST_P(RoundTripTest, ADecodedQuantisedDeltaEncodesToTheSameBytes) {
  const EncodeOptions options{.codec = GetParam(), .grid = MakeGrid({-1, -1, -1}, {1, 1, 1}, 20)};
  Rng rng(11);
  const std::string bytes = Encode(RandomDelta(rng, 400), options);
  const absl::StatusOr<Delta> back = DecodeDelta(bytes);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(Encode(*back, options), bytes);
}

INSTANTIATE_TEST_SUITE_P(AllCodecs, RoundTripTest, testing::ValuesIn(kAllCodecs),
                         [](const auto& run) { return CodecName(run.param); });

TEST(QuantisationTest, PositionsOutsideTheGridAreClampedToIt) {
  const EncodeOptions options{.codec = {}, .grid = MakeGrid({0, 0, 0}, {1, 1, 1}, 8)};
  Delta delta;
  delta.vertex_slots = {0, 1};
  delta.positions = {{-5, 1e300, 0.5}, {-1e300, 2, 1}};
  const absl::StatusOr<Delta> back = DecodeDelta(Encode(delta, options));
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_THAT(back->positions[0], testing::ElementsAre(0, options.grid.step * 255, options.grid.step * 128));
  EXPECT_THAT(back->positions[1], testing::ElementsAre(0, options.grid.step * 255, options.grid.step * 255));
}

TEST(QuantisationTest, AGridHasPositiveFiniteStepsWhateverTheBox) {
  const double huge = std::numeric_limits<double>::max() / 2;
  for (const QuantizationGrid& grid :
       {MakeGrid({3, 3, 3}, {3, 3, 3}, 10), MakeGrid({-huge, 0, 0}, {huge, 1, 1}, 1),
        MakeGrid({0, 0, 0}, {5e-324, 0, 0}, 30)}) {
    EXPECT_GT(grid.step, 0);
    EXPECT_TRUE(std::isfinite(grid.step));
    EXPECT_TRUE(EncodeDelta({}, {.codec = {}, .grid = grid}).ok());
  }
}

TEST(QuantisationTest, AnInvalidGridIsRefused) {
  for (const QuantizationGrid& grid :
       {QuantizationGrid{{0, 0, 0}, 1, 0}, QuantizationGrid{{0, 0, 0}, 1, 31},
        QuantizationGrid{{0, 0, 0}, -1, 8}, QuantizationGrid{{NAN, 0, 0}, 1, 8},
        QuantizationGrid{{0, 0, 0}, INFINITY, 8}, QuantizationGrid{{0, 0, 1e308}, 1e308, 8}}) {
    const absl::StatusOr<std::string> bytes = EncodeDelta({}, {.codec = {}, .grid = grid});
    EXPECT_EQ(bytes.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(ErrorReason(bytes.status()), reason::kBadArgument);
  }
}

TEST(PeekTest, TheHeaderIsReadWithoutTheSections) {
  Delta delta = TetBlock(2);
  delta.from_revision = 4;
  delta.to_revision = 9;
  delta.consistent = false;
  delta.checksum = {77, 88};
  const absl::StatusOr<DeltaHeader> header =
      PeekDelta(Encode(delta, {.codec = {}, .grid = MakeGrid({0, 0, 0}, {1, 1, 1}, 12)}));
  ASSERT_TRUE(header.ok()) << header.status();
  EXPECT_EQ(header->from_revision, 4);
  EXPECT_EQ(header->to_revision, 9);
  EXPECT_FALSE(header->consistent);
  EXPECT_EQ(header->position_bits, 12);
  EXPECT_EQ(header->checksum, delta.checksum);
}

TEST(StatsTest, RawBytesAreThoseOfFixedWidthArrays) {
  Delta delta = TetBlock(2);
  delta.removed_vertices = {1};
  delta.vertex_slots = {2, 3};
  delta.positions = {{0, 0, 0}, {1, 1, 1}};
  EncodeStats stats;
  ASSERT_TRUE(EncodeDelta(delta, {}, &stats).ok());
  EXPECT_EQ(stats.raw_topology_bytes, 48u * (4 + 1 + 16) + 4);
  EXPECT_EQ(stats.raw_geometry_bytes, 2u * 28);
  EXPECT_EQ(stats.attribute_bytes, 0u);
}

TEST(StatsTest, EncodedPartsAddUpToTheMessage) {
  Rng rng(5);
  EncodeStats stats;
  const absl::StatusOr<std::string> bytes = EncodeDelta(RandomDelta(rng, 300), {}, &stats);
  ASSERT_TRUE(bytes.ok());
  constexpr size_t kHeaderCountAndSeal = 40 + 1 + 8;
  EXPECT_EQ(stats.topology_bytes + stats.geometry_bytes + stats.attribute_bytes + kHeaderCountAndSeal,
            bytes->size());
}

}  // namespace
}  // namespace dynmesh
