#include "core/codec/symbols.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "core/codec/bytes.h"
#include "core/codec/draco_gate.h"
#include "core/codec/zstd_frame.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

using Symbols = std::vector<uint32_t>;

constexpr size_t kMinAutoDraco = 500;  // below, Draco's blob costs more than it saves
constexpr size_t kMinZstd = 16;        // a frame's header alone takes 6 bytes
constexpr int kLowBits = 16;
constexpr uint32_t kLowMask = (1u << kLowBits) - 1;
constexpr uint64_t kMaxVarint32Bytes = 5;

absl::string_view AsBytes(absl::Span<const uint32_t> symbols) {
  return {reinterpret_cast<const char*>(symbols.data()), symbols.size() * sizeof(uint32_t)};
}

Packed RawArray(absl::Span<const uint32_t> symbols) {
  return {Packing::kRaw, symbols.size(), std::string(AsBytes(symbols))};
}

std::string Varints(absl::Span<const uint32_t> symbols) {
  ByteWriter out;
  out.Reserve(symbols.size());
  for (uint32_t symbol : symbols) out.Varint(symbol);
  return std::move(out).Take();
}

void KeepSmaller(Packing packing, std::string bytes, Packed& best) {
  if (bytes.size() >= best.bytes.size()) return;
  best.packing = packing;
  best.bytes = std::move(bytes);
}

// One Draco blob where every symbol is small enough, else one for the low and one for the high halves.
absl::StatusOr<std::string> DracoBlobs(absl::Span<const uint32_t> symbols) {
  const auto largest = std::max_element(symbols.begin(), symbols.end());
  if (symbols.empty() || *largest < kDracoSymbolLimit) return DracoEncode(symbols);
  Symbols low(symbols.size());
  Symbols high(symbols.size());
  for (size_t i = 0; i < symbols.size(); ++i) {
    low[i] = symbols[i] & kLowMask;
    high[i] = symbols[i] >> kLowBits;
  }
  DYNMESH_ASSIGN_OR_RETURN(std::string blobs, DracoEncode(low));
  DYNMESH_ASSIGN_OR_RETURN(const std::string high_blob, DracoEncode(high));
  return blobs + high_blob;
}

// The first symbol is often far larger than the rest (a first slot), so it stays out of Draco's tables.
// REQUIRES: not empty.
absl::StatusOr<std::string> PackDraco(absl::Span<const uint32_t> symbols) {
  DYNMESH_ASSIGN_OR_RETURN(const std::string blobs, DracoBlobs(symbols.subspan(1)));
  ByteWriter out;
  out.Varint(symbols[0]);
  out.Bytes(blobs);
  return std::move(out).Take();
}

// Puts the high halves into symbols[1], symbols[2], ...
absl::Status AddHighHalves(const Symbols& high, Symbols& symbols) {
  for (size_t i = 0; i < high.size(); ++i) {
    uint32_t& symbol = symbols[i + 1];
    if ((symbol | high[i]) > kLowMask) return CorruptPayload("a Draco section's halves overlap");
    symbol |= high[i] << kLowBits;
  }
  return absl::OkStatus();
}

absl::StatusOr<Symbols> UnpackDraco(absl::string_view bytes, size_t count) {
  if (count < 2) return CorruptPayload("a Draco section holds too few symbols");
  ByteReader in(bytes);
  const uint64_t first = in.Varint();
  if (!in.ok() || first > UINT32_MAX) return CorruptPayload("a Draco section has no first symbol");
  absl::string_view blobs = in.Bytes(in.remaining());
  Symbols symbols(1, static_cast<uint32_t>(first));
  DYNMESH_RETURN_IF_ERROR(DracoDecode(blobs, count - 1, symbols));
  if (blobs.empty()) return symbols;
  Symbols high;
  DYNMESH_RETURN_IF_ERROR(DracoDecode(blobs, count - 1, high));
  DYNMESH_RETURN_IF_ERROR(AddHighHalves(high, symbols));
  if (!blobs.empty()) return CorruptPayload("a Draco section has bytes left over");
  return symbols;
}

absl::StatusOr<Symbols> UnpackRaw(absl::string_view bytes, size_t count) {
  if (bytes.size() != count * sizeof(uint32_t)) return CorruptPayload("a raw section is not of its length");
  Symbols symbols(count);
  if (count > 0) std::memcpy(symbols.data(), bytes.data(), bytes.size());
  return symbols;
}

absl::StatusOr<Symbols> UnpackVarints(absl::string_view bytes, size_t count) {
  if (bytes.size() < count) return CorruptPayload("a section is shorter than its symbols");
  ByteReader in(bytes);
  Symbols symbols(count);
  uint64_t largest = 0;
  for (uint32_t& symbol : symbols) {
    const uint64_t value = in.Varint();
    largest = std::max(largest, value);
    symbol = static_cast<uint32_t>(value);
  }
  if (!in.done() || largest > UINT32_MAX) return CorruptPayload("a section does not hold its symbols");
  return symbols;
}

}  // namespace

Packed PackSymbols(absl::Span<const uint32_t> symbols, Codec codec) {
  if (codec == Codec::kRaw || symbols.empty()) return RawArray(symbols);
  if (codec == Codec::kDraco) {
    absl::StatusOr<std::string> blobs = PackDraco(symbols);
    if (blobs.ok()) return {Packing::kDraco, symbols.size(), *std::move(blobs)};
  }
  Packed best{Packing::kVarint, symbols.size(), Varints(symbols)};
  if (best.bytes.size() >= kMinZstd) KeepSmaller(Packing::kZstd, CompressFrame(best.bytes), best);
  if (codec == Codec::kUnspecified && symbols.size() >= kMinAutoDraco) {
    absl::StatusOr<std::string> blobs = PackDraco(symbols);
    if (blobs.ok()) KeepSmaller(Packing::kDraco, *std::move(blobs), best);
  }
  return AsBytes(symbols).size() < best.bytes.size() ? RawArray(symbols) : best;
}

Packed PackArray(absl::Span<const uint32_t> symbols, Codec codec) {
  Packed best = RawArray(symbols);
  if (codec == Codec::kRaw || best.bytes.size() < kMinZstd) return best;
  KeepSmaller(Packing::kRawZstd, CompressFrame(best.bytes), best);
  return best;
}

absl::StatusOr<Symbols> UnpackSymbols(const Section& section) {
  const uint64_t count = section.count;
  switch (section.packing) {
    case Packing::kRaw:
      return UnpackRaw(section.bytes, count);
    case Packing::kVarint:
      return UnpackVarints(section.bytes, count);
    case Packing::kDraco:
      return UnpackDraco(section.bytes, count);
    case Packing::kZstd: {
      DYNMESH_ASSIGN_OR_RETURN(const std::string varints,
                               DecompressFrame(section.bytes, count, count * kMaxVarint32Bytes));
      return UnpackVarints(varints, count);
    }
    case Packing::kRawZstd: {
      const uint64_t size = count * sizeof(uint32_t);
      DYNMESH_ASSIGN_OR_RETURN(const std::string raw, DecompressFrame(section.bytes, size, size));
      return UnpackRaw(raw, count);
    }
  }
  return CorruptPayload("a section is packed in an unknown way");
}

Packed PackSlots(absl::Span<const Slot> slots, Codec codec) {
  Symbols gaps(slots.size());
  Slot next = 0;
  for (size_t i = 0; i < slots.size(); ++i) {
    gaps[i] = slots[i] - next;
    next = slots[i] + 1;
  }
  return PackSymbols(gaps, codec);
}

absl::StatusOr<std::vector<Slot>> UnpackSlots(const Section& section) {
  DYNMESH_ASSIGN_OR_RETURN(Symbols slots, UnpackSymbols(section));
  uint64_t next = 0;
  for (uint32_t& slot : slots) {
    next += slot;
    if (next >= kNoSlot) return CorruptPayload("a section's slots run beyond the last slot");
    slot = static_cast<Slot>(next++);
  }
  return slots;
}

}  // namespace dynmesh
