#include "server/rpc/convert_checks.h"

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/rpc/convert.h"
#include "server/rpc/convert_queries.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

constexpr char kField[] = "checks";

absl::StatusOr<Severity> ToSeverity(v1::CheckSeverity severity) {
  switch (severity) {
    case v1::CHECK_SEVERITY_UNSPECIFIED:
    case v1::CHECK_SEVERITY_WARN:
      return Severity::kWarn;
    case v1::CHECK_SEVERITY_OFF:
      return Severity::kOff;
    case v1::CHECK_SEVERITY_REJECT:
      return Severity::kReject;
    default:
      return BadField(kField, absl::StrCat("there is no severity ", static_cast<int>(severity)));
  }
}

v1::CheckSeverity FromSeverity(Severity severity) {
  return severity == Severity::kReject ? v1::CHECK_SEVERITY_REJECT
         : severity == Severity::kWarn ? v1::CHECK_SEVERITY_WARN
                                       : v1::CHECK_SEVERITY_OFF;
}

v1::CheckSetting FromSetting(CheckKind check, const CheckSetting& setting) {
  v1::CheckSetting message;
  message.set_check(static_cast<v1::CheckKind>(check));
  message.set_severity(FromSeverity(setting.severity));
  message.set_threshold(setting.threshold);
  return message;
}

void FromSurface(const SurfaceSummary& surface, v1::SurfaceTopology* message) {
  message->set_pieces(surface.pieces);
  message->set_non_manifold(surface.non_manifold);
  message->set_non_orientable(surface.non_orientable);
  message->set_holes(surface.holes);
  message->set_genus(surface.genus);
  message->set_euler_characteristic(surface.euler_characteristic);
}

void FromTopology(const MeshTopology& topology, v1::MeshTopology* message) {
  message->set_euler_characteristic(topology.euler_characteristic);
  message->set_components(topology.components);
  message->set_isolated_vertices(topology.isolated_vertices);
  message->set_bodies(topology.bodies);
  message->set_non_orientable_bodies(topology.non_orientable_bodies);
  FromSurface(topology.surface, message->mutable_surface());
  FromSurface(topology.shells, message->mutable_shells());
}

}  // namespace

absl::StatusOr<CheckSettings> ToCheckSettings(const CheckSettingList& messages) {
  CheckSettings settings;
  std::array<bool, kNumChecks + 1> is_named = {};
  for (const v1::CheckSetting& message : messages) {
    if (!IsCheckKind(message.check())) {
      return BadField(kField, absl::StrCat("there is no check ", static_cast<int>(message.check())));
    }
    const auto check = static_cast<CheckKind>(message.check());
    if (std::exchange(is_named[message.check()], true)) {
      return BadField(kField, absl::StrCat(TraitsOf(check).name, " is named twice"));
    }
    CheckSetting setting{Severity::kOff, TraitsOf(check).default_threshold};
    DYNMESH_ASSIGN_OR_RETURN(setting.severity, ToSeverity(message.severity()));
    if (message.has_threshold()) setting.threshold = message.threshold();
    DYNMESH_RETURN_IF_ERROR(settings.Set(check, setting));
  }
  return settings;
}

absl::StatusOr<CheckSettings> ToLocalCheckSettings(const CheckSettingList& messages) {
  DYNMESH_ASSIGN_OR_RETURN(const CheckSettings settings, ToCheckSettings(messages));
  for (const v1::CheckSetting& message : messages) {
    const auto check = static_cast<CheckKind>(message.check());
    if (IsLocal(check)) continue;
    return BadField(kField, absl::StrCat(TraitsOf(check).name,
                                         " speaks of the whole mesh, which is not looked at for each batch"));
  }
  return settings;
}

void FromCheckSettings(const CheckSettings& settings, CheckSettingList* messages) {
  for (CheckKind check : AllChecks()) {
    if (settings.IsOn(check)) *messages->Add() = FromSetting(check, settings[check]);
  }
}

absl::StatusOr<CheckQuestion> ToCheckQuestion(const v1::CheckSessionRequest& request) {
  CheckQuestion question;
  if (request.has_max_findings()) question.max_findings = request.max_findings();
  if (question.max_findings > kMaxFindings) {
    return BadField("max_findings", absl::StrCat("max_findings is at most ", kMaxFindings));
  }
  if (!request.checks().empty()) {
    DYNMESH_ASSIGN_OR_RETURN(question.checks, ToCheckSettings(request.checks()));
  }
  if (!request.has_selection()) return question;
  CheckQuestion::Part part;
  DYNMESH_ASSIGN_OR_RETURN(part.kind, ToEntityKind(request.kind(), "kind"));
  DYNMESH_ASSIGN_OR_RETURN(part.selection, ToSelection(request.selection(), request.as_of_revision()));
  question.part = std::move(part);
  return question;
}

std::vector<FindingsPiece> CutFindings(const CheckReport& report) {
  constexpr size_t kRows = kChunkBytes / (sizeof(Slot) + sizeof(double));
  std::vector<FindingsPiece> pieces;
  for (size_t i = 0; i < report.tallies.size(); ++i) {
    for (EntityKind kind : kEntityKinds) {
      const size_t size = report.tallies[i].findings[Dimension(kind)].slots.size();
      for (size_t begin = 0; begin < size; begin += kRows) {
        pieces.push_back({i, kind, begin, std::min(begin + kRows, size)});
      }
    }
  }
  return pieces;
}

void FromFindings(const CheckReport& report, const FindingsPiece& piece, v1::CheckFindings* message) {
  const Tally& tally = report.tallies[piece.tally];
  const Findings& findings = tally.findings[Dimension(piece.kind)];
  const size_t count = piece.end - piece.begin;
  message->set_check(static_cast<v1::CheckKind>(tally.check));
  message->set_kind(FromEntityKind(piece.kind));
  message->set_ids(findings.slots.data() + piece.begin, count * sizeof(Slot));
  message->set_values(findings.values.data() + piece.begin, count * sizeof(double));
}

void FromSummary(const CheckReport& report, v1::CheckSummary* message) {
  for (const Tally& tally : report.tallies) {
    v1::CheckTally* part = message->add_tallies();
    *part->mutable_setting() = FromSetting(tally.check, tally.setting);
    part->set_measured(tally.num_measured);
    part->set_bad(tally.num_bad);
    part->set_lowest(tally.lowest);
    part->set_highest(tally.highest);
  }
  if (report.topology.has_value()) FromTopology(*report.topology, message->mutable_topology());
}

}  // namespace dynmesh
