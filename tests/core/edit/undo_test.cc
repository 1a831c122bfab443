// Undoing and redoing batches: the mesh is as it was, with all ids of all kinds, all attributes and the
// boundary, and a mirror follows.
//
// DYNMESH_UNDO_BATCHES: how many on each kind of mesh (default 30), and 500 times as many operator calls on
// one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>

#include "absl/strings/str_split.h"
#include "core/delta/diff.h"
#include "core/delta/mirror.h"
#include "core/edit/restore_batches.h"
#include "core/edit/transaction.h"
#include "core/mesh/validate.h"
#include "tests/support/count_down.h"
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

/// The first line that differs, as it is and as it should be.
std::string FirstDifference(const std::string& actual, const std::string& expected) {
  const std::vector<std::string> is = absl::StrSplit(actual, '\n'), should = absl::StrSplit(expected, '\n');
  for (size_t i = 0; i < std::max(is.size(), should.size()); ++i) {
    const std::string left = i < is.size() ? is[i] : "(end)", right = i < should.size() ? should[i] : "(end)";
    if (left != right) return left + "\n  but was\n" + right;
  }
  return "";
}

/// A mesh with what it held after each batch so far, and the images that lead to and fro.
class Chronicle {
 public:
  explicit Chronicle(Mesh mesh) : mesh_(std::move(mesh)) { Note(); }

  Mesh& mesh() { return mesh_; }
  const ElementModel& model() const { return pages_[undos_.size()].model; }
  size_t num_undos() const { return undos_.size(); }
  size_t num_redos() const { return redos_.size(); }

  /// Notes a batch that was committed.
  void Add(BatchImage image) {
    undos_.push_back(std::move(image));
    redos_.clear();
    pages_.resize(undos_.size());
    Note();
  }

  /// Undoes, or redoes, the last `count` batches as one revision.
  void Undo(size_t count) { Move(count, undos_, redos_); }
  void Redo(size_t count) { Move(count, redos_, undos_); }

  /// Fails the test unless undoing can be rolled back without a trace.
  void UndoInVain(size_t count) {
    const std::string before = Describe(mesh_);
    const auto images = Last(count, undos_);
    ASSERT_TRUE(RestoreBatches(mesh_, images, {.dry_run = true}).ok());
    EXPECT_EQ(Describe(mesh_), before);
    EXPECT_THAT(Validate(mesh_), IsEmpty());
  }

 private:
  struct Page {
    std::string content;
    size_t num_columns;
    ElementModel model;
  };

  static std::vector<const BatchImage*> Last(size_t count, const std::vector<BatchImage>& images) {
    std::vector<const BatchImage*> last;
    for (size_t i = 0; i < count; ++i) last.push_back(&images[images.size() - 1 - i]);
    return last;
  }

  void Move(size_t count, std::vector<BatchImage>& from, std::vector<BatchImage>& to) {
    const int64_t revision = mesh_.revision();
    auto restored = RestoreBatches(mesh_, Last(count, from), {});
    ASSERT_TRUE(restored.ok()) << restored.status();
    EXPECT_EQ(restored->revision, revision + 1);
    EXPECT_EQ(restored->checksum, mesh_.checksum());
    from.resize(from.size() - count);
    for (BatchImage& image : restored->images) to.push_back(std::move(image));
    Check();
  }

  void Note() {
    const size_t columns = mesh_.attributes().size();
    pages_.push_back({DescribeContent(mesh_, columns), columns, ModelOf(mesh_)});
    ASSERT_TRUE(mirror_.Apply(Diff(mesh_, mirror_.revision())).ok());
  }

  void Check() {
    const Page& page = pages_[undos_.size()];
    ASSERT_EQ(FirstDifference(DescribeContent(mesh_, page.num_columns), page.content), "");
    EXPECT_THAT(Validate(mesh_), IsEmpty());
    if (++num_checks_ % 8 == 0) ExpectEqualsOracle(mesh_, page.model);
    const absl::Status followed = mirror_.Apply(Diff(mesh_, mirror_.revision()));
    ASSERT_TRUE(followed.ok()) << followed;
    ASSERT_TRUE(ModelOf(mirror_) == page.model);
    ExpectSameRows();
  }

  void ExpectSameRows() {
    for (const AttributeColumn& column : mesh_.attributes()) {
      const auto copy = std::find_if(mirror_.attributes().begin(), mirror_.attributes().end(),
                                     [&](const auto& other) { return other.spec() == column.spec(); });
      ASSERT_NE(copy, mirror_.attributes().end()) << column.spec().name;
      mesh_.slots(column.spec().kind).live().ForEach([&](Slot slot) {
        EXPECT_EQ(copy->Row(slot), column.Row(slot)) << column.spec().name << " " << slot;
      });
    }
  }

  Mesh mesh_;
  Mirror mirror_;
  std::vector<Page> pages_;  ///< pages_[n]: after n batches
  std::vector<BatchImage> undos_, redos_;
  int num_checks_ = 0;
};

/// Applies edits as one batch and notes it.
void Do(Chronicle& chronicle, const std::vector<Edit>& edits) {
  auto applied = ApplyBatch(chronicle.mesh(), edits, {.make_image = true});
  ASSERT_TRUE(applied.ok()) << applied.status();
  chronicle.Add(*std::move(applied->image));
}

void UndoAndRedoAll(Chronicle& chronicle) {
  const size_t count = chronicle.num_undos();
  for (size_t i = 0; i < count; ++i) chronicle.Undo(1);
  chronicle.Redo(count);
  chronicle.UndoInVain(count);
  chronicle.Undo(count);
}

constexpr Slot kFirstNew = kNewVertex;

TEST(UndoTest, TakesBackWhatABatchAddedMovedAndRemoved) {
  Chronicle chronicle(HybridOfFour());
  Do(chronicle,
     {AddVerticesEdit{{{5, 5, 5}}}, AddElementsEdit{ElementType::kTriangle, {0, 1, kFirstNew}},
      MoveVerticesEdit{{2, 3}, {{0, 0, 9}, {-0.0, 0, 8}}}, RemoveElementsEdit{EntityKind::kCell, {0, 3}}});
  UndoAndRedoAll(chronicle);
}

TEST(UndoTest, TellsNothingOfWhatABatchMadeAndRemoved) {
  Mesh mesh = OneTet();
  mesh.BeginBatch();
  const VertexId v = *mesh.AddVertex({1, 2, 3});
  const EntityId wire = Add(mesh, ElementType::kWireEdge, {0, v.slot()});
  ASSERT_TRUE(mesh.RemoveElement(wire).ok());
  ASSERT_TRUE(mesh.RemoveVertex(v).ok());
  EXPECT_EQ(mesh.ImageSince(0).num_items(), 0u);
  mesh.Rollback();
}

TEST(UndoTest, HoldsTheFirstOfManyPositionsAndRows) {
  Chronicle chronicle(OneTet());
  const AttributeSpec spec = {"a", EntityKind::kVertex, AttributeType::kInt32, 1};
  Do(chronicle, {AddAttributeEdit{spec}, SetAttributeEdit{spec, {1, 0}, {1, 0, 0, 0, 2, 0, 0, 0}}});
  Do(chronicle, {MoveVerticesEdit{{1, 0, 1}, {{7, 7, 7}, {8, 8, 8}, {9, 9, 9}}},
                 SetAttributeEdit{spec, {1, 0, 1}, {3, 0, 0, 0, 4, 0, 0, 0, 5, 0, 0, 0}},
                 RemoveElementsEdit{EntityKind::kCell, {0}}, RemoveVerticesEdit{{1}}});
  UndoAndRedoAll(chronicle);
}

TEST(UndoTest, LeavesTheColumnsOfABatchWithoutTheirRows) {
  Chronicle chronicle(OneTet());
  const AttributeSpec spec = {"a", EntityKind::kCell, AttributeType::kInt32, 1};
  Do(chronicle, {AddAttributeEdit{spec}, SetAttributeEdit{spec, {0}, {1, 2, 3, 4}}});
  chronicle.Undo(1);
  ASSERT_EQ(chronicle.mesh().attributes().size(), 1u);
  EXPECT_EQ(chronicle.mesh().attributes()[0].Row(0), std::vector<uint8_t>(4));
  chronicle.Redo(1);
}

TEST(UndoTest, GivesADuplicatesInheritanceBack) {
  Mesh mesh = Disk(5);
  Add(mesh, ElementType::kWireEdge, {1, 0});  // the edge that triangles use becomes an element
  for (int i = 0; i < 2; ++i) Add(mesh, ElementType::kWireEdge, {0, 1});
  for (int i = 0; i < 2; ++i) Add(mesh, ElementType::kTriangle, {0, 2, 1});
  Commit(mesh);
  const Slot face = mesh.FindFace({VertexId(0), VertexId(1), VertexId(2)}).slot();
  const Slot wire = mesh.FindEdge(VertexId(0), VertexId(1)).slot();
  Chronicle chronicle(std::move(mesh));
  Do(chronicle, {RemoveElementsEdit{EntityKind::kFace, {face}}});  // a duplicate takes its place
  Do(chronicle,
     {RemoveElementsEdit{EntityKind::kEdge, {wire}},
      RemoveElementsEdit{EntityKind::kFace,
                         {chronicle.mesh().FindFace({VertexId(0), VertexId(1), VertexId(2)}).slot()}}});
  UndoAndRedoAll(chronicle);
}

TEST(UndoTest, ForgetsAnEdgeWithAllItsDuplicates) {
  Mesh mesh;
  AddVertices(mesh, 3);
  ASSERT_TRUE(mesh.StoreRelation({EntityKind::kVertex, EntityKind::kVertex}, true).ok());
  Commit(mesh);
  Chronicle chronicle(std::move(mesh));
  Do(chronicle, {AddElementsEdit{ElementType::kWireEdge, {0, 1, 1, 0, 0, 1}}});
  UndoAndRedoAll(chronicle);
}

TEST(UndoTest, TurnsFacesAndEdgesBackThatBecameElements) {
  Chronicle chronicle(TetGrid(1, 1, 1));
  Mesh& mesh = chronicle.mesh();
  const CellId c(0);
  const auto face = mesh.Vertices(mesh.Faces(c)[1].face());
  const auto edge = mesh.Vertices(mesh.Edge(c, 2));
  const std::vector<Slot> turned = {face[1].slot(), face[0].slot(), face[2].slot()};
  const std::vector<Slot> flipped = {edge[1].slot(), edge[0].slot()};
  const Slot f = mesh.Faces(c)[1].face().slot();
  Do(chronicle,
     {AddElementsEdit{ElementType::kTriangle, turned}, AddElementsEdit{ElementType::kWireEdge, flipped}});
  Do(chronicle, {RemoveElementsEdit{EntityKind::kFace, {f}},
                 AddElementsEdit{ElementType::kTriangle, {turned[1], turned[0], turned[2]}},
                 RemoveElementsEdit{EntityKind::kCell, {0, 1, 2, 3, 4, 5}}});
  UndoAndRedoAll(chronicle);
}

TEST(UndoTest, FindsEdgesAndFacesOfHubsAgain) {
  constexpr int kMany = 600;  // more than 512: looked up by hashing
  Mesh mesh = Book(kMany);
  std::vector<Slot> all(kMany);
  for (int i = 0; i < kMany; ++i) all[i] = i;
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.RemoveElements(EntityKind::kFace, all).ok());
  const BatchImage undo = mesh.ImageSince(0);
  Commit(mesh);
  const auto undone = RestoreBatches(mesh, {&undo}, {});
  ASSERT_TRUE(undone.ok()) << undone.status();
  EXPECT_THAT(Validate(mesh), IsEmpty());
  EXPECT_TRUE(mesh.FindEdge(VertexId(0), VertexId(1)).valid());
  const BatchImage* const redo = &undone->images[0];
  ASSERT_TRUE(RestoreBatches(mesh, {redo}, {}).ok());
  EXPECT_THAT(Validate(mesh), IsEmpty());
  EXPECT_EQ(mesh.NumLive(EntityKind::kEdge), 0u);
}

TEST(UndoTest, PutsFormerOccupantsBackIntoSlotsThatWereGivenOutAgain) {
  Chronicle chronicle(TetWithDanglers());
  Do(chronicle, {RemoveElementsEdit{EntityKind::kCell, {0}}, RemoveElementsEdit{EntityKind::kFace, {4}},
                 RemoveElementsEdit{EntityKind::kEdge, {8}}});
  const Slot limit = chronicle.mesh().slots(EntityKind::kFace).limit();
  Do(chronicle, {AddElementsEdit{ElementType::kTetrahedron, {1, 0, 2, 4}}});
  Do(chronicle,
     {AddElementsEdit{ElementType::kWireEdge, {0, 3}}, AddElementsEdit{ElementType::kTriangle, {3, 2, 1}}});
  EXPECT_EQ(chronicle.mesh().slots(EntityKind::kFace).limit(), limit) << "no slot was given out again";
  UndoAndRedoAll(chronicle);
}

TEST(UndoTest, SaysThatWhatCameBackIsYounger) {
  Mesh mesh = OneTet();
  auto removed = ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, {0}}}, {.make_image = true});
  ASSERT_TRUE(removed.ok());
  ASSERT_TRUE(RestoreBatches(mesh, {&*removed->image}, {}).ok());
  EXPECT_TRUE(mesh.CheckLive(CellId(0), 3).ok());
  EXPECT_EQ(ErrorReason(mesh.CheckLive(CellId(0), 2)), reason::kEntityRemoved);
}

TEST(UndoTest, AnImageOfAnotherStateIsRefusedAndChangesNothing) {
  Mesh mesh = TetGrid(1, 1, 1);
  auto removed = ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, {0}}}, {.make_image = true});
  ASSERT_TRUE(removed.ok());
  ASSERT_TRUE(ApplyBatch(mesh, {RemoveElementsEdit{EntityKind::kCell, {1}}}, {}).ok());
  const std::string before = Describe(mesh);
  EXPECT_EQ(RestoreBatches(mesh, {&*removed->image}, {}).status().code(), absl::StatusCode::kInternal);
  EXPECT_EQ(Describe(mesh), before);
}

TEST(UndoTest, WhoStopsItHasChangedNothing) {
  Chronicle chronicle(TetGrid(1, 1, 1));
  std::vector<BatchImage> images;
  for (Slot c : {0, 1, 2}) {
    auto removed =
        ApplyBatch(chronicle.mesh(), {RemoveElementsEdit{EntityKind::kCell, {c}}}, {.make_image = true});
    ASSERT_TRUE(removed.ok());
    images.push_back(*std::move(removed->image));
  }
  const std::string before = Describe(chronicle.mesh());
  CountDown meter(images[2].num_items() + 1);
  const auto stopped =
      RestoreBatches(chronicle.mesh(), {&images[2], &images[1], &images[0]}, {.meter = meter});
  EXPECT_EQ(stopped.status(), CountDown::error());
  EXPECT_EQ(meter.charges_after_end(), 0);
  EXPECT_EQ(Describe(chronicle.mesh()), before);
}

/// Draws batches of every kind of edit. Some are refused: those that remove what they have removed before.
class BatchDice {
 public:
  BatchDice(const Mesh& mesh, uint32_t seed) : mesh_(mesh), rng_(seed) {}

  int Uniform(int below) { return std::uniform_int_distribution<int>(0, below - 1)(rng_); }

  /// One call of an operator, or a small move.
  Edit AnyOperator() {
    const bool crowded = mesh_.NumElements(EntityKind::kCell) > 2000;
    switch (Uniform(crowded ? 3 : 6)) {
      case 0:
        return CollapseEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {}, {}, {}};
      case 1:
        return SwapEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {}};
      case 2:
        return SwapFacesEdit{{Any(EntityKind::kFace)}, {}};
      case 3:
        return SplitEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {}, {}, {}};
      case 4:
        return SplitElementsEdit{EntityKind::kCell, {Any(EntityKind::kCell)}, {}, {}};
      default: {
        const Slot v = Any(EntityKind::kVertex);
        Point place = mesh_.Position(VertexId(v));
        place[Uniform(3)] += 1e-3;
        return MoveVerticesEdit{{v}, {place}};
      }
    }
  }

  std::vector<Edit> AnyBatch() {
    std::vector<Edit> edits;
    for (int i = Uniform(4); i >= 0; --i) edits.push_back(AnyEdit());
    return edits;
  }

 private:
  static constexpr size_t kMaxElements = 80;  ///< beyond: only what makes them fewer

  Edit AnyEdit() {
    const bool crowded =
        mesh_.NumElements(EntityKind::kFace) + mesh_.NumElements(EntityKind::kCell) > kMaxElements;
    switch (Uniform(crowded ? 6 : 12)) {
      case 0:
      case 1:
        return RemoveElementsEdit{kind_ = kEntityKinds[1 + Uniform(3)], {AnyElement(kind_)}};
      case 2:
        return CollapseEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {}, {}, {}};
      case 3:
        return MoveVerticesEdit{{Any(EntityKind::kVertex)}, {AnyPoint()}};
      case 4:
        return AnyAttributeEdit();
      case 5:
        return SwapEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {.keep_orientation = false}};
      case 6:
        return SplitEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {}, {}, {}};
      case 7:
        return SplitElementsEdit{kind_ = kEntityKinds[1 + Uniform(3)], {AnyElement(kind_)}, {}, {}};
      case 8:
        return MergeVerticesEdit{{Any(EntityKind::kVertex), Any(EntityKind::kVertex)}, {}, {}};
      case 9:
        return AddVerticesEdit{{AnyPoint(), AnyPoint()}};
      default:
        return AnyAddition();
    }
  }

  Edit AnyAddition() {
    AddElementsEdit edit{kElementTypes[Uniform(std::size(kElementTypes))], {}};
    for (int k = 0; k < NumVertices(edit.type); ++k) edit.vertices.push_back(Any(EntityKind::kVertex));
    return edit;
  }

  Edit AnyAttributeEdit() {
    if (mesh_.attributes().size() < 4 && Uniform(3) == 0) {
      const EntityKind kind = kEntityKinds[Uniform(kNumEntityKinds)];
      AttributeSpec spec = {"a" + std::to_string(mesh_.attributes().size()), kind, AttributeType::kFloat64,
                            1};
      if (Uniform(2) == 0) spec.default_row = {0, 0, 0, 0, 0, 0, 0xf0, 0x3f};
      return AddAttributeEdit{spec};
    }
    if (mesh_.attributes().empty()) return AddVerticesEdit{{AnyPoint()}};
    SetAttributeEdit edit{mesh_.attributes()[Uniform(mesh_.attributes().size())].spec(), {}, {}};
    edit.slots = {Any(edit.spec.kind)};
    edit.rows = std::vector<uint8_t>(sizeof(double));
    edit.rows[6] = Uniform(256);
    return edit;
  }

  Slot Any(EntityKind kind) {
    const BitSet& live = mesh_.slots(kind).live();
    if (live.empty()) return 0;
    const Slot slot = live.Next(Uniform(mesh_.slots(kind).limit()));
    return slot == kNoSlot ? live.Next(0) : slot;
  }

  Slot AnyElement(EntityKind kind) {
    for (int tries = 0; tries < 10; ++tries) {
      const Slot slot = Any(kind);
      if (mesh_.IsLive({kind, slot}) && mesh_.IsElement({kind, slot})) return slot;
    }
    return Any(kind);
  }

  Point AnyPoint() {
    std::uniform_real_distribution<> uniform(-1, 1);
    return {uniform(rng_), uniform(rng_), uniform(rng_)};
  }

  const Mesh& mesh_;
  std::mt19937 rng_;
  EntityKind kind_ = EntityKind::kCell;
};

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
