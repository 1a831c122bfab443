#include <gtest/gtest.h>

#include <algorithm>

#include "core/codec/envelope.h"
#include "core/codec/symbols.h"
#include "core/mesh/error.h"
#include "tests/core/codec/allocation_meter.h"
#include "tests/core/codec/delta_samples.h"
#include "tests/core/codec/message_surgery.h"

namespace dynmesh {
namespace {

// What DecodeDelta may use at once, from what FORMAT.md says of the weight rule.
constexpr size_t kFixedBytes = 12 << 20;
constexpr size_t kBytesPerMessageByte = 6 * kMaxExpansion;

std::string Encode(const Delta& delta, Codec codec) {
  absl::StatusOr<std::string> bytes = EncodeDelta(delta, {.codec = codec, .grid = {}});
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  return bytes.ok() ? *bytes : std::string();
}

std::string EncodeQuantised(const Delta& delta, Codec codec) {
  absl::StatusOr<std::string> bytes =
      EncodeDelta(delta, {.codec = codec, .grid = MakeGrid({-1, -1, -1}, {1, 1, 1}, 14)});
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  return bytes.ok() ? *bytes : std::string();
}

// Every kind of stream, and long enough that each codec packs most of them its own way.
std::string LongMessage(Codec codec, int size = 700) {
  Rng rng(1);
  Delta delta = RandomDelta(rng, size);
  const Delta block = TetBlock(5);
  delta.OfKind(EntityKind::kCell) = block.OfKind(EntityKind::kCell);
  return EncodeQuantised(delta, codec);
}

Delta RandomDeltaOfSeed(int seed) {
  Rng rng(seed);
  return RandomDelta(rng, 20);
}

std::string FlipBit(std::string bytes, size_t bit) {
  bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << bit % 8));
  return bytes;
}

void ExpectDamageIsSeen(const std::string& bytes) {
  const absl::StatusOr<Delta> delta = DecodeDelta(bytes);
  ASSERT_FALSE(delta.ok());
  const std::string reason = ErrorReason(delta.status());
  EXPECT_TRUE(reason == reason::kCorruptPayload || reason == reason::kUnsupportedFormat) << delta.status();
}

// The contract with a hostile sender: an error or a valid delta, in bounded memory.
bool IsHarmless(const std::string& bytes) {
  const AllocationMeter meter;
  const absl::StatusOr<Delta> delta = DecodeDelta(bytes);
  EXPECT_LE(meter.peak_bytes(), kFixedBytes + kBytesPerMessageByte * bytes.size());
  if (delta.ok()) {
    EXPECT_TRUE(CheckDelta(*delta).ok()) << CheckDelta(*delta);
  } else {
    EXPECT_NE(ErrorReason(delta.status()), "") << delta.status();
  }
  return !testing::Test::HasFailure();
}

class DamageTest : public testing::TestWithParam<Codec> {};

TEST_P(DamageTest, AMessageCutAnywhereIsRefused) {
  for (const NamedDelta& sample : SmallDeltas()) {
    const std::string bytes = Encode(sample.delta, GetParam());
    for (size_t size = 0; size < bytes.size(); ++size) ExpectDamageIsSeen(bytes.substr(0, size));
  }
}

TEST_P(DamageTest, AMessageWithBytesBehindItIsRefused) {
  ExpectDamageIsSeen(Encode(TetBlock(2), GetParam()) + '\0');
}

TEST_P(DamageTest, EveryFlippedBitOfASmallMessageIsSeen) {
  for (const NamedDelta& sample : SmallDeltas()) {
    const std::string bytes = Encode(sample.delta, GetParam());
    for (size_t bit = 0; bit < 8 * bytes.size(); ++bit) ExpectDamageIsSeen(FlipBit(bytes, bit));
  }
}

TEST_P(DamageTest, RandomFlippedBitsOfALongMessageAreSeen) {
  const std::string bytes = LongMessage(GetParam());
  Rng rng(2);
  for (int i = 0; i < 30000; ++i) ExpectDamageIsSeen(FlipBit(bytes, rng() % (8 * bytes.size())));
}

TEST_P(DamageTest, ACutAndSealedMessageIsHarmless) {
  for (const NamedDelta& sample : SmallDeltas()) {
    const std::string bytes = Encode(sample.delta, GetParam());
    for (size_t size = 0; size < bytes.size(); ++size) {
      ASSERT_TRUE(IsHarmless(Reseal(bytes.substr(0, size)))) << sample.name << ", " << size << " bytes";
    }
  }
}

TEST_P(DamageTest, EveryFlippedAndSealedBitOfASmallMessageIsHarmless) {
  for (const NamedDelta& sample : SmallDeltas()) {
    for (const std::string& bytes :
         {Encode(sample.delta, GetParam()), EncodeQuantised(sample.delta, GetParam())}) {
      for (size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        ASSERT_TRUE(IsHarmless(Reseal(FlipBit(bytes, bit)))) << sample.name << ", bit " << bit;
      }
    }
  }
}

TEST_P(DamageTest, RandomMutationsOfASealedLongMessageAreHarmless) {
  const std::string bytes = LongMessage(GetParam());
  for (int seed = 0; seed < 8000; ++seed) {
    Rng rng(seed);
    std::string mutated = bytes;
    for (int edits = 1 + rng() % 4; edits > 0; --edits) {
      mutated[rng() % bytes.size()] = static_cast<char>(rng());
    }
    ASSERT_TRUE(IsHarmless(Reseal(mutated))) << "seed " << seed;
  }
}

// The first bytes of a section (descriptors, tables, counts) are the ones that decoders trust.
TEST_P(DamageTest, MutatedBeginningsOfSectionsAreHarmless) {
  const ForgedMessage honest = TakeApart(LongMessage(GetParam()));
  for (int seed = 0; seed < 6000; ++seed) {
    Rng rng(seed);
    ForgedMessage forged = honest;
    std::string& bytes = forged.sections[rng() % forged.sections.size()].bytes;
    const size_t reach = std::min<size_t>(bytes.size(), 64);
    for (int edits = 1 + rng() % 3; edits > 0; --edits) bytes[rng() % reach] = static_cast<char>(rng());
    ASSERT_TRUE(IsHarmless(forged.Seal())) << "seed " << seed;
  }
}

TEST_P(DamageTest, ForgedTableEntriesAreHarmless) {
  const ForgedMessage honest = TakeApart(LongMessage(GetParam(), 40));
  const uint64_t claims[] = {0,
                             1,
                             2,
                             1u << 10,
                             1u << 20,
                             1u << 28,
                             1u << 31,
                             UINT32_MAX,
                             uint64_t{1} << 32,
                             uint64_t{1} << 40,
                             uint64_t{1} << 62,
                             UINT64_MAX};
  for (size_t i = 0; i < honest.sections.size(); ++i) {
    for (uint64_t claim : claims) {
      for (auto field : {&ForgedSection::count, &ForgedSection::size}) {
        ForgedMessage forged = honest;
        forged.sections[i].*field = claim;
        ASSERT_TRUE(IsHarmless(forged.Seal())) << "section " << i << ", claim " << claim;
      }
    }
    for (int packing = 0; packing < 256; ++packing) {
      ForgedMessage forged = honest;
      forged.sections[i].packing = packing;
      ASSERT_TRUE(IsHarmless(forged.Seal())) << "section " << i << ", packing " << packing;
    }
  }
}

TEST_P(DamageTest, MissingRepeatedAndSwappedSectionsAreRefused) {
  const ForgedMessage honest = TakeApart(Encode(RandomDeltaOfSeed(4), GetParam()));
  for (size_t i = 0; i < honest.sections.size(); ++i) {
    ForgedMessage repeated = honest;
    repeated.sections.insert(repeated.sections.begin() + i, honest.sections[i]);
    ExpectDamageIsSeen(repeated.Seal());
    ForgedMessage unknown = honest;
    unknown.sections[i].id = 15;
    ExpectDamageIsSeen(unknown.Seal());
    ForgedMessage missing = honest;
    missing.sections.erase(missing.sections.begin() + i);
    ASSERT_TRUE(IsHarmless(missing.Seal())) << "section " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(AllCodecs, DamageTest, testing::ValuesIn(kAllCodecs),
                         [](const auto& run) { return CodecName(run.param); });

// A message of one section that claims `count` symbols and carries `padding_bytes` to be allowed to.
std::string Bomb(const Packed& packed, uint64_t count, size_t padding_bytes) {
  ForgedMessage forged = TakeApart(Encode({}, Codec::kRaw));
  forged.sections.push_back(
      {section::kPadding, 1, padding_bytes, padding_bytes, std::string(padding_bytes, '\0')});
  forged.sections.push_back({section::kRemovedVertices, static_cast<uint8_t>(packed.packing), count,
                             packed.bytes.size(), packed.bytes});
  return forged.Seal();
}

TEST(BombTest, ALightMessageMayNotClaimMuch) {
  for (Codec codec : {Codec::kZstd, Codec::kDraco}) {
    const std::vector<uint32_t> zeros(4 << 20);
    const Packed packed = PackSymbols(zeros, codec);
    ASSERT_LT(packed.bytes.size(), 4096u);
    const std::string bytes = Bomb(packed, packed.count, 0);
    ExpectDamageIsSeen(bytes);
    EXPECT_TRUE(IsHarmless(bytes));
  }
}

TEST(BombTest, AHeavyMessageStaysWithinTheStatedMemory) {
  for (Codec codec : {Codec::kZstd, Codec::kDraco}) {
    const std::vector<uint32_t> zeros(4 << 20);
    const std::string bytes = Bomb(PackSymbols(zeros, codec), zeros.size(), zeros.size() / 64);
    EXPECT_TRUE(DecodeDelta(bytes).ok());
    EXPECT_TRUE(IsHarmless(bytes));
    const std::vector<uint32_t> in_two_blobs(4 << 20, 1 << 20);
    EXPECT_TRUE(IsHarmless(Bomb(PackSymbols(in_two_blobs, codec), zeros.size(), zeros.size() / 64)));
  }
}

TEST(BombTest, ADracoBlobThatClaimsMoreThanTheTableIsRefused) {
  const std::vector<uint32_t> zeros(4 << 20);
  const std::string bytes = Bomb(PackSymbols(zeros, Codec::kDraco), 1000, 4096);
  ExpectDamageIsSeen(bytes);
  EXPECT_TRUE(IsHarmless(bytes));
}

TEST(LimitsTest, MoreElementsThanAllowedAreRefusedByName) {
  DecodeLimits limits;
  limits.max_elements = 47;
  const absl::StatusOr<Delta> delta = DecodeDelta(Encode(TetBlock(2), Codec::kUnspecified), limits);
  EXPECT_EQ(delta.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(GetErrorDetail(delta.status())->Find("limit"), "max_elements");
  limits.max_elements = 48;
  EXPECT_TRUE(DecodeDelta(Encode(TetBlock(2), Codec::kUnspecified), limits).ok());
}

TEST(LimitsTest, ALongerPayloadThanAllowedIsRefusedByName) {
  DecodeLimits limits;
  limits.max_payload_bytes = 48;
  const absl::StatusOr<Delta> delta = DecodeDelta(Encode(TetBlock(2), Codec::kUnspecified), limits);
  EXPECT_EQ(delta.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(GetErrorDetail(delta.status())->Find("limit"), "max_payload_bytes");
}

// A message of version 2 with one column: vertex, uint8, 2 components, max, "ab", default 3 4.
constexpr char kDescription[] = {0, 5, 2, 3, 2, 'a', 'b', 3, 4};

std::string WithDescription(absl::string_view description, char version) {
  Delta delta;
  delta.attributes.push_back(
      {{"ab", EntityKind::kVertex, AttributeType::kUint8, 2, AttributePolicy::kMax, {3, 4}}, {}, {}});
  ForgedMessage message = TakeApart(Encode(delta, Codec::kRaw));
  message.header[4] = version;
  message.sections[0].bytes = std::string(description);
  message.sections[0].count = message.sections[0].size = description.size();
  return message.Seal();
}

TEST(DescriptionTest, OfAColumnThatCannotBeIsRefused) {
  const absl::string_view valid(kDescription, sizeof(kDescription));
  ASSERT_TRUE(DecodeDelta(WithDescription(valid, 2)).ok());
  const auto refused = [](std::string description, char version = 2) {
    const absl::Status status = DecodeDelta(WithDescription(description, version)).status();
    return ErrorReason(status) == reason::kCorruptPayload;
  };
  const auto changed = [&](size_t at, char byte) {
    std::string description(valid);
    description[at] = byte;
    return description;
  };
  EXPECT_TRUE(refused(changed(0, 4))) << "kind";
  for (char type : {0, 6, -1}) EXPECT_TRUE(refused(changed(1, type))) << "type " << int{type};
  EXPECT_TRUE(refused(changed(1, 2))) << "a default of two bytes is none of two int32";
  for (char components : {0, 1, 3, 17}) EXPECT_TRUE(refused(changed(2, components))) << int{components};
  for (char policy : {0, 5, -1}) EXPECT_TRUE(refused(changed(3, policy))) << "policy " << int{policy};
  for (char name_bytes : {0, 1, 3, 5, 64, -1})
    EXPECT_TRUE(refused(changed(4, name_bytes))) << int{name_bytes};
  for (size_t size = 1; size < valid.size(); ++size) {
    if (size == 7) continue;  // no default: zeros
    EXPECT_TRUE(refused(std::string(valid.substr(0, size)))) << size;
  }
  EXPECT_TRUE(refused(std::string("\0\3\1\1\1a\0\0\xc0\x7f", 10))) << "NaN";
  EXPECT_TRUE(refused(std::string("\0\5\1ab", 5), 1)) << "version 1 has no uint8";
}

TEST(VersionTest, ANewerVersionIsToldFromDamage) {
  for (int version : {0, 3, 255}) {
    std::string bytes = Encode({}, Codec::kRaw);
    bytes[4] = static_cast<char>(version);
    for (const absl::Status& status : {DecodeDelta(bytes).status(), PeekDelta(bytes).status()}) {
      EXPECT_EQ(status.code(), absl::StatusCode::kUnimplemented);
      EXPECT_EQ(ErrorReason(status), reason::kUnsupportedFormat);
    }
  }
}

}  // namespace
}  // namespace dynmesh
