#include "server/session/durability/answer_codec.h"

#include <array>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "core/codec/bytes.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

class AnswerWriter {
 public:
  template <typename T>
  void Fixed(T value) {
    out_.Fixed(value);
  }
  void Count(uint64_t count) { out_.Varint(count); }

  void Text(absl::string_view text) { out_.Text(text); }

  template <typename T>
  void Array(const std::vector<T>& values) {
    Count(values.size());
    out_.Bytes({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
  }

  void Id(EntityId id) {
    Fixed(static_cast<uint8_t>(id.kind));
    Fixed(id.slot);
  }

  /// Calls write(item) for each.
  template <typename Items, typename Fn>
  void Each(const Items& items, Fn write) {
    Count(items.size());
    for (const auto& item : items) write(item);
  }

  void State(const Checksum& checksum, const std::array<uint32_t, kNumEntityKinds>& counts) {
    Fixed(checksum.topology);
    Fixed(checksum.geometry);
    for (uint32_t count : counts) Fixed(count);
  }

  void Error(const absl::Status& status) {
    Fixed(static_cast<uint8_t>(status.code()));
    Text({status.message().data(), status.message().size()});
    const absl::optional<ErrorDetail> detail = GetErrorDetail(status);
    Fixed(static_cast<uint8_t>(detail.has_value()));
    if (!detail.has_value()) return;
    Text(detail->reason);
    Each(detail->metadata, [this](const auto& pair) {
      Text(pair.first);
      Text(pair.second);
    });
  }

  std::string Take() && { return std::move(out_).Take(); }

 private:
  ByteWriter out_;
};

/// Reads what AnswerWriter wrote; failure is sticky, as of ByteReader.
class AnswerReader {
 public:
  explicit AnswerReader(absl::string_view bytes) : in_(bytes) {}

  template <typename T>
  T Fixed() {
    return in_.Fixed<T>();
  }

  std::string Text() { return in_.Text(); }

  template <typename T>
  std::vector<T> Array() {
    const uint64_t count = in_.Varint();
    if (count > in_.remaining() / sizeof(T)) return Fail<std::vector<T>>();
    const absl::string_view bytes = in_.Bytes(count * sizeof(T));
    std::vector<T> values(count);
    if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }

  EntityId Id() {
    const uint8_t kind = Fixed<uint8_t>();
    const Slot slot = Fixed<Slot>();
    if (kind >= kNumEntityKinds) return Fail<EntityId>();
    return {static_cast<EntityKind>(kind), slot};
  }

  /// Items that take a byte or more each.
  template <typename Item, typename Fn>
  std::vector<Item> Each(Fn read) {
    std::vector<Item> items;
    const uint64_t count = in_.Varint();
    if (count > in_.remaining()) return Fail<std::vector<Item>>();
    for (uint64_t i = 0; i < count && ok(); ++i) items.push_back(read());
    return items;
  }

  void State(Checksum& checksum, std::array<uint32_t, kNumEntityKinds>& counts) {
    checksum.topology = Fixed<uint64_t>();
    checksum.geometry = Fixed<uint64_t>();
    for (uint32_t& count : counts) count = Fixed<uint32_t>();
  }

  absl::Status Error() {
    const auto code = static_cast<absl::StatusCode>(Fixed<uint8_t>());
    const std::string message = Text();
    if (Fixed<uint8_t>() == 0) return absl::Status(code, message);
    const std::string reason = Text();
    ErrorMetadata metadata = Each<ErrorMetadata::value_type>([this] {
      std::string key = Text();
      return std::make_pair(std::move(key), Text());
    });
    return MakeError(code, reason, message, std::move(metadata));
  }

  bool ok() const { return ok_ && in_.ok(); }

  /// `answer` if all was read and nothing failed.
  template <typename Answer>
  absl::StatusOr<Answer> End(Answer answer) const {
    if (ok_ && in_.done()) return answer;
    return CorruptPayload("an answer that was stored is none");
  }

 private:
  template <typename T>
  T Fail() {
    ok_ = false;
    return {};
  }

  ByteReader in_;
  bool ok_ = true;
};

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
