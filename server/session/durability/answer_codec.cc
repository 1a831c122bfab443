#include "server/session/durability/answer_codec.h"

#include <array>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "core/mesh/error.h"
#include "server/session/durability/answer_bytes.h"

namespace dynmesh {
namespace {

void WriteEdit(const EditResult& edit, AnswerWriter& out) {
  out.Array(edit.new_slots);
  out.Each(edit.lineage, [&](const Lineage& lineage) {
    out.Id(lineage.element);
    out.Id(lineage.parent);
  });
  out.Array(edit.skipped);
  out.Each(edit.refusals, [&](const Refusal& refusal) {
    out.Fixed(refusal.index);
    out.Error(refusal.status);
  });
  out.Fixed(edit.num_moved);
}

EditResult ReadEdit(AnswerReader& in) {
  EditResult edit;
  edit.new_slots = in.Array<Slot>();
  edit.lineage = in.Each<Lineage>([&] {
    const EntityId element = in.Id();
    return Lineage{element, in.Id()};
  });
  edit.skipped = in.Array<uint32_t>();
  edit.refusals = in.Each<Refusal>([&] {
    const auto index = in.Fixed<uint32_t>();
    return Refusal{index, in.Error()};
  });
  edit.num_moved = in.Fixed<uint32_t>();
  return edit;
}

void WriteWarning(const BatchWarning& warning, AnswerWriter& out) {
  out.Fixed(warning.check);
  out.Text(warning.name);
  out.Fixed(static_cast<uint8_t>(warning.kind));
  out.Fixed(warning.threshold);
  out.Array(warning.ids);
  out.Array(warning.values);
  out.Fixed(warning.count);
}

BatchWarning ReadWarning(AnswerReader& in) {
  BatchWarning warning;
  warning.check = in.Fixed<uint32_t>();
  warning.name = in.Text();
  warning.kind = static_cast<EntityKind>(in.Fixed<uint8_t>() % kNumEntityKinds);
  warning.threshold = in.Fixed<double>();
  warning.ids = in.Array<Slot>();
  warning.values = in.Array<double>();
  warning.count = in.Fixed<uint64_t>();
  return warning;
}

}  // namespace

std::string EncodeAnswer(const BatchResult& result) {
  AnswerWriter out;
  out.Fixed(result.revision);
  out.Each(result.results, [&](const EditResult& edit) { WriteEdit(edit, out); });
  out.State(result.checksum, result.counts);
  out.Fixed(result.num_made);
  out.Each(result.degenerate, [&](EntityId id) { out.Id(id); });
  out.Each(result.duplicate, [&](EntityId id) { out.Id(id); });
  out.Each(result.warnings, [&](const BatchWarning& warning) { WriteWarning(warning, out); });
  return std::move(out).Take();
}

absl::StatusOr<BatchResult> DecodeBatchResult(absl::string_view bytes) {
  AnswerReader in(bytes);
  BatchResult result;
  result.revision = in.Fixed<int64_t>();
  result.results = in.Each<EditResult>([&] { return ReadEdit(in); });
  in.State(result.checksum, result.counts);
  result.num_made = in.Fixed<uint64_t>();
  result.degenerate = in.Each<EntityId>([&] { return in.Id(); });
  result.duplicate = in.Each<EntityId>([&] { return in.Id(); });
  result.warnings = in.Each<BatchWarning>([&] { return ReadWarning(in); });
  return in.End(std::move(result));
}

std::string EncodeAnswer(const HistoryResult& result) {
  AnswerWriter out;
  out.Fixed(result.revision);
  out.Fixed(result.count);
  out.State(result.checksum, result.counts);
  out.Fixed(result.undoable_batches);
  out.Fixed(result.redoable_batches);
  out.Fixed(result.target_revision);
  return std::move(out).Take();
}

absl::StatusOr<HistoryResult> DecodeHistoryResult(absl::string_view bytes) {
  AnswerReader in(bytes);
  HistoryResult result;
  result.revision = in.Fixed<int64_t>();
  result.count = in.Fixed<uint32_t>();
  in.State(result.checksum, result.counts);
  result.undoable_batches = in.Fixed<uint32_t>();
  result.redoable_batches = in.Fixed<uint32_t>();
  result.target_revision = in.Fixed<int64_t>();
  return in.End(result);
}

std::string EncodeAnswer(const RepairOutcome& outcome) {
  AnswerWriter out;
  out.Fixed(outcome.revision);
  out.Each(outcome.reports, [&](const RepairReport& report) {
    uint8_t findings = 0;
    report.ForEach([&](RepairFinding, const RepairTally&) { ++findings; });
    out.Fixed(findings);
    report.ForEach([&](RepairFinding finding, const RepairTally& tally) {
      out.Fixed(static_cast<uint8_t>(finding));
      out.Fixed(tally.count);
      out.Each(tally.entities, [&](EntityId id) { out.Id(id); });
    });
  });
  out.State(outcome.checksum, outcome.counts);
  return std::move(out).Take();
}

absl::StatusOr<RepairOutcome> DecodeRepairOutcome(absl::string_view bytes) {
  AnswerReader in(bytes);
  RepairOutcome outcome;
  bool known = true;
  outcome.revision = in.Fixed<int64_t>();
  outcome.reports = in.Each<RepairReport>([&] {
    RepairReport report;
    for (int findings = in.Fixed<uint8_t>(); findings > 0 && in.ok(); --findings) {
      const int finding = in.Fixed<uint8_t>();
      RepairTally tally;
      tally.count = in.Fixed<uint64_t>();
      tally.entities = in.Each<EntityId>([&] { return in.Id(); });
      known = known && finding >= 1 && finding <= kNumRepairFindings;
      if (known) report.Put(static_cast<RepairFinding>(finding), std::move(tally));
    }
    return report;
  });
  in.State(outcome.checksum, outcome.counts);
  if (!known) return CorruptPayload("a repair that was stored found what nobody knows");
  return in.End(std::move(outcome));
}

}  // namespace dynmesh
