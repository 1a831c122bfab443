#ifndef DYNMESH_SERVER_SESSION_DURABILITY_ANSWER_CODEC_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_ANSWER_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/edit/transaction.h"
#include "server/session/importer/importer.h"
#include "server/session/repair_session.h"
#include "server/session/session.h"

/// The answers of requests as bytes, so that a retry gets the first one also after a restart.
///
/// Law: Decode...(Encode(answer)) equals the answer, but for BatchResult::image, which is left out, and what
/// an import says of checks, of which it makes none. The
/// bytes are meant for this build and later ones; what reads them is told the format by the log record.
/// Errors of Decode...: DATA_LOSS CORRUPT_PAYLOAD. Counts are checked before anything is allocated.
namespace dynmesh {

std::string EncodeAnswer(const BatchResult& result);
std::string EncodeAnswer(const HistoryResult& result);
std::string EncodeAnswer(const RepairOutcome& outcome);
std::string EncodeAnswer(const ImportOutcome& outcome);

absl::StatusOr<BatchResult> DecodeBatchResult(absl::string_view bytes);
absl::StatusOr<HistoryResult> DecodeHistoryResult(absl::string_view bytes);
absl::StatusOr<RepairOutcome> DecodeRepairOutcome(absl::string_view bytes);
absl::StatusOr<ImportOutcome> DecodeImportOutcome(absl::string_view bytes);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_ANSWER_CODEC_H_
