// The same as restore_revision_test.cc for random histories: meshes go back to whatever they were, and on
// from there, and back again, so that slots have many occupants.
//
// DYNMESH_RESTORE_BATCHES: how many on each kind of mesh (default 24).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/edit/restore_revision.h"
#include "core/edit/transaction.h"
#include "tests/core/edit/batch_dice.h"
#include "tests/core/edit/past.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/random_edits.h"

namespace dynmesh::testing {
namespace {

int NumBatches() {
  const char* batches = std::getenv("DYNMESH_RESTORE_BATCHES");
  return batches != nullptr ? std::atoi(batches) : 24;
}

/// Applies batches until some are accepted, and goes back now and then.
void LiveOn(Past& past, BatchDice& dice) {
  for (int i = 0; i < NumBatches() && !::testing::Test::HasFailure(); ++i) {
    const auto applied =
        ApplyBatch(past.mesh(), dice.AnyBatch(), {.skip_refused = true, .keeper = &past.keeper()});
    if (applied.ok()) past.Note();
    if (dice.Uniform(6) == 0) past.GoBackTo(dice.Uniform(past.size()));
  }
}

void RunOn(Mesh mesh, uint32_t seed) {
  SCOPED_TRACE(seed);
  for (Relation relation : kStorableRelations) {
    ASSERT_TRUE(mesh.StoreRelation(relation, seed % 2 == 0).ok());
  }
  Past past(std::move(mesh));
  BatchDice dice(past.mesh(), seed);
  LiveOn(past, dice);
  const size_t num_states = past.size();
  for (size_t i = 0; i < num_states && !::testing::Test::HasFailure(); ++i) past.GoBackTo(i);
}

TEST(RestoreRevisionRandomTest, BatchesOnEveryKindOfMesh) {
  uint32_t seed = 40;
  for (auto& [name, mesh] : AllMeshes()) {
    SCOPED_TRACE(name);
    RunOn(std::move(mesh), ++seed);
    if (HasFailure()) return;
  }
}

/// One batch of primitive edits; `model` is told.
void EditOnce(Past& past, RandomEditor& editor) {
  past.mesh().BeginBatch();
  for (int i = editor.Uniform(25); i >= 0; --i) editor.Edit();
  ASSERT_TRUE(past.keeper().Keep(past.mesh()).ok());
  Commit(past.mesh());
  past.Note();
}

TEST(RestoreRevisionRandomTest, PrimitiveEditsOnComplexesWithDuplicatesAndDegenerates) {
  for (uint32_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    Mesh start;
    for (Relation relation : kStorableRelations)
      ASSERT_TRUE(start.StoreRelation(relation, seed % 2 == 0).ok());
    Past past(std::move(start));
    ElementModel model;
    RandomEditor editor(
        past.mesh(), model, seed,
        {.max_vertices = 9, .degenerate_rate = 0.2, .duplicate_rate = 0.15, .attributes = true});
    for (int batch = 0; batch < NumBatches(); ++batch) {
      EditOnce(past, editor);
      if (editor.Uniform(4) == 0) past.GoBackTo(editor.Uniform(past.size()));
      if (HasFailure()) return;
      model = ModelOf(past.mesh());
    }
    const size_t num_states = past.size();
    for (size_t i = 0; i < num_states && !HasFailure(); ++i) past.GoBackTo(i);
  }
}

TEST(RestoreRevisionRandomTest, WhatAnotherMeshIsChangesNothing) {
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    std::vector<Mesh> meshes(2);
    for (Mesh& mesh : meshes) {
      ElementModel model;
      RandomEditor editor(mesh, model, seed * 2 + (&mesh - meshes.data()),
                          {.max_vertices = 9, .degenerate_rate = 0.2, .duplicate_rate = 0.15});
      for (int batch = 0; batch < 6 + 6 * static_cast<int>(&mesh == meshes.data()); ++batch) {
        for (int i = editor.Uniform(25); i >= 0; --i) editor.Edit();
        Commit(mesh);
      }
    }
    const std::string before = Describe(meshes[0]);
    const auto restored = RestoreRevision(meshes[0], meshes[1], {});
    EXPECT_FALSE(restored.ok());
    EXPECT_EQ(Describe(meshes[0]), before);
    EXPECT_EQ(RestoreRevision(meshes[1], meshes[0], {}).status().code(), absl::StatusCode::kOutOfRange);
  }
}

}  // namespace
}  // namespace dynmesh::testing
