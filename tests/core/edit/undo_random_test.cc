// The same as undo_test.cc for random batches.
//
// DYNMESH_UNDO_BATCHES: how many on each kind of mesh (default 30), and 500 times as many operator calls on
// one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include "core/edit/restore_batches.h"
#include "core/edit/transaction.h"
#include "core/mesh/validate.h"
#include "tests/core/edit/batch_dice.h"
#include "tests/core/edit/chronicle.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/random_edits.h"

namespace dynmesh::testing {
namespace {

using ::testing::IsEmpty;

int NumBatches() {
  const char* batches = std::getenv("DYNMESH_UNDO_BATCHES");
  return batches != nullptr ? std::atoi(batches) : 30;
}

/// Applies batches until some are accepted, and notes those.
void ApplySome(Chronicle& chronicle, BatchDice& dice, int num_batches) {
  for (int i = 0; i < num_batches; ++i) {
    auto applied = ApplyBatch(chronicle.mesh(), dice.AnyBatch(), {.skip_refused = true, .make_image = true});
    if (!applied.ok()) continue;
    ASSERT_TRUE(applied->image.has_value());
    chronicle.Add(*std::move(applied->image));
  }
}

/// To the first state, to the last, and there and back by steps of all sizes.
void GoToAndFro(Chronicle& chronicle, BatchDice& dice) {
  while (chronicle.num_undos() > 0 && !::testing::Test::HasFailure()) chronicle.Undo(1);
  while (chronicle.num_redos() > 0 && !::testing::Test::HasFailure()) chronicle.Redo(1);
  for (int i = 0; i < 6 && !::testing::Test::HasFailure(); ++i) {
    if (chronicle.num_undos() > 0) chronicle.UndoInVain(1 + dice.Uniform(chronicle.num_undos()));
    chronicle.Undo(dice.Uniform(chronicle.num_undos() + 1));
    chronicle.Redo(dice.Uniform(chronicle.num_redos() + 1));
  }
  chronicle.Undo(chronicle.num_undos());
  chronicle.Redo(chronicle.num_redos());
}

void RunOn(Mesh mesh, uint32_t seed) {
  SCOPED_TRACE(seed);
  for (Relation relation : kStorableRelations) {
    ASSERT_TRUE(mesh.StoreRelation(relation, seed % 2 == 0).ok());
  }
  Chronicle chronicle(std::move(mesh));
  BatchDice dice(chronicle.mesh(), seed);
  for (int round = 0; round < 2 && !::testing::Test::HasFailure(); ++round) {
    ApplySome(chronicle, dice, NumBatches());
    GoToAndFro(chronicle, dice);
    chronicle.Undo(chronicle.num_undos() / 2);  // the next round begins in the middle
  }
}

TEST(UndoRandomTest, BatchesOnEveryKindOfMesh) {
  uint32_t seed = 10;
  for (auto& [name, mesh] : AllMeshes()) {
    SCOPED_TRACE(name);
    RunOn(std::move(mesh), ++seed);
    if (HasFailure()) return;
  }
}

TEST(UndoRandomTest, ManyOperatorCallsAreUndoneToTheFirstStateAndRedone) {
  const uint32_t seed = 5;
  SCOPED_TRACE(seed);
  Mesh mesh = TetGrid(5, 5, 5);
  BatchDice dice(mesh, seed);
  const std::string first = DescribeContent(mesh, 0);
  std::vector<BatchImage> undos;
  for (int call = 0; call < 500 * NumBatches(); ++call) {
    auto applied = ApplyBatch(mesh, {dice.AnyOperator()}, {.make_image = true});
    if (applied.ok()) undos.push_back(*std::move(applied->image));
  }
  ASSERT_GT(undos.size(), 50u * NumBatches());
  const std::string last = DescribeContent(mesh, 0);
  const auto restore_all = [&](std::vector<BatchImage> images) {
    std::vector<BatchImage> inverses;
    while (!images.empty()) {
      std::vector<const BatchImage*> some;
      for (size_t i = 0; i < std::min<size_t>(images.size(), 100); ++i) some.push_back(&images.rbegin()[i]);
      auto restored = RestoreBatches(mesh, some, {});
      EXPECT_TRUE(restored.ok()) << restored.status();
      if (!restored.ok()) break;
      for (BatchImage& image : restored->images) inverses.push_back(std::move(image));
      images.resize(images.size() - some.size());
    }
    EXPECT_THAT(Validate(mesh), IsEmpty());
    return inverses;
  };
  const std::vector<BatchImage> redos = restore_all(std::move(undos));
  EXPECT_EQ(FirstDifference(DescribeContent(mesh, 0), first), "");
  restore_all(redos);
  EXPECT_EQ(FirstDifference(DescribeContent(mesh, 0), last), "");
}

TEST(UndoRandomTest, PrimitiveEditsOnComplexesWithDuplicatesAndDegenerates) {
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    Mesh start;
    for (Relation relation : kStorableRelations)
      ASSERT_TRUE(start.StoreRelation(relation, seed % 2 == 0).ok());
    Chronicle chronicle(std::move(start));
    Mesh& mesh = chronicle.mesh();
    ElementModel model;
    RandomEditor editor(
        mesh, model, seed,
        {.max_vertices = 9, .degenerate_rate = 0.2, .duplicate_rate = 0.15, .attributes = true});
    BatchDice dice(mesh, seed);
    for (int round = 0; round < 2; ++round) {
      for (int batch = 0; batch < NumBatches(); ++batch) {
        mesh.BeginBatch();
        for (int i = editor.Uniform(25); i >= 0; --i) editor.Edit();
        BatchImage image = mesh.ImageSince(0);
        Commit(mesh);
        chronicle.Add(std::move(image));
      }
      GoToAndFro(chronicle, dice);
      chronicle.Undo(chronicle.num_undos() / 3);
      if (HasFailure()) return;
      model = chronicle.model();
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
