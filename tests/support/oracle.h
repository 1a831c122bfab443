#ifndef DYNMESH_TESTS_SUPPORT_ORACLE_H_
#define DYNMESH_TESTS_SUPPORT_ORACLE_H_

#include <map>
#include <string>
#include <vector>

#include "core/delta/mirror.h"
#include "core/mesh/mesh.h"

namespace dynmesh::testing {

/// What a user knows of a mesh: the vertices and elements put in, by id. Nothing derived.
struct ElementModel {
  struct Element {
    ElementType type;
    std::vector<VertexId> vertices;
    friend bool operator==(const Element&, const Element&) = default;
  };
  std::map<VertexId, Point> vertices;
  std::map<EntityId, Element> elements;

  friend bool operator==(const ElementModel&, const ElementModel&) = default;
};

/// The model that a mesh, or a mirror, says it holds.
ElementModel ModelOf(const Mesh& mesh);
ElementModel ModelOf(const Mirror& mirror);

/// Fails the test unless `mesh` is sound (Validate), holds exactly `model`, has the entities that brute force
/// derives from the model alone, and answers all 16 relations and the boundary as brute force does.
void ExpectEqualsOracle(const Mesh& mesh, const ElementModel& model);

/// All that can be told of a mesh as text: entities, order of vertices, flags, stamps, sorted lists, checksum.
/// Equal texts mean equal meshes but for the order within upward lists.
std::string Describe(const Mesh& mesh);

/// The same without what undoing does not bring back: revision, stamps, and slots that nobody lives in. Of
/// attributes the first `num_columns`.
std::string DescribeContent(const Mesh& mesh, size_t num_columns);

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SUPPORT_ORACLE_H_
