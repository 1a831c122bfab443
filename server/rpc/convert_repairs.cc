#include "server/rpc/convert_repairs.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/rpc/convert.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

RemoveDuplicatesOptions ToRemoveDuplicatesOptions(const v1::RemoveDuplicates& message) {
  RemoveDuplicatesOptions options;
  if (message.has_max_measure()) options.max_measure = message.max_measure();
  if (message.any_shape()) options.max_measure = absl::nullopt;
  options.isolated_vertices = message.isolated_vertices();
  return options;
}

absl::StatusOr<RepairStep> ToRepairStep(const v1::RepairStep& message) {
  switch (message.kind_case()) {
    case v1::RepairStep::kOrient:
      return OrientStep{{.outward = !message.orient().by_majority()}};
    case v1::RepairStep::kWeld:
      return WeldStep{message.weld().tolerance()};
    case v1::RepairStep::kRemoveDuplicates:
      return RemoveDuplicatesStep{ToRemoveDuplicatesOptions(message.remove_duplicates())};
    case v1::RepairStep::kSplitNonManifold:
      return SplitNonManifoldStep{};
    case v1::RepairStep::kFillHoles:
      return FillHolesStep{message.fill_holes().max_edges()};
    case v1::RepairStep::KIND_NOT_SET:
      break;
  }
  return BadField("steps", "a step says nothing, or is of a kind that this server does not know");
}

void FromTally(RepairFinding finding, const RepairTally& tally, v1::RepairFinding* message) {
  std::vector<uint8_t> kinds;
  std::vector<Slot> ids;
  for (EntityId id : tally.entities) {
    kinds.push_back(FromEntityKind(id.kind));
    ids.push_back(id.slot);
  }
  message->set_kind(static_cast<v1::RepairFindingKind>(finding));
  message->set_count(tally.count);
  message->set_entity_kinds(FromArray(kinds));
  message->set_ids(FromArray(ids));
}

static_assert(v1::RepairFindingKind_MAX == kNumRepairFindings);

}  // namespace

absl::StatusOr<RepairRequest> ToRepairRequest(const v1::RepairSessionRequest& request) {
  RepairRequest repair;
  for (const v1::RepairStep& message : request.steps()) {
    absl::StatusOr<RepairStep> step = ToRepairStep(message);
    if (!step.ok()) return WithMetadata(step.status(), "step", absl::StrCat(repair.steps.size()));
    repair.steps.push_back(*std::move(step));
  }
  if (request.has_if_revision()) repair.if_revision = request.if_revision();
  repair.request_id = request.request_id();
  repair.validate_only = request.validate_only();
  repair.note = ToNote(request.note());
  return repair;
}

void FromRepairOutcome(const RepairOutcome& outcome, v1::RepairResult* result) {
  result->set_revision(outcome.revision);
  for (const RepairReport& report : outcome.reports) {
    v1::RepairStepResult* step = result->add_steps();
    report.ForEach([step](RepairFinding finding, const RepairTally& tally) {
      FromTally(finding, tally, step->add_findings());
    });
  }
  *result->mutable_checksum() = FromChecksum(outcome.checksum);
  KindCounts counts;
  std::copy(outcome.counts.begin(), outcome.counts.end(), counts.begin());
  *result->mutable_counts() = FromCounts(counts);
}

}  // namespace dynmesh
