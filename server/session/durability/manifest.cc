#include "server/session/durability/manifest.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/mesh/error.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

constexpr uint64_t kManifestFormat = 1;

absl::Status CheckManifestFormat(ByteReader& in, absl::string_view what) {
  const uint64_t format = in.Varint();
  if (!in.ok() || format == 0) return StoreDamaged(what);
  return format <= kManifestFormat ? absl::OkStatus() : StoreFormatNewer(format, kManifestFormat);
}

void WriteRetention(const Retention& retention, ByteWriter& out) {
  out.Fixed(retention.max_revisions);
  out.Fixed(absl::ToInt64Microseconds(retention.max_age));
  out.Fixed(retention.max_bytes);
}

bool ReadRetention(ByteReader& in, Retention& retention) {
  retention.max_revisions = in.Fixed<uint32_t>();
  retention.max_age = absl::Microseconds(in.Fixed<int64_t>());
  retention.max_bytes = in.Fixed<uint64_t>();
  return in.ok() && retention.max_age >= absl::ZeroDuration();
}

void WriteChecks(const CheckSettings& checks, ByteWriter& out) {
  std::vector<CheckKind> on;
  for (CheckKind check : AllChecks()) {
    if (!(checks[check] == CheckSettings()[check])) on.push_back(check);
  }
  out.Varint(on.size());
  for (CheckKind check : on) {
    out.Text(TraitsOf(check).name);
    out.Fixed(static_cast<uint8_t>(checks[check].severity));
    out.Fixed(checks[check].threshold);
  }
}

/// Checks by names that this build does not know are passed over: they came and went with another one.
bool ReadChecks(ByteReader& in, CheckSettings& checks) {
  for (uint64_t count = in.Varint(); count > 0 && in.ok(); --count) {
    const CheckKind check = FindCheck(in.Text());
    const auto severity = in.Fixed<uint8_t>();
    const auto threshold = in.Fixed<double>();
    if (severity > static_cast<uint8_t>(Severity::kReject)) return false;
    if (check == CheckKind::kUnspecified) continue;
    if (!checks.Set(check, {static_cast<Severity>(severity), threshold}).ok()) return false;
  }
  return in.ok();
}

bool ReadRelations(ByteReader& in, std::vector<Relation>& relations) {
  for (uint64_t count = in.Varint(); count > 0 && in.ok(); --count) {
    const auto index = in.Fixed<uint8_t>();
    if (index >= kNumStorableRelations || relations.size() == kNumStorableRelations) return false;
    relations.push_back(kStorableRelations[index]);
  }
  return in.ok();
}

}  // namespace

void WriteSettings(const SessionSettings& settings, ByteWriter& out) {
  out.Fixed(static_cast<uint8_t>(settings.durability));
  out.Fixed(static_cast<uint8_t>(settings.duplicates == DuplicatePolicy::kRefuse));
  out.Varint(settings.stored_relations.size());
  for (Relation relation : settings.stored_relations)
    out.Fixed(static_cast<uint8_t>(StorableIndex(relation)));
  WriteChecks(settings.checks, out);
  WriteRetention(settings.retention, out);
}

bool ReadSettings(ByteReader& in, SessionSettings& settings) {
  const auto durability = in.Fixed<uint8_t>();
  const auto duplicates = in.Fixed<uint8_t>();
  const bool known = durability >= static_cast<uint8_t>(SessionDurability::kNone) &&
                     durability <= static_cast<uint8_t>(SessionDurability::kSync);
  if (!known || duplicates > 1) return false;
  settings.durability = static_cast<SessionDurability>(durability);
  settings.duplicates = duplicates == 0 ? DuplicatePolicy::kKeep : DuplicatePolicy::kRefuse;
  return ReadRelations(in, settings.stored_relations) && ReadChecks(in, settings.checks) &&
         ReadRetention(in, settings.retention);
}

std::string EncodeManifest(const SessionManifest& manifest) {
  ByteWriter out;
  out.Varint(kManifestFormat);
  out.Fixed(absl::ToUnixMicros(manifest.commit_time));
  out.Fixed(manifest.newest);
  out.Bytes(manifest.head);
  return std::move(out).Take();
}

absl::StatusOr<SessionManifest> DecodeManifest(absl::string_view bytes) {
  constexpr absl::string_view kWhat = "the manifest of a checkpoint is none";
  ByteReader in(bytes);
  DYNMESH_RETURN_IF_ERROR(CheckManifestFormat(in, kWhat));
  SessionManifest manifest;
  manifest.commit_time = absl::FromUnixMicros(in.Fixed<int64_t>());
  manifest.newest = in.Fixed<int64_t>();
  manifest.head = std::string(in.Bytes(in.remaining()));
  if (!in.done() || manifest.newest < 0) return StoreDamaged(kWhat);
  return manifest;
}

std::string EncodeIdentity(const SessionIdentity& identity) {
  ByteWriter out;
  out.Varint(kManifestFormat);
  out.Text(identity.uid);
  out.Fixed(absl::ToUnixMicros(identity.create_time));
  out.Text(identity.request_id);
  out.Fixed(identity.fingerprint);
  out.Varint(static_cast<uint64_t>(identity.create_revision));
  WriteSettings(identity.settings, out);
  return std::move(out).Take();
}

absl::StatusOr<SessionIdentity> DecodeIdentity(absl::string_view bytes) {
  constexpr absl::string_view kWhat = "the identity of a session is none";
  ByteReader in(bytes);
  DYNMESH_RETURN_IF_ERROR(CheckManifestFormat(in, kWhat));
  SessionIdentity identity;
  identity.uid = in.Text();
  identity.create_time = absl::FromUnixMicros(in.Fixed<int64_t>());
  identity.request_id = in.Text();
  identity.fingerprint = in.Fixed<uint64_t>();
  const uint64_t revision = in.Varint();
  identity.create_revision = static_cast<int64_t>(revision);
  bool sound = revision <= kMaxStamp && ReadSettings(in, identity.settings);
  sound &= identity.settings.durability != SessionDurability::kNone;  // those are in no store
  if (!sound || !in.done()) return StoreDamaged(kWhat);
  return identity;
}

}  // namespace dynmesh
