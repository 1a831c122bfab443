#include "server/session/limits.h"

#include <unistd.h>

namespace dynmesh {

uint64_t DefaultMaxSessionBytes() {
  constexpr uint64_t kMost = uint64_t{64} << 30;
  const long pages = sysconf(_SC_PHYS_PAGES);
  const long page_bytes = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page_bytes <= 0) return kMost;
  return std::min(kMost, static_cast<uint64_t>(pages) * static_cast<uint64_t>(page_bytes) / 4 * 3);
}

}  // namespace dynmesh
