#include "core/mesh/batch_image.h"

namespace dynmesh {
namespace {

template <typename T>
size_t Bytes(const std::vector<T>& items) {
  return items.capacity() * sizeof(T);
}

}  // namespace

size_t BatchImage::Entities::memory_bytes() const {
  return Bytes(slots) + Bytes(types) + Bytes(states) + Bytes(vertices) + Bytes(parts);
}

size_t BatchImage::Positions::memory_bytes() const { return Bytes(slots) + Bytes(positions); }

size_t BatchImage::Rows::memory_bytes() const { return Bytes(slots) + Bytes(bytes); }

uint64_t BatchImage::num_items() const {
  uint64_t items = ended_vertices.slots.size() + moved.slots.size();
  for (int kind = 0; kind < kNumEntityKinds; ++kind) {
    items += made[kind].size() + ended[kind].slots.size() + reshaped[kind].slots.size();
  }
  for (const Rows& of_column : rows) items += of_column.slots.size();
  return items;
}

size_t BatchImage::memory_bytes() const {
  size_t bytes = sizeof(*this) + ended_vertices.memory_bytes() + moved.memory_bytes() + Bytes(rows);
  for (int kind = 0; kind < kNumEntityKinds; ++kind) {
    bytes += Bytes(made[kind]) + ended[kind].memory_bytes() + reshaped[kind].memory_bytes();
  }
  for (const Rows& of_column : rows) bytes += of_column.memory_bytes();
  return bytes;
}

}  // namespace dynmesh
