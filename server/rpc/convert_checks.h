#ifndef DYNMESH_SERVER_RPC_CONVERT_CHECKS_H_
#define DYNMESH_SERVER_RPC_CONVERT_CHECKS_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/check/check.h"
#include "core/check/report.h"
#include "dynmesh/v1/checks.pb.h"
#include "dynmesh/v1/types.pb.h"
#include "server/session/check_session.h"

namespace dynmesh {

using CheckSettingList = google::protobuf::RepeatedPtrField<v1::CheckSetting>;

/// Checks that are not named are off. Errors: INVALID_ARGUMENT BAD_ARGUMENT.
absl::StatusOr<CheckSettings> ToCheckSettings(const CheckSettingList& messages);
/// The same for checks of single entities only.
absl::StatusOr<CheckSettings> ToLocalCheckSettings(const CheckSettingList& messages);
/// Those that are on.
void FromCheckSettings(const CheckSettings& settings, CheckSettingList* messages);

/// Errors: INVALID_ARGUMENT BAD_ARGUMENT, BAD_ENTITY_KIND; those of ToSelection.
absl::StatusOr<CheckQuestion> ToCheckQuestion(const v1::CheckSessionRequest& request);

/// A run of the findings of one tally and kind.
struct FindingsPiece {
  size_t tally;
  EntityKind kind;
  size_t begin;
  size_t end;
};
/// All findings, in pieces that fit a message.
std::vector<FindingsPiece> CutFindings(const CheckReport& report);
void FromFindings(const CheckReport& report, const FindingsPiece& piece, v1::CheckFindings* message);
void FromSummary(const CheckReport& report, v1::CheckSummary* message);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_CHECKS_H_
