// Random edits against brute force, and exact roll-back.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/validate.h"
#include "tests/support/meshes.h"
#include "tests/support/random_edits.h"

namespace dynmesh::testing {
namespace {

struct Mix {
  const char* name;
  RandomEditOptions options;
};

class MeshRandomTest : public ::testing::TestWithParam<Mix> {};

TEST_P(MeshRandomTest, EveryStateEqualsBruteForce) {
  for (uint32_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed, GetParam().options);
    for (int batch = 0; batch < 30; ++batch) {
      for (int i = editor.Uniform(6); i >= 0; --i) editor.Edit();
      Commit(mesh);
      ExpectEqualsOracle(mesh, model);
      if (HasFailure()) FAIL() << "seed " << seed << " batch " << batch;
    }
  }
}

void StoreAll(Mesh& mesh) {
  for (Relation relation : kStorableRelations) ASSERT_TRUE(mesh.StoreRelation(relation, true).ok());
}

TEST_P(MeshRandomTest, StoredRelationsStayCurrentWheneverTheyAreSwitched) {
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed, GetParam().options);
    if (seed % 2 == 0) StoreAll(mesh);
    for (int batch = 0; batch < 30; ++batch) {
      const Relation relation = kStorableRelations[editor.Uniform(kNumStorableRelations)];
      ASSERT_TRUE(mesh.StoreRelation(relation, editor.Uniform(3) > 0).ok());
      const ElementModel before = model;
      mesh.BeginBatch();
      for (int i = editor.Uniform(8); i >= 0; --i) editor.Edit();
      if (editor.Uniform(4) == 0) {
        mesh.Rollback();
        model = before;
      } else {
        Commit(mesh);
      }
      ExpectEqualsOracle(mesh, model);
      if (HasFailure()) FAIL() << "seed " << seed << " batch " << batch;
    }
  }
}

TEST_P(MeshRandomTest, RollbackRestoresEverything) {
  RandomEditOptions options = GetParam().options;
  options.attributes = true;
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed, options);
    for (int batch = 0; batch < 30; ++batch) {
      const std::string before = Describe(mesh);
      const ElementModel model_before = model;
      mesh.BeginBatch();
      for (int i = editor.Uniform(12); i >= 0; --i) editor.Edit();
      if (editor.Uniform(2) == 0) {
        Commit(mesh);
        continue;
      }
      mesh.Rollback();
      model = model_before;
      ASSERT_EQ(Describe(mesh), before) << "seed " << seed << " batch " << batch;
      ASSERT_THAT(Validate(mesh), ::testing::IsEmpty());
    }
    ExpectEqualsOracle(mesh, model);
  }
}

TEST_P(MeshRandomTest, PilesOfThousandsOnFewVerticesStaySound) {
  RandomEditOptions options = GetParam().options;
  options.max_vertices = 5;  // every list becomes long, and every cycle has many duplicates
  Mesh mesh;
  ElementModel model;
  RandomEditor editor(mesh, model, 3, options);
  StoreAll(mesh);
  for (int batch = 0; batch < 8; ++batch) {
    const ElementModel before = model;
    mesh.BeginBatch();
    for (int i = 0; i < 1000; ++i) editor.Edit();
    if (batch % 4 == 3) {
      mesh.Rollback();
      model = before;
    } else {
      Commit(mesh);
    }
    ASSERT_THAT(Validate(mesh), ::testing::IsEmpty()) << "batch " << batch;
    ASSERT_TRUE(ModelOf(mesh) == model) << "batch " << batch;
  }
  while (!model.elements.empty()) {
    ASSERT_TRUE(mesh.RemoveElement(model.elements.begin()->first).ok());
    model.elements.erase(model.elements.begin());
  }
  EXPECT_EQ(mesh.NumLive(EntityKind::kEdge), 0u);
  EXPECT_THAT(Validate(mesh), ::testing::IsEmpty());
}

TEST_P(MeshRandomTest, ARefusedBatchLeavesNoTraceInWhatFollows) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    Mesh straight, detour;
    ElementModel straight_model, detour_model;
    RandomEditor go(straight, straight_model, seed, GetParam().options);
    RandomEditor wander(detour, detour_model, seed, GetParam().options);
    for (int batch = 0; batch < 20; ++batch) {
      const ElementModel before = detour_model;
      detour.BeginBatch();
      RandomEditor(detour, detour_model, seed + batch, GetParam().options).Edit();
      RandomEditor(detour, detour_model, seed * batch, GetParam().options).Edit();
      detour.Rollback();
      detour_model = before;
      for (RandomEditor* editor : {&go, &wander}) {
        for (int i = 0; i < 8; ++i) editor->Edit();
      }
      Commit(straight);
      Commit(detour);
      ASSERT_EQ(Describe(straight), Describe(detour)) << "seed " << seed << " batch " << batch;
    }
  }
}

TEST_P(MeshRandomTest, RemovingAllElementsLeavesOnlyVertices) {
  Mesh mesh;
  ElementModel model;
  RandomEditor editor(mesh, model, 7, GetParam().options);
  for (int i = 0; i < 300; ++i) editor.Edit();
  Commit(mesh);
  for (const auto& [id, element] : model.elements) ASSERT_TRUE(mesh.RemoveElement(id).ok());
  Commit(mesh);
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    EXPECT_EQ(mesh.NumLive(kind), 0u);
    EXPECT_TRUE(mesh.Boundary(kind).empty());
  }
  EXPECT_TRUE(mesh.Boundary(EntityKind::kVertex).empty());
  EXPECT_THAT(Validate(mesh), ::testing::IsEmpty());
}

/// Few elements go and many equal ones come.
RandomEditOptions Piles() {
  RandomEditOptions options;
  options.duplicate_rate = 0.3;
  return options;
}

RandomEditOptions Only(std::vector<ElementType> types) {
  RandomEditOptions options;
  options.types = std::move(types);
  return options;
}

INSTANTIATE_TEST_SUITE_P(
    Mixes, MeshRandomTest,
    ::testing::Values(Mix{"Everything", {}}, Mix{"Piles", Piles()},
                      Mix{"Tets", Only({ElementType::kTetrahedron})},
                      Mix{"Hexes", Only({ElementType::kHexahedron})},
                      Mix{"Hybrid", Only({ElementType::kTetrahedron, ElementType::kPyramid,
                                          ElementType::kPrism, ElementType::kHexahedron})},
                      Mix{"Surfaces", Only({ElementType::kTriangle, ElementType::kQuad})},
                      Mix{"Wires", Only({ElementType::kWireEdge})},
                      Mix{"TetsAndDanglers",
                          Only({ElementType::kTetrahedron, ElementType::kTriangle, ElementType::kWireEdge})}),
    [](const auto& mix) { return mix.param.name; });

}  // namespace
}  // namespace dynmesh::testing
