#include <algorithm>
#include <array>
#include <boost/unordered_map.hpp>
#include <utility>

#include "tests/bench/peers/cgal_tds3.h"

namespace dynmesh::bench {
namespace {

using Tds = CgalTds3::Tds;
using FacetKey = std::array<uint32_t, 3>;  ///< indices of its vertices, ascending; 0 is the vertex outside

struct Facet {
  FacetKey key;
  Tds::Cell_handle cell;
  int index;
};

uint32_t IndexOf(Tds::Vertex_handle v) { return v->info() + 1; }

Facet FacetOf(Tds::Cell_handle cell, int index) {
  FacetKey key = {IndexOf(cell->vertex((index + 1) & 3)), IndexOf(cell->vertex((index + 2) & 3)),
                  IndexOf(cell->vertex((index + 3) & 3))};
  std::sort(key.begin(), key.end());
  return {key, cell, index};
}

/// Joins facets that meet, in buckets of their lowest vertex; returns those without a partner.
class SortingMatcher {
 public:
  explicit SortingMatcher(size_t num_vertices) : end_(num_vertices + 1) {}

  void Add(const Facet& facet) { facets_.push_back(facet); }

  std::vector<Facet> Match(Tds& tds) {
    Sort();
    std::vector<Facet> single;
    size_t begin = 0;
    for (size_t end : end_) {
      MatchBucket(tds, begin, end, single);
      begin = end;
    }
    return single;
  }

 private:
  void Sort() {
    for (const Facet& facet : facets_) ++end_[facet.key[0]];
    size_t sum = 0;
    for (size_t& place : end_) sum += std::exchange(place, sum);
    std::vector<Facet> sorted(facets_.size());
    for (const Facet& facet : facets_) sorted[end_[facet.key[0]]++] = facet;
    facets_ = std::move(sorted);
  }

  void MatchBucket(Tds& tds, size_t begin, size_t end, std::vector<Facet>& single) {
    std::sort(facets_.begin() + begin, facets_.begin() + end,
              [](const Facet& a, const Facet& b) { return a.key < b.key; });
    for (size_t i = begin; i < end; ++i) {
      if (i + 1 == end || facets_[i].key != facets_[i + 1].key) {
        single.push_back(facets_[i]);
        continue;
      }
      tds.set_adjacency(facets_[i].cell, facets_[i].index, facets_[i + 1].cell, facets_[i + 1].index);
      ++i;
    }
  }

  std::vector<size_t> end_;
  std::vector<Facet> facets_;
};

class HashingMatcher {
 public:
  explicit HashingMatcher(size_t) {}

  void Add(const Facet& facet) { facets_[facet.key].push_back(facet); }

  std::vector<Facet> Match(Tds& tds) {
    std::vector<Facet> single;
    for (const auto& [key, pair] : facets_) {
      if (pair.size() == 1) single.push_back(pair[0]);
      if (pair.size() > 1) tds.set_adjacency(pair[0].cell, pair[0].index, pair[1].cell, pair[1].index);
    }
    return single;
  }

 private:
  boost::unordered_map<FacetKey, std::vector<Facet>> facets_;
};

void AddVertices(const MeshInput& input, CgalTds3& peer) {
  peer.tds.set_dimension(3);
  peer.outside = peer.tds.create_vertex();
  peer.outside->info() = kNoSlot;
  peer.vertices.reserve(input.points.size());
  for (const Point& point : input.points) {
    peer.vertices.push_back(peer.tds.create_vertex());
    peer.vertices.back()->set_point({point[0], point[1], point[2]});
    peer.vertices.back()->info() = peer.vertices.size() - 1;
  }
}

template <typename Matcher>
void AddCells(const MeshInput& input, CgalTds3& peer, Matcher& matcher) {
  peer.cells.reserve(input.num_elements());
  for (size_t i = 0; i < input.elements.size(); i += 4) {
    std::array<Tds::Vertex_handle, 4> v;
    for (int k = 0; k < 4; ++k) v[k] = peer.vertices[input.elements[i + k].slot()];
    const auto cell = peer.tds.create_cell(v[0], v[1], v[2], v[3]);
    cell->info() = peer.cells.size();
    for (int k = 0; k < 4; ++k) v[k]->set_cell(cell);
    for (int k = 0; k < 4; ++k) matcher.Add(FacetOf(cell, k));
    peer.cells.push_back(cell);
  }
}

/// A cell outside for each facet of the boundary, so that every cell has four neighbours.
template <typename Matcher>
void CloseBoundary(const std::vector<Facet>& boundary, CgalTds3& peer, Matcher matcher) {
  for (const Facet& facet : boundary) {
    std::array<Tds::Vertex_handle, 4> v;
    for (int k = 0; k < 4; ++k) v[k] = facet.cell->vertex(k);
    v[facet.index] = peer.outside;
    std::swap(v[(facet.index + 1) & 3], v[(facet.index + 2) & 3]);
    const auto cell = peer.tds.create_cell(v[0], v[1], v[2], v[3]);
    cell->info() = kNoSlot;
    peer.outside->set_cell(cell);
    peer.tds.set_adjacency(facet.cell, facet.index, cell, facet.index);
    for (int k = 1; k < 4; ++k) matcher.Add(FacetOf(cell, (facet.index + k) & 3));
  }
  matcher.Match(peer.tds);
}

template <typename Matcher>
std::unique_ptr<CgalTds3> Build(const MeshInput& input) {
  auto peer = std::make_unique<CgalTds3>();
  AddVertices(input, *peer);
  Matcher matcher(input.points.size() + 1);
  AddCells(input, *peer, matcher);
  CloseBoundary(matcher.Match(peer->tds), *peer, Matcher(input.points.size() + 1));
  return peer;
}

}  // namespace

std::unique_ptr<CgalTds3> BuildCgalTds3(const MeshInput& input) { return Build<SortingMatcher>(input); }

std::unique_ptr<CgalTds3> BuildCgalTds3ByHash(const MeshInput& input) { return Build<HashingMatcher>(input); }

}  // namespace dynmesh::bench
