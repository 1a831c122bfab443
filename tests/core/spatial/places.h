#ifndef DYNMESH_TESTS_CORE_SPATIAL_PLACES_H_
#define DYNMESH_TESTS_CORE_SPATIAL_PLACES_H_

#include <random>
#include <vector>

#include "core/spatial/spatial_search.h"

/// Questions about places answered by looking at everything, and places to ask about.
namespace dynmesh::testing {

std::vector<Slot> BruteInBox(const Mesh& mesh, EntityKind kind, const Box& box);
std::vector<NearVertex> BruteNearest(const Mesh& mesh, const Point& point, size_t count);
CellId BruteFindCell(const Mesh& mesh, const Point& point);
FaceId BruteFindFace(const Mesh& mesh, const Point& point, double tolerance);
std::vector<RayHit> BruteHits(const Mesh& mesh, const Ray& ray, RayTargets targets);

/// Random places in and about the box round a mesh, some of them at its vertices and on its grid planes.
class RandomPlaces {
 public:
  RandomPlaces(const Mesh& mesh, uint32_t seed);

  Point AnyPoint();
  Box AnyBox();
  Ray AnyRay();

 private:
  int Uniform(int below) { return std::uniform_int_distribution<int>(0, below - 1)(rng_); }

  std::mt19937 rng_;
  std::vector<Point> vertices_;
  Box box_;
};

/// Fails the test unless indices that have caught up with `mesh` answer `n` random questions of each kind as
/// brute force does. `indices` has one for each kind.
void ExpectSameAnswers(const Mesh& mesh, const std::vector<SpatialIndex>& indices, uint32_t seed, int n);

std::vector<SpatialIndex> NewIndices();
void CatchUpAll(const Mesh& mesh, std::vector<SpatialIndex>& indices);

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_CORE_SPATIAL_PLACES_H_
