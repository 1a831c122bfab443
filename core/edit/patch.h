#ifndef DYNMESH_CORE_EDIT_PATCH_H_
#define DYNMESH_CORE_EDIT_PATCH_H_

#include <array>
#include <cstdint>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// In a batch or a patch, vertex id kNewVertex | k means the k-th vertex that it has added so far. (In a
/// batch, vertices that collapses add do not count, as nobody can foresee them, and those of skipped splits
/// do.)
inline constexpr Slot kNewVertex = 0x80000000u;

/// Entities that one operator may look at where that is more than its star: a second's work or two.
inline constexpr uint64_t kMaxPatchWork = 50'000'000;

/// Vertices that a new one lies between, with weights that add up to 1: what its attributes are made of.
struct Blend {
  absl::InlinedVector<VertexId, 4> vertices;
  absl::InlinedVector<double, 4> weights;
};

/// What an edit operator would do to a mesh, as a value: elements that go, and elements that take their
/// place. Operators plan patches (`PlanSplitEdge(mesh, e, ...)`), which changes nothing; ApplyPatch carries
/// them out.
///
/// Planning says whether the topology permits the operator; CheckPatch whether the geometry does.
struct Patch {
  struct NewVertex {
    Point position;
    Blend blend;
  };
  struct Move {
    VertexId vertex;
    Point position;
  };
  /// A vertex that becomes another one, in every element.
  struct Merger {
    VertexId kept, gone;
    double weight = 0;  ///< of `gone` in the attributes of `kept`, from 0 to 1; `kept` itself has the rest
  };
  /// An edge that gets a vertex in the middle.
  struct Cut {
    VertexId a, b;
    VertexId middle;
  };

  std::vector<NewVertex> new_vertices;
  std::vector<Move> moves;
  std::vector<Merger>
      mergers;            ///< attributes of vertices, and of the edges and faces there, follow from these
  std::vector<Cut> cuts;  ///< and from these
  std::vector<EntityId> removed;
  std::vector<NewElement> added;
  std::vector<uint32_t> parents;  ///< of each added element: an index in `removed`
  std::vector<VertexId> removed_vertices;
  /// Whether the planner leaves it to ApplyPatch to see that the Euler characteristic stays. Splits and swaps
  /// keep the topology as they are made; merges are meant to change it.
  bool check_euler = false;
  /// What Orientation() of all added cells must be; 0: each that of its parent.
  int orientation = 0;
  uint64_t work = 0;  ///< entities looked at to plan it

  void Clear();
  /// Adds a vertex and returns its id within the patch.
  VertexId AddVertex(const Point& position, Blend blend);
  /// Says that an element goes; those that Add() names next take its place.
  void Remove(EntityId element) { removed.push_back(element); }
  /// REQUIRES: after a Remove().
  void Add(ElementType type, absl::Span<const VertexId> vertices);
  /// In place of removed[parent], among others.
  void AddChildOf(size_t parent, ElementType type, absl::Span<const VertexId> vertices);
};

/// A vertex in the middle of `vertices`, as they will be.
Patch::NewVertex MiddleOf(const Mesh& mesh, const Patch& patch, absl::Span<const VertexId> vertices);

/// Where a vertex of the mesh or of the patch will be.
Point PositionAfter(const Mesh& mesh, const Patch& patch, VertexId v);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_PATCH_H_
