#include "tests/core/edit/chronicle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_split.h"
#include "core/delta/diff.h"
#include "core/edit/restore_batches.h"
#include "core/mesh/validate.h"

namespace dynmesh::testing {

std::string FirstDifference(const std::string& actual, const std::string& expected) {
  const std::vector<std::string> is = absl::StrSplit(actual, '\n'), should = absl::StrSplit(expected, '\n');
  for (size_t i = 0; i < std::max(is.size(), should.size()); ++i) {
    const std::string left = i < is.size() ? is[i] : "(end)", right = i < should.size() ? should[i] : "(end)";
    if (left != right) return left + "\n  but was\n" + right;
  }
  return "";
}

void Chronicle::Add(BatchImage image) {
  undos_.push_back(std::move(image));
  redos_.clear();
  pages_.resize(undos_.size());
  Note();
}

void Chronicle::Do(const std::vector<Edit>& edits) {
  auto applied = ApplyBatch(mesh_, edits, {.make_image = true});
  ASSERT_TRUE(applied.ok()) << applied.status();
  Add(*std::move(applied->image));
}

void Chronicle::UndoInVain(size_t count) {
  const std::string before = Describe(mesh_);
  const auto images = Last(count, undos_);
  ASSERT_TRUE(RestoreBatches(mesh_, images, {.dry_run = true}).ok());
  EXPECT_EQ(Describe(mesh_), before);
  EXPECT_THAT(Validate(mesh_), ::testing::IsEmpty());
}

void Chronicle::UndoAndRedoAll() {
  const size_t count = num_undos();
  for (size_t i = 0; i < count; ++i) Undo(1);
  Redo(count);
  UndoInVain(count);
  Undo(count);
}

std::vector<const BatchImage*> Chronicle::Last(size_t count, const std::vector<BatchImage>& images) {
  std::vector<const BatchImage*> last;
  for (size_t i = 0; i < count; ++i) last.push_back(&images[images.size() - 1 - i]);
  return last;
}

void Chronicle::Move(size_t count, std::vector<BatchImage>& from, std::vector<BatchImage>& to) {
  const int64_t revision = mesh_.revision();
  auto restored = RestoreBatches(mesh_, Last(count, from), {});
  ASSERT_TRUE(restored.ok()) << restored.status();
  EXPECT_EQ(restored->revision, revision + 1);
  EXPECT_EQ(restored->checksum, mesh_.checksum());
  from.resize(from.size() - count);
  for (BatchImage& image : restored->images) to.push_back(std::move(image));
  Check();
}

void Chronicle::Note() {
  const size_t columns = mesh_.attributes().size();
  pages_.push_back({DescribeContent(mesh_, columns), columns, ModelOf(mesh_)});
  ASSERT_TRUE(mirror_.Apply(Diff(mesh_, mirror_.revision())).ok());
}

void Chronicle::Check() {
  const Page& page = pages_[undos_.size()];
  ASSERT_EQ(FirstDifference(DescribeContent(mesh_, page.num_columns), page.content), "");
  EXPECT_THAT(Validate(mesh_), ::testing::IsEmpty());
  if (++num_checks_ % 8 == 0) ExpectEqualsOracle(mesh_, page.model);
  const absl::Status followed = mirror_.Apply(Diff(mesh_, mirror_.revision()));
  ASSERT_TRUE(followed.ok()) << followed;
  ASSERT_TRUE(ModelOf(mirror_) == page.model);
  ExpectSameRows();
}

void Chronicle::ExpectSameRows() {
  for (const AttributeColumn& column : mesh_.attributes()) {
    const auto copy = std::find_if(mirror_.attributes().begin(), mirror_.attributes().end(),
                                   [&](const auto& other) { return other.spec() == column.spec(); });
    ASSERT_NE(copy, mirror_.attributes().end()) << column.spec().name;
    mesh_.slots(column.spec().kind).live().ForEach([&](Slot slot) {
      EXPECT_EQ(copy->Row(slot), column.Row(slot)) << column.spec().name << " " << slot;
    });
  }
}

}  // namespace dynmesh::testing
