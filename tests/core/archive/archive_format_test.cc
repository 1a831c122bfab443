#include <gtest/gtest.h>

#include <cctype>
#include <fstream>
#include <sstream>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "tests/core/archive/archive_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

/// The archive of the worked example in FORMAT.md, and its mesh.
struct Example {
  Mesh mesh;
  Archive archive;
};

Example MakeExample() {
  Mesh mesh;
  for (const Point& point : {Point{0, 0, 0}, Point{1, 0, 0}, Point{0, 1, 0}}) {
    EXPECT_TRUE(mesh.AddVertex(point).ok());
  }
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Commit(mesh);
  Archive archive = Archive::Of(mesh);
  RecordEncoder encoder;
  mesh.BeginBatch();
  EXPECT_TRUE(mesh.MoveVertex(VertexId(1), {2, 0, 0}).ok());
  archive.records.push_back(encoder.Encode(mesh, "hi"));
  Commit(mesh);
  return {std::move(mesh), std::move(archive)};
}

/// Parts of the document: lines of its last fence look like "0010  01 02 03  what it is", and each part
/// begins at 0000.
std::vector<std::string> PartsOfDocument() {
  std::ifstream file(DYNMESH_ARCHIVE_FORMAT_MD);
  std::vector<std::string> parts;
  for (std::string line; std::getline(file, line);) {
    if (line.size() < 8 || line[4] != ' ' || line[5] != ' ' || !std::isxdigit(line[0])) continue;
    if (line.substr(0, 4) == "0000") parts.emplace_back();
    EXPECT_EQ(std::stoul(line.substr(0, 4), nullptr, 16), parts.back().size()) << line;
    std::istringstream words(line.substr(6, line.find("  ", 6) - 6));
    for (std::string word; words >> word;) absl::StrAppend(&parts.back(), absl::HexStringToBytes(word));
  }
  return parts;
}

/// A line for each.
std::string HexOf(const std::vector<std::string>& parts) {
  std::string lines;
  for (const std::string& part : parts) absl::StrAppend(&lines, absl::BytesToHexString(part), "\n");
  return lines;
}

TEST(ArchiveFormatTest, TheDocumentsExampleIsWhatTheCodeWrites) {
  const Example example = MakeExample();
  std::vector<std::string> expected = {example.archive.head};
  for (const auto& [id, page] : example.archive.pages) expected.push_back(page);
  expected.push_back(example.archive.records[0]);
  EXPECT_EQ(HexOf(PartsOfDocument()), HexOf(expected));
}

TEST(ArchiveFormatTest, TheDocumentsExampleGivesItsMesh) {
  const std::vector<std::string> parts = PartsOfDocument();
  ASSERT_GE(parts.size(), 3u);
  Archive archive;
  archive.head = parts.front();
  for (size_t i = 1; i + 1 < parts.size(); ++i) {
    archive.pages[{EntityKind::kVertex, static_cast<uint32_t>(i)}] = parts[i];
  }
  archive.records = {parts.back()};
  const absl::StatusOr<Mesh> mesh = Rebuild(archive);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  ExpectIdentical(*mesh, MakeExample().mesh);
}

}  // namespace
}  // namespace dynmesh::testing
