#include "core/archive/dirty_pages.h"

namespace dynmesh {

void DirtyPages::Add(const Journal& journal) {
  for (const JournalEntry& entry : journal.entries) {
    if (entry.op == JournalOp::kAddAttribute) continue;  // heads and records tell columns
    pages_[Dimension(entry.kind)].Set(entry.slot / kPageSlots);
  }
}

void DirtyPages::Add(const DirtyPages& others) {
  for (int kind = 0; kind < kNumEntityKinds; ++kind) {
    others.pages_[kind].ForEach([&](Slot page) { pages_[kind].Set(page); });
  }
}

void DirtyPages::Add(EntityKind kind, Slot begin, Slot end) {
  for (Slot page = begin / kPageSlots; page < NumPages(end); ++page) pages_[Dimension(kind)].Set(page);
}

void DirtyPages::AddAll(const Mesh& mesh) {
  for (EntityKind kind : kEntityKinds) {
    for (Slot page = 0; page < NumPages(mesh.slots(kind).limit()); ++page) pages_[Dimension(kind)].Set(page);
  }
}

size_t DirtyPages::size() const {
  size_t size = 0;
  for (const BitSet& pages : pages_) size += pages.size();
  return size;
}

std::vector<PageId> DirtyPages::List() const {
  std::vector<PageId> list;
  list.reserve(size());
  for (EntityKind kind : kEntityKinds) {
    pages_[Dimension(kind)].ForEach([&](Slot page) { list.push_back({kind, page}); });
  }
  return list;
}

}  // namespace dynmesh
