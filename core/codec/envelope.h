#ifndef DYNMESH_CORE_CODEC_ENVELOPE_H_
#define DYNMESH_CORE_CODEC_ENVELOPE_H_

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/codec/codec.h"
#include "core/mesh/ids.h"

/// The outer form of a message: header, section table, sections, checksum. See FORMAT.md.
namespace dynmesh {

/// How the bytes of one section are packed. The values travel on the wire: never renumber.
enum class Packing : uint8_t {
  kRaw = 1,      ///< symbols as uint32 each; byte sections as they are
  kZstd = 2,     ///< symbols as varints, then zstd; byte sections through zstd
  kDraco = 3,    ///< symbols through Draco
  kVarint = 4,   ///< symbols as varints
  kRawZstd = 5,  ///< symbols as uint32 each, then zstd
};

/// What a section holds. The values travel on the wire: never renumber.
namespace section {
inline constexpr uint32_t kPadding = 0;
inline constexpr uint32_t kRemovedVertices = 1;
inline constexpr uint32_t kVertexSlots = 2;
inline constexpr uint32_t kPositions = 3;
inline constexpr uint32_t kGridIndices[] = {4, 5, 6};

/// Sections of an element kind, from 16 * dimension on.
enum ElementPart : uint32_t {
  kRemoved = 0,
  kSlots = 1,
  kTypeRuns = 2,
  kVertexTable = 3,
  kCorners = 4,
  kMisses = 5,
  kVertices = 6,
};
constexpr uint32_t Of(EntityKind kind, ElementPart part) { return 16 * Dimension(kind) + part; }

/// Sections of an attribute column, from 64 + 4 * column on.
enum ColumnPart : uint32_t { kSpec = 0, kRowSlots = 1, kRows = 2 };
constexpr uint32_t Of(uint32_t column, ColumnPart part) { return 64 + 4 * column + part; }

/// Whether a section holds the slots that were written or removed, of vertices, elements or rows.
constexpr bool HoldsSlots(uint32_t id) {
  if (id >= 64) return id % 4 == kRowSlots;
  return id < 16 ? id == kRemovedVertices || id == kVertexSlots : id % 16 <= kSlots;
}

/// Whether the count of a section counts bytes rather than symbols.
constexpr bool HoldsBytes(uint32_t id) {
  return id == kPadding || id == kPositions || (id >= 64 && id % 4 != kRowSlots);
}
}  // namespace section

/// A stream after packing. `count` is in symbols or, in byte sections, in bytes before packing.
struct Packed {
  Packing packing = Packing::kRaw;
  uint64_t count = 0;
  std::string bytes;
};

/// A section of a message that was read; borrows the message's bytes.
struct Section {
  uint32_t id = 0;
  Packing packing = Packing::kRaw;
  uint64_t count = 0;
  absl::string_view bytes;
};

/// Versions of the format: the second one describes attribute columns in more words. A message is of the
/// lowest that can say what it says, so that old readers read what old writers could have written.
inline constexpr int kFirstVersion = 1;
inline constexpr int kLatestVersion = 2;

struct MessageHeader {
  int version = kFirstVersion;
  DeltaHeader delta;
  QuantizationGrid grid;  ///< bits 0: lossless
};

/// Decoded bytes that a message may claim for each of its own: the weight rule of FORMAT.md.
inline constexpr uint64_t kMaxExpansion = 256;

/// Collects sections, in ascending order of id, and writes the message.
class MessageWriter {
 public:
  /// Leaves out empty streams. REQUIRES: `id` is greater than those before.
  void Add(uint32_t id, Packed packed);

  /// Bytes that sections with ids in [first, last] take, table entries included.
  uint64_t SectionBytes(uint32_t first, uint32_t last) const;

  /// The message, padded where the weight rule asks for it.
  std::string Finish(const MessageHeader& header) &&;

 private:
  // Puts padding in front if header, seal (`other_bytes`) and sections weigh too little for what they claim.
  void PadTo(uint64_t other_bytes);

  std::vector<std::pair<uint32_t, Packed>> sections_;
};

/// A message whose checksum, header and table are sound; borrows the bytes that it was read from.
struct Message {
  MessageHeader header;
  std::vector<Section> sections;  ///< ascending strictly by id, none of count 0
};

/// Errors: DATA_LOSS CORRUPT_PAYLOAD, UNIMPLEMENTED UNSUPPORTED_FORMAT.
absl::StatusOr<Message> ReadMessage(absl::string_view bytes);

/// Hands out the sections of a message in order.
class SectionReader {
 public:
  explicit SectionReader(absl::Span<const Section> sections) : sections_(sections) {}

  /// The section `id` if it is the next one, and moves on; an empty one otherwise.
  Section Take(uint32_t id) {
    if (!NextIs(id)) return Section();
    const Section next = sections_.front();
    sections_.remove_prefix(1);
    return next;
  }

  bool NextIs(uint32_t id) const { return !sections_.empty() && sections_.front().id == id; }
  bool done() const { return sections_.empty(); }

 private:
  absl::Span<const Section> sections_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_ENVELOPE_H_
