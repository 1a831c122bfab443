#include "tests/bench/limit/flat_mesh.h"

#include <algorithm>
#include <utility>

namespace dynmesh::bench {
namespace {

/// A cycle of kSize vertices as lowest vertex and the rest: rotated, then reflected so that equal cycles are
/// equal.
template <int kSize>
std::array<uint32_t, kSize> Canonical(const uint32_t* cycle) {
  int lowest = 0;
  for (int k = 1; k < kSize; ++k) {
    if (cycle[k] < cycle[lowest]) lowest = k;
  }
  std::array<uint32_t, kSize> canonical;
  for (int k = 0; k < kSize; ++k) canonical[k] = cycle[(lowest + k) % kSize];
  if (canonical[1] > canonical[kSize - 1]) std::swap(canonical[1], canonical[kSize - 1]);
  return canonical;
}

/// Items keyed by kSize vertices, sorted by counting into a bucket for each lowest one; then those that are
/// equal.
template <int kSize>
class Buckets {
 public:
  using Key = std::array<uint32_t, kSize>;

  Buckets(size_t num_items, size_t num_vertices) : end_(num_vertices + 1), items_(num_items) {}

  void Count(uint32_t lowest) { ++end_[lowest + 1]; }
  void EndCount() {
    for (size_t v = 1; v < end_.size(); ++v) end_[v] += end_[v - 1];
  }
  void Put(uint32_t item, const Key& key) {
    Item& place = items_[end_[key[0]]++];
    place.item = item;
    std::copy(key.begin() + 1, key.end(), place.others.begin());
  }

  /// Calls leader(item, lowest vertex, others) for the first of equal items, then equal(item) for each of
  /// them.
  template <typename Leader, typename Equal>
  void ForEachGroup(Leader leader, Equal equal) {
    uint32_t begin = 0;
    for (uint32_t v = 0; v + 1 < end_.size(); ++v) {
      const uint32_t end = end_[v];
      uint32_t rest = end;  // [begin, rest) is what has no group yet
      while (begin < rest) rest = TakeGroup(v, begin, rest, leader, equal);
      begin = end;
    }
  }

 private:
  struct Item {
    uint32_t item;
    std::array<uint32_t, kSize - 1> others;
  };

  /// The group of the first item of [begin, end); the others close up, in order. Returns where they end.
  template <typename Leader, typename Equal>
  uint32_t TakeGroup(uint32_t lowest, uint32_t begin, uint32_t end, Leader& leader, Equal& equal) {
    const Item first = items_[begin];
    leader(first.item, lowest, first.others);
    equal(first.item);
    uint32_t kept = begin;
    for (uint32_t i = begin + 1; i < end; ++i) {
      if (SameOthers(first, items_[i])) {
        equal(items_[i].item);
      } else {
        items_[kept++] = items_[i];
      }
    }
    return kept;
  }

  /// Word by word: std::array's comparison calls memcmp.
  static bool SameOthers(const Item& a, const Item& b) {
    uint32_t difference = 0;
    for (int k = 0; k < kSize - 1; ++k) difference |= a.others[k] ^ b.others[k];
    return difference == 0;
  }

  std::vector<uint32_t> end_;
  std::vector<Item> items_;
};

/// How a stored cycle lies against another list of it: first common place and direction, as core's FaceCode.
template <int kSize>
uint8_t CodeOf(const uint32_t* stored, const uint32_t* cycle) {
  int rotation = 0;
  while (stored[rotation] != cycle[0]) ++rotation;
  const bool flipped = stored[(rotation + 1) % kSize] != cycle[1];
  return rotation | (flipped ? 4 : 0);
}

/// kFaceSize: vertices of every face; kNumFaces: faces of every cell.
template <int kFaceSize, int kNumFaces>
class Builder {
 public:
  explicit Builder(const MeshInput& input) : shape_(TemplateOf(input.type)) {
    mesh_.type = input.type;
    mesh_.points = input.points;
    FlatRows& elements = mesh_.has_cells() ? Rows(3, 0) : Rows(2, 0);
    elements.stride = input.stride();
    elements.ids.resize(input.elements.size());
    for (size_t i = 0; i < elements.ids.size(); ++i) elements.ids[i] = input.elements[i].slot();
  }

  FlatMesh Build() && {
    if (mesh_.has_cells()) FindFaces();
    FindEdges();
    Rows(0, 1) = Invert(Rows(1, 0), mesh_.num_vertices());
    return std::move(mesh_);
  }

 private:
  using FaceCycle = std::array<uint32_t, kFaceSize>;

  FlatRows& Rows(int from, int to) { return mesh_.rows[from][to]; }

  FaceCycle CycleOf(uint32_t cell, int face) const {
    const uint32_t* vertices = &mesh_.rows[3][0].ids[size_t{cell} * shape_.num_vertices];
    FaceCycle cycle;
    for (int k = 0; k < kFaceSize; ++k) cycle[k] = vertices[shape_.faces[face].vertices[k]];
    return cycle;
  }

  template <typename Fn>
  void ForEachUse(Fn fn) const {
    const uint32_t num_cells = mesh_.rows[3][0].size();
    uint32_t use = 0;
    for (uint32_t c = 0; c < num_cells; ++c) {
      for (int i = 0; i < kNumFaces; ++i) fn(use++, CycleOf(c, i));
    }
  }

  void FindFaces() {
    const size_t num_uses = Rows(3, 0).size() * kNumFaces;
    Buckets<kFaceSize> buckets(num_uses, mesh_.num_vertices());
    ForEachUse([&](uint32_t, const FaceCycle& cycle) {
      buckets.Count(*std::min_element(cycle.begin(), cycle.end()));
    });
    buckets.EndCount();
    ForEachUse(
        [&](uint32_t use, const FaceCycle& cycle) { buckets.Put(use, Canonical<kFaceSize>(cycle.data())); });
    ReserveFaces(num_uses);
    uint32_t face = 0;
    buckets.ForEachGroup([&](uint32_t use, auto&&...) { face = AddFace(use); },
                         [&](uint32_t use) { AddUse(face, use); });
    Rows(2, 3).offsets.push_back(num_uses);
  }

  void ReserveFaces(size_t num_uses) {
    Rows(3, 2).stride = kNumFaces;
    Rows(3, 2).ids.resize(num_uses);
    mesh_.face_codes.resize(num_uses);
    Rows(2, 0).stride = kFaceSize;
    Rows(2, 0).ids.reserve(num_uses / 2 * kFaceSize);
    Rows(2, 3).ids.reserve(num_uses);
    Rows(2, 3).offsets.reserve(num_uses / 2);
  }

  uint32_t AddFace(uint32_t use) {
    const FaceCycle cycle = CycleOf(use / kNumFaces, use % kNumFaces);
    Rows(2, 0).ids.insert(Rows(2, 0).ids.end(), cycle.begin(), cycle.end());
    Rows(2, 3).offsets.push_back(Rows(2, 3).ids.size());
    return Rows(2, 3).offsets.size() - 1;
  }

  void AddUse(uint32_t face, uint32_t use) {
    const uint32_t cell = use / kNumFaces;
    Rows(2, 3).ids.push_back(cell);
    Rows(3, 2).ids[use] = face;
    const FaceCycle cycle = CycleOf(cell, use % kNumFaces);
    mesh_.face_codes[use] = CodeOf<kFaceSize>(&Rows(2, 0).ids[size_t{face} * kFaceSize], cycle.data());
  }

  template <typename Fn>
  void ForEachSide(Fn fn) const {
    const std::vector<uint32_t>& cycles = mesh_.rows[2][0].ids;
    for (size_t side = 0; side < cycles.size(); side += kFaceSize) {
      for (int k = 0; k < kFaceSize; ++k) {
        const uint32_t a = cycles[side + k], b = cycles[side + (k + 1) % kFaceSize];
        fn(side + k, std::array<uint32_t, 2>{std::min(a, b), std::max(a, b)});
      }
    }
  }

  void FindEdges() {
    const size_t num_sides = Rows(2, 0).ids.size();
    Buckets<2> buckets(num_sides, mesh_.num_vertices());
    ForEachSide([&](uint32_t, const auto& ends) { buckets.Count(ends[0]); });
    buckets.EndCount();
    ForEachSide([&](uint32_t side, const auto& ends) { buckets.Put(side, ends); });
    ReserveEdges(num_sides);
    buckets.ForEachGroup([&](uint32_t, uint32_t a, const auto& others) { AddEdge(a, others[0]); },
                         [&](uint32_t side) { AddSide(side); });
    Rows(1, 2).offsets.push_back(num_sides);
  }

  void ReserveEdges(size_t num_sides) {
    Rows(2, 1).stride = kFaceSize;
    Rows(2, 1).ids.resize(num_sides);
    Rows(1, 0).stride = 2;
    Rows(1, 0).ids.reserve(num_sides / 2);
    Rows(1, 2).offsets.reserve(num_sides / 4);
    Rows(1, 2).ids.reserve(num_sides);
  }

  void AddEdge(uint32_t a, uint32_t b) {
    Rows(1, 0).ids.push_back(a);
    Rows(1, 0).ids.push_back(b);
    Rows(1, 2).offsets.push_back(Rows(1, 2).ids.size());
  }

  void AddSide(uint32_t side) {
    Rows(1, 2).ids.push_back(side / kFaceSize);
    Rows(2, 1).ids[side] = Rows(1, 2).offsets.size() - 1;
  }

  const ElementTemplate& shape_;
  FlatMesh mesh_;
};

}  // namespace

size_t FlatMesh::memory_bytes() const {
  size_t bytes = points.size() * sizeof(Point) + face_codes.size();
  for (const auto& of_kind : rows) {
    for (const FlatRows& relation : of_kind) bytes += relation.memory_bytes();
  }
  return bytes;
}

FlatMesh BuildFlatDefault(const MeshInput& input) {
  switch (input.type) {
    case ElementType::kTetrahedron:
      return Builder<3, 4>(input).Build();
    case ElementType::kHexahedron:
      return Builder<4, 6>(input).Build();
    default:
      return Builder<3, 1>(input).Build();
  }
}

}  // namespace dynmesh::bench
