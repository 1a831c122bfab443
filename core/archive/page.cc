#include "core/archive/page.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/archive/column_rows.h"
#include "core/archive/part.h"
#include "core/archive/slot_rows.h"

namespace dynmesh {
namespace {

constexpr size_t kTypicalPageBytes = 16 << 10;

void WriteColumnsOf(const Mesh& mesh, EntityKind kind, Slot begin, Slot end, ByteWriter& out) {
  const auto& columns = mesh.attributes();
  ByteWriter sections;
  uint64_t num_sections = 0;
  for (size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].spec().kind != kind) continue;
    ColumnRowWriter rows(columns[i], begin, mesh.revision());
    columns[i].stamps().ForEachSince(0, begin, end, [&](Slot slot) { rows.Write(slot); });
    if (rows.empty()) continue;
    rows.AppendTo(i, sections);
    ++num_sections;
  }
  out.Varint(num_sections);
  out.Bytes(sections.bytes());
}

}  // namespace

std::string EncodePage(const Mesh& mesh, PageId page) {
  const Slot begin = page.index * kPageSlots;
  const Slot end = std::min<uint64_t>(mesh.slots(page.kind).limit(), uint64_t{begin} + kPageSlots);
  ByteWriter out;
  out.Reserve(kTypicalPageBytes);
  BeginPart(ArchivePart::kPage, out);
  out.Fixed<EntityKind>(page.kind);
  out.Varint(page.index);
  out.Varint(mesh.revision());
  out.Varint(end - begin);
  SlotRowWriter rows(mesh, page.kind, RowContext::At(mesh.revision()), out);
  for (Slot slot = begin; slot < end; ++slot) rows.Write(slot);
  WriteColumnsOf(mesh, page.kind, begin, end, out);
  return SealPart(std::move(out));
}

}  // namespace dynmesh
