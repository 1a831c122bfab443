#ifndef DYNMESH_CORE_ADAPT_CHANGES_H_
#define DYNMESH_CORE_ADAPT_CHANGES_H_

#include <cstdint>
#include <vector>

#include "absl/types/span.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// When something last changed round each vertex, so that what was tried in vain is tried again only where
/// there is reason to. Times count calls of Now(). Cost: O(1) each. Thread safety: that of std::vector.
class Changes {
 public:
  /// The time since which everything has been touched.
  static constexpr uint32_t kBeginning = 0;

  void Touch(VertexId v) {
    if (v.slot() >= touched_.size()) touched_.resize(v.slot() + 1, 0);
    touched_[v.slot()] = now_;
  }
  /// The present, which ends; what is touched from here on is touched since.
  uint32_t Now() { return now_++; }

  bool IsTouchedSince(VertexId v, uint32_t time) const {
    return time == kBeginning || (v.slot() < touched_.size() && touched_[v.slot()] > time);
  }
  bool AnyTouchedSince(absl::Span<const VertexId> vertices, uint32_t time) const {
    for (VertexId v : vertices) {
      if (IsTouchedSince(v, time)) return true;
    }
    return false;
  }

 private:
  std::vector<uint32_t> touched_;  ///< by vertex slot
  uint32_t now_ = kBeginning + 1;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ADAPT_CHANGES_H_
