#ifndef DYNMESH_CORE_ARCHIVE_PAGE_H_
#define DYNMESH_CORE_ARCHIVE_PAGE_H_

#include <compare>
#include <cstdint>
#include <string>

#include "core/mesh/mesh.h"

namespace dynmesh {

/// Slots of a page: those that share a maximum of their stamps.
inline constexpr Slot kPageSlots = StampColumn::kPageSlots;

/// Names a page: slots kPageSlots * index on of a kind.
struct PageId {
  EntityKind kind = EntityKind::kVertex;
  uint32_t index = 0;

  friend constexpr auto operator<=>(const PageId&, const PageId&) = default;
};

/// How many pages hold `limit` slots.
constexpr uint32_t NumPages(Slot limit) { return (uint64_t{limit} + kPageSlots - 1) / kPageSlots; }

/// Everything that a mesh holds in one page, attributes included, at its present revision.
///
/// Pages may be taken at different revisions, edits between them: the records since the first of these make
/// the whole exact (Rebuilder). REQUIRES: page.index < NumPages(mesh.slots(page.kind).limit()), no batch is
/// open. Cost: linear in the page; 10 to 50 us.
std::string EncodePage(const Mesh& mesh, PageId page);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ARCHIVE_PAGE_H_
