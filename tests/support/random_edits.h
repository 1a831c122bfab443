#ifndef DYNMESH_TESTS_SUPPORT_RANDOM_EDITS_H_
#define DYNMESH_TESTS_SUPPORT_RANDOM_EDITS_H_

#include <random>
#include <vector>

#include "core/mesh/mesh.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {

struct RandomEditOptions {
  std::vector<ElementType> types = {std::begin(kElementTypes), std::end(kElementTypes)};
  int max_vertices = 14;        ///< few vertices: much sharing, many non-manifold and duplicate entities
  double degenerate_rate = 0.1;
  double duplicate_rate = 0.1;
  bool attributes = false;
};

/// Random primitive edits on a mesh, told to a model too. Keeps `mesh` and `model` as members' references.
class RandomEditor {
 public:
  RandomEditor(Mesh& mesh, ElementModel& model, uint32_t seed, RandomEditOptions options = {});

  /// One edit, accepted or (rarely, and then checked) refused.
  void Edit();

  std::mt19937& rng() { return rng_; }
  int Uniform(int below) { return std::uniform_int_distribution<int>(0, below - 1)(rng_); }

 private:
  void AddVertex();
  void RemoveVertex();
  void MoveVertex();
  void AddElement();
  void AddDuplicate();
  void RemoveElement();
  void SetAttribute();
  std::vector<uint8_t> AnyRow(const AttributeSpec& spec);
  VertexId AnyVertex();
  Point AnyPoint();
  void Put(ElementType type, const std::vector<VertexId>& vertices);

  Mesh& mesh_;
  ElementModel& model_;
  std::mt19937 rng_;
  RandomEditOptions options_;
};

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SUPPORT_RANDOM_EDITS_H_
