// Rows of neighbours: stored or on demand, one or many, short or very long.

#include "core/mesh/relations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "core/mesh/cells_across.h"
#include "core/mesh/sort_unique.h"
#include "core/mesh/validate.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Relation kVertexCells = {EntityKind::kVertex, EntityKind::kCell};
constexpr Relation kCellCells = {EntityKind::kCell, EntityKind::kCell};

TEST(SortUniqueTest, DropsWhatStandsSoManyTimesAndAnyRepeats) {
  std::mt19937 rng(9);
  constexpr Slot kSelf = 500;
  for (size_t others = 0; others < 80; ++others) {
    for (size_t times : {1, 2, 3, 4}) {
      for (Slot range : {7u, 1000u, 0x7fffffffu}) {
        std::vector<Slot> values(times, kSelf);
        std::set<Slot> expected;
        while (values.size() < times + others) {
          const Slot value = rng() % range;
          if (value == kSelf) continue;
          values.push_back(value);
          expected.insert(value);
        }
        std::shuffle(values.begin(), values.end(), rng);
        const size_t count = values.size();
        values.resize(count + 8);
        values.resize(SortUniqueWithout(values.data(), count, kSelf, times));
        EXPECT_EQ(values, std::vector<Slot>(expected.begin(), expected.end())) << others << " " << times;
      }
    }
  }
}

TEST(SortUniqueTest, BothWidthsOfRegistersGiveTheSame) {
#ifdef __x86_64__
  if (!internal::kHasAvx2) GTEST_SKIP() << "this machine has but one";
  std::mt19937 rng(4);
  for (size_t count = 1; count <= internal::kRankSorted; ++count) {
    std::vector<Slot> values(count + 16);
    for (Slot& value : values) value = rng() % (2 * count);
    Slot narrow[internal::kRankSorted], wide[internal::kRankSorted];
    internal::RankSort(values.data(), count, narrow);
    internal::RankSortWide(values.data(), count, wide);
    EXPECT_TRUE(std::equal(narrow, narrow + count, wide)) << count;
  }
#endif
}

TEST(CellsAcrossTest, SortsEveryOrderOfEveryNumber) {
  constexpr Slot kCell = 0x7ffffff0;
  constexpr CellId kOverflow(kNoSlot - 1);
  std::array<Slot, 4> others = {3, 17, 0x7ffffffd, 0x7ffffffe};
  do {
    for (unsigned present = 0; present < 16; ++present) {
      std::array<std::array<CellId, 2>, 4> uses;
      std::vector<Slot> expected;
      for (int i = 0; i < 4; ++i) {
        uses[i] = {CellId(kCell), CellId()};
        if ((present >> i & 1) == 0) continue;
        uses[i] = {CellId(std::min(kCell, others[i])), CellId(std::max(kCell, others[i]))};
        expected.push_back(others[i]);
      }
      std::sort(expected.begin(), expected.end());
      const std::array<CellId, 2>* pointers[] = {&uses[0], &uses[1], &uses[2], &uses[3]};
      Slot row[4];
      const int size = CellsAcross(kCell, pointers, kOverflow, row);
      ASSERT_EQ(size, static_cast<int>(expected.size()));
      EXPECT_TRUE(std::equal(expected.begin(), expected.end(), row));
      uses[1][1] = kOverflow;
      EXPECT_LT(CellsAcross(kCell, pointers, kOverflow, row), 0);
      uses[1] = uses[0];
      EXPECT_EQ(CellsAcross(kCell, pointers, kOverflow, row) < 0, (present & 1) != 0);
    }
  } while (std::next_permutation(others.begin(), others.end()));
}

TEST(SortUniqueTest, EqualsSortAndUniqueAtEveryLength) {
  std::mt19937 rng(1);
  for (size_t length = 0; length < 120; ++length) {
    for (uint32_t range : {3u, 40u, 0x7fffffffu}) {
      std::vector<Slot> values(length);
      for (Slot& value : values) value = rng() % range;
      std::vector<Slot> expected = values;
      std::sort(expected.begin(), expected.end());
      expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
      std::vector<Slot> distinct = expected;
      std::shuffle(distinct.begin(), distinct.end(), rng);
      distinct.resize(distinct.size() + 7);
      SortDistinct(distinct.data(), expected.size());
      distinct.resize(expected.size());
      ASSERT_EQ(distinct, expected) << "length " << length << " range " << range;
      values.resize(length + 7);
      values.resize(SortUnique(values.data(), length));
      ASSERT_EQ(values, expected) << "length " << length << " range " << range;
    }
  }
}

TEST(RelationsTest, RowsInBlocksAreThoseOfEachAlone) {
  for (const NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    for (EntityKind from : kEntityKinds) {
      for (EntityKind to : kEntityKinds) {
        size_t rows = 0;
        ForEachRow(named.mesh, {from, to}, [&](Slot slot, absl::Span<const Slot> row) {
          std::vector<Slot> alone;
          AppendNeighbors(named.mesh, {from, to}, slot, alone);
          EXPECT_EQ(row, absl::MakeConstSpan(alone));
          ++rows;
        });
        EXPECT_EQ(rows, named.mesh.NumLive(from));
      }
    }
  }
}

TEST(RelationsTest, BlocksLongerThanOneGoOnWhereTheLastEnded) {
  const Mesh mesh = TetGrid(9, 9, 9);
  std::vector<Slot> slots;
  for (Slot v = mesh.slots(EntityKind::kVertex).limit(); v-- > 0;) slots.push_back(v);
  ASSERT_GT(slots.size(), 2 * RowBlock::kMaxRows);
  const CsrTable table = Neighbors(mesh, kVertexCells, slots);
  ASSERT_EQ(table.num_rows(), slots.size());
  for (size_t i = 0; i < slots.size(); ++i) {
    std::vector<Slot> alone;
    AppendNeighbors(mesh, kVertexCells, slots[i], alone);
    ASSERT_EQ(table.Row(i), absl::MakeConstSpan(alone)) << i;
  }
}

TEST(RelationsTest, OnlyTheSixStorableRelationsCanBeSwitched) {
  Mesh mesh = OneTet();
  for (EntityKind from : kEntityKinds) {
    for (EntityKind to : kEntityKinds) {
      const Relation relation = {from, to};
      const absl::Status status = mesh.StoreRelation(relation, true);
      EXPECT_EQ(status.ok(), StorableIndex(relation) < kNumStorableRelations);
      EXPECT_EQ(mesh.stored().Has(relation), status.ok());
      if (!status.ok()) {
        EXPECT_EQ(ErrorReason(status), reason::kBadArgument);
      }
    }
  }
}

TEST(RelationsTest, AStoredRelationTakesBytesUntilItIsDropped) {
  Mesh mesh = TetGrid(3, 3, 3);
  const size_t before = mesh.memory_bytes();
  for (Relation relation : kStorableRelations) {
    ASSERT_TRUE(mesh.StoreRelation(relation, true).ok());
    EXPECT_GT(mesh.stored().memory_bytes(relation), mesh.NumLive(relation.from) * sizeof(Slot));
  }
  EXPECT_GT(mesh.memory_bytes(), before);
  for (Relation relation : kStorableRelations) ASSERT_TRUE(mesh.StoreRelation(relation, false).ok());
  EXPECT_EQ(mesh.memory_bytes(), before);
}

TEST(RelationsTest, CellsOfManyTypesKeepTheirStoredEdges) {
  Mesh mesh = HybridOfFour();
  ASSERT_TRUE(mesh.StoreRelation(kStorableRelations[0], true).ok());
  EXPECT_THAT(Validate(mesh), IsEmpty());
  const auto vertices = mesh.Vertices(CellId(0));
  ASSERT_TRUE(
      mesh.AddElement(mesh.Type(CellId(0)), std::vector<VertexId>(vertices.begin(), vertices.end())).ok());
  EXPECT_THAT(Validate(mesh), IsEmpty());
}

// ---- Hubs: rows that are too long to be stored ----

/// `n` tetrahedra on the face 0-1-2.
Mesh Sheaf(int n) {
  Mesh mesh;
  AddVertices(mesh, n + 3);
  for (Slot k = 0; k < static_cast<Slot>(n); ++k) Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3 + k});
  Commit(mesh);
  return mesh;
}

void ExpectStoredEqualsOnDemand(Mesh& mesh, Relation relation) {
  ASSERT_TRUE(mesh.stored().Has(relation));
  std::vector<std::vector<Slot>> stored;
  ForEachRow(mesh, relation,
             [&](Slot, absl::Span<const Slot> row) { stored.emplace_back(row.begin(), row.end()); });
  ASSERT_TRUE(mesh.StoreRelation(relation, false).ok());
  size_t i = 0;
  ForEachRow(mesh, relation, [&](Slot slot, absl::Span<const Slot> row) {
    EXPECT_EQ(row, absl::MakeConstSpan(stored[i++])) << "row " << slot;
  });
  ASSERT_TRUE(mesh.StoreRelation(relation, true).ok());
}

TEST(RelationsTest, AFaceOfThousandsOfCellsTakesNoSquareOfThem) {
  Mesh mesh = Sheaf(4);
  for (Relation relation : kStorableRelations) ASSERT_TRUE(mesh.StoreRelation(relation, true).ok());
  AddVertices(mesh, 3000);
  for (Slot k = 0; k < 3000; ++k) Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 7 + k});
  Commit(mesh);
  EXPECT_LT(mesh.stored().memory_bytes(kCellCells), size_t{3000} * 3000 * sizeof(Slot) / 8);
  for (Relation relation : {kCellCells, kVertexCells}) ExpectStoredEqualsOnDemand(mesh, relation);
  for (Slot c = 0; c < 2995; ++c) ASSERT_TRUE(mesh.RemoveElement(CellId(c)).ok());
  Commit(mesh);
  for (Relation relation : {kCellCells, kVertexCells}) ExpectStoredEqualsOnDemand(mesh, relation);
  EXPECT_THAT(Validate(mesh), IsEmpty());
}

TEST(RelationsTest, RowsCrossTheirLongestLengthInBothDirections) {
  Mesh mesh = Sheaf(StoredRows::kMaxRow - 2);
  ASSERT_TRUE(mesh.StoreRelation(kCellCells, true).ok());
  AddVertices(mesh, 20);
  for (int round = 0; round < 3; ++round) {
    std::vector<EntityId> added;
    for (Slot k = 0; k < 20; ++k) {
      added.push_back(Add(mesh, ElementType::kTetrahedron, {0, 1, 2, StoredRows::kMaxRow + 1 + k}));
      ASSERT_THAT(Validate(mesh), IsEmpty()) << "round " << round << " cell " << k;
    }
    ExpectStoredEqualsOnDemand(mesh, kCellCells);
    for (EntityId id : added) ASSERT_TRUE(mesh.RemoveElement(id).ok());
    Commit(mesh);
    ExpectStoredEqualsOnDemand(mesh, kCellCells);
  }
}

TEST(RelationsTest, ARolledBackBatchLeavesStoredRowsAsTheyWere) {
  Mesh mesh = Sheaf(StoredRows::kMaxRow + 1);
  for (Relation relation : kStorableRelations) ASSERT_TRUE(mesh.StoreRelation(relation, true).ok());
  AddVertices(mesh, 1);
  Commit(mesh);
  mesh.BeginBatch();
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, StoredRows::kMaxRow + 4});
  for (Slot c = 0; c < 10; ++c) ASSERT_TRUE(mesh.RemoveElement(CellId(c)).ok());
  mesh.Rollback();
  EXPECT_THAT(Validate(mesh), IsEmpty());
  for (Relation relation : kStorableRelations) ExpectStoredEqualsOnDemand(mesh, relation);
}

}  // namespace
}  // namespace dynmesh::testing
