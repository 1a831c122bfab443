#ifndef DYNMESH_SERVER_SESSION_DURABILITY_MANIFEST_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_MANIFEST_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/codec/bytes.h"
#include "server/session/session_info.h"

/// What a session's store holds beside records and pages. Formats of their own, sealed by the store.
namespace dynmesh {

/// The manifest of a checkpoint: format (varint, 1), time of the last commit (int64, us since 1970), newest
/// revision (int64), head (core/archive/head.h).
struct SessionManifest {
  absl::Time commit_time;
  std::string head;
  int64_t newest = 0;  ///< some pages may be as late as that
};

/// Durability (u8), duplicates (u8), stored relations (their places in kStorableRelations), checks that are
/// not as usual (name, severity, threshold), retention (revisions u32, age in us i64, bytes u64); texts and
/// lists begin with their length (varint).
void WriteSettings(const SessionSettings& settings, ByteWriter& out);
/// False if the bytes are none, or of no durability that a session can have.
bool ReadSettings(ByteReader& in, SessionSettings& settings);

std::string EncodeManifest(const SessionManifest& manifest);
/// Errors: FAILED_PRECONDITION STORE_FORMAT_NEWER; DATA_LOSS STORE_DAMAGED.
absl::StatusOr<SessionManifest> DecodeManifest(absl::string_view bytes);

/// What a session is beside its mesh: the value kIdentityName of its store.
struct SessionIdentity {
  std::string uid;
  absl::Time create_time;
  SessionSettings settings;
  // Of the request that created it, for retries.
  std::string request_id = {};
  uint64_t fingerprint = 0;
  int64_t create_revision = 0;  ///< at which it began
};

inline constexpr char kIdentityName[] = "identity";

/// Format (varint, 1), uid, creation (int64, us since 1970), request id, fingerprint (u64), revision at which
/// it began (varint), settings; texts begin with their length (varint).
std::string EncodeIdentity(const SessionIdentity& identity);
/// Errors: as DecodeManifest.
absl::StatusOr<SessionIdentity> DecodeIdentity(absl::string_view bytes);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_MANIFEST_H_
