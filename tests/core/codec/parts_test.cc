#include <gtest/gtest.h>

#include <numeric>

#include "core/codec/bytes.h"
#include "core/codec/draco_gate.h"
#include "core/codec/planes.h"
#include "core/codec/symbols.h"
#include "core/codec/vertex_cache.h"
#include "core/codec/zstd_frame.h"
#include "tests/core/codec/delta_samples.h"

namespace dynmesh {
namespace {

Section ViewOf(const Packed& packed) { return {0, packed.packing, packed.count, packed.bytes}; }

TEST(BytesTest, VarintsOfEveryLengthComeBack) {
  ByteWriter out;
  for (int shift = 0; shift < 64; ++shift) out.Varint(uint64_t{1} << shift);
  out.Varint(UINT64_MAX);
  ByteReader in(out.bytes());
  for (int shift = 0; shift < 64; ++shift) EXPECT_EQ(in.Varint(), uint64_t{1} << shift);
  EXPECT_EQ(in.Varint(), UINT64_MAX);
  EXPECT_TRUE(in.done());
}

TEST(BytesTest, AVarintThatDoesNotFitOrEndFails) {
  for (const std::string& bytes : {std::string(10, '\xff'), std::string(11, '\x80'), std::string("\x80")}) {
    ByteReader in(bytes);
    EXPECT_EQ(in.Varint(), 0u);
    EXPECT_FALSE(in.ok());
  }
}

TEST(BytesTest, FailureIsSticky) {
  ByteReader in("abc");
  EXPECT_EQ(in.Fixed<uint32_t>(), 0u);
  EXPECT_EQ(in.Fixed<uint8_t>(), 0u);
  EXPECT_TRUE(in.Bytes(1).empty());
  EXPECT_FALSE(in.ok());
}

TEST(ZigZagTest, SmallDifferencesGetSmallSymbols) {
  EXPECT_EQ(ZigZag<uint32_t>(0), 0u);
  EXPECT_EQ(ZigZag<uint32_t>(-1), 1u);
  EXPECT_EQ(ZigZag<uint32_t>(1), 2u);
  for (uint32_t value : {0u, 1u, 77u, 0x7fffffffu, 0x80000000u, 0xffffffffu}) {
    EXPECT_EQ(UnZigZag(ZigZag(value)), value);
    EXPECT_EQ(ZigZag(UnZigZag(value)), value);
  }
}

class SymbolsTest : public testing::TestWithParam<Codec> {};

TEST_P(SymbolsTest, StreamsOfAnyLengthAndRangeComeBack) {
  Rng rng(9);
  for (size_t count : {0, 1, 2, 3, 7, 499, 500, 501, 5000}) {
    for (int bits : {0, 1, 6, 16, 17, 18, 31, 32}) {
      std::vector<uint32_t> symbols(count);
      for (uint32_t& symbol : symbols) symbol = bits == 0 ? 0 : static_cast<uint32_t>(rng()) >> (32 - bits);
      const Packed packed = PackSymbols(symbols, GetParam());
      const absl::StatusOr<std::vector<uint32_t>> back = UnpackSymbols(ViewOf(packed));
      ASSERT_TRUE(back.ok()) << back.status();
      EXPECT_EQ(*back, symbols) << count << " symbols of " << bits << " bits";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllCodecs, SymbolsTest, testing::ValuesIn(kAllCodecs),
                         [](const auto& run) { return CodecName(run.param); });

TEST(SymbolsTest, TheSmallestPackingIsKept) {
  Rng rng(10);
  std::vector<uint32_t> symbols(20000);
  for (uint32_t& symbol : symbols) symbol = std::min(rng() % 60, rng() % 60);
  const size_t smallest = PackSymbols(symbols, Codec::kUnspecified).bytes.size();
  for (Codec codec : kAllCodecs) EXPECT_LE(smallest, PackSymbols(symbols, codec).bytes.size());
}

TEST(SymbolsTest, ADemandedCodecIsHonouredWhereItCanBe) {
  const std::vector<uint32_t> symbols(100, 7);
  EXPECT_EQ(PackSymbols(symbols, Codec::kRaw).packing, Packing::kRaw);
  EXPECT_EQ(PackSymbols(symbols, Codec::kZstd).packing, Packing::kZstd);
  EXPECT_EQ(PackSymbols(symbols, Codec::kDraco).packing, Packing::kDraco);
  EXPECT_EQ(PackSymbols({7}, Codec::kDraco).packing, Packing::kVarint);
  EXPECT_EQ(PackSymbols({7}, Codec::kZstd).packing, Packing::kVarint);
}

TEST(SymbolsTest, SlotsBeyondTheLastOneAreRefused) {
  const std::vector<uint32_t> last = {kNoSlot - 1};
  EXPECT_TRUE(UnpackSlots(ViewOf(PackSymbols(last, Codec::kRaw))).ok());
  const std::vector<uint32_t> beyond = {kNoSlot - 1, 0};
  EXPECT_FALSE(UnpackSlots(ViewOf(PackSymbols(beyond, Codec::kRaw))).ok());
  const std::vector<uint32_t> none = {kNoSlot};
  EXPECT_FALSE(UnpackSlots(ViewOf(PackSymbols(none, Codec::kRaw))).ok());
}

TEST(DracoGateTest, NoSymbolsAreRefusedOnBothSides) {
  EXPECT_FALSE(DracoEncode({}).ok());
  absl::string_view bytes;
  std::vector<uint32_t> symbols;
  EXPECT_FALSE(DracoDecode(bytes, 0, symbols).ok());
}

TEST(DracoGateTest, TheLargestSymbolComesBack) {
  const std::vector<uint32_t> symbols = {0, kDracoSymbolLimit - 1, 5};
  const absl::StatusOr<std::string> blob = DracoEncode(symbols);
  ASSERT_TRUE(blob.ok()) << blob.status();
  absl::string_view bytes = *blob;
  std::vector<uint32_t> back;
  ASSERT_TRUE(DracoDecode(bytes, symbols.size(), back).ok());
  EXPECT_EQ(back, symbols);
  EXPECT_TRUE(bytes.empty());
}

TEST(DracoGateTest, OnlyTheFirstOfTwoBlobsIsTaken) {
  const std::vector<uint32_t> symbols(600, 3);
  const std::string blob = *DracoEncode(symbols);
  const std::string both = blob + blob;
  absl::string_view bytes = both;
  std::vector<uint32_t> back;
  ASSERT_TRUE(DracoDecode(bytes, symbols.size(), back).ok());
  EXPECT_EQ(bytes.size(), blob.size());
}

TEST(DracoGateTest, EveryByteOfTheHeaderIsChecked) {
  constexpr size_t kHeaderBytes = 25;
  const std::vector<uint32_t> symbols(600, 3);
  const std::string blob = *DracoEncode(symbols);
  for (size_t bit = 0; bit < 8 * kHeaderBytes; ++bit) {
    std::string damaged = blob;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    absl::string_view bytes = damaged;
    std::vector<uint32_t> back;
    EXPECT_FALSE(DracoDecode(bytes, symbols.size(), back).ok()) << "bit " << bit;
  }
}

TEST(ZstdFrameTest, PartsAndWholesDecompressAlike) {
  std::string bytes;
  for (int i = 0; i < 4000; ++i) bytes.push_back(static_cast<char>(i * i >> 3));
  for (const std::string& frame : {CompressFrame(bytes), CompressFrameInParts(bytes, 1000)}) {
    EXPECT_EQ(*DecompressFrame(frame, bytes.size(), bytes.size()), bytes);
    EXPECT_FALSE(DecompressFrame(frame, 0, bytes.size() - 1).ok());
    EXPECT_FALSE(DecompressFrame(frame, bytes.size() + 1, 1 << 20).ok());
    EXPECT_FALSE(DecompressFrame(frame + frame, bytes.size(), 2 * bytes.size()).ok());
    EXPECT_FALSE(DecompressFrame(frame.substr(0, frame.size() - 1), bytes.size(), bytes.size()).ok());
  }
}

TEST(PlanesTest, RowsOfEveryShapeComeBack) {
  Rng rng(12);
  for (AttributeType type : {AttributeType::kFloat64, AttributeType::kInt32, AttributeType::kFloat32,
                             AttributeType::kInt64, AttributeType::kUint8}) {
    for (int components : {1, 3, 16}) {
      for (int count : {1, 2, 300, 1000}) {
        const RowShape shape{type, components};
        std::vector<uint8_t> rows(count * shape.row_bytes());
        for (uint8_t& byte : rows) byte = rng() % 5;
        for (Codec codec : kAllCodecs) {
          const Packed packed = PackRows(rows, shape, codec);
          EXPECT_EQ(*UnpackRows(ViewOf(packed), shape), rows);
        }
      }
    }
  }
}

TEST(VertexCacheTest, WriterAndReaderAgreeOverALongWalk) {
  Rng rng(13);
  VertexCache writer;
  VertexCache reader;
  for (int i = 0; i < 20000; ++i) {
    const Slot slot = rng() % 100;
    const uint32_t code = writer.Use(slot);
    ASSERT_LE(code, VertexCache::kCapacity);
    if (code == 0) {
      reader.Push(slot);
    } else {
      ASSERT_TRUE(reader.Holds(code));
      ASSERT_EQ(reader.UseCode(code), slot);
    }
  }
}

TEST(VertexCacheTest, ItForgetsTheSixtyFourthVertex) {
  VertexCache cache;
  for (Slot slot = 0; slot < 64; ++slot) EXPECT_EQ(cache.Use(slot), 0u);
  EXPECT_EQ(cache.Use(1), 63u);
  EXPECT_EQ(cache.Use(0), 0u);
}

}  // namespace
}  // namespace dynmesh
