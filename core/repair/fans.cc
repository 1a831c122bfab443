#include "core/repair/fans.h"

#include <algorithm>

#include "core/edit/star.h"

namespace dynmesh {
namespace {

/// Numbers that are joined to sets, each known by its lowest member.
class DisjointSets {
 public:
  explicit DisjointSets(size_t size) : parents_(size) {
    for (uint32_t i = 0; i < size; ++i) parents_[i] = i;
  }

  uint32_t Find(uint32_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }

  void Join(uint32_t a, uint32_t b) {
    a = Find(a);
    b = Find(b);
    parents_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<uint32_t> parents_;
};

/// Joins the elements of one star. Elements are numbered cells first, then faces, then wires.
class FanFinder {
 public:
  FanFinder(const Mesh& mesh, VertexId v, Star star)
      : mesh_(mesh),
        edges_(mesh.IncidentEdges(v).begin(), mesh.IncidentEdges(v).end()),
        star_(std::move(star)),
        num_faces_end_(star_.cells.size() + star_.faces.size()),
        sets_(num_faces_end_ + star_.wires.size()) {
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  }

  std::vector<std::vector<EntityId>> Find() {
    for (EdgeId e : edges_) JoinAcross(e);
    for (EdgeId e : edges_) JoinToCells(e);
    for (EdgeId e : edges_) JoinWire(e);
    return Collect();
  }

 private:
  template <typename Ids>
  static uint32_t PlaceOf(const Ids& sorted, typename Ids::value_type id) {
    return std::lower_bound(sorted.begin(), sorted.end(), id) - sorted.begin();
  }
  uint32_t Number(CellId c) const { return PlaceOf(star_.cells, c); }
  uint32_t Number(FaceId f) const { return star_.cells.size() + PlaceOf(star_.faces, f); }
  uint32_t Number(EdgeId e) const { return num_faces_end_ + PlaceOf(star_.wires, e); }

  /// Sets are known by their lowest numbers, and cells have the lowest.
  bool HasCells(FaceId f) { return sets_.Find(Number(f)) < star_.cells.size(); }

  void JoinAcross(EdgeId e) {
    FaceId pair[2];
    int count = 0;
    for (FaceId f : mesh_.IncidentFaces(e)) {
      const auto cells = mesh_.IncidentCells(f);
      if (cells.size() == 2) sets_.Join(Number(cells[0]), Number(cells[1]));
      if (!mesh_.IsElement(f)) continue;
      if (!cells.empty()) sets_.Join(Number(f), Number(*std::min_element(cells.begin(), cells.end())));
      if (count < 2) pair[count] = f;
      ++count;
    }
    if (count == 2) sets_.Join(Number(pair[0]), Number(pair[1]));
  }

  CellId LowestCellAt(EdgeId e) const {
    CellId lowest;  // invalid ids are the highest
    for (FaceId f : mesh_.IncidentFaces(e)) {
      for (CellId c : mesh_.IncidentCells(f)) lowest = std::min(lowest, c);
    }
    return lowest;
  }

  /// Fans of faces alone go with the cells at the first edge where there are some.
  void JoinToCells(EdgeId e) {
    const CellId c = LowestCellAt(e);
    if (!c.valid()) return;
    for (FaceId f : mesh_.IncidentFaces(e)) {
      if (mesh_.IsElement(f) && !HasCells(f)) sets_.Join(Number(f), Number(c));
    }
  }

  void JoinWire(EdgeId e) {
    if (!mesh_.IsElement(e)) return;
    FaceId face;
    for (FaceId f : mesh_.IncidentFaces(e)) {
      if (mesh_.IsElement(f)) face = std::min(face, f);
    }
    if (const CellId c = LowestCellAt(e); c.valid()) {
      sets_.Join(Number(e), Number(c));
    } else if (face.valid()) {
      sets_.Join(Number(e), Number(face));
    }
  }

  EntityId Element(uint32_t number) const {
    if (number < star_.cells.size()) return star_.cells[number];
    if (number < num_faces_end_) return star_.faces[number - star_.cells.size()];
    return star_.wires[number - num_faces_end_];
  }

  std::vector<std::vector<EntityId>> Collect() {
    std::vector<std::vector<EntityId>> fans;
    std::vector<uint32_t> fan_of(num_faces_end_);
    for (uint32_t i = 0; i < num_faces_end_ + star_.wires.size(); ++i) {
      const uint32_t first = sets_.Find(i);
      if (first >= num_faces_end_) continue;  // a wire by itself
      if (first == i) {
        fan_of[i] = fans.size();
        fans.emplace_back();
      }
      fans[fan_of[first]].push_back(Element(i));
    }
    return fans;
  }

  const Mesh& mesh_;
  std::vector<EdgeId> edges_;
  const Star star_;
  const size_t num_faces_end_;
  DisjointSets sets_;
};

}  // namespace

Fans FansAt(const Mesh& mesh, VertexId v) {
  Star star = StarOf(mesh, v);
  Fans result;
  result.work = 3 * star.work;
  result.fans = FanFinder(mesh, v, std::move(star)).Find();
  return result;
}

}  // namespace dynmesh
