#include <gtest/gtest.h>

#include <cctype>
#include <fstream>
#include <sstream>

#include "absl/strings/escaping.h"
#include "core/mesh/error.h"
#include "server/store/layout.h"
#include "server/store/store_errors.h"

namespace dynmesh::layout {
namespace {

// Lines of the document like "0009  01 02 03    what it is".
std::string BytesOfDocument() {
  std::ifstream file(DYNMESH_STORE_FORMAT_MD);
  std::string bytes;
  for (std::string line; std::getline(file, line);) {
    if (line.size() < 8 || line[4] != ' ' || line[5] != ' ' || !std::isxdigit(line[0])) continue;
    const std::string offset_and_bytes = line.substr(0, line.find("  ", 6));
    std::istringstream words(offset_and_bytes.substr(6));
    EXPECT_EQ(std::stoul(line.substr(0, 4), nullptr, 16), bytes.size()) << line;
    for (std::string word; words >> word;) bytes += absl::HexStringToBytes(word);
  }
  return bytes;
}

TEST(LayoutTest, TheExampleOfTheDocumentIsWhatIsWritten) {
  const std::string key = RecordKey(1, 3);
  const std::string value = Seal(key, WriteRecord({2, "abc"}));
  EXPECT_EQ(absl::BytesToHexString(key + value), absl::BytesToHexString(BytesOfDocument()));
}

TEST(LayoutTest, WhatIsWrittenIsReadAgain) {
  const std::string record_payload = WriteRecord({41, "bytes"});
  const auto record = ReadRecord(record_payload);
  EXPECT_EQ(record->previous, 41);
  EXPECT_EQ(record->bytes, "bytes");
  const std::vector<PageVersion> pages = {{4, 7}, {UINT64_MAX, 1}};
  const std::string manifest_payload = WriteManifest({8, pages, "mine"});
  const auto manifest = ReadManifest(manifest_payload);
  EXPECT_EQ(manifest->revision, 8);
  EXPECT_EQ(manifest->pages, pages);
  EXPECT_EQ(manifest->bytes, "mine");
  EXPECT_EQ(*ReadNumber(WriteNumber(INT64_MAX)), uint64_t{INT64_MAX});
  const auto version = VersionOfKey(PageKeyOf(3, UINT64_MAX, 5));
  EXPECT_EQ(version->page, UINT64_MAX);
  EXPECT_EQ(version->checkpoint, 5u);
  EXPECT_EQ(*RevisionOfKey(RecordKey(1, INT64_MAX)), INT64_MAX);
  EXPECT_EQ(*SessionOfKey(ManifestKey(77, 3)), 77u);
  EXPECT_EQ(*CheckpointOfKey(ManifestKey(77, 3)), 3u);
  EXPECT_TRUE(IsManifestKey(ManifestKey(77, 3)));
  EXPECT_FALSE(IsManifestKey(PageKeyOf(77, 3, 3)));
}

TEST(LayoutTest, AManifestNamesEachPageOnceInOrder) {
  for (const std::vector<PageVersion>& pages :
       {std::vector<PageVersion>{{2, 1}, {1, 1}}, {{2, 1}, {2, 2}}, {{1, 0}}, {{1, UINT64_MAX}}}) {
    EXPECT_EQ(ErrorReason(ReadManifest(WriteManifest({1, pages, ""})).status()), reason::kStoreDamaged);
  }
}

TEST(LayoutTest, KeysSortAsTheirNumbersDo) {
  EXPECT_LT(RecordKey(1, 255), RecordKey(1, 256));
  EXPECT_LT(PageKeyOf(1, 1, 300), PageKeyOf(1, 2, 1));
  EXPECT_LT(ManifestKey(1, 255), ManifestKey(1, 256));
  EXPECT_LT(ManifestKey(1, UINT64_MAX), PageKeyOf(1, 0, 1));
  for (const std::string& key : {ManifestKey(5, 1), PageKeyOf(5, UINT64_MAX, 1), RecordKey(5, INT64_MAX),
                                 TrimmedKey(5), ValueKey(5, std::string(kMaxNameBytes, '\xff'))}) {
    EXPECT_TRUE(DataOf(5).from <= key && key < DataOf(5).to);
    EXPECT_TRUE(DataOfAll().from <= key && key < DataOfAll().to);
  }
}

TEST(LayoutTest, ARangeOfRecordsHoldsThoseAfterOneUpToAnother) {
  const KeyRange range = RecordsOf(1, 3, 5);
  for (int64_t revision = 2; revision <= 7; ++revision) {
    const std::string key = RecordKey(1, revision);
    EXPECT_EQ(range.from <= key && key < range.to, revision == 4 || revision == 5) << revision;
  }
  EXPECT_LT(RecordKey(1, INT64_MAX), RecordsOf(1, 0).to);
  EXPECT_LT(RecordsOf(1, 0).to, TrimmedKey(1));
}

TEST(LayoutTest, NoFlippedBitEscapesTheSeal) {
  const std::string key = RecordKey(1, 3);
  const std::string value = Seal(key, WriteRecord({2, "abc"}));
  for (size_t bit = 0; bit < 8 * (key.size() + value.size()); ++bit) {
    std::string both = key + value;
    both[bit / 8] ^= 1 << bit % 8;
    const auto payload = Unseal(both.substr(0, key.size()), absl::string_view(both).substr(key.size()));
    EXPECT_EQ(ErrorReason(payload.status()), reason::kStoreDamaged) << bit;
  }
}

TEST(LayoutTest, BytesOfEveryLengthAreRefusedOrRead) {
  for (size_t size = 0; size < 64; ++size) {
    for (const char fill : {'\0', '\1', '\x7f', '\xff'}) {
      const std::string bytes(size, fill);
      (void)Unseal("key", bytes);
      (void)SessionOfKey(bytes);
      (void)RevisionOfKey(bytes);
      (void)VersionOfKey(bytes);
      EXPECT_EQ(ReadNumber(bytes).ok(), size == 8 && fill != '\xff');
      EXPECT_EQ(ReadRecord(bytes).ok(), size >= 8 && fill != '\xff');
      (void)CheckpointOfKey(bytes);
      EXPECT_EQ(ReadManifest(bytes).ok(), size >= 16 && fill == '\0') << "other counts are too large";
    }
  }
}

}  // namespace
}  // namespace dynmesh::layout
