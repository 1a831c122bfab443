#include "tests/core/edit/batch_dice.h"

#include <iterator>
#include <string>

namespace dynmesh::testing {
namespace {

constexpr size_t kMaxElements = 80;  ///< beyond: only what makes them fewer

}  // namespace

Edit BatchDice::AnyOperator() {
  const bool crowded = mesh_.NumElements(EntityKind::kCell) > 2000;
  switch (Uniform(crowded ? 3 : 6)) {
    case 0:
      return CollapseEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {}, {}, {}};
    case 1:
      return SwapEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {}};
    case 2:
      return SwapFacesEdit{{Any(EntityKind::kFace)}, {}};
    case 3:
      return SplitEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {}, {}, {}};
    case 4:
      return SplitElementsEdit{EntityKind::kCell, {Any(EntityKind::kCell)}, {}, {}};
    default: {
      const Slot v = Any(EntityKind::kVertex);
      Point place = mesh_.Position(VertexId(v));
      place[Uniform(3)] += 1e-3;
      return MoveVerticesEdit{{v}, {place}};
    }
  }
}

std::vector<Edit> BatchDice::AnyBatch() {
  std::vector<Edit> edits;
  for (int i = Uniform(4); i >= 0; --i) edits.push_back(AnyEdit());
  return edits;
}

Edit BatchDice::AnyEdit() {
  const bool crowded =
      mesh_.NumElements(EntityKind::kFace) + mesh_.NumElements(EntityKind::kCell) > kMaxElements;
  switch (Uniform(crowded ? 6 : 12)) {
    case 0:
    case 1:
      return RemoveElementsEdit{kind_ = kEntityKinds[1 + Uniform(3)], {AnyElement(kind_)}};
    case 2:
      return CollapseEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {}, {}, {}};
    case 3:
      return MoveVerticesEdit{{Any(EntityKind::kVertex)}, {AnyPoint()}};
    case 4:
      return AnyAttributeEdit();
    case 5:
      return SwapEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {.keep_orientation = false}};
    case 6:
      return SplitEdgesEdit{{{Any(EntityKind::kEdge)}, {}}, {}, {}, {}};
    case 7:
      return SplitElementsEdit{kind_ = kEntityKinds[1 + Uniform(3)], {AnyElement(kind_)}, {}, {}};
    case 8:
      return MergeVerticesEdit{{Any(EntityKind::kVertex), Any(EntityKind::kVertex)}, {}, {}};
    case 9:
      return AddVerticesEdit{{AnyPoint(), AnyPoint()}};
    default:
      return AnyAddition();
  }
}

Edit BatchDice::AnyAddition() {
  AddElementsEdit edit{kElementTypes[Uniform(std::size(kElementTypes))], {}};
  for (int k = 0; k < NumVertices(edit.type); ++k) edit.vertices.push_back(Any(EntityKind::kVertex));
  return edit;
}

Edit BatchDice::AnyAttributeEdit() {
  if (mesh_.attributes().size() < 4 && Uniform(3) == 0) {
    const EntityKind kind = kEntityKinds[Uniform(kNumEntityKinds)];
    AttributeSpec spec = {"a" + std::to_string(mesh_.attributes().size()), kind, AttributeType::kFloat64, 1};
    if (Uniform(2) == 0) spec.default_row = {0, 0, 0, 0, 0, 0, 0xf0, 0x3f};
    return AddAttributeEdit{spec};
  }
  if (mesh_.attributes().empty()) return AddVerticesEdit{{AnyPoint()}};
  SetAttributeEdit edit{mesh_.attributes()[Uniform(mesh_.attributes().size())].spec(), {}, {}};
  edit.slots = {Any(edit.spec.kind)};
  edit.rows = std::vector<uint8_t>(sizeof(double));
  edit.rows[6] = Uniform(256);
  return edit;
}

Slot BatchDice::Any(EntityKind kind) {
  const BitSet& live = mesh_.slots(kind).live();
  if (live.empty()) return 0;
  const Slot slot = live.Next(Uniform(mesh_.slots(kind).limit()));
  return slot == kNoSlot ? live.Next(0) : slot;
}

Slot BatchDice::AnyElement(EntityKind kind) {
  for (int tries = 0; tries < 10; ++tries) {
    const Slot slot = Any(kind);
    if (mesh_.IsLive({kind, slot}) && mesh_.IsElement({kind, slot})) return slot;
  }
  return Any(kind);
}

Point BatchDice::AnyPoint() {
  std::uniform_real_distribution<> uniform(-1, 1);
  return {uniform(rng_), uniform(rng_), uniform(rng_)};
}

}  // namespace dynmesh::testing
