// Random histories of random meshes, kept by records and by checkpoints that are never done in one go. At any
// moment the archive gives back the mesh, and both go on in the same way.
//
// DYNMESH_ARCHIVE_BATCHES: how many on each mesh (default 40).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "core/edit/restore_batches.h"
#include "core/edit/run_batch.h"
#include "core/edit/transaction.h"
#include "tests/core/archive/archive_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/random_edits.h"

namespace dynmesh::testing {
namespace {

int NumBatches() {
  const char* batches = std::getenv("DYNMESH_ARCHIVE_BATCHES");
  return batches != nullptr ? std::atoi(batches) : 40;
}

/// Draws operators and other edits of any kind; some are refused.
class EditDice {
 public:
  explicit EditDice(uint32_t seed) : rng_(seed) {}

  int Uniform(int below) { return std::uniform_int_distribution<int>(0, below - 1)(rng_); }

  std::vector<Edit> AnyBatch(const Mesh& mesh) {
    std::vector<Edit> edits;
    for (int i = Uniform(4); i >= 0; --i) edits.push_back(AnyEdit(mesh));
    return edits;
  }

 private:
  Edit AnyEdit(const Mesh& mesh) {
    const bool crowded = mesh.NumElements(EntityKind::kFace) + mesh.NumElements(EntityKind::kCell) > 100;
    const EntityKind kind = kEntityKinds[1 + Uniform(3)];
    switch (Uniform(crowded ? 6 : 11)) {
      case 0:
      case 1:
        return RemoveElementsEdit{kind, {Any(mesh, kind)}};
      case 2:
        return CollapseEdgesEdit{{{Any(mesh, EntityKind::kEdge)}, {}}, {}, {}, {}};
      case 3:
        return MoveVerticesEdit{{Any(mesh, EntityKind::kVertex)}, {AnyPoint()}};
      case 4:
        return AnyAttribute(mesh);
      case 5:
        return SwapEdgesEdit{{{Any(mesh, EntityKind::kEdge)}, {}}, {.keep_orientation = false}};
      case 6:
        return SplitEdgesEdit{{{Any(mesh, EntityKind::kEdge)}, {}}, {}, {}, {}};
      case 7:
        return SplitElementsEdit{kind, {Any(mesh, kind)}, {}, {}};
      case 8:
        return AddVerticesEdit{{AnyPoint(), AnyPoint()}};
      case 9:
        return SwapFacesEdit{{Any(mesh, EntityKind::kFace)}, {}};
      default:
        return AnyAddition(mesh);
    }
  }

  Edit AnyAddition(const Mesh& mesh) {
    AddElementsEdit edit{kElementTypes[Uniform(std::size(kElementTypes))], {}};
    for (int k = 0; k < NumVertices(edit.type); ++k) {
      edit.vertices.push_back(Any(mesh, EntityKind::kVertex));
    }
    return edit;
  }

  Edit AnyAttribute(const Mesh& mesh) {
    if (mesh.attributes().size() < 4 && Uniform(3) == 0) {
      AttributeSpec spec{"a" + std::to_string(mesh.attributes().size()), kEntityKinds[Uniform(4)],
                         AttributeType::kFloat64, 1};
      if (Uniform(2) == 0) spec.default_row = {0, 0, 0, 0, 0, 0, 0xf0, 0x3f};
      return AddAttributeEdit{spec};
    }
    if (mesh.attributes().empty()) return AddVerticesEdit{{AnyPoint()}};
    SetAttributeEdit edit{mesh.attributes()[Uniform(mesh.attributes().size())].spec(), {}, {}};
    edit.slots = {Any(mesh, edit.spec.kind)};
    edit.rows = std::vector<uint8_t>(sizeof(double));
    edit.rows[6] = Uniform(256);
    return edit;
  }

  Slot Any(const Mesh& mesh, EntityKind kind) {
    const BitSet& live = mesh.slots(kind).live();
    if (live.empty()) return 0;
    const Slot slot = live.Next(Uniform(mesh.slots(kind).limit()));
    return slot == kNoSlot ? live.Next(0) : slot;
  }

  Point AnyPoint() {
    std::uniform_real_distribution<> uniform(-1, 1);
    return {uniform(rng_), uniform(rng_), uniform(rng_)};
  }

  std::mt19937 rng_;
};

/// Takes the record of a batch when it has passed all checks.
class RecordTaker : public BatchChecker {
 public:
  explicit RecordTaker(ArchiveKeeper& keeper) : keeper_(keeper) {}
  absl::Status Check(const Mesh& mesh, WorkMeter&, std::vector<BatchWarning>&) override {
    keeper_.Keep(mesh);
    return absl::OkStatus();
  }

 private:
  ArchiveKeeper& keeper_;
};

/// Begins a checkpoint now and then, and copies some pages of one that is under way.
void Checkpoint(const Mesh& mesh, ArchiveKeeper& keeper, std::mt19937& rng) {
  if (!keeper.is_checkpointing() && rng() % 4 == 0) keeper.BeginCheckpoint(mesh);
  while (keeper.is_checkpointing() && rng() % 2 == 0) keeper.CopyPage(mesh, 0);
}

Mesh ExpectRebuilds(const ArchiveKeeper& keeper, const Mesh& mesh, uint32_t seed) {
  absl::StatusOr<Mesh> rebuilt = Rebuild(keeper.archive(), seed);
  EXPECT_TRUE(rebuilt.ok()) << rebuilt.status();
  if (!rebuilt.ok()) return Mesh();
  ExpectIdentical(*rebuilt, mesh);
  return *std::move(rebuilt);
}

TEST(ArchiveRandomTest, PrimitiveEditsWithRollbacksAndUndo) {
  for (uint32_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(
        mesh, model, seed,
        {.max_vertices = 9, .degenerate_rate = 0.2, .duplicate_rate = 0.15, .attributes = true});
    ArchiveKeeper keeper(mesh);
    std::vector<BatchImage> undos;
    for (int batch = 0; batch < NumBatches(); ++batch) {
      mesh.BeginBatch();
      if (!undos.empty() && editor.Uniform(4) == 0) {
        ASSERT_TRUE(mesh.Restore(undos.back()).ok());
        undos.pop_back();
        model = ModelOf(mesh);
      } else {
        for (int i = editor.Uniform(25); i >= 0; --i) editor.Edit();
        const Mesh::Savepoint savepoint = mesh.MakeSavepoint();
        const ElementModel before = model;
        if (editor.Uniform(3) == 0) {
          for (int i = editor.Uniform(10); i >= 0; --i) editor.Edit();
          mesh.RollbackTo(savepoint);
          model = before;
        }
        undos.push_back(mesh.ImageSince(0));
      }
      keeper.Keep(mesh);
      Commit(mesh);
      Checkpoint(mesh, keeper, editor.rng());
      if (editor.Uniform(3) == 0) {  // a batch that comes to nothing leaves no trace
        const ElementModel before = model;
        mesh.BeginBatch();
        for (int i = editor.Uniform(10); i >= 0; --i) editor.Edit();
        mesh.Rollback();
        model = before;
      }
      ExpectRebuilds(keeper, mesh, editor.Uniform(3));
      if (HasFailure()) return;
    }
  }
}

TEST(ArchiveRandomTest, TheSameEditsGiveBothTheSameIds) {
  for (uint32_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    const RandomEditOptions options = {
        .max_vertices = 12, .degenerate_rate = 0.1, .duplicate_rate = 0.15, .attributes = true};
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed, options);
    ArchiveKeeper keeper(mesh);
    for (int batch = 0; batch < NumBatches(); ++batch) {
      mesh.BeginBatch();
      for (int i = editor.Uniform(20); i >= 0; --i) editor.Edit();
      keeper.Keep(mesh);
      Commit(mesh);
      Checkpoint(mesh, keeper, editor.rng());
    }
    Mesh rebuilt = ExpectRebuilds(keeper, mesh, seed);
    ElementModel copied = model;
    RandomEditor first(mesh, model, seed + 100, options), second(rebuilt, copied, seed + 100, options);
    for (int batch = 0; batch < NumBatches() && !HasFailure(); ++batch) {
      for (int i = first.Uniform(20); i >= 0; --i) first.Edit();
      for (int i = second.Uniform(20); i >= 0; --i) second.Edit();
      Commit(mesh);
      Commit(rebuilt);
      ASSERT_TRUE(model == copied);
    }
    ExpectIdentical(rebuilt, mesh);
  }
}

void RunOperators(Mesh mesh, uint32_t seed) {
  SCOPED_TRACE(seed);
  EditDice dice(seed);
  std::mt19937 rng(seed);
  ArchiveKeeper keeper(mesh);
  RecordTaker taker(keeper);
  int num_applied = 0;
  for (int batch = 0; batch < NumBatches() && !::testing::Test::HasFailure(); ++batch) {
    const auto edits = dice.AnyBatch(mesh);
    const absl::Status applied = ApplyBatch(mesh, edits, {.skip_refused = true, .checker = &taker}).status();
    num_applied += applied.ok();
    Checkpoint(mesh, keeper, rng);
    if (applied.ok() && rng() % 4 == 0) ExpectRebuilds(keeper, mesh, seed);
  }
  EXPECT_GT(num_applied, NumBatches() / 5);
  Mesh rebuilt = ExpectRebuilds(keeper, mesh, 0);
  EditDice first(seed + 1), second(seed + 1);
  for (int batch = 0; batch < NumBatches() && !::testing::Test::HasFailure(); ++batch) {
    const auto edits = first.AnyBatch(mesh), same_edits = second.AnyBatch(rebuilt);
    const auto applied = ApplyBatch(mesh, edits, {.skip_refused = true});
    const auto applied_too = ApplyBatch(rebuilt, same_edits, {.skip_refused = true});
    ASSERT_EQ(applied.status(), applied_too.status());
    ASSERT_EQ(mesh.checksum(), rebuilt.checksum());
  }
  ExpectIdentical(rebuilt, mesh);
}

TEST(ArchiveRandomTest, OperatorsOnEveryKindOfMesh) {
  uint32_t seed = 20;
  for (auto& [name, mesh] : AllMeshes()) {
    SCOPED_TRACE(name);
    RunOperators(std::move(mesh), ++seed);
    if (HasFailure()) return;
  }
}

TEST(ArchiveRandomTest, ManySplitsAndCollapsesOverManyPages) {
  const uint32_t seed = 7;
  SCOPED_TRACE(seed);
  Mesh mesh = TetGrid(5, 5, 5);
  std::mt19937 rng(seed);
  ArchiveKeeper keeper(mesh);
  RecordTaker taker(keeper);
  for (int batch = 0; batch < 25 * NumBatches(); ++batch) {
    const BitSet& edges = mesh.slots(EntityKind::kEdge).live();
    const Slot e = edges.Next(rng() % mesh.slots(EntityKind::kEdge).limit());
    if (e == kNoSlot) continue;
    const Edit edit = rng() % 5 < 3 ? Edit(SplitEdgesEdit{{{e}, {}}, {}, {}, {}})
                                    : Edit(CollapseEdgesEdit{{{e}, {}}, {}, {}, {}});
    ApplyBatch(mesh, {edit}, {.checker = &taker}).IgnoreError();
    Checkpoint(mesh, keeper, rng);
    if (batch % 200 == 0) ExpectRebuilds(keeper, mesh, batch);
    if (HasFailure()) return;
  }
  ExpectRebuilds(keeper, mesh, 0);
}

}  // namespace
}  // namespace dynmesh::testing
