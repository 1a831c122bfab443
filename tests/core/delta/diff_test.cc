// The delta law: a copy at revision r, plus Diff(r), equals the mesh. Also through the codec and in parts.

#include "core/delta/diff.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/codec.h"
#include "core/delta/mirror.h"
#include "tests/support/meshes.h"
#include "tests/support/random_edits.h"
#include "tests/support/rows.h"

namespace dynmesh::testing {
namespace {

void ExpectEqual(const Mirror& mirror, const Mesh& mesh) {
  EXPECT_EQ(mirror.revision(), mesh.revision());
  EXPECT_EQ(mirror.checksum(), mesh.checksum());
  EXPECT_TRUE(ModelOf(mirror) == ModelOf(mesh));
  ExpectSameRows(mirror.attributes(), mesh);
}

Delta ThroughCodec(const Delta& delta, Codec codec) {
  EncodeOptions options;
  options.codec = codec;
  const auto bytes = EncodeDelta(delta, options);
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  auto decoded = DecodeDelta(*bytes);
  EXPECT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_TRUE(*decoded == delta);
  return *std::move(decoded);
}

/// Random batches on a mesh with attributes; `after_commit` sees each state.
template <typename Fn>
void RandomHistory(uint32_t seed, int batches, Fn after_commit) {
  Mesh mesh;
  ElementModel model;
  RandomEditOptions options;
  options.attributes = true;
  RandomEditor editor(mesh, model, seed, options);
  for (int batch = 0; batch < batches; ++batch) {
    mesh.BeginBatch();
    for (int i = editor.Uniform(8); i >= 0; --i) editor.Edit();
    Commit(mesh);
    after_commit(mesh, editor);
  }
}

TEST(DiffTest, AnyOldCopyPlusTheDiffEqualsTheMesh) {
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    std::vector<Mirror> copies = {Mirror()};  // copies[r] is at revision r
    RandomHistory(seed, 60, [&](const Mesh& mesh, RandomEditor& editor) {
      for (int i = 0; i < 3; ++i) {
        Mirror copy = copies[editor.Uniform(copies.size())];
        const Delta delta = Diff(mesh, copy.revision());
        ASSERT_TRUE(CheckDelta(delta).ok());
        EXPECT_TRUE(copy.Apply(delta).ok());
        ExpectEqual(copy, mesh);
        EXPECT_TRUE(copy.Apply(delta).ok()) << "twice is harmless";
        ExpectEqual(copy, mesh);
        if (i == 2) copies.push_back(copy);
      }
    });
  }
}

TEST(DiffTest, TheLawHoldsThroughEveryCodec) {
  const Codec codecs[] = {Codec::kUnspecified, Codec::kRaw, Codec::kZstd, Codec::kDraco};
  for (Codec codec : codecs) {
    Mirror copy;
    RandomHistory(11, 40, [&](const Mesh& mesh, RandomEditor& editor) {
      if (editor.Uniform(2) == 0) return;
      EXPECT_TRUE(copy.Apply(ThroughCodec(Diff(mesh, copy.revision()), codec)).ok());
      ExpectEqual(copy, mesh);
    });
  }
}

TEST(DiffTest, PartsTakenWhileTheMeshChangesAndAClosingDiffMakeACopy) {
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    Mirror copy;
    DiffCursor cursor;
    int64_t start = -1;
    int64_t from = 0;
    RandomHistory(seed, 60, [&](const Mesh& mesh, RandomEditor& editor) {
      if (mesh.revision() < 20) return;
      if (start < 0) start = mesh.revision();
      if (!cursor.done()) {
        const Delta part = DiffPart(mesh, from, 1 + editor.Uniform(4), cursor);
        EXPECT_FALSE(part.consistent);
        EXPECT_TRUE(copy.Apply(part).ok());
        return;
      }
      EXPECT_TRUE(copy.Apply(ClosingDiff(mesh, start, from)).ok());
      ExpectEqual(copy, mesh);
      cursor = DiffCursor();
      start = -1;
      from = mesh.revision();
    });
    EXPECT_GT(from, 20) << "no copy was completed";
  }
}

TEST(DiffTest, PartsOfALargeMeshAreBounded) {
  const Mesh mesh = TetGrid(12, 12, 12);
  Mirror copy;
  DiffCursor cursor;
  int parts = 0;
  while (!cursor.done()) {
    const Delta part = DiffPart(mesh, 0, 1000, cursor);
    EXPECT_LE(part.vertex_slots.size() + part.num_upserted_elements(), 1000 + StampColumn::kPageSlots);
    EXPECT_TRUE(copy.Apply(part).ok());
    ++parts;
  }
  EXPECT_GE(parts, 8);
  EXPECT_TRUE(copy.Apply(Diff(mesh, 0)).ok());
  ExpectEqual(copy, mesh);
}

TEST(DiffTest, ADiffHoldsOnlyWhatChanged) {
  Mesh mesh = TetGrid(6, 6, 6);
  ASSERT_TRUE(mesh.MoveVertex(VertexId(5), {9, 9, 9}).ok());
  ASSERT_TRUE(mesh.RemoveElement(CellId(7)).ok());
  Commit(mesh);
  const Delta delta = Diff(mesh, 1);
  EXPECT_THAT(delta.vertex_slots, ::testing::ElementsAre(5));
  EXPECT_THAT(delta.OfKind(EntityKind::kCell).removed, ::testing::ElementsAre(7));
  EXPECT_EQ(delta.num_upserted_elements(), 0u);
  EXPECT_TRUE(Diff(mesh, 2).empty());
}

TEST(MirrorTest, RefusesWhatDoesNotFitAndStaysAsItWas) {
  const Mesh mesh = OneTet();
  Mirror copy;
  ASSERT_TRUE(copy.Apply(Diff(mesh, 0)).ok());
  Delta backwards;
  EXPECT_EQ(ErrorReason(copy.Apply(backwards)), reason::kRevisionMismatch) << "it ends before this copy";
  Delta far;
  far.to_revision = 1;
  far.vertex_slots = {Mirror::kMaxSlots};
  far.positions = {Point{}};
  EXPECT_EQ(copy.Apply(far).code(), absl::StatusCode::kResourceExhausted);
  Delta twice;
  twice.to_revision = 1;
  twice.attributes.push_back({{"a", EntityKind::kVertex, AttributeType::kInt32, 1}, {0}, std::vector<uint8_t>(4)});
  twice.attributes.push_back({{"a", EntityKind::kVertex, AttributeType::kFloat64, 16}, {0}, std::vector<uint8_t>(128)});
  EXPECT_EQ(ErrorReason(copy.Apply(twice)), reason::kCorruptPayload);
  Delta many;
  many.to_revision = 1;
  for (int i = 0; i <= kMaxAttributeColumns; ++i) {
    many.attributes.push_back({{"a" + std::to_string(i), EntityKind::kVertex, AttributeType::kInt32, 1}, {}, {}});
  }
  EXPECT_EQ(ErrorReason(copy.Apply(many)), reason::kCorruptPayload);
  ExpectEqual(copy, mesh);
}

TEST(MirrorTest, RefusesAGapAndSeesADifference) {
  Mesh mesh = OneTet();
  Commit(mesh);
  Mirror copy;
  EXPECT_EQ(ErrorReason(copy.Apply(Diff(mesh, 1))), reason::kRevisionMismatch);
  EXPECT_EQ(copy.num_vertices(), 0u);
  Delta wrong = Diff(mesh, 0);
  wrong.positions[2][0] += 1;
  EXPECT_EQ(ErrorReason(copy.Apply(wrong)), reason::kChecksumMismatch);
  Mirror quantized(Mirror::Geometry::kQuantized);
  EXPECT_TRUE(quantized.Apply(wrong).ok());
  wrong.OfKind(EntityKind::kCell).vertices.pop_back();
  EXPECT_EQ(ErrorReason(quantized.Apply(wrong)), reason::kCorruptPayload);
}

}  // namespace
}  // namespace dynmesh::testing
