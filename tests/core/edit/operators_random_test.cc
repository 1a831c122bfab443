// Random operators on every kind of mesh, sound or broken, in batches that skip what is refused: after each
// batch the mesh equals brute force in every relation and the boundary, and a mirror proves itself; at the
// end all is undone.
//
// DYNMESH_OPERATOR_CALLS: how many on each kind of mesh (default 400).

#include <gtest/gtest.h>

#include <cstdlib>
#include <deque>
#include <random>

#include "core/delta/diff.h"
#include "core/delta/mirror.h"
#include "core/edit/restore_batches.h"
#include "core/edit/transaction.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"
#include "tests/support/random_edits.h"
#include "tests/support/rows.h"

namespace dynmesh::testing {
namespace {

constexpr size_t kMaxElements = 150;  ///< beyond: only what makes them fewer

int NumCalls() {
  const char* calls = std::getenv("DYNMESH_OPERATOR_CALLS");
  return calls != nullptr ? std::atoi(calls) : 400;
}

/// Draws edits for a mesh.
class Dice {
 public:
  Dice(const Mesh& mesh, uint32_t seed) : mesh_(mesh), rng_(seed) {}

  int Uniform(int below) { return std::uniform_int_distribution<int>(0, below - 1)(rng_); }

  Edit AnyOperator() {
    const bool crowded = NumElements() > kMaxElements;
    switch (crowded ? 1 + Uniform(2) : Uniform(8)) {
      case 0:
        return SplitEdgesEdit{AnyEdges(), Parameters(0.1, 0.8), {}, AnyLimits()};
      case 1:
        return CollapseEdgesEdit{
            AnyEdges(), Uniform(2) ? Parameters(0, 1) : std::vector<double>(), {}, AnyLimits()};
      case 2:
        return SwapEdgesEdit{AnyEdges(), AnyLimits()};
      case 3:
        return SwapFacesEdit{{Any(EntityKind::kFace)}, AnyLimits()};
      case 4: {
        const EntityKind kind = kEntityKinds[1 + Uniform(3)];
        return SplitElementsEdit{kind, {Any(kind)}, {}, AnyLimits()};
      }
      case 5:
        return DissolveVerticesEdit{{Any(EntityKind::kVertex)}, AnyLimits()};
      case 6: {
        const SmoothRule rule{.method = static_cast<SmoothMethod>(Uniform(3)),
                              .move_boundary = Uniform(2) == 0,
                              .tangential = Uniform(2) == 0};
        return SmoothVerticesEdit{{Any(EntityKind::kVertex), Any(EntityKind::kVertex)}, rule, 2, AnyLimits()};
      }
      default: {
        const Slot kept = Any(EntityKind::kVertex);  // with itself would be the caller's mistake
        return MergeVerticesEdit{{kept, kept + 1 + Uniform(5)}, {}, AnyLimits()};
      }
    }
  }

 private:
  size_t NumElements() const {
    size_t count = 0;
    for (EntityKind kind : kEntityKinds) count += mesh_.NumElements(kind);
    return count;
  }

  Slot Any(EntityKind kind) { return Uniform(mesh_.slots(kind).limit() + 1); }

  EdgeNames AnyEdges() {
    EdgeNames edges;
    const Slot e = Any(EntityKind::kEdge);
    if (Uniform(2) == 0 && mesh_.IsLive(EdgeId(e))) {
      for (VertexId v : mesh_.Vertices(EdgeId(e))) edges.ends.push_back(v.slot());
      if (Uniform(2) == 0) std::swap(edges.ends[0], edges.ends[1]);
    } else {
      edges.ids = {e};
    }
    return edges;
  }

  std::vector<double> Parameters(double least, double extent) {
    return {least + extent * std::uniform_real_distribution<double>(0, 1)(rng_)};
  }

  PatchLimits AnyLimits() { return {.keep_orientation = Uniform(2) == 0}; }

  const Mesh& mesh_;
  std::mt19937 rng_;
};

/// Applies some operators as one batch, whose image it adds to `images`, or as a dry run that leaves no
/// trace.
void ApplyAndCheck(Mesh& mesh, Dice& dice, Mirror& mirror, std::deque<BatchImage>& images) {
  std::vector<Edit> edits;
  for (int i = dice.Uniform(4); i >= 0; --i) edits.push_back(dice.AnyOperator());
  BatchOptions options;
  options.skip_refused = true;
  options.dry_run = dice.Uniform(8) == 0;
  options.max_lineage = 100'000;
  options.make_image = true;
  const std::string before = options.dry_run ? Describe(mesh) : "";
  auto result = ApplyBatch(mesh, edits, options);
  ASSERT_TRUE(result.ok()) << result.status();
  if (options.dry_run) {
    ASSERT_EQ(Describe(mesh), before);
  } else {
    images.push_front(*std::move(result->image));
  }
  ASSERT_TRUE(mirror.Apply(Diff(mesh, mirror.revision())).ok());
  ExpectEqualsOracle(mesh, ModelOf(mesh));
}

/// Undoes all batches, last one first.
void UndoAll(const Mesh& start, const std::deque<BatchImage>& images, Mesh& mesh, Mirror& mirror) {
  std::vector<const BatchImage*> order;
  for (const BatchImage& image : images) order.push_back(&image);
  const auto restored = RestoreBatches(mesh, order, {});
  ASSERT_TRUE(restored.ok()) << restored.status();
  ASSERT_EQ(mesh.checksum(), start.checksum());
  for (EntityKind kind : kEntityKinds) {
    const auto live = [kind](const Mesh& m) {
      std::vector<Slot> slots;
      m.slots(kind).live().ListMembers(slots);
      return slots;
    };
    ASSERT_EQ(live(mesh), live(start));
  }
  ExpectEqualsOracle(mesh, ModelOf(mesh));
  ASSERT_TRUE(mirror.Apply(Diff(mesh, mirror.revision())).ok());
  ASSERT_EQ(mirror.checksum(), start.checksum());
}

void RunOn(Mesh start, uint32_t seed) {
  for (Relation relation : kStorableRelations) {
    ASSERT_TRUE(start.StoreRelation(relation, seed % 2 == 0).ok());
  }
  for (int calls = 0; calls < NumCalls();) {
    Mesh mesh = start.Clone();
    Dice dice(mesh, seed + calls);
    Mirror mirror;
    std::deque<BatchImage> images;
    for (int batch = 0; batch < 40; ++batch) {
      ApplyAndCheck(mesh, dice, mirror, images);
      if (::testing::Test::HasFailure()) FAIL() << "seed " << seed + calls << ", batch " << batch;
    }
    UndoAll(start, images, mesh, mirror);
    if (::testing::Test::HasFailure()) FAIL() << "seed " << seed + calls << ", undone";
    calls += 100;  // 2.5 a batch
  }
}

TEST(OperatorsRandomTest, OnEveryKindOfMesh) {
  uint32_t seed = 1;
  for (auto& [name, mesh] : AllMeshes()) {
    SCOPED_TRACE(name);
    RunOn(std::move(mesh), ++seed);
    if (HasFailure()) return;
  }
}

TEST(OperatorsRandomTest, OnRandomComplexesWithDuplicatesAndDegenerates) {
  for (uint32_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed);
    for (int i = 0; i < 60; ++i) editor.Edit();
    Commit(mesh);
    RunOn(std::move(mesh), seed);
    if (HasFailure()) return;
  }
}

/// For each kind and each policy that looks at parents a column that holds 5 everywhere, and 7 by default.
void AddConstantColumns(Mesh& mesh) {
  for (EntityKind kind : kEntityKinds) {
    for (AttributePolicy policy :
         {AttributePolicy::kInterpolate, AttributePolicy::kCopy, AttributePolicy::kMax}) {
      const bool narrow = policy == AttributePolicy::kInterpolate;
      const std::string name = "p" + std::to_string(static_cast<int>(policy));
      const AttributeSpec spec = {name, kind,   narrow ? AttributeType::kFloat32 : AttributeType::kUint8,
                                  1,    policy, narrow ? RowOf<float>({7}) : RowOf<uint8_t>({7})};
      ASSERT_TRUE(mesh.AddAttribute(spec).ok());
      const auto row = narrow ? RowOf<float>({5}) : RowOf<uint8_t>({5});
      const int column = mesh.FindAttribute(name, kind);
      mesh.slots(kind).live().ForEach(
          [&](Slot slot) { ASSERT_TRUE(mesh.SetAttribute(column, slot, row).ok()); });
    }
  }
  Commit(mesh);
}

double ValueAt(const AttributeColumn& column, Slot slot) {
  return column.spec().type == AttributeType::kFloat32 ? ValuesOf<float>(column.Row(slot))[0]
                                                       : ValuesOf<uint8_t>(column.Row(slot))[0];
}

void ExpectConstant(const Mesh& mesh, const AttributeColumn& column) {
  const EntityKind kind = column.spec().kind;
  for (Slot slot = 0; slot < mesh.slots(kind).limit(); ++slot) {
    const EntityId id(kind, slot);
    const double value = ValueAt(column, slot);
    if (!mesh.IsLive(id)) {
      ASSERT_EQ(value, 7) << EntityKindName(kind) << " " << slot;
    } else if (kind == EntityKind::kVertex || mesh.IsElement(id)) {
      ASSERT_EQ(value, 5) << EntityKindName(kind) << " " << slot;
    } else {
      ASSERT_TRUE(value == 5 || value == 7) << EntityKindName(kind) << " " << slot;
    }
  }
}

TEST(OperatorsRandomTest, AttributesThatAreConstantStayConstantAndAMirrorHasThem) {
  uint32_t seed = 100;
  for (auto& [name, mesh] : AllMeshes()) {
    SCOPED_TRACE(name);
    AddConstantColumns(mesh);
    Dice dice(mesh, ++seed);
    Mirror mirror;
    std::deque<BatchImage> images;
    for (int batch = 0; batch < 30; ++batch) {
      ApplyAndCheck(mesh, dice, mirror, images);
      for (const AttributeColumn& column : mesh.attributes()) ExpectConstant(mesh, column);
      if (HasFailure()) FAIL() << "seed " << seed << ", batch " << batch;
    }
    ExpectSameRows(mirror.attributes(), mesh);
  }
}

}  // namespace
}  // namespace dynmesh::testing
