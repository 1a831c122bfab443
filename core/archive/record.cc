#include "core/archive/record.h"

#include <algorithm>
#include <utility>

#include "core/archive/column_rows.h"
#include "core/archive/part.h"
#include "core/archive/slot_rows.h"

namespace dynmesh {
namespace {

/// Of what an edit touches, each slot is named about twice.
constexpr size_t kTypicalBytesPerEntry = 12;
constexpr size_t kTypicalBytes = 128;

/// Ascending, each once. Journals of many steps ascend already for the most part.
void SortUnique(std::vector<Slot>& slots) {
  if (!std::is_sorted(slots.begin(), slots.end())) std::sort(slots.begin(), slots.end());
  slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
}

/// Calls fn(first, count) for each run of slots that follow each other.
template <typename Fn>
void ForEachRun(const std::vector<Slot>& slots, Fn fn) {
  for (size_t begin = 0; begin < slots.size();) {
    size_t end = begin + 1;
    while (end < slots.size() && slots[end] == slots[end - 1] + 1) ++end;
    fn(slots[begin], end - begin);
    begin = end;
  }
}

}  // namespace

std::string RecordEncoder::Encode(const Mesh& mesh, absl::string_view note) {
  Collect(mesh);
  ByteWriter out;
  out.Reserve(kTypicalBytes + note.size() + mesh.journal().entries.size() * kTypicalBytesPerEntry);
  BeginPart(ArchivePart::kRecord, out);
  out.Varint(mesh.revision() + 1);
  WriteFit(mesh.FitNow(), out);
  WriteWidths(RowWidths::Of(mesh), out);
  WriteColumnHeads(mesh, mesh.attributes().size() - num_new_columns_, out);
  out.Varint(note.size());
  out.Bytes(note);
  for (EntityKind kind : kEntityKinds) WriteSlots(mesh, kind, out);
  WriteRows(mesh, out);
  return SealPart(std::move(out));
}

void RecordEncoder::Collect(const Mesh& mesh) {
  for (std::vector<Slot>& slots : slots_) slots.clear();
  for (std::vector<Slot>& slots : rows_) slots.clear();
  rows_.resize(mesh.attributes().size());
  num_new_columns_ = 0;
  for (const JournalEntry& entry : mesh.journal().entries) {
    if (entry.op == JournalOp::kAddAttribute) {
      ++num_new_columns_;
    } else if (entry.op == JournalOp::kSetAttribute) {
      rows_[entry.a].push_back(entry.slot);
    } else {
      slots_[Dimension(entry.kind)].push_back(entry.slot);
    }
  }
  for (std::vector<Slot>& slots : slots_) SortUnique(slots);
  for (std::vector<Slot>& slots : rows_) SortUnique(slots);
}

void RecordEncoder::WriteSlots(const Mesh& mesh, EntityKind kind, ByteWriter& out) const {
  const std::vector<Slot>& slots = slots_[Dimension(kind)];
  size_t num_runs = 0;
  ForEachRun(slots, [&](Slot, size_t) { ++num_runs; });
  out.Varint(num_runs);
  Slot next = 0;
  SlotRowWriter rows(mesh, kind, RowContext::At(mesh.revision() + 1), out);
  ForEachRun(slots, [&](Slot first, size_t count) {
    out.Varint(first - next);
    out.Varint(count);
    for (size_t i = 0; i < count; ++i) rows.Write(first + i);
    next = first + count;
  });
}

void RecordEncoder::WriteRows(const Mesh& mesh, ByteWriter& out) const {
  const auto has_rows = [](const std::vector<Slot>& slots) { return !slots.empty(); };
  out.Varint(std::count_if(rows_.begin(), rows_.end(), has_rows));
  for (size_t column = 0; column < rows_.size(); ++column) {
    if (rows_[column].empty()) continue;
    ColumnRowWriter rows(mesh.attributes()[column], 0, mesh.revision() + 1);
    for (Slot slot : rows_[column]) rows.Write(slot);
    rows.AppendTo(column, out);
  }
}

absl::StatusOr<RecordView> ReadRecord(absl::string_view bytes) {
  DYNMESH_ASSIGN_OR_RETURN(const absl::string_view content, OpenPart(ArchivePart::kRecord, bytes));
  ByteReader in(content);
  RecordView record;
  const uint64_t revision = in.Varint();
  const bool sound = revision >= 1 && revision < kMaxStamp && ReadFit(in, record.fit) &&
                     ReadWidths(in, record.widths) && ReadColumnHeads(in, record.new_columns);
  record.revision = static_cast<int64_t>(revision);
  record.note = in.Bytes(in.Varint());
  record.body = in.Bytes(in.remaining());
  if (!sound || !in.ok()) return ArchiveDamaged("a record of an archive does not say what a batch did");
  return record;
}

}  // namespace dynmesh
