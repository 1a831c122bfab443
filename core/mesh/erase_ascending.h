#ifndef DYNMESH_CORE_MESH_ERASE_ASCENDING_H_
#define DYNMESH_CORE_MESH_ERASE_ASCENDING_H_

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/mesh/ids.h"

namespace dynmesh {

/// What EraseAscending reads and writes behind a list; it puts back what stands there.
inline constexpr size_t kListMargin = 4;

namespace internal {

using FourSlots = int32_t __attribute__((vector_size(16)));

inline FourSlots LoadFour(const Slot* slots) {
  FourSlots four;
  std::memcpy(&four, slots, sizeof(four));
  return four;
}

inline FourSlots FourOf(size_t value) {
  const auto v = static_cast<int32_t>(value);
  return FourSlots{v, v, v, v};
}

inline constexpr FourSlots kPlaces = {0, 1, 2, 3};

}  // namespace internal

/// Removes one entry that equals `value` from an ascending list of `length`: four entries at a time, and
/// without a branch on what they are, which nobody can foresee. REQUIRES: there is one; slots below 2^31;
/// kListMargin entries behind the list can be read and written.
inline void EraseAscending(Slot* list, size_t length, Slot value) {
  using namespace internal;  // NOLINT: short
  const FourSlots removed = FourOf(value);
  for (size_t at = 0; at < length; at += 4) {
    const FourSlots here = LoadFour(list + at), next = LoadFour(list + at + 1);
    const FourSlots keeps = (here < removed) | (kPlaces + FourOf(at) >= FourOf(length - 1));
    const FourSlots result = keeps ? here : next;
    std::memcpy(list + at, &result, sizeof(result));
  }
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_ERASE_ASCENDING_H_
