#include "core/codec/envelope.h"

#include <xxhash.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/codec/bytes.h"

namespace dynmesh {
namespace {

constexpr absl::string_view kMagic("DYNM", 4);
constexpr uint8_t kConsistentFlag = 1;
constexpr int kMaxBits = 30;
constexpr size_t kChecksumBytes = sizeof(uint64_t);
constexpr uint64_t kMaxCount = uint64_t{1} << 40;  // keeps sums of counts far from overflow
constexpr uint64_t kBytesPerSymbol = 4;

uint64_t Hash(absl::string_view bytes) { return XXH64(bytes.data(), bytes.size(), 0); }

uint64_t DecodedBytes(uint32_t id, uint64_t count) {
  if (id == section::kPadding) return 0;
  return section::HoldsBytes(id) ? count : count * kBytesPerSymbol;
}

void WriteHeader(const MessageHeader& header, ByteWriter& out) {
  out.Bytes(kMagic);
  out.Fixed<uint8_t>(header.version);
  out.Fixed<uint8_t>(header.delta.consistent ? kConsistentFlag : 0);
  out.Fixed<uint8_t>(header.grid.bits);
  out.Fixed<uint8_t>(0);
  out.Fixed<int64_t>(header.delta.from_revision);
  out.Fixed<int64_t>(header.delta.to_revision);
  out.Fixed<uint64_t>(header.delta.checksum.topology);
  out.Fixed<uint64_t>(header.delta.checksum.geometry);
  if (header.grid.bits == 0) return;
  for (double coordinate : header.grid.origin) out.Fixed<double>(coordinate);
  out.Fixed<double>(header.grid.step);
}

void WriteEntry(uint32_t id, const Packed& packed, ByteWriter& out) {
  out.Varint(id);
  out.Fixed<Packing>(packed.packing);
  out.Varint(packed.count);
  out.Varint(packed.bytes.size());
}

absl::Status CheckVersion(absl::string_view bytes) {
  if (bytes.size() <= kMagic.size() || bytes.substr(0, kMagic.size()) != kMagic) {
    return CorruptPayload("the bytes are not a dynmesh message");
  }
  const int version = static_cast<uint8_t>(bytes[kMagic.size()]);
  if (version >= kFirstVersion && version <= kLatestVersion) return absl::OkStatus();
  return MakeError(absl::StatusCode::kUnimplemented, reason::kUnsupportedFormat,
                   absl::StrCat("the message is of format version ", version, ", and this build reads ",
                                kFirstVersion, " to ", kLatestVersion),
                   {{"version", absl::StrCat(version)}});
}

absl::StatusOr<absl::string_view> CheckSeal(absl::string_view bytes) {
  if (bytes.size() < kMagic.size() + kChecksumBytes) return CorruptPayload("the message is truncated");
  const absl::string_view body = bytes.substr(0, bytes.size() - kChecksumBytes);
  ByteReader seal(bytes.substr(body.size()));
  if (seal.Fixed<uint64_t>() != Hash(body)) return CorruptPayload("the message's checksum does not match");
  return body;
}

absl::Status ReadGrid(ByteReader& in, QuantizationGrid& grid) {
  if (grid.bits == 0) return absl::OkStatus();
  bool finite = true;
  for (double& coordinate : grid.origin) {
    coordinate = in.Fixed<double>();
    finite &= std::isfinite(coordinate);
  }
  grid.step = in.Fixed<double>();
  if (!in.ok() || grid.bits > kMaxBits || !finite || !std::isfinite(grid.step) || grid.step <= 0) {
    return CorruptPayload("the message's quantisation grid is not valid");
  }
  return absl::OkStatus();
}

absl::StatusOr<MessageHeader> ReadHeader(ByteReader& in) {
  MessageHeader header;
  in.Bytes(kMagic.size());
  header.version = in.Fixed<uint8_t>();
  const uint8_t flags = in.Fixed<uint8_t>();
  header.grid.bits = header.delta.position_bits = in.Fixed<uint8_t>();
  const uint8_t reserved = in.Fixed<uint8_t>();
  header.delta.consistent = flags == kConsistentFlag;
  header.delta.from_revision = in.Fixed<int64_t>();
  header.delta.to_revision = in.Fixed<int64_t>();
  header.delta.checksum.topology = in.Fixed<uint64_t>();
  header.delta.checksum.geometry = in.Fixed<uint64_t>();
  if (!in.ok() || flags > kConsistentFlag || reserved != 0) {
    return CorruptPayload("the message's header is not valid");
  }
  DYNMESH_RETURN_IF_ERROR(ReadGrid(in, header.grid));
  return header;
}

// The entry's `bytes` have the claimed size but no address yet: sections follow the whole table.
struct Entry {
  Section section;
  uint64_t size = 0;
};

Entry ReadEntry(ByteReader& in) {
  Entry entry;
  entry.section.id = static_cast<uint32_t>(std::min<uint64_t>(in.Varint(), UINT32_MAX));
  entry.section.packing = in.Fixed<Packing>();
  entry.section.count = in.Varint();
  entry.size = in.Varint();
  return entry;
}

absl::StatusOr<std::vector<Entry>> ReadTable(ByteReader& in) {
  const uint64_t num_entries = in.Varint();
  std::vector<Entry> entries;
  for (uint64_t i = 0; i < num_entries && in.ok(); ++i) {
    entries.push_back(ReadEntry(in));
    const Section& section = entries.back().section;
    const bool ascends = i == 0 || entries[i - 1].section.id < section.id;
    if (!ascends || section.count == 0 || section.count > kMaxCount) {
      return CorruptPayload("the message's section table is not valid");
    }
  }
  if (!in.ok()) return CorruptPayload("the message's section table is truncated");
  return entries;
}

absl::Status CheckWeight(const std::vector<Entry>& entries, uint64_t message_bytes) {
  uint64_t decoded_bytes = 0;
  for (const Entry& entry : entries) {
    decoded_bytes += DecodedBytes(entry.section.id, entry.section.count);
    if (decoded_bytes > kMaxExpansion * message_bytes) {
      return CorruptPayload("the message claims more than its size can stand for");
    }
  }
  return absl::OkStatus();
}

}  // namespace

void MessageWriter::Add(uint32_t id, Packed packed) {
  assert(sections_.empty() || sections_.back().first < id);
  if (packed.count > 0) sections_.emplace_back(id, std::move(packed));
}

uint64_t MessageWriter::SectionBytes(uint32_t first, uint32_t last) const {
  ByteWriter entries;
  uint64_t payload_bytes = 0;
  for (const auto& [id, packed] : sections_) {
    if (id < first || id > last) continue;
    WriteEntry(id, packed, entries);
    payload_bytes += packed.bytes.size();
  }
  return entries.size() + payload_bytes;
}

void MessageWriter::PadTo(uint64_t other_bytes) {
  uint64_t decoded_bytes = 0;
  for (const auto& [id, packed] : sections_) decoded_bytes += DecodedBytes(id, packed.count);
  const uint64_t size = other_bytes + SectionBytes(0, UINT32_MAX);
  const uint64_t needed = (decoded_bytes + kMaxExpansion - 1) / kMaxExpansion;
  if (needed <= size) return;
  const uint64_t missing = needed - size;
  sections_.insert(sections_.begin(),
                   {section::kPadding, {Packing::kRaw, missing, std::string(missing, '\0')}});
}

std::string MessageWriter::Finish(const MessageHeader& header) && {
  ByteWriter out;
  WriteHeader(header, out);
  PadTo(out.size() + kChecksumBytes);
  out.Varint(sections_.size());
  for (const auto& [id, packed] : sections_) WriteEntry(id, packed, out);
  for (const auto& [id, packed] : sections_) out.Bytes(packed.bytes);
  out.Fixed<uint64_t>(Hash(out.bytes()));
  return std::move(out).Take();
}

absl::StatusOr<Message> ReadMessage(absl::string_view bytes) {
  DYNMESH_RETURN_IF_ERROR(CheckVersion(bytes));
  DYNMESH_ASSIGN_OR_RETURN(const absl::string_view body, CheckSeal(bytes));
  ByteReader in(body);
  Message message;
  DYNMESH_ASSIGN_OR_RETURN(message.header, ReadHeader(in));
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Entry> entries, ReadTable(in));
  DYNMESH_RETURN_IF_ERROR(CheckWeight(entries, bytes.size()));
  for (const Entry& entry : entries) {
    message.sections.push_back(entry.section);
    message.sections.back().bytes = in.Bytes(entry.size);
  }
  if (!in.done()) return CorruptPayload("the message's sections do not fill it");
  return message;
}

}  // namespace dynmesh
