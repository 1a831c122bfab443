#include "core/codec/element_codec.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/codec/bytes.h"
#include "core/codec/symbols.h"
#include "core/codec/vertex_cache.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

using section::ElementPart;
using Symbols = std::vector<uint32_t>;

constexpr int kTypeBits = 3;
constexpr uint32_t kMaxRun = 1u << (32 - kTypeBits);

// A run of equal types as one symbol: length - 1, then the type in the low bits.
Symbols TypeRuns(const std::vector<ElementType>& types) {
  Symbols runs;
  for (auto begin = types.begin(); begin != types.end();) {
    const auto stop = begin + std::min<size_t>(kMaxRun, types.end() - begin);
    const auto end = std::find_if(begin, stop, [begin](ElementType t) { return t != *begin; });
    runs.push_back(static_cast<uint32_t>(end - begin - 1) << kTypeBits | static_cast<uint32_t>(*begin));
    begin = end;
  }
  return runs;
}

absl::StatusOr<std::vector<ElementType>> ExpandRuns(const Symbols& runs, EntityKind kind, size_t count) {
  std::vector<ElementType> types;
  types.reserve(count);
  for (uint32_t run : runs) {
    const ElementType type = static_cast<ElementType>(run & ((1u << kTypeBits) - 1));
    const size_t length = (run >> kTypeBits) + size_t{1};
    if (!IsElementType(static_cast<int>(type)) || KindOf(type) != kind || length > count - types.size()) {
      return CorruptPayload("a run of element types is not valid");
    }
    types.insert(types.end(), length, type);
  }
  if (types.size() != count) return CorruptPayload("element types are not one for each slot");
  return types;
}

struct CornerStreams {
  Symbols table;    // vertices that occur, ascending
  Symbols corners;  // codes of the cache
  Symbols misses;   // zigzag distances within the table
};

// Every vertex that occurs is missed the first time, so the misses alone are enough for the table.
CornerStreams ToStreams(const std::vector<VertexId>& vertices) {
  CornerStreams streams;
  streams.corners.reserve(vertices.size());
  VertexCache cache;
  for (VertexId vertex : vertices) {
    streams.corners.push_back(cache.Use(vertex.slot()));
    if (streams.corners.back() == 0) streams.misses.push_back(vertex.slot());
  }
  Symbols& table = streams.table = streams.misses;
  std::sort(table.begin(), table.end());
  table.erase(std::unique(table.begin(), table.end()), table.end());
  uint32_t last = 0;
  for (uint32_t& miss : streams.misses) {
    const uint32_t local = std::lower_bound(table.begin(), table.end(), miss) - table.begin();
    miss = ZigZag(local - std::exchange(last, local));
  }
  return streams;
}

// The misses one after another, as vertices of the table.
class MissReader {
 public:
  explicit MissReader(const CornerStreams& streams) : streams_(streams) {}

  // kNoSlot when there is no further miss or it leaves the table.
  Slot Next() {
    if (next_ == streams_.misses.size()) return kNoSlot;
    local_ += UnZigZag(streams_.misses[next_++]);
    return local_ < streams_.table.size() ? streams_.table[local_] : kNoSlot;
  }

  bool done() const { return next_ == streams_.misses.size(); }

 private:
  const CornerStreams& streams_;
  size_t next_ = 0;
  uint32_t local_ = 0;
};

absl::StatusOr<std::vector<VertexId>> FromStreams(const CornerStreams& streams) {
  std::vector<VertexId> vertices;
  vertices.reserve(streams.corners.size());
  VertexCache cache;
  MissReader misses(streams);
  for (uint32_t code : streams.corners) {
    if (code != 0 && !cache.Holds(code)) return CorruptPayload("a corner is beyond the vertex cache");
    const Slot slot = code == 0 ? misses.Next() : cache.UseCode(code);
    if (slot == kNoSlot) return CorruptPayload("a corner is beyond the vertex table");
    if (code == 0) cache.Push(slot);
    vertices.emplace_back(slot);
  }
  if (!misses.done()) return CorruptPayload("there are vertices that no corner asks for");
  return vertices;
}

// One of the two ways to write corners.
using PackedParts = std::vector<std::pair<ElementPart, Packed>>;

PackedParts PackStreams(const std::vector<VertexId>& vertices, Codec codec) {
  const CornerStreams streams = ToStreams(vertices);
  PackedParts parts;
  parts.emplace_back(ElementPart::kVertexTable, PackSlots(streams.table, codec));
  parts.emplace_back(ElementPart::kCorners, PackSymbols(streams.corners, codec));
  parts.emplace_back(ElementPart::kMisses, PackSymbols(streams.misses, codec));
  return parts;
}

PackedParts PackPlain(const std::vector<VertexId>& vertices, Codec codec) {
  Symbols slots(vertices.size());
  std::transform(vertices.begin(), vertices.end(), slots.begin(), [](VertexId v) { return v.slot(); });
  PackedParts parts;
  parts.emplace_back(ElementPart::kVertices, PackArray(slots, codec));
  return parts;
}

size_t TotalBytes(const PackedParts& parts) {
  size_t bytes = 0;
  for (const auto& [part, packed] : parts) bytes += packed.bytes.size();
  return bytes;
}

void EncodeVertices(EntityKind kind, const std::vector<VertexId>& vertices, Codec codec,
                    MessageWriter& writer) {
  PackedParts best = codec == Codec::kRaw ? PackPlain(vertices, codec) : PackStreams(vertices, codec);
  if (codec == Codec::kUnspecified) {
    PackedParts plain = PackPlain(vertices, codec);
    if (TotalBytes(plain) < TotalBytes(best)) best = std::move(plain);
  }
  for (auto& [part, packed] : best) writer.Add(section::Of(kind, part), std::move(packed));
}

absl::StatusOr<std::vector<VertexId>> UnpackVertices(const Section& section) {
  DYNMESH_ASSIGN_OR_RETURN(const Symbols slots, UnpackSymbols(section));
  if (std::find(slots.begin(), slots.end(), kNoSlot) != slots.end()) {
    return CorruptPayload("a corner names no vertex");
  }
  return std::vector<VertexId>(slots.begin(), slots.end());
}

absl::StatusOr<std::vector<VertexId>> DecodeVertices(EntityKind kind, SectionReader& sections) {
  const uint32_t plain = section::Of(kind, ElementPart::kVertices);
  if (sections.NextIs(plain)) return UnpackVertices(sections.Take(plain));
  CornerStreams streams;
  const auto take = [&](ElementPart part) { return sections.Take(section::Of(kind, part)); };
  DYNMESH_ASSIGN_OR_RETURN(streams.table, UnpackSlots(take(ElementPart::kVertexTable)));
  DYNMESH_ASSIGN_OR_RETURN(streams.corners, UnpackSymbols(take(ElementPart::kCorners)));
  DYNMESH_ASSIGN_OR_RETURN(streams.misses, UnpackSymbols(take(ElementPart::kMisses)));
  return FromStreams(streams);
}

size_t CountCorners(const std::vector<ElementType>& types) {
  size_t corners = 0;
  for (ElementType type : types) corners += NumVertices(type);
  return corners;
}

}  // namespace

void EncodeElements(EntityKind kind, const ElementChanges& changes, Codec codec, MessageWriter& writer) {
  writer.Add(section::Of(kind, ElementPart::kRemoved), PackSlots(changes.removed, codec));
  if (changes.slots.empty()) return;
  writer.Add(section::Of(kind, ElementPart::kSlots), PackSlots(changes.slots, codec));
  writer.Add(section::Of(kind, ElementPart::kTypeRuns), PackSymbols(TypeRuns(changes.types), codec));
  EncodeVertices(kind, changes.vertices, codec, writer);
}

absl::Status DecodeElements(EntityKind kind, SectionReader& sections, ElementChanges& changes) {
  const auto take = [&](ElementPart part) { return sections.Take(section::Of(kind, part)); };
  DYNMESH_ASSIGN_OR_RETURN(changes.removed, UnpackSlots(take(ElementPart::kRemoved)));
  DYNMESH_ASSIGN_OR_RETURN(changes.slots, UnpackSlots(take(ElementPart::kSlots)));
  DYNMESH_ASSIGN_OR_RETURN(const Symbols runs, UnpackSymbols(take(ElementPart::kTypeRuns)));
  DYNMESH_ASSIGN_OR_RETURN(changes.types, ExpandRuns(runs, kind, changes.slots.size()));
  DYNMESH_ASSIGN_OR_RETURN(changes.vertices, DecodeVertices(kind, sections));
  if (changes.vertices.size() != CountCorners(changes.types)) {
    return CorruptPayload("elements have more or fewer corners than their types");
  }
  return absl::OkStatus();
}

}  // namespace dynmesh
