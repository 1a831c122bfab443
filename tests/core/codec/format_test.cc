#include <gtest/gtest.h>

#include <cctype>
#include <cmath>
#include <fstream>
#include <sstream>

#include "absl/strings/escaping.h"
#include "tests/core/codec/delta_samples.h"

namespace dynmesh {
namespace {

// The delta of the worked example in FORMAT.md.
Delta Example() {
  Delta delta;
  delta.from_revision = 41;
  delta.to_revision = 42;
  delta.checksum = {0x1122334455667788, 0x99aabbccddeeff00};
  delta.vertex_slots = {4};
  delta.positions = {{0.1, 0.7, 1.3}};
  ElementChanges& cells = delta.OfKind(EntityKind::kCell);
  cells.removed = {3};
  cells.slots = {7, 9};
  cells.types = {ElementType::kTetrahedron, ElementType::kTetrahedron};
  for (Slot v : {0, 1, 2, 4, 1, 4, 2, 300}) cells.vertices.emplace_back(v);
  return delta;
}

// Lines of the document's last fence look like "0010  01 02 03  what it is".
std::string BytesOfDocument() {
  std::ifstream file(DYNMESH_FORMAT_MD);
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

// What the golden messages say: lattice of 3 * 3 * 3 vertices, 48 tetrahedra, a region for each of them.
Delta Golden() {
  Delta delta = TetBlock(2);
  delta.from_revision = 1;
  delta.to_revision = 3;
  delta.checksum = {5, 6};
  for (Slot slot = 0; slot < 27; ++slot) {
    delta.vertex_slots.push_back(slot);
    delta.positions.push_back({slot % 3 * 0.5, slot / 3 % 3 * 0.5, slot / 9 * 0.5});
  }
  AttributeChanges regions{{"region", EntityKind::kCell, AttributeType::kInt32, 1}, {}, {}};
  for (Slot slot = 0; slot < 48; ++slot) {
    regions.slots.push_back(slot);
    regions.rows.insert(regions.rows.end(), {static_cast<uint8_t>(slot / 6), 0, 0, 0});
  }
  delta.attributes.push_back(regions);
  return delta;
}

// Golden() as version 1 was first written, by zstd and lossless, and by Draco on a grid of one bit an axis.
// Never change these: a later build must still read them.
constexpr char kZstdGolden[] =
    "44594e4d0101000001000000000000000300000000000000050000000000000006000000000000000a02021b11030288"
    "0566310230113204010233021b113402c0015e35041b1b40010909410230114202c0011928b52ffd201b450000100000"
    "01000bc00228b52ffd608801e502004402ff0000c020dfff7f007fff00c00000200000dfff00007f7f000000000000ff"
    "c020ff7f002020b0c3960344c811860839c28b112ea604b91205902b5120b91205902b5100c849a508eebc3981f86c19"
    "2e05c8704db01e1da9360428b52ffd203045000010000001009b000bfc0228b52ffd201b45000010000001000bc00228"
    "b52ffd20c0ad0200f40200000000040300040804020b04040306040403070c08100404030d0e0c12110700080402140c"
    "000c081000040315111000f0c918380069a0bd5375dd5180008e1a02d701c4a61aff14591030a8b3f31acb8e0b000206"
    "12131205020f061205071213120d120a01050208050a0104030201726567696f6e28b52ffd203045000010000001009b"
    "000b28b52ffd20c0850000200000020004000d40c1140260f10ab032ffd5bb8d18c446";

constexpr char kDracoGolden[] =
    "44594e4d0101010001000000000000000300000000000000050000000000000006000000000000000000000000000000"
    "00000000000000000000000000000000000000000000f03f0c02031b2104031b2c05031b2906031b2631033021320401"
    "0233031b213403c001800135031b3d40010909410330214202c0011900445241434f0203000000001a00000001010405"
    "01000001fe010101010140010000445241434f0203000000001a0000000101040501000001fe010101032916b1132916"
    "08ec90bde1519c5b8000445241434f0203000000001a0000000101040501000001fe01010103b133ed0465070570e823"
    "e7a200445241434f0203000000001a0000000101040501000001fe01010103893d03790203cc169000445241434f0203"
    "000000002f0000000101040501000001fe0101010101400100fc0200445241434f0203000000001a0000000101040501"
    "000001fe010101010140010000445241434f020300000000bf0000000101040501000001fe01010416b908035901690d"
    "d51a035901ad015903075901ad010101ac030101ac54035454420dd62efd78647cb0496220b5a60cfcbc9e7c24a072d5"
    "2491ddde8c2c26d2622beac07f30507ad5c89b6cef64269ea5db31181e2082d6545e7d14bd8a7ec0ff878b5000445241"
    "434f0203000000001a0000000101040501000001fe01000603ed046507b113510cb113093b7810fd5c873c5a425a4e59"
    "dfb29753b6d415ab09030201726567696f6e00445241434f0203000000002f0000000101040501000001fe0101010101"
    "40010028b52ffd20c0850000200000020004000d40c1140260f10ab0721cd5e8aecec256";

// A column that only version 2 can describe, as it was first written.
constexpr char kColumnGolden[] =
    "44594e4d0201000001000000000000000200000000000000000000000000000000000000000000000340011010410102"
    "08420110100104010403737562ffffffffffffffff0300000001000000010000000000000002000000000000805e63bc"
    "2b6e2c3745";

Delta ColumnGolden() {
  Delta delta;
  delta.from_revision = 1;
  delta.to_revision = 2;
  const AttributeSpec spec{"sub", EntityKind::kEdge,      AttributeType::kInt64,
                           1,     AttributePolicy::kDrop, {0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff}};
  delta.attributes.push_back({spec, {3, 5}, {1, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0x80}});
  return delta;
}

TEST(FormatTest, AColumnOfVersion2StaysAsItIs) {
  EncodeOptions options;
  options.codec = Codec::kRaw;
  const absl::StatusOr<std::string> bytes = EncodeDelta(ColumnGolden(), options);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_EQ(absl::BytesToHexString(*bytes), kColumnGolden);
  const absl::StatusOr<Delta> delta = DecodeDelta(absl::HexStringToBytes(kColumnGolden));
  ASSERT_TRUE(delta.ok()) << delta.status();
  EXPECT_TRUE(SameBits(*delta, ColumnGolden()));
}

TEST(FormatTest, OnlyColumnsThatNeedItAreOfVersion2) {
  const auto version = [](const AttributeSpec& spec) {
    Delta delta;
    delta.attributes.push_back({spec, {}, {}});
    return int{(*EncodeDelta(delta, {}))[4]};
  };
  AttributeSpec spec{"a", EntityKind::kCell, AttributeType::kInt32, 1};
  EXPECT_EQ(version(spec), 1);
  spec.policy = AttributePolicy::kCopy;
  spec.default_row.assign(4, 0);
  EXPECT_EQ(version(spec), 1) << "said in more words, but the same";
  spec.policy = AttributePolicy::kMax;
  EXPECT_EQ(version(spec), 2);
  EXPECT_EQ(version({"a", EntityKind::kCell, AttributeType::kUint8, 1}), 2);
}

TEST(FormatTest, TheDocumentsExampleIsWhatTheCodeWrites) {
  const absl::StatusOr<std::string> bytes = EncodeDelta(Example(), {});
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_EQ(absl::BytesToHexString(*bytes), absl::BytesToHexString(BytesOfDocument()));
}

TEST(FormatTest, TheDocumentsExampleDecodesToItsDelta) {
  const absl::StatusOr<Delta> delta = DecodeDelta(BytesOfDocument());
  ASSERT_TRUE(delta.ok()) << delta.status();
  EXPECT_TRUE(SameBits(*delta, Example()));
}

TEST(FormatTest, AnOldZstdMessageStillDecodes) {
  const absl::StatusOr<Delta> delta = DecodeDelta(absl::HexStringToBytes(kZstdGolden));
  ASSERT_TRUE(delta.ok()) << delta.status();
  EXPECT_TRUE(SameBits(*delta, Golden()));
}

TEST(FormatTest, AnOldDracoMessageStillDecodes) {
  const absl::StatusOr<Delta> delta = DecodeDelta(absl::HexStringToBytes(kDracoGolden));
  ASSERT_TRUE(delta.ok()) << delta.status();
  Delta expected = Golden();
  for (Point& position : expected.positions) {
    for (double& coordinate : position) coordinate = std::round(coordinate);
  }
  EXPECT_TRUE(SameBits(*delta, expected));
}

}  // namespace
}  // namespace dynmesh
