#include "tests/core/codec/message_surgery.h"

#include <xxhash.h>

#include <cstring>

#include "core/codec/bytes.h"

namespace dynmesh {
namespace {

constexpr size_t kSealBytes = 8;
constexpr size_t kPlainHeaderBytes = 40;
constexpr size_t kGridBytes = 32;
constexpr size_t kBitsOffset = 6;

}  // namespace

std::string Reseal(std::string message) {
  if (message.size() < kSealBytes) return message;
  const size_t size = message.size() - kSealBytes;
  const uint64_t seal = XXH64(message.data(), size, 0);
  std::memcpy(message.data() + size, &seal, kSealBytes);
  return message;
}

std::string ForgedMessage::Seal() const {
  ByteWriter out;
  out.Bytes(header);
  out.Varint(sections.size());
  for (const ForgedSection& section : sections) {
    out.Varint(section.id);
    out.Fixed<uint8_t>(section.packing);
    out.Varint(section.count);
    out.Varint(section.size);
  }
  for (const ForgedSection& section : sections) out.Bytes(section.bytes);
  out.Fixed<uint64_t>(0);
  return Reseal(std::move(out).Take());
}

ForgedMessage TakeApart(absl::string_view message) {
  ByteReader in(message);
  ForgedMessage forged;
  forged.header = std::string(in.Bytes(kPlainHeaderBytes + (message[kBitsOffset] != 0 ? kGridBytes : 0)));
  forged.sections.resize(in.Varint());
  for (ForgedSection& section : forged.sections) {
    section.id = static_cast<uint32_t>(in.Varint());
    section.packing = in.Fixed<uint8_t>();
    section.count = in.Varint();
    section.size = in.Varint();
  }
  for (ForgedSection& section : forged.sections) section.bytes = std::string(in.Bytes(section.size));
  return forged;
}

}  // namespace dynmesh
