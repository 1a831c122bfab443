#include "server/rpc/query_weight.h"

#include <gtest/gtest.h>

#include <limits>

namespace dynmesh::testing {
namespace {

constexpr uint64_t kMax = std::numeric_limits<uint64_t>::max();

TEST(QueryWeightTest, AFewPlacesInASmallMeshAreLight) {
  EXPECT_FALSE(IsHeavyPlaceQuery(0, 0));
  EXPECT_FALSE(IsHeavyPlaceQuery(1, kManyRows));
  EXPECT_FALSE(IsHeavyPlaceQuery(50, kManyRows));
  EXPECT_FALSE(IsHeavyPlaceQuery(kManyPlaces, 1'000));
}

TEST(QueryWeightTest, OnePlaceInALargeMeshIsHeavy) {
  EXPECT_TRUE(IsHeavyPlaceQuery(1, kManyRows + 1));
  EXPECT_TRUE(IsHeavyPlaceQuery(0, kMax));
}

TEST(QueryWeightTest, ManyPlacesAreHeavyAnywhere) {
  EXPECT_TRUE(IsHeavyPlaceQuery(kManyPlaces + 1, 0));
  EXPECT_TRUE(IsHeavyPlaceQuery(kMax, kMax));
}

TEST(QueryWeightTest, PlacesThatMayEachMeetEverythingAreHeavy) {
  EXPECT_TRUE(IsHeavyPlaceQuery(51, kManyRows));
  EXPECT_TRUE(IsHeavyPlaceQuery(kManyPlaces, 1'001));
}

TEST(QueryWeightTest, RingsAreJudgedByWhatTheyMayReach) {
  EXPECT_FALSE(IsHeavyRingQuery(kManyRows, 1, kManyRows)) << "one ring is no walk";
  EXPECT_FALSE(IsHeavyRingQuery(50, 2, kManyRows));
  EXPECT_TRUE(IsHeavyRingQuery(51, 2, kManyRows));
  EXPECT_FALSE(IsHeavyRingQuery(1, 1000, 1'000'000));
  EXPECT_TRUE(IsHeavyRingQuery(1, 2, 1'000'001));
  EXPECT_TRUE(IsHeavyRingQuery(kMax, 2, kMax)) << "nothing overflows";
}

TEST(QueryWeightTest, MovesInHistoryAreJudgedByWhatTheyPutBack) {
  EXPECT_FALSE(IsHeavyMove(0, 0)) << "0 means one";
  EXPECT_FALSE(IsHeavyMove(1, kManyRestored));
  EXPECT_TRUE(IsHeavyMove(1, kManyRestored + 1));
  EXPECT_TRUE(IsHeavyMove(2, 0));
}

}  // namespace
}  // namespace dynmesh::testing
