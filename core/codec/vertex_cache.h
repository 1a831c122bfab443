#ifndef DYNMESH_CORE_CODEC_VERTEX_CACHE_H_
#define DYNMESH_CORE_CODEC_VERTEX_CACHE_H_

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <utility>

#include "core/mesh/ids.h"

namespace dynmesh {

/// The last 63 distinct vertices that were used, most recent first. Writer and reader keep equal ones.
class VertexCache {
 public:
  static constexpr uint32_t kCapacity = 63;

  /// The code of `slot`: its position from 1 on, or 0 when it is not here. It is in front afterwards.
  uint32_t Use(Slot slot) {
    Slot carried = slot;
    for (uint32_t i = 0; i < size_; ++i) {
      std::swap(carried, slots_[i]);
      if (carried == slot) return i + 1;
    }
    if (size_ < kCapacity) slots_[size_++] = carried;
    return 0;
  }

  /// The slot with code `code`, which is in front afterwards. REQUIRES: Holds(code).
  Slot UseCode(uint32_t code) {
    assert(Holds(code));
    const Slot slot = slots_[code - 1];
    std::copy_backward(slots_.begin(), slots_.begin() + (code - 1), slots_.begin() + code);
    slots_[0] = slot;
    return slot;
  }

  /// Puts in front a slot that was missed.
  void Push(Slot slot) {
    size_ = std::min(size_ + 1, kCapacity);
    std::copy_backward(slots_.begin(), slots_.begin() + (size_ - 1), slots_.begin() + size_);
    slots_[0] = slot;
  }

  bool Holds(uint32_t code) const { return code >= 1 && code <= size_; }

 private:
  std::array<Slot, kCapacity> slots_;
  uint32_t size_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_VERTEX_CACHE_H_
