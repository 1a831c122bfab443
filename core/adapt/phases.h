#ifndef DYNMESH_CORE_ADAPT_PHASES_H_
#define DYNMESH_CORE_ADAPT_PHASES_H_

#include <memory>

#include "absl/status/status.h"
#include "core/adapt/operations.h"
#include "core/adapt/work_list.h"

namespace dynmesh {

/// One kind of work on a mesh: which entities it concerns, and what is tried on each. It may be interrupted
/// between any two of them, also by others who edit the mesh: then it starts anew.
class Phase {
 public:
  virtual ~Phase() = default;

  /// Adds all that there is to do where something has changed since a time. Cost: linear in the mesh.
  virtual void Fill(const Mesh& mesh, const AdaptState& state, uint32_t since, WorkList& work) const = 0;
  /// Works on what is at a slot now, if there is still something to do, and adds what follows from it.
  /// Errors: those of Operations.
  virtual absl::Status Process(Slot slot, Operations& operations, WorkList& work) const = 0;
};

/// split_phase.cc: edges that are too long, the longest first.
std::unique_ptr<Phase> MakeSplitPhase();
/// collapse_phase.cc: edges that are too short, the shortest first.
std::unique_ptr<Phase> MakeCollapsePhase();
/// smooth_phase.cc: all vertices, towards the mean of their neighbours.
std::unique_ptr<Phase> MakeSmoothPhase();

/// What is tried on an element that is not good enough.
enum class Remedies { kSwaps, kAll };
/// improve_phase.cc: elements that are not good enough, the worst first.
std::unique_ptr<Phase> MakeImprovePhase(Remedies remedies);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ADAPT_PHASES_H_
