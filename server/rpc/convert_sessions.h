#ifndef DYNMESH_SERVER_RPC_CONVERT_SESSIONS_H_
#define DYNMESH_SERVER_RPC_CONVERT_SESSIONS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "dynmesh/v1/sessions.pb.h"
#include "server/session/export.h"
#include "server/session/importer/importer.h"
#include "server/session/session_info.h"

namespace dynmesh {

/// Errors: INVALID_ARGUMENT BAD_ARGUMENT.
absl::StatusOr<SessionDurability> ToDurability(v1::Durability durability);
/// Errors: INVALID_ARGUMENT BAD_ARGUMENT.
absl::StatusOr<SessionSettings> ToSettings(const v1::SessionSettings& message);
/// INVALID_ARGUMENT BAD_ARGUMENT unless the mask names fields that UpdateSession can change, and their values
/// are good.
absl::StatusOr<SettingsUpdate> ToSettingsUpdate(const v1::UpdateSessionRequest& request);
v1::Session FromSessionInfo(const SessionInfo& info);

/// Opaque: the name of the last session of a page.
std::string ToPageToken(absl::string_view last_name);
/// Errors: INVALID_ARGUMENT BAD_PAGE_TOKEN. Empty for an empty token.
absl::StatusOr<std::string> FromPageToken(const std::string& token);

/// Errors: INVALID_ARGUMENT BAD_ARGUMENT.
absl::StatusOr<ImportOptions> ToImportOptions(const v1::ImportHeader& header);

/// Hands what an import message carries to `staged`; takes the bytes out of it.
/// Errors: those of StagedMesh; INVALID_ARGUMENT BAD_ARGUMENT for a second header or an empty message.
absl::Status StagePart(v1::ImportMeshRequest* request, StagedMesh& staged);

void FromImportOutcome(const ImportOutcome& outcome, v1::ImportResult* result);

void FromExportChunk(const ExportChunk& chunk, v1::ExportMeshResponse* response);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_SESSIONS_H_
