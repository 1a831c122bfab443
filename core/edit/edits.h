#ifndef DYNMESH_CORE_EDIT_EDITS_H_
#define DYNMESH_CORE_EDIT_EDITS_H_

#include <cstdint>
#include <variant>
#include <vector>

#include "core/edit/check_patch.h"
#include "core/edit/patch.h"
#include "core/edit/smooth.h"
#include "core/mesh/mesh.h"

namespace dynmesh {

/// The edits of a batch, as values. Slots are what the caller read; positions are xyz.
struct AddVerticesEdit {
  std::vector<Point> positions;
};
struct RemoveVerticesEdit {
  std::vector<Slot> vertices;
};
struct MoveVerticesEdit {
  std::vector<Slot> vertices;
  std::vector<Point> positions;
};
struct AddElementsEdit {
  ElementType type = ElementType::kUnspecified;
  std::vector<Slot> vertices;  ///< NumVertices(type) for each element
};
struct RemoveElementsEdit {
  EntityKind kind = EntityKind::kCell;
  std::vector<Slot> elements;
};
struct AddAttributeEdit {
  AttributeSpec spec;
};
struct SetAttributeEdit {
  AttributeSpec spec;  ///< of the column; policy and default do not matter, and `type` is that of `rows`
  std::vector<Slot> slots;
  std::vector<uint8_t> rows;
};

/// Edges, by their ids or by their two vertices, which may be new ones of the batch. One of both is empty.
struct EdgeNames {
  std::vector<Slot> ids;
  std::vector<Slot> ends;  ///< two vertices for each edge

  size_t size() const { return ids.size() + ends.size() / 2; }
};

/// Operators: each item is planned, checked and carried out before the next one is looked at, so that an item
/// may follow from those before it. See split.h, collapse.h, swap.h.
struct SplitEdgesEdit {
  EdgeNames edges;
  std::vector<double> parameters;  ///< one for each edge, between 0 and 1; or none: 0.5
  std::vector<Point> positions;    ///< of the new vertices; or none: on the edge
  PatchLimits limits;
};
struct CollapseEdgesEdit {
  EdgeNames edges;
  std::vector<double> parameters;  ///< one for each edge, from 0 to 1; or none: 0.5
  std::vector<Point> positions;    ///< where the ends meet; or none: on the edge
  PatchLimits limits;
};
struct SwapEdgesEdit {
  EdgeNames edges;
  PatchLimits limits;
};
struct SwapFacesEdit {
  std::vector<Slot> faces;
  PatchLimits limits;
};
struct SplitElementsEdit {
  EntityKind kind = EntityKind::kCell;
  std::vector<Slot> elements;
  std::vector<Point> positions;  ///< of the new vertices; or none: the centroids
  PatchLimits limits;
};

struct MergeVerticesEdit {
  std::vector<Slot> pairs;       ///< for each item the vertex that stays and the one that goes
  std::vector<Point> positions;  ///< where they meet; or none: where the first one is
  PatchLimits limits;
};
/// Removes vertices and fills the gaps anew: see remove_vertex.h.
struct DissolveVerticesEdit {
  std::vector<Slot> vertices;
  PatchLimits limits;
};

/// Moves vertices as smooth.h says: all of them in their order, so many times. Who is gone after the first
/// time is passed over.
struct SmoothVerticesEdit {
  std::vector<Slot> vertices = {};
  SmoothRule rule = {};
  uint32_t iterations = 1;  ///< 1 to kMaxSmoothIterations
  PatchLimits limits = {};
};
inline constexpr uint32_t kMaxSmoothIterations = 1000;

using Edit = std::variant<AddVerticesEdit, RemoveVerticesEdit, MoveVerticesEdit, AddElementsEdit,
                          RemoveElementsEdit, AddAttributeEdit, SetAttributeEdit, SplitEdgesEdit,
                          CollapseEdgesEdit, SwapEdgesEdit, SwapFacesEdit, SplitElementsEdit,
                          MergeVerticesEdit, DissolveVerticesEdit, SmoothVerticesEdit>;

/// Whether it splits, collapses, swaps, merges, dissolves or smooths.
inline bool IsOperator(const Edit& edit) {
  return std::holds_alternative<SplitEdgesEdit>(edit) || std::holds_alternative<CollapseEdgesEdit>(edit) ||
         std::holds_alternative<SwapEdgesEdit>(edit) || std::holds_alternative<SwapFacesEdit>(edit) ||
         std::holds_alternative<SplitElementsEdit>(edit) || std::holds_alternative<MergeVerticesEdit>(edit) ||
         std::holds_alternative<DissolveVerticesEdit>(edit) ||
         std::holds_alternative<SmoothVerticesEdit>(edit);
}

/// How many vertices, elements, rows, or places for an operator an edit names.
uint64_t NumItems(const Edit& edit);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_EDITS_H_
