#include "core/repair/distinct_elements.h"

#include <algorithm>

#include "core/mesh/vertex_cycle.h"

namespace dynmesh {
namespace {

std::vector<CycleKey> FacesOf(const NewElement& cell) {
  const ElementTemplate& shape = TemplateOf(cell.type);
  std::vector<CycleKey> faces;
  for (int i = 0; i < shape.num_faces; ++i) {
    faces.push_back(CanonicalCycle(FaceVertices(shape.faces[i], cell.vertices()).span()));
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

/// Whether the set of its vertices says all of an element.
bool IsSimplex(ElementType type) { return NumVertices(type) == Dimension(KindOf(type)) + 1; }

}  // namespace

bool AreEqual(const NewElement& a, const NewElement& b) {
  if (a.type != b.type) return false;
  if (KindOf(a.type) == EntityKind::kCell) return FacesOf(a) == FacesOf(b);
  return CanonicalCycle(a.vertices()) == CanonicalCycle(b.vertices());
}

bool DistinctElements::Insert(const NewElement& element) {
  Key key;
  key.fill(kNoSlot);
  key[0] = static_cast<Slot>(element.type);
  const auto vertices = element.vertices();
  for (size_t k = 0; k < vertices.size(); ++k) key[k + 1] = vertices[k].slot();
  std::sort(key.begin() + 1, key.begin() + 1 + vertices.size());
  const auto [it, is_new] = arrangements_.try_emplace(key);
  if (IsSimplex(element.type)) return is_new;
  const bool known = std::any_of(it->second.begin(), it->second.end(),
                                 [&](const NewElement& other) { return AreEqual(element, other); });
  if (!known) it->second.push_back(element);
  return !known;
}

}  // namespace dynmesh
