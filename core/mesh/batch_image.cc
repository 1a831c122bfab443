#include "core/mesh/batch_image.h"

namespace dynmesh {
namespace {

template <typename T>
size_t CapacityBytes(const std::vector<T>& items) {
  return items.capacity() * sizeof(T);
}

}  // namespace

size_t BatchImage::Entities::memory_bytes() const {
  return CapacityBytes(slots) + CapacityBytes(types) + CapacityBytes(states) + CapacityBytes(vertices) +
         CapacityBytes(parts);
}

size_t BatchImage::Positions::memory_bytes() const { return CapacityBytes(slots) + CapacityBytes(positions); }

size_t BatchImage::Rows::memory_bytes() const { return CapacityBytes(slots) + CapacityBytes(bytes); }

uint64_t BatchImage::num_items() const {
  uint64_t items = ended_vertices.slots.size() + moved.slots.size();
  for (int kind = 0; kind < kNumEntityKinds; ++kind) {
    items += made[kind].size() + ended[kind].slots.size() + reshaped[kind].slots.size();
  }
  for (const Rows& of_column : rows) items += of_column.slots.size();
  return items;
}

size_t BatchImage::memory_bytes() const {
  size_t bytes = sizeof(*this) + ended_vertices.memory_bytes() + moved.memory_bytes() + CapacityBytes(rows);
  for (int kind = 0; kind < kNumEntityKinds; ++kind) {
    bytes += CapacityBytes(made[kind]) + ended[kind].memory_bytes() + reshaped[kind].memory_bytes();
  }
  for (const Rows& of_column : rows) bytes += of_column.memory_bytes();
  return bytes;
}

}  // namespace dynmesh
