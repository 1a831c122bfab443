#include "tests/core/codec/delta_samples.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace dynmesh {
namespace {

constexpr EntityKind kElementKinds[] = {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell};
constexpr Slot kLastSlot = kNoSlot - 1;

Slot RandomSlot(Rng& rng, Slot limit) { return std::uniform_int_distribution<Slot>(0, limit - 1)(rng); }

// `count` distinct slots, half of the time close together and at times at the end of the range.
std::vector<Slot> RandomSlots(Rng& rng, int count) {
  const Slot spread = rng() % 2 ? 2 * count + 1 : kNoSlot;
  const Slot begin = rng() % 2 ? 0 : kNoSlot - spread;
  std::vector<Slot> slots;
  for (int i = 0; i < count; ++i) slots.push_back(begin + RandomSlot(rng, spread));
  std::sort(slots.begin(), slots.end());
  slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
  return slots;
}

// Takes every other slot of `all` away, so that the two halves are disjoint.
std::vector<Slot> TakeHalf(std::vector<Slot>& all) {
  std::vector<Slot> kept, taken;
  for (size_t i = 0; i < all.size(); ++i) (i % 2 ? taken : kept).push_back(all[i]);
  all = kept;
  return taken;
}

double RandomCoordinate(Rng& rng) {
  const double kinds[] = {0.0,
                          -0.0,
                          std::numeric_limits<double>::denorm_min(),
                          -std::numeric_limits<double>::max(),
                          std::normal_distribution<double>(0, 1)(rng),
                          std::uniform_real_distribution<double>(-1e6, 1e6)(rng)};
  return kinds[rng() % 6];
}

std::vector<ElementType> TypesOf(EntityKind kind) {
  std::vector<ElementType> types;
  std::copy_if(std::begin(kElementTypes), std::end(kElementTypes), std::back_inserter(types),
               [kind](ElementType type) { return KindOf(type) == kind; });
  return types;
}

void AddElement(Slot slot, ElementType type, const std::vector<Slot>& vertices, Delta& delta) {
  ElementChanges& changes = delta.OfKind(KindOf(type));
  changes.slots.push_back(slot);
  changes.types.push_back(type);
  for (Slot v : vertices) changes.vertices.emplace_back(v);
}

// Vertices near a walking centre, now and then anywhere.
void AddRandomElements(Rng& rng, EntityKind kind, int size, Delta& delta) {
  ElementChanges& changes = delta.OfKind(kind);
  std::vector<Slot> slots = RandomSlots(rng, 2 * size);
  changes.removed = TakeHalf(slots);
  const std::vector<ElementType> types = TypesOf(kind);
  const bool mixed = rng() % 2;
  Slot centre = RandomSlot(rng, kNoSlot - 3 * size - 100);
  for (Slot slot : slots) {
    const ElementType type = types[mixed ? rng() % types.size() : 0];
    std::vector<Slot> vertices(NumVertices(type));
    for (Slot& v : vertices) v = rng() % 50 == 0 ? RandomSlot(rng, kNoSlot) : centre + RandomSlot(rng, 20);
    AddElement(slot, type, vertices, delta);
    centre += rng() % 3;
  }
}

template <typename Float>
void FillWithCoordinates(Rng& rng, std::vector<uint8_t>& rows) {
  constexpr double kLargest = std::numeric_limits<Float>::max();
  for (size_t i = 0; i < rows.size(); i += sizeof(Float)) {
    const auto value = static_cast<Float>(std::clamp(RandomCoordinate(rng), -kLargest, kLargest));
    std::memcpy(&rows[i], &value, sizeof(value));
  }
}

std::vector<uint8_t> RandomRows(Rng& rng, const AttributeSpec& spec, size_t count) {
  std::vector<uint8_t> rows(count * spec.row_bytes());
  for (uint8_t& byte : rows) byte = static_cast<uint8_t>(rng());
  if (spec.type == AttributeType::kFloat64) FillWithCoordinates<double>(rng, rows);
  if (spec.type == AttributeType::kFloat32) FillWithCoordinates<float>(rng, rows);
  return rows;
}

AttributeChanges RandomAttribute(Rng& rng, int size) {
  AttributeChanges changes;
  changes.spec.name = "column_" + std::to_string(rng() % 1000);
  changes.spec.kind = kEntityKinds[rng() % kNumEntityKinds];
  changes.spec.type = static_cast<AttributeType>(1 + rng() % 5);
  changes.spec.components = 1 + rng() % kMaxAttributeComponents;
  changes.spec.policy = static_cast<AttributePolicy>(rng() % 5);
  if (rng() % 2) changes.spec.default_row = RandomRows(rng, changes.spec, 1);
  changes.slots = RandomSlots(rng, size);
  changes.rows = RandomRows(rng, changes.spec, changes.slots.size());
  return changes;
}

NamedDelta OneOfType(ElementType type) {
  Delta delta;
  std::vector<Slot> vertices;
  for (int i = 0; i < NumVertices(type); ++i) vertices.push_back(10 + 3 * i);
  AddElement(5, type, vertices, delta);
  return {"one " + std::string(ElementTypeName(type)), delta};
}

Delta RemovedOnly() {
  Delta delta;
  delta.removed_vertices = {0, 1, 7};
  delta.OfKind(EntityKind::kEdge).removed = {3};
  delta.OfKind(EntityKind::kFace).removed = {0x7ffffffe};
  delta.OfKind(EntityKind::kCell).removed = {1, 2, 3, kLastSlot};
  return delta;
}

Delta DegenerateElements() {
  Delta delta;
  AddElement(0, ElementType::kTetrahedron, {4, 4, 4, 4}, delta);
  AddElement(1, ElementType::kTetrahedron, {4, 5, 4, 5}, delta);
  AddElement(2, ElementType::kHexahedron, {1, 1, 2, 2, 3, 3, 1, 1}, delta);
  AddElement(0, ElementType::kTriangle, {9, 9, 8}, delta);
  AddElement(0, ElementType::kWireEdge, {7, 7}, delta);
  return delta;
}

Delta LargestSlots() {
  Delta delta;
  delta.vertex_slots = {0, 0x7ffffffe, 0x7fffffff, kLastSlot};
  delta.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  AddElement(0x7ffffffe, ElementType::kTetrahedron, {0, 0x7ffffffe, 0x7fffffff, kLastSlot}, delta);
  AddElement(kLastSlot, ElementType::kTetrahedron, {kLastSlot, 0, kLastSlot - 1, 1}, delta);
  return delta;
}

Delta DanglingFacesAndWires() {
  Delta delta;
  AddElement(0, ElementType::kTetrahedron, {0, 1, 2, 3}, delta);
  AddElement(2, ElementType::kTriangle, {0, 1, 9}, delta);
  AddElement(5, ElementType::kQuad, {3, 2, 8, 7}, delta);
  AddElement(1, ElementType::kWireEdge, {3, 100}, delta);
  AddElement(4, ElementType::kWireEdge, {100, 101}, delta);
  return delta;
}

Delta MixedCells() {
  Delta delta;
  for (Slot slot = 0; slot < 12; ++slot) {
    const ElementType type = static_cast<ElementType>(4 + slot % 4);
    std::vector<Slot> vertices;
    for (int i = 0; i < NumVertices(type); ++i) vertices.push_back(2 * slot + i);
    AddElement(slot, type, vertices, delta);
  }
  return delta;
}

Delta MovedVertices() {
  Delta delta;
  delta.vertex_slots = {1, 2, 30};
  delta.positions = {{0.1, -0.0, 1e300}, {0.1, 5e-324, -1e300}, {-0.1, 0.25, 3}};
  return delta;
}

Delta WithAttributes() {
  Delta delta;
  delta.attributes.push_back({{"temperature", EntityKind::kVertex, AttributeType::kFloat64, 1}, {0, 9}, {}});
  delta.attributes.push_back({{"region", EntityKind::kCell, AttributeType::kInt32, 3}, {1}, {}});
  delta.attributes.push_back({{"empty", EntityKind::kFace, AttributeType::kInt32, 16}, {}, {}});
  for (int type = 3; type <= 5; ++type) {
    AttributeSpec spec{"type_" + std::to_string(type), EntityKind::kEdge, static_cast<AttributeType>(type), 2};
    spec.policy = static_cast<AttributePolicy>(type - 1);
    spec.default_row.assign(spec.row_bytes(), 3);
    delta.attributes.push_back({spec, {4, 5, 1000}, {}});
  }
  Rng rng(7);
  for (AttributeChanges& changes : delta.attributes) {
    changes.rows = RandomRows(rng, changes.spec, changes.slots.size());
  }
  return delta;
}

Delta ChunkOfLongerAnswer() {
  Delta delta = LargestSlots();
  delta.from_revision = 17;
  delta.to_revision = int64_t{1} << 40;
  delta.consistent = false;
  delta.checksum = {0x0123456789abcdef, 0xfedcba9876543210};
  return delta;
}

Slot LatticeSlot(int n, int x, int y, int z) { return (z * (n + 1) + y) * (n + 1) + x; }

std::vector<Slot> CubeCorners(int n, int x, int y, int z) {
  const auto at = [=](int dx, int dy, int dz) { return LatticeSlot(n, x + dx, y + dy, z + dz); };
  return {at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0),
          at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)};
}

template <typename Fn>
void ForEachCube(int n, Fn fn) {
  for (int i = 0; i < n * n * n; ++i) fn(CubeCorners(n, i % n, i / n % n, i / n / n));
}

}  // namespace

std::string CodecName(Codec codec) {
  constexpr const char* kNames[] = {"Auto", "Raw", "Zstd", "Draco"};
  return kNames[static_cast<int>(codec)];
}

std::vector<NamedDelta> SmallDeltas() {
  std::vector<NamedDelta> samples = {{"empty", {}},
                                     {"removed only", RemovedOnly()},
                                     {"degenerate elements", DegenerateElements()},
                                     {"largest slots", LargestSlots()},
                                     {"dangling faces and wires", DanglingFacesAndWires()},
                                     {"mixed cells", MixedCells()},
                                     {"moved vertices", MovedVertices()},
                                     {"attributes", WithAttributes()},
                                     {"chunk of a longer answer", ChunkOfLongerAnswer()}};
  for (ElementType type : kElementTypes) samples.push_back(OneOfType(type));
  return samples;
}

Delta RandomDelta(Rng& rng, int size) {
  Delta delta;
  delta.from_revision = rng() % 1000;
  delta.to_revision = delta.from_revision + rng() % 1000;
  delta.consistent = rng() % 2;
  delta.checksum = {rng(), rng()};
  std::vector<Slot> slots = RandomSlots(rng, 2 * size);
  delta.removed_vertices = TakeHalf(slots);
  delta.vertex_slots = slots;
  for (size_t i = 0; i < slots.size(); ++i) {
    delta.positions.push_back({RandomCoordinate(rng), RandomCoordinate(rng), RandomCoordinate(rng)});
  }
  for (EntityKind kind : kElementKinds) AddRandomElements(rng, kind, size, delta);
  for (int i = rng() % 4; i > 0; --i) delta.attributes.push_back(RandomAttribute(rng, size));
  return delta;
}

Delta HexBlock(int n) {
  Delta delta;
  Slot slot = 0;
  ForEachCube(n, [&](const std::vector<Slot>& c) { AddElement(slot++, ElementType::kHexahedron, c, delta); });
  return delta;
}

Delta TetBlock(int n) {
  constexpr int kTets[6][4] = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6},
                               {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
  Delta delta;
  Slot slot = 0;
  ForEachCube(n, [&](const std::vector<Slot>& c) {
    for (const int(&t)[4] : kTets) {
      AddElement(slot++, ElementType::kTetrahedron, {c[t[0]], c[t[1]], c[t[2]], c[t[3]]}, delta);
    }
  });
  return delta;
}

bool SameBits(const Delta& a, const Delta& b) {
  return a == b && (a.positions.empty() || std::memcmp(a.positions.data(), b.positions.data(),
                                                       a.positions.size() * sizeof(Point)) == 0);
}

}  // namespace dynmesh
