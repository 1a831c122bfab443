#ifndef DYNMESH_CORE_REPAIR_REPAIR_REPORT_H_
#define DYNMESH_CORE_REPAIR_REPAIR_REPORT_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/mesh/ids.h"

namespace dynmesh {

/// What a repair found at an entity, and did about it or not. The values travel on the wire: never renumber.
enum class RepairFinding : uint8_t {
  kReversed = 1,           ///< an element that turns the other way now, by its new id
  kNotOrientable = 2,      ///< the lowest element of a component that cannot be oriented, and stays as it was
  kMerged = 3,             ///< a vertex that became another one
  kShrunk = 4,             ///< a quad that became a triangle, by its old id
  kDegenerate = 5,         ///< an element that was removed: it named a vertex twice, or had no size
  kDuplicate = 6,          ///< an element that was removed: it was equal to another one
  kIsolated = 7,           ///< a vertex that was removed
  kSplit = 8,              ///< a vertex that its fans do not share any more
  kAdded = 9,              ///< a new vertex or face
  kStillNonManifold = 10,  ///< an edge or face that copies of its vertices do not take apart
  kFilled = 11,            ///< the lowest edge of a hole that is closed now
  kHoleTooLong = 12,       ///< the lowest edge of a hole that stays: it has more edges than was asked for
  kHoleBranches = 13,      ///< that of one that meets itself, or another one, in a vertex
  kHoleInconsistent = 14,  ///< that of one whose faces turn differently
  kHoleFaceExists = 15,    ///< that of one whose only filling is there already: the other side of a lone face
};
inline constexpr int kNumRepairFindings = 15;

/// How often something was found, and the first entities.
struct RepairTally {
  /// So many entities of each finding are told.
  static constexpr size_t kMaxTold = 1000;

  uint64_t count = 0;
  std::vector<EntityId> entities;
};

/// What one repair did: tallies by finding.
class RepairReport {
 public:
  void Add(RepairFinding finding, EntityId entity) {
    RepairTally& tally = tallies_[Index(finding)];
    ++tally.count;
    if (tally.entities.size() < RepairTally::kMaxTold) tally.entities.push_back(entity);
  }

  /// Says how often something was found.
  void Put(RepairFinding finding, RepairTally tally) { tallies_[Index(finding)] = std::move(tally); }

  const RepairTally& Of(RepairFinding finding) const { return tallies_[Index(finding)]; }
  uint64_t Count(RepairFinding finding) const { return Of(finding).count; }

  /// Calls fn(finding, tally) for each that is not empty.
  template <typename Fn>
  void ForEach(Fn fn) const {
    for (int i = 0; i < kNumRepairFindings; ++i) {
      if (tallies_[i].count > 0) fn(static_cast<RepairFinding>(i + 1), tallies_[i]);
    }
  }

 private:
  static size_t Index(RepairFinding finding) { return static_cast<size_t>(finding) - 1; }

  std::array<RepairTally, kNumRepairFindings> tallies_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_REPAIR_REPAIR_REPORT_H_
