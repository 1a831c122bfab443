#include "core/codec/codec.h"

#include <cassert>
#include <cmath>
#include <new>
#include <stdexcept>
#include <utility>

#include "core/codec/attribute_codec.h"
#include "core/codec/bytes.h"
#include "core/codec/element_codec.h"
#include "core/codec/envelope.h"
#include "core/codec/position_codec.h"
#include "core/codec/symbols.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

constexpr int kMaxGridBits = 30;
constexpr EntityKind kElementKinds[] = {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell};
constexpr uint32_t kFirstElementSection = section::Of(EntityKind::kEdge, section::kRemoved);
constexpr uint32_t kFirstColumnSection = section::Of(0, section::kSpec);

// Runs `fn`; memory that runs out, also for an absurd length, becomes a status.
template <typename Fn>
auto CatchOutOfMemory(Fn fn) -> decltype(fn()) {
  try {
    return fn();
  } catch (const std::bad_alloc&) {
  } catch (const std::length_error&) {
  }
  return MakeError(absl::StatusCode::kResourceExhausted, reason::kLimitExceeded,
                   "memory ran out in the codec", {{"limit", "memory"}});
}

absl::Status CheckGrid(const QuantizationGrid& grid) {
  if (grid.step == 0) return absl::OkStatus();
  bool valid = std::isfinite(grid.step) && grid.step > 0 && grid.bits >= 1 && grid.bits <= kMaxGridBits;
  const double extent = valid ? grid.step * ((1u << grid.bits) - 1) : 0;
  for (double coordinate : grid.origin) {
    valid &= std::isfinite(coordinate) && std::isfinite(coordinate + extent);
  }
  return valid ? absl::OkStatus()
               : InvalidArgument(reason::kBadArgument, "the quantisation grid is not valid");
}

MessageHeader HeaderOf(const Delta& delta, const QuantizationGrid& grid) {
  MessageHeader header;
  header.version = VersionFor(delta.attributes);
  header.delta.from_revision = delta.from_revision;
  header.delta.to_revision = delta.to_revision;
  header.delta.consistent = delta.consistent;
  header.delta.checksum = delta.checksum;
  if (grid.step > 0) header.grid = grid;
  return header;
}

void CountRaw(const Delta& delta, EncodeStats& stats) {
  stats.raw_geometry_bytes = delta.vertex_slots.size() * (sizeof(Slot) + sizeof(Point));
  stats.raw_topology_bytes = delta.removed_vertices.size() * sizeof(Slot);
  for (const ElementChanges& changes : delta.elements) {
    stats.raw_topology_bytes +=
        (changes.removed.size() + changes.slots.size() + changes.vertices.size()) * sizeof(Slot);
    stats.raw_topology_bytes += changes.types.size();
  }
}

void CountEncoded(const MessageWriter& writer, EncodeStats& stats) {
  stats.topology_bytes = writer.SectionBytes(section::kRemovedVertices, section::kRemovedVertices) +
                         writer.SectionBytes(kFirstElementSection, kFirstColumnSection - 1);
  stats.geometry_bytes = writer.SectionBytes(section::kVertexSlots, kFirstElementSection - 1);
  stats.attribute_bytes = writer.SectionBytes(kFirstColumnSection, UINT32_MAX);
}

std::string Encode(const Delta& delta, const EncodeOptions& options, EncodeStats* stats) {
  MessageWriter writer;
  writer.Add(section::kRemovedVertices, PackSlots(delta.removed_vertices, options.codec));
  writer.Add(section::kVertexSlots, PackSlots(delta.vertex_slots, options.codec));
  EncodePositions(delta.positions, options, writer);
  for (EntityKind kind : kElementKinds) EncodeElements(kind, delta.OfKind(kind), options.codec, writer);
  EncodeAttributes(delta.attributes, options.codec, writer);
  if (stats != nullptr) {
    CountRaw(delta, *stats);
    CountEncoded(writer, *stats);
  }
  return std::move(writer).Finish(HeaderOf(delta, options.grid));
}

// Before anything is unpacked. Counts of other sections follow from those of slots, or are found out.
absl::Status CheckLimits(const Message& message, const DecodeLimits& limits) {
  for (const Section& section : message.sections) {
    if (section::HoldsSlots(section.id) && section.count > limits.max_elements) {
      return LimitExceeded("max_elements", limits.max_elements, section.count);
    }
  }
  return absl::OkStatus();
}

Delta EmptyDelta(const DeltaHeader& header) {
  Delta delta;
  delta.from_revision = header.from_revision;
  delta.to_revision = header.to_revision;
  delta.consistent = header.consistent;
  delta.checksum = header.checksum;
  return delta;
}

absl::StatusOr<Delta> Decode(absl::string_view bytes, const DecodeLimits& limits) {
  DYNMESH_ASSIGN_OR_RETURN(const Message message, ReadMessage(bytes));
  DYNMESH_RETURN_IF_ERROR(CheckLimits(message, limits));
  Delta delta = EmptyDelta(message.header.delta);
  SectionReader sections(message.sections);
  sections.Take(section::kPadding);
  DYNMESH_ASSIGN_OR_RETURN(delta.removed_vertices, UnpackSlots(sections.Take(section::kRemovedVertices)));
  DYNMESH_ASSIGN_OR_RETURN(delta.vertex_slots, UnpackSlots(sections.Take(section::kVertexSlots)));
  DYNMESH_ASSIGN_OR_RETURN(delta.positions,
                           DecodePositions(delta.vertex_slots.size(), message.header.grid, sections));
  for (EntityKind kind : kElementKinds) {
    DYNMESH_RETURN_IF_ERROR(DecodeElements(kind, sections, delta.OfKind(kind)));
  }
  DYNMESH_ASSIGN_OR_RETURN(delta.attributes, DecodeAttributes(message.header.version, sections));
  if (!sections.done()) return CorruptPayload("the message has a section that does not belong");
  DYNMESH_RETURN_IF_ERROR(CheckDelta(delta));
  return delta;
}

}  // namespace

absl::StatusOr<std::string> EncodeDelta(const Delta& delta, const EncodeOptions& options,
                                        EncodeStats* stats) {
  assert(CheckDelta(delta).ok());
  DYNMESH_RETURN_IF_ERROR(CheckGrid(options.grid));
  return CatchOutOfMemory([&]() -> absl::StatusOr<std::string> { return Encode(delta, options, stats); });
}

absl::StatusOr<Delta> DecodeDelta(absl::string_view bytes, const DecodeLimits& limits) {
  if (bytes.size() > limits.max_payload_bytes) {
    return LimitExceeded("max_payload_bytes", limits.max_payload_bytes, bytes.size());
  }
  return CatchOutOfMemory([&] { return Decode(bytes, limits); });
}

absl::StatusOr<DeltaHeader> PeekDelta(absl::string_view bytes) {
  return CatchOutOfMemory([&]() -> absl::StatusOr<DeltaHeader> {
    DYNMESH_ASSIGN_OR_RETURN(const Message message, ReadMessage(bytes));
    return message.header.delta;
  });
}

}  // namespace dynmesh
