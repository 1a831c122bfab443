// Many elements at once: in an order in which neighbours come together.

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/mesh/mesh.h"
#include "core/mesh/spatial_order.h"

namespace dynmesh {
namespace {

/// Fewer elements stay in the order they came: sorting would cost more than it gives.
constexpr size_t kFew = 32;

absl::Status WithIndex(const absl::Status& status, size_t index) {
  return WithMetadata(status, "index", absl::StrCat(index));
}

}  // namespace

absl::Status Mesh::AddElements(ElementType type, absl::Span<const VertexId> vertices,
                               absl::FunctionRef<void(size_t, EntityId)> added) {
  if (!IsElementType(static_cast<int>(type))) return CheckVertices(type, {});
  const size_t size = NumVertices(type);
  const size_t count = vertices.size() / size;
  if (vertices.size() % size != 0) return CheckVertices(type, vertices.last(vertices.size() % size));
  for (size_t i = 0; i < count; ++i) {
    const absl::Status checked = CheckVertices(type, vertices.subspan(i * size, size));
    if (!checked.ok()) return WithIndex(checked, i);
  }
  const Permutation order = count < kFew ? Permutation() : OrderOfElements(vertices, size);
  for (size_t k = 0; k < count; ++k) {
    const size_t i = order.empty() ? k : order[k];
    const absl::StatusOr<EntityId> id = AddChecked(type, vertices.subspan(i * size, size));
    if (!id.ok()) return WithIndex(id.status(), i);
    added(i, *id);
  }
  return absl::OkStatus();
}

Permutation Mesh::OrderOfElements(absl::Span<const VertexId> vertices, size_t size) const {
  std::vector<Point> centers(vertices.size() / size, Point{0, 0, 0});
  for (size_t i = 0; i < centers.size(); ++i) {
    for (VertexId v : vertices.subspan(i * size, size)) {
      for (int axis = 0; axis < 3; ++axis) centers[i][axis] += Position(v)[axis] / size;
    }
  }
  return HilbertOrder(centers);
}

absl::Status Mesh::RemoveElements(EntityKind kind, absl::Span<const Slot> elements) {
  for (size_t i = 0; i < elements.size(); ++i) {
    const absl::Status checked = CheckRemovable({kind, elements[i]});
    if (!checked.ok()) return WithIndex(checked, i);
  }
  if (std::is_sorted(elements.begin(), elements.end())) return RemoveAscending(kind, elements, elements);
  std::vector<Slot> sorted(elements.begin(), elements.end());
  std::sort(sorted.begin(), sorted.end());
  return RemoveAscending(kind, sorted, elements);
}

absl::Status Mesh::RemoveAscending(EntityKind kind, absl::Span<const Slot> sorted,
                                   absl::Span<const Slot> elements) {
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  if (twice != sorted.end()) {
    const auto first = std::find(elements.begin(), elements.end(), *twice);
    const auto second = std::find(first + 1, elements.end(), *twice);
    return WithIndex(EntityNotFound(reason::kEntityRemoved, {kind, *twice}), second - elements.begin());
  }
  for (Slot slot : sorted) Remove({kind, slot});
  return absl::OkStatus();
}

}  // namespace dynmesh
