#include "tests/core/archive/archive_support.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/archive/head.h"
#include "core/delta/diff.h"
#include "core/mesh/validate.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

void AppendParts(const Mesh& mesh, EntityId id, std::string& text) {
  absl::StrAppend(&text, EntityKindName(id.kind), " ", id.slot, " type ", static_cast<int>(mesh.Type(id)),
                  " degenerate ", mesh.IsDegenerate(id), " parts");
  if (id.kind == EntityKind::kFace) {
    for (EdgeId e : mesh.Edges(FaceId(id.slot))) absl::StrAppend(&text, " ", e.slot());
    absl::StrAppend(&text, " cells");
    for (CellId c : mesh.IncidentCells(FaceId(id.slot))) absl::StrAppend(&text, " ", c.slot());
  } else if (id.kind == EntityKind::kCell) {
    for (OrientedFace oriented : mesh.Faces(CellId(id.slot))) absl::StrAppend(&text, " ", oriented.packed());
  }
  text += "\n";
}

void AppendSpec(const AttributeColumn& column, std::string& text) {
  const AttributeSpec& spec = column.spec();
  absl::StrAppend(&text, spec.name, " ", EntityKindName(spec.kind), " ", static_cast<int>(spec.type), " ",
                  spec.components, " ", static_cast<int>(spec.policy), " born ", column.born());
  for (uint8_t byte : spec.default_row) absl::StrAppend(&text, " ", int{byte});
  text += "\n";
}

/// Bits, which "0" and "-0" do not tell apart.
void AppendBits(const Mesh& mesh, std::string& text) {
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
    for (double x : mesh.Position(VertexId(v)))
      absl::StrAppend(&text, absl::Hex(std::bit_cast<uint64_t>(x)), " ");
  });
  text += "\n";
}

std::string FirstDifferingLine(const std::string& actual, const std::string& expected) {
  const std::vector<std::string> is = absl::StrSplit(actual, '\n'), should = absl::StrSplit(expected, '\n');
  const auto [left, right] = std::mismatch(is.begin(), is.end(), should.begin(), should.end());
  if (left == is.end() && right == should.end()) return "";
  return absl::StrCat(left == is.end() ? "(end)" : *left, "\n  should be\n",
                      right == should.end() ? "(end)" : *right);
}

}  // namespace

Archive Archive::Of(const Mesh& mesh) {
  Archive archive;
  archive.head = EncodeHead(mesh);
  DirtyPages all;
  all.AddAll(mesh);
  for (PageId page : all.List()) archive.pages[page] = EncodePage(mesh, page);
  return archive;
}

absl::StatusOr<Mesh> Rebuild(const Archive& archive, uint32_t shuffle_seed, const RebuildOptions& options) {
  DYNMESH_ASSIGN_OR_RETURN(Rebuilder rebuilder, Rebuilder::Start(archive.head, options));
  std::vector<const std::string*> pages;
  for (const auto& [id, page] : archive.pages) pages.push_back(&page);
  std::mt19937 rng(shuffle_seed);
  if (shuffle_seed != 0) std::shuffle(pages.begin(), pages.end(), rng);
  for (const std::string* page : pages) DYNMESH_RETURN_IF_ERROR(rebuilder.AddPage(*page));
  for (const std::string& record : archive.records) DYNMESH_RETURN_IF_ERROR(rebuilder.AddRecord(record));
  return std::move(rebuilder).Finish();
}

std::string DescribeExactly(const Mesh& mesh) {
  std::string text = Describe(mesh);
  absl::StrAppend(&text, "policy ", static_cast<int>(mesh.options().duplicates), " widths ",
                  mesh.FaceStride(), " ", mesh.CellVertexStride(), " ", mesh.CellFaceStride(), " plain ",
                  mesh.IsPlain(), "\n");
  for (EntityKind kind : kEntityKinds) {
    absl::StrAppend(&text, "max ", mesh.options().limits.max_slots[Dimension(kind)], " live ",
                    mesh.NumLive(kind), " duplicates ", mesh.HasDuplicates(kind), "\n");
    if (kind == EntityKind::kVertex) continue;
    mesh.slots(kind).live().ForEach([&](Slot slot) { AppendParts(mesh, {kind, slot}, text); });
  }
  for (const AttributeColumn& column : mesh.attributes()) AppendSpec(column, text);
  AppendBits(mesh, text);
  return text;
}

void ExpectIdentical(const Mesh& rebuilt, const Mesh& mesh) {
  EXPECT_THAT(Validate(rebuilt), ::testing::IsEmpty());
  EXPECT_EQ(FirstDifferingLine(DescribeExactly(rebuilt), DescribeExactly(mesh)), "");
  EXPECT_TRUE(rebuilt.FitNow() == mesh.FitNow());
  const int64_t step = std::max<int64_t>(1, mesh.revision() / 16);
  for (int64_t from = 0; from <= mesh.revision(); from += step) {
    EXPECT_TRUE(Diff(rebuilt, from) == Diff(mesh, from)) << "from revision " << from;
  }
}

std::string Resealed(std::string bytes) {
  if (bytes.size() < sizeof(uint64_t)) return bytes;
  const size_t size = bytes.size() - sizeof(uint64_t);
  const uint64_t seal = XXH64(bytes.data(), size, 0);
  std::memcpy(bytes.data() + size, &seal, sizeof(seal));
  return bytes;
}

void ArchiveKeeper::Keep(const Mesh& mesh) {
  archive_.records.push_back(encoder_.Encode(mesh, absl::StrCat("note ", mesh.revision() + 1)));
  dirty_.Add(mesh.journal());
}

void ArchiveKeeper::BeginCheckpoint(const Mesh& mesh) {
  to_copy_ = std::exchange(dirty_, {}).List();
  next_head_ = EncodeHead(mesh);
  records_at_begin_ = archive_.records.size();
  if (to_copy_.empty()) EndCheckpoint();
}

void ArchiveKeeper::CopyPage(const Mesh& mesh, size_t which) {
  std::swap(to_copy_[which], to_copy_.back());
  archive_.pages[to_copy_.back()] = EncodePage(mesh, to_copy_.back());
  to_copy_.pop_back();
  if (to_copy_.empty()) EndCheckpoint();
}

void ArchiveKeeper::EndCheckpoint() {
  archive_.head = next_head_;
  archive_.records.erase(archive_.records.begin(), archive_.records.begin() + records_at_begin_);
}

}  // namespace dynmesh::testing
