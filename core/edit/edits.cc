#include "core/edit/edits.h"

namespace dynmesh {
namespace {

struct ItemCounter {
  uint64_t operator()(const AddVerticesEdit& e) const { return e.positions.size(); }
  uint64_t operator()(const RemoveVerticesEdit& e) const { return e.vertices.size(); }
  uint64_t operator()(const MoveVerticesEdit& e) const { return e.vertices.size(); }
  uint64_t operator()(const AddElementsEdit& e) const {
    return IsElementType(static_cast<int>(e.type)) ? e.vertices.size() / NumVertices(e.type)
                                                   : e.vertices.size();
  }
  uint64_t operator()(const RemoveElementsEdit& e) const { return e.elements.size(); }
  uint64_t operator()(const AddAttributeEdit&) const { return 1; }
  uint64_t operator()(const SetAttributeEdit& e) const { return e.slots.size(); }
  uint64_t operator()(const SplitEdgesEdit& e) const { return e.edges.size(); }
  uint64_t operator()(const CollapseEdgesEdit& e) const { return e.edges.size(); }
  uint64_t operator()(const SwapEdgesEdit& e) const { return e.edges.size(); }
  uint64_t operator()(const SwapFacesEdit& e) const { return e.faces.size(); }
  uint64_t operator()(const SplitElementsEdit& e) const { return e.elements.size(); }
  uint64_t operator()(const MergeVerticesEdit& e) const { return e.pairs.size() / 2; }
  uint64_t operator()(const DissolveVerticesEdit& e) const { return e.vertices.size(); }
  uint64_t operator()(const SmoothVerticesEdit& e) const {
    return e.vertices.size() * uint64_t{e.iterations};
  }
};

}  // namespace

uint64_t NumItems(const Edit& edit) { return std::visit(ItemCounter(), edit); }

}  // namespace dynmesh
