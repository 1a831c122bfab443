#ifndef DYNMESH_TESTS_BENCH_DIGEST_H_
#define DYNMESH_TESTS_BENCH_DIGEST_H_

#include <cstdint>

#include "core/mesh/checksum.h"
#include "core/mesh/mesh.h"

namespace dynmesh::bench {

inline uint32_t SlotOf(uint32_t slot) { return slot; }
template <EntityKind K>
uint32_t SlotOf(Id<K> id) {
  return id.slot();
}
inline uint32_t SlotOf(OrientedFace face) { return face.face().slot(); }

/// What the timed loops make of rows: every entry is read, and tied to whose row it is in, so that no
/// compiler may read a table as one long array. Little else is done.
struct Sum {
  uint64_t value = 0;

  template <typename Row>
  void operator()(uint32_t slot, const Row& row) {
    uint64_t sum = 0;
    for (const auto& id : row) sum += SlotOf(id);
    value += sum ^ slot;
  }
};

/// What the checks make of rows, whatever the order of rows and entries: equal only if all rows are.
struct Fingerprint {
  uint64_t value = 0;
  uint64_t entries = 0;

  template <typename Row>
  void operator()(uint32_t slot, const Row& row) {
    for (const auto& id : row) value += Checksum::Mix(uint64_t{slot} << 32 | SlotOf(id));
    entries += row.size();
  }
  friend bool operator==(const Fingerprint&, const Fingerprint&) = default;
};

/// Ends the program with a message unless `same`: figures of things that do not do the same are worthless.
void CheckSame(bool same, const char* task, const char* what);

}  // namespace dynmesh::bench

#endif  // DYNMESH_TESTS_BENCH_DIGEST_H_
