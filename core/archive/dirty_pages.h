#ifndef DYNMESH_CORE_ARCHIVE_DIRTY_PAGES_H_
#define DYNMESH_CORE_ARCHIVE_DIRTY_PAGES_H_

#include <array>
#include <cstddef>
#include <vector>

#include "core/archive/page.h"
#include "core/mesh/bit_set.h"
#include "core/mesh/journal.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// Which pages a checkpoint has to write: those that batches have touched since the last one.
///
///     dirty.Add(mesh.journal());          // before each Commit()
///     ...
///     DirtyPages taken = std::exchange(dirty, {});   // a checkpoint begins, with EncodeHead(mesh)
///     for (PageId page : taken.List()) store.Put(page, EncodePage(mesh, page));
///     // where it fails: dirty.Add(taken)
///
/// From the journal and not from stamps, because derived edges and faces are turned without one. Edits
/// without a journal (a bulk build, edits outside a batch) are not seen: AddAll() after them.
/// Cost: Add some nanoseconds a step of the journal. Thread safety: that of std::vector.
class DirtyPages {
 public:
  /// Pages of all slots and rows that the batch has touched.
  void Add(const Journal& journal);
  void Add(const DirtyPages& others);
  /// Pages of the slots from `begin` to before `end`.
  void Add(EntityKind kind, Slot begin, Slot end);
  /// Every page that the mesh has.
  void AddAll(const Mesh& mesh);

  bool Has(PageId page) const { return pages_[Dimension(page.kind)].Test(page.index); }
  bool empty() const { return size() == 0; }
  size_t size() const;
  /// Ascending.
  std::vector<PageId> List() const;

 private:
  std::array<BitSet, kNumEntityKinds> pages_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ARCHIVE_DIRTY_PAGES_H_
