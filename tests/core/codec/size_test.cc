#include <gtest/gtest.h>
#include <zstd.h>

#include "core/mesh/error.h"
#include "tests/core/codec/delta_samples.h"

namespace dynmesh {
namespace {

constexpr int kZstdLevel = 3;

template <typename T>
void Append(const std::vector<T>& values, std::string& out) {
  out.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

// What a client would send that knows zstd and nothing about meshes.
size_t ZstdOnRawArrays(const Delta& delta) {
  std::string raw;
  for (const ElementChanges& changes : delta.elements) {
    Append(changes.removed, raw);
    Append(changes.slots, raw);
    Append(changes.types, raw);
    Append(changes.vertices, raw);
  }
  std::string frame(ZSTD_compressBound(raw.size()), '\0');
  return ZSTD_compress(frame.data(), frame.size(), raw.data(), raw.size(), kZstdLevel);
}

EncodeStats StatsOf(const Delta& delta) {
  EncodeStats stats;
  EXPECT_TRUE(EncodeDelta(delta, {}, &stats).ok());
  return stats;
}

// The same elements over vertices whose slots are scattered at random.
Delta Scattered(Delta delta) {
  Rng rng(1);
  for (VertexId& v : delta.OfKind(EntityKind::kCell).vertices) {
    v = VertexId(static_cast<Slot>(Checksum::Mix(v.slot()) >> 32) & 0x7fffffff);
  }
  return delta;
}

// Elements without any neighbourhood: the worst case for a cache.
Delta Shuffled(Delta delta) {
  Rng rng(2);
  std::vector<VertexId>& vertices = delta.OfKind(EntityKind::kCell).vertices;
  for (size_t i = vertices.size(); i > 1; --i) std::swap(vertices[i - 1], vertices[rng() % i]);
  return delta;
}

// The same few elements over and over, far apart: what a general compressor is best at.
Delta Repeated(int count) {
  Rng rng(3);
  Delta delta = Shuffled(TetBlock(7));
  ElementChanges& cells = delta.OfKind(EntityKind::kCell);
  for (size_t i = 1200; i < cells.vertices.size(); ++i) cells.vertices[i] = cells.vertices[i % 1200];
  cells.vertices.resize(4 * count);
  cells.slots.resize(count);
  cells.types.resize(count);
  return delta;
}

TEST(SizeTest, ATetrahedronInSpatialOrderTakesAtMost35Bits) {
  for (int n : {6, 10, 20}) {
    const Delta delta = TetBlock(n);
    const EncodeStats stats = StatsOf(delta);
    EXPECT_LE(stats.topology_bytes * 8.0 / delta.num_upserted_elements(), 35) << n;
  }
}

TEST(SizeTest, NoDeltaOfAThousandElementsTakesMoreThanZstdOnRawArrays) {
  for (const Delta& delta :
       {TetBlock(6), TetBlock(12), HexBlock(12), Scattered(TetBlock(8)), Scattered(HexBlock(11)),
        Shuffled(TetBlock(8)), Shuffled(Scattered(TetBlock(8))), Repeated(2000)}) {
    ASSERT_GE(delta.num_upserted_elements(), 1000u);
    EXPECT_LE(StatsOf(delta).topology_bytes, ZstdOnRawArrays(delta));
  }
}

}  // namespace
}  // namespace dynmesh
