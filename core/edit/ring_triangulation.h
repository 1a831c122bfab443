#ifndef DYNMESH_CORE_EDIT_RING_TRIANGULATION_H_
#define DYNMESH_CORE_EDIT_RING_TRIANGULATION_H_

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "absl/functional/function_ref.h"

namespace dynmesh {

/// Operators retriangulate rings of at most so many vertices.
inline constexpr size_t kMaxRing = 24;

/// The best triangulation of a ring of vertices, without a new one, by dynamic programming over its parts
/// (Klincsek, "Minimal triangulations of polygonal domains", 1980). Vertices are places 0, 1, ... in the
/// ring.
///
///     RingTriangulation triangulation(ring.size(), RingTriangulation::Aim::kBestWorst);
///     if (triangulation.Find(may_join, score)) triangulation.ForEach([](const Triangle& t) { ... });
///
/// Cost: O(size^3) calls of score, O(size^2) of may_join. Thread safety: that of std::vector.
class RingTriangulation {
 public:
  /// Corners i < k < j, which turn as the ring does. The parts beyond i-k and k-j are others' business.
  struct Triangle {
    size_t i, k, j;
  };
  enum class Aim {
    kBestWorst,  ///< the lowest score of a triangle is to be as high as it can
    kBestSum,    ///< the sum of all scores is; REQUIRES: none is above 0
  };

  /// A score that no triangle of the result may have.
  static constexpr double kForbidden = -std::numeric_limits<double>::infinity();

  /// REQUIRES: size >= 3.
  RingTriangulation(size_t size, Aim aim) : size_(size), aim_(aim), best_(size * size, Best{Nothing(), 0}) {}

  /// Whether there is a triangulation all of whose chords may_join(i, j), i < j, permits and whose scores are
  /// above kForbidden. 0 and size - 1 are neighbours on the ring, so their edge is no chord.
  bool Find(absl::FunctionRef<bool(size_t, size_t)> may_join,
            absl::FunctionRef<double(const Triangle&)> score) {
    for (size_t span = 2; span < size_; ++span) {
      for (size_t i = 0; i + span < size_; ++i) {
        const bool may = span + 1 == size_ || may_join(i, i + span);
        At(i, i + span) = may ? FindBetween(i, i + span, score) : Best{kForbidden, i + 1};
      }
    }
    return score_found() > kForbidden;
  }

  double score_found() const { return At(0, size_ - 1).score; }

  /// Calls fn(triangle) for each of the size - 2 triangles, that on the edge of 0 and size - 1 first.
  /// REQUIRES: Find() was true.
  template <typename Fn>
  void ForEach(Fn fn) const {
    ForEachBetween(0, size_ - 1, fn);
  }

 private:
  /// Of the polygon between two vertices of the ring and their chord.
  struct Best {
    double score;
    size_t apex;
  };

  double Nothing() const { return aim_ == Aim::kBestWorst ? std::numeric_limits<double>::infinity() : 0; }
  double Join(double a, double b) const { return aim_ == Aim::kBestWorst ? std::min(a, b) : a + b; }

  Best& At(size_t i, size_t j) { return best_[i * size_ + j]; }
  const Best& At(size_t i, size_t j) const { return best_[i * size_ + j]; }

  Best FindBetween(size_t i, size_t j, absl::FunctionRef<double(const Triangle&)> score) const {
    Best best{kForbidden, i + 1};
    for (size_t k = i + 1; k < j; ++k) {
      const double rest = Join(At(i, k).score, At(k, j).score);
      if (rest <= best.score) continue;  // one more triangle makes it no better
      const double joined = Join(rest, score({i, k, j}));
      if (joined > best.score) best = {joined, k};
    }
    return best;
  }

  template <typename Fn>
  void ForEachBetween(size_t i, size_t j, Fn& fn) const {
    if (j < i + 2) return;
    const size_t k = At(i, j).apex;
    fn(Triangle{i, k, j});
    ForEachBetween(i, k, fn);
    ForEachBetween(k, j, fn);
  }

  const size_t size_;
  const Aim aim_;
  std::vector<Best> best_;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_RING_TRIANGULATION_H_
