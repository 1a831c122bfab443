#ifndef DYNMESH_CORE_MESH_RELATION_H_
#define DYNMESH_CORE_MESH_RELATION_H_

#include "core/mesh/ids.h"

namespace dynmesh {

/// A neighbour relation from one kind of entity to another.
struct Relation {
  EntityKind from;
  EntityKind to;

  friend constexpr bool operator==(Relation, Relation) = default;
};

/// The relations that can be stored instead of being worked out on demand (paper, section 4).
inline constexpr Relation kStorableRelations[] = {
    {EntityKind::kCell, EntityKind::kEdge}, {EntityKind::kVertex, EntityKind::kCell},
    {EntityKind::kEdge, EntityKind::kCell}, {EntityKind::kVertex, EntityKind::kFace},
    {EntityKind::kCell, EntityKind::kCell}, {EntityKind::kVertex, EntityKind::kVertex},
};
inline constexpr int kNumStorableRelations = 6;

/// Index into kStorableRelations, or kNumStorableRelations.
constexpr int StorableIndex(Relation relation) {
  int i = 0;
  while (i < kNumStorableRelations && !(kStorableRelations[i] == relation)) ++i;
  return i;
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_RELATION_H_
