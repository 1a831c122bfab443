#ifndef DYNMESH_CORE_MESH_PIPELINE_H_
#define DYNMESH_CORE_MESH_PIPELINE_H_

#include <algorithm>
#include <cstddef>

namespace dynmesh {

/// Calls every stage(i) for i = 0, ..., count - 1, each stage some items ahead of the next: what one stage
/// asks of memory is there when the next one reads it. All stages but the last should only ask; they see what
/// the last one has done to the items before.
template <typename... Stages>
void Pipeline(size_t count, Stages... stages) {
  constexpr size_t kAhead = 6;  // covers the latency of memory; few enough for the first-level cache
  const size_t ahead = std::min(kAhead, count);
  const size_t lag = ahead * (sizeof...(Stages) - 1);
  for (size_t step = 0; step < count + lag; ++step) {
    size_t i = step;  // below 0 it wraps beyond count
    ((i < count ? stages(i) : void(), i -= ahead), ...);
  }
}

/// Asks for the cache line at an address, which may be anything.
inline void Prefetch(const void* address) { __builtin_prefetch(address); }

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_PIPELINE_H_
