#include "tests/core/edit/past.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <utility>

#include "core/delta/diff.h"
#include "core/edit/restore_batches.h"
#include "core/edit/restore_revision.h"
#include "core/mesh/validate.h"
#include "tests/core/edit/chronicle.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

void ExpectSameParts(const Mesh& mesh, const Mesh& then) {
  then.slots(EntityKind::kFace).live().ForEach([&](Slot slot) {
    EXPECT_EQ(mesh.Edges(FaceId(slot)), then.Edges(FaceId(slot))) << "face " << slot;
  });
  then.slots(EntityKind::kCell).live().ForEach([&](Slot slot) {
    const auto is = mesh.Faces(CellId(slot)), should = then.Faces(CellId(slot));
    ASSERT_EQ(is.size(), should.size());
    for (size_t i = 0; i < is.size(); ++i) EXPECT_EQ(is[i].packed(), should[i].packed()) << "cell " << slot;
  });
}

void ExpectSameBits(const Mesh& mesh, const Mesh& then) {
  then.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(std::bit_cast<uint64_t>(mesh.Position(VertexId(slot))[i]),
                std::bit_cast<uint64_t>(then.Position(VertexId(slot))[i]));
    }
  });
}

void ExpectDefaultRows(const Mesh& mesh, const AttributeColumn& column) {
  mesh.slots(column.spec().kind).live().ForEach([&](Slot slot) {
    EXPECT_EQ(column.Row(slot), column.default_row()) << column.spec().name << " " << slot;
  });
}

void ExpectSameRows(const Mesh& mesh, const Mirror& mirror) {
  for (const AttributeColumn& column : mesh.attributes()) {
    const auto copy = std::find_if(mirror.attributes().begin(), mirror.attributes().end(),
                                   [&](const auto& other) { return other.spec() == column.spec(); });
    ASSERT_NE(copy, mirror.attributes().end()) << column.spec().name;
    mesh.slots(column.spec().kind).live().ForEach([&](Slot slot) {
      ASSERT_EQ(copy->Row(slot), column.Row(slot)) << column.spec().name << " " << slot;
    });
  }
}

/// Whether the slot holds another entity in the two, or an entity in one of them.
bool IsAnother(const Mesh& a, const Mesh& b, EntityId id) {
  return a.IsLive(id) != b.IsLive(id) ||
         (a.IsLive(id) && a.slots(id.kind).Born(id.slot) != b.slots(id.kind).Born(id.slot));
}

void ExpectChanged(const Mesh& mesh, const Mesh& before, EntityId id) {
  if (IsAnother(mesh, before, id)) return;
  ASSERT_TRUE(mesh.IsLive(id)) << "what is stamped at " << EntityKindName(id.kind) << " " << id.slot;
  if (id.kind == EntityKind::kVertex) {
    EXPECT_FALSE(mesh.Position(VertexId(id.slot)) == before.Position(VertexId(id.slot))) << id.slot;
  } else {
    EXPECT_TRUE(mesh.IsElement(id) != before.IsElement(id) || mesh.VerticesOf(id) != before.VerticesOf(id))
        << EntityKindName(id.kind) << " " << id.slot;
  }
}

void ExpectBirthsOfDifference(const Mesh& mesh, const Mesh& before) {
  for (EntityKind kind : kEntityKinds) {
    mesh.slots(kind).live().ForEach([&](Slot slot) {
      const Stamp born = mesh.slots(kind).Born(slot);
      const bool is_new = born == static_cast<Stamp>(mesh.revision());
      EXPECT_EQ(IsAnother(mesh, before, {kind, slot}), is_new) << EntityKindName(kind) << " " << slot;
    });
  }
}

}  // namespace

void ExpectSameContent(const Mesh& mesh, const Mesh& then) {
  const size_t columns = then.attributes().size();
  EXPECT_THAT(Validate(mesh), ::testing::IsEmpty());
  ASSERT_EQ(FirstDifference(DescribeContent(mesh, columns), DescribeContent(then, columns)), "");
  ExpectSameParts(mesh, then);
  ExpectSameBits(mesh, then);
  for (size_t i = columns; i < mesh.attributes().size(); ++i) ExpectDefaultRows(mesh, mesh.attributes()[i]);
  EXPECT_TRUE(mesh.FitNow() == then.FitNow());
}

void ExpectStampsOfDifference(const Mesh& mesh, const Mesh& before) {
  const Stamp since = static_cast<Stamp>(before.revision());
  for (EntityKind kind : kEntityKinds) {
    const StampColumn& changed = mesh.changed(kind);
    changed.ForEachSince(since, 0, changed.size(), [&](Slot slot) {
      ExpectChanged(mesh, before, {kind, slot});
    });
  }
  ExpectBirthsOfDifference(mesh, before);
  for (size_t i = 0; i < before.attributes().size(); ++i) {
    const AttributeColumn &is = mesh.attributes()[i], &was = before.attributes()[i];
    is.stamps().ForEachSince(since, 0, is.stamps().size(), [&](Slot slot) {
      const bool another = IsAnother(mesh, before, {is.spec().kind, slot});
      EXPECT_TRUE(another || is.Row(slot) != was.Row(slot)) << is.spec().name << " " << slot;
    });
  }
}

void Past::Note() {
  pages_.push_back({mesh_.Clone(), Mirror()});
  ASSERT_TRUE(pages_.back().mirror.Apply(Diff(mesh_, 0)).ok());
}

void Past::GoBackTo(size_t i) {
  const Mesh then = pages_[i].mesh.Clone();
  const bool from_archive = i % 2 == 0;
  if (!from_archive) return Restore(then, then);
  const absl::StatusOr<Mesh> rebuilt = Rebuild(Archive::Of(then));
  ASSERT_TRUE(rebuilt.ok()) << rebuilt.status();
  Restore(*rebuilt, then);
}

void Past::Restore(const Mesh& target, const Mesh& then) {
  const Mesh before = mesh_.Clone();
  RestoreInVain(target);
  const auto restored = RestoreRevision(mesh_, target, {.keeper = &keeper_});
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(restored->revision, before.revision() + 1);
  EXPECT_EQ(restored->revision, mesh_.revision());
  EXPECT_EQ(restored->checksum, mesh_.checksum());
  EXPECT_EQ(restored->counts, then.FitNow().num_live);
  ASSERT_EQ(restored->images.size(), 1u);
  Check(before, then);
  if (::testing::Test::HasFailure()) return;
  BatchImage redo, undo;
  RestoreImage(restored->images[0], before, redo);
  if (!::testing::Test::HasFailure()) RestoreImage(redo, then, undo);
}

void Past::RestoreInVain(const Mesh& target) {
  const std::string before = Describe(mesh_);
  const auto dry = RestoreRevision(mesh_, target, {.dry_run = true, .keeper = &keeper_});
  ASSERT_TRUE(dry.ok()) << dry.status();
  EXPECT_EQ(dry->revision, mesh_.revision());
  EXPECT_EQ(dry->checksum, target.checksum());
  EXPECT_TRUE(dry->images.empty());
  ASSERT_EQ(FirstDifference(Describe(mesh_), before), "");
}

void Past::RestoreImage(const BatchImage& image, const Mesh& then, BatchImage& inverse) {
  const Mesh before = mesh_.Clone();
  auto restored = RestoreBatches(mesh_, {&image}, {.keeper = &keeper_});
  ASSERT_TRUE(restored.ok()) << restored.status();
  ASSERT_EQ(restored->images.size(), 1u);
  inverse = std::move(restored->images[0]);
  Check(before, then);
}

void Past::Check(const Mesh& before, const Mesh& then) {
  ExpectSameContent(mesh_, then);
  ExpectStampsOfDifference(mesh_, before);
  CheckMirrors();
  if (::testing::Test::HasFailure()) return;
  if (++num_checks_ % 8 == 0) ExpectEqualsOracle(mesh_, ModelOf(then));
  const absl::StatusOr<Mesh> replayed = Rebuild(records_.archive(), num_checks_ % 3);
  ASSERT_TRUE(replayed.ok()) << replayed.status();
  if (num_checks_ % 4 == 0) ExpectIdentical(*replayed, mesh_);
  ASSERT_EQ(FirstDifference(DescribeExactly(*replayed), DescribeExactly(mesh_)), "");
  Note();
}

void Past::CheckMirrors() {
  const ElementModel model = ModelOf(mesh_);
  for (const Page& page : pages_) {
    Mirror mirror = page.mirror;
    const absl::Status followed = mirror.Apply(Diff(mesh_, mirror.revision()));
    ASSERT_TRUE(followed.ok()) << followed << " from " << page.mirror.revision();
    ASSERT_TRUE(ModelOf(mirror) == model) << "from " << page.mirror.revision();
    ExpectSameRows(mesh_, mirror);
  }
}

}  // namespace dynmesh::testing
