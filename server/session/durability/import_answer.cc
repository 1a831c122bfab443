// What an import was answered, as bytes.

#include <utility>

#include "server/session/durability/answer_bytes.h"
#include "server/session/durability/answer_codec.h"
#include "server/session/durability/manifest.h"
#include "server/session/importer/importer.h"

namespace dynmesh {
namespace {

void WriteCounts(const KindCounts& counts, AnswerWriter& out) {
  for (uint64_t count : counts) out.Fixed(count);
}

KindCounts ReadCounts(AnswerReader& in) {
  KindCounts counts;
  for (uint64_t& count : counts) count = in.Fixed<uint64_t>();
  return counts;
}

void WriteSpec(const AttributeSpec& spec, AnswerWriter& out) {
  out.Text(spec.name);
  out.Fixed(static_cast<uint8_t>(spec.kind));
  out.Fixed(static_cast<uint8_t>(spec.type));
  out.Fixed(static_cast<uint8_t>(spec.components));
  out.Fixed(static_cast<uint8_t>(spec.policy));
  out.Array(spec.default_row);
}

AttributeSpec ReadSpec(AnswerReader& in) {
  AttributeSpec spec;
  spec.name = in.Text();
  spec.kind = static_cast<EntityKind>(in.Fixed<uint8_t>());
  spec.type = static_cast<AttributeType>(in.Fixed<uint8_t>());
  spec.components = in.Fixed<uint8_t>();
  spec.policy = static_cast<AttributePolicy>(in.Fixed<uint8_t>());
  spec.default_row = in.Array<uint8_t>();
  return spec;
}

void WriteMeshWarning(const MeshWarning& warning, AnswerWriter& out) {
  out.Fixed(static_cast<uint8_t>(warning.warning));
  out.Fixed(static_cast<uint8_t>(warning.kind));
  out.Array(warning.ids);
  out.Fixed(warning.count);
}

MeshWarning ReadMeshWarning(AnswerReader& in) {
  MeshWarning warning;
  warning.warning = static_cast<WarningKind>(in.Fixed<uint8_t>());
  warning.kind = static_cast<EntityKind>(in.Fixed<uint8_t>());
  warning.ids = in.Array<Slot>();
  warning.count = in.Fixed<uint64_t>();
  return warning;
}

void WriteInfo(const SessionInfo& info, AnswerWriter& out) {
  out.Text(EncodeIdentity({info.uid, info.create_time, info.settings}));
  out.Text(info.name);
  out.Text(info.etag);
  out.Fixed(info.durable_revision);
  out.Fixed(absl::ToUnixMicros(info.update_time));
  for (const KindCounts* counts :
       {&info.counts, &info.estimated_counts, &info.boundary_counts, &info.element_counts}) {
    WriteCounts(*counts, out);
  }
  out.Fixed(info.euler_characteristic);
  out.Fixed(info.checksum.topology);
  out.Fixed(info.checksum.geometry);
  out.Fixed(info.memory_bytes);
  out.Each(info.attributes, [&](const AttributeSpec& spec) { WriteSpec(spec, out); });
  out.Each(info.stored_relations, [&](const StoredRelation& stored) { out.Fixed(stored.memory_bytes); });
  out.Fixed(static_cast<uint8_t>(info.bounds.has_value()));
  const Box bounds = info.bounds.value_or(Box{});
  for (const Point& corner : {bounds.low, bounds.high}) {
    for (int axis = 0; axis < 3; ++axis) out.Fixed(corner[axis]);
  }
}

absl::Status ReadWhoItIs(AnswerReader& in, SessionInfo& info) {
  DYNMESH_ASSIGN_OR_RETURN(SessionIdentity identity, DecodeIdentity(in.Text()));
  info.uid = std::move(identity.uid);
  info.create_time = identity.create_time;
  info.settings = std::move(identity.settings);
  info.name = in.Text();
  info.etag = in.Text();
  info.durable_revision = in.Fixed<int64_t>();
  info.update_time = absl::FromUnixMicros(in.Fixed<int64_t>());
  return absl::OkStatus();
}

/// Bytes of relations are those of the relations of the settings, in that order.
bool ReadRelationBytes(AnswerReader& in, SessionInfo& info) {
  const auto bytes = in.Each<uint64_t>([&] { return in.Fixed<uint64_t>(); });
  if (bytes.size() != info.settings.stored_relations.size()) return false;
  for (size_t i = 0; i < bytes.size(); ++i) {
    info.stored_relations.push_back({info.settings.stored_relations[i], bytes[i]});
  }
  return true;
}

void ReadBounds(AnswerReader& in, SessionInfo& info) {
  const bool has_bounds = in.Fixed<uint8_t>() != 0;
  Box bounds;
  for (Point* corner : {&bounds.low, &bounds.high}) {
    for (int axis = 0; axis < 3; ++axis) (*corner)[axis] = in.Fixed<double>();
  }
  if (has_bounds) info.bounds = bounds;
}

bool ReadWhatItHolds(AnswerReader& in, SessionInfo& info) {
  for (KindCounts* counts :
       {&info.counts, &info.estimated_counts, &info.boundary_counts, &info.element_counts}) {
    *counts = ReadCounts(in);
  }
  info.euler_characteristic = in.Fixed<int64_t>();
  info.checksum.topology = in.Fixed<uint64_t>();
  info.checksum.geometry = in.Fixed<uint64_t>();
  info.memory_bytes = in.Fixed<uint64_t>();
  info.attributes = in.Each<AttributeSpec>([&] { return ReadSpec(in); });
  const bool has_relations = ReadRelationBytes(in, info);
  ReadBounds(in, info);
  for (const AttributeSpec& spec : info.attributes) {
    if (!CheckAttributeSpec(spec).ok()) return false;
  }
  return has_relations;
}

bool IsSound(const MeshWarning& warning) {
  return warning.warning <= WarningKind::kDuplicateElement && Dimension(warning.kind) < kNumEntityKinds;
}

}  // namespace

std::string EncodeAnswer(const ImportOutcome& outcome) {
  AnswerWriter out;
  out.Fixed(outcome.revision);
  WriteInfo(outcome.info, out);
  out.Each(outcome.warnings, [&](const MeshWarning& warning) { WriteMeshWarning(warning, out); });
  return std::move(out).Take();
}

absl::StatusOr<ImportOutcome> DecodeImportOutcome(absl::string_view bytes) {
  AnswerReader in(bytes);
  ImportOutcome outcome;
  outcome.revision = outcome.info.revision = in.Fixed<int64_t>();
  if (!ReadWhoItIs(in, outcome.info).ok() || !ReadWhatItHolds(in, outcome.info)) in.Spoil();
  outcome.warnings = in.Each<MeshWarning>([&] { return ReadMeshWarning(in); });
  for (const MeshWarning& warning : outcome.warnings) {
    if (!IsSound(warning)) in.Spoil();
  }
  return in.End(std::move(outcome));
}

}  // namespace dynmesh
