#ifndef DYNMESH_TESTS_CORE_EDIT_BATCH_DICE_H_
#define DYNMESH_TESTS_CORE_EDIT_BATCH_DICE_H_

#include <cstdint>
#include <random>
#include <vector>

#include "core/edit/transaction.h"
#include "core/mesh/mesh.h"

namespace dynmesh::testing {

/// Draws batches of every kind of edit. Some are refused: those that remove what they have removed before.
class BatchDice {
 public:
  BatchDice(const Mesh& mesh, uint32_t seed) : mesh_(mesh), rng_(seed) {}

  int Uniform(int below) { return std::uniform_int_distribution<int>(0, below - 1)(rng_); }

  /// One call of an operator, or a small move.
  Edit AnyOperator();
  std::vector<Edit> AnyBatch();

 private:
  Edit AnyEdit();
  Edit AnyAddition();
  Edit AnyAttributeEdit();
  Slot Any(EntityKind kind);
  Slot AnyElement(EntityKind kind);
  Point AnyPoint();

  const Mesh& mesh_;
  std::mt19937 rng_;
  EntityKind kind_ = EntityKind::kCell;
};

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_CORE_EDIT_BATCH_DICE_H_
