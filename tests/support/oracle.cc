#include "tests/support/oracle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "absl/strings/str_cat.h"
#include "core/mesh/relations.h"
#include "core/mesh/validate.h"

namespace dynmesh::testing {
namespace {

using Key = std::vector<VertexId>;

/// The smallest of all rotations and reflections of a cycle (for an edge: the sorted pair).
Key KeyOfCycle(Key cycle) {
  Key best = cycle;
  for (int reflected = 0; reflected < 2; ++reflected) {
    for (size_t rotation = 0; rotation < cycle.size(); ++rotation) {
      std::rotate(cycle.begin(), cycle.begin() + 1, cycle.end());
      best = std::min(best, cycle);
    }
    std::reverse(cycle.begin(), cycle.end());
  }
  return best;
}

std::vector<Key> EdgeKeys(ElementType type, absl::Span<const VertexId> v) {
  std::vector<Key> keys;
  const ElementTemplate& shape = TemplateOf(type);
  for (int e = 0; e < shape.num_edges; ++e) {
    keys.push_back(KeyOfCycle({v[shape.edges[e].vertices[0]], v[shape.edges[e].vertices[1]]}));
  }
  return keys;
}

std::vector<Key> FaceKeys(ElementType type, absl::Span<const VertexId> v) {
  std::vector<Key> keys;
  const ElementTemplate& shape = TemplateOf(type);
  for (int i = 0; i < shape.num_faces; ++i) {
    Key key;
    for (int k = 0; k < shape.faces[i].size; ++k) key.push_back(v[shape.faces[i].vertices[k]]);
    keys.push_back(KeyOfCycle(key));
  }
  return keys;
}

/// For each vertex cycle that anything uses, how many elements stand there.
std::map<Key, int> ElementsByCycle(const ElementModel& model, EntityKind kind) {
  std::map<Key, int> elements;
  for (const auto& [id, element] : model.elements) {
    const auto keys = kind == EntityKind::kEdge ? EdgeKeys(element.type, element.vertices)
                                                : FaceKeys(element.type, element.vertices);
    for (const Key& key : keys) elements[key] += id.kind == kind;
  }
  return elements;
}

/// Everything below and beside each entity, found by comparing vertices only.
class Oracle {
 public:
  Oracle(const Mesh& mesh, const ElementModel& model) : mesh_(mesh) {
    for (const auto& [v, position] : model.vertices) entities_[0].push_back(v.slot());
    for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
      mesh.slots(kind).live().ForEach([&](Slot slot) { AddEntity({kind, slot}); });
    }
  }

  /// Ids of dimension `to` below `id` (or itself), through primaries.
  std::set<Slot> Below(EntityId id, EntityKind to) const {
    if (id.kind == to) return {id.slot};
    std::set<Slot> below;
    const auto vertices = mesh_.VerticesOf(id);
    const ElementType type = mesh_.Type(id);
    if (to == EntityKind::kVertex) {
      for (VertexId v : vertices) below.insert(v.slot());
    } else {
      for (const Key& key : to == EntityKind::kEdge ? EdgeKeys(type, vertices) : FaceKeys(type, vertices)) {
        below.insert(primaries_[Dimension(to)].at(key));
      }
    }
    return below;
  }

  std::set<Slot> Neighbors(EntityId id, EntityKind to) const {
    if (to < id.kind) return Below(id, to);
    std::set<Slot> result;
    if (to > id.kind) {
      for (Slot slot : entities_[Dimension(to)]) {
        if (Below({to, slot}, id.kind).count(id.slot)) result.insert(slot);
      }
      return result;
    }
    for (Slot slot : entities_[Dimension(to)]) {
      if (slot != id.slot && Adjacent(id, {to, slot})) result.insert(slot);
    }
    return result;
  }

  std::set<Slot> Boundary(EntityKind kind) const {
    std::set<Slot> faces, edges, vertices;
    for (Slot f : entities_[2]) {
      if (Uses(EntityKind::kCell, {EntityKind::kFace, f}) != 1) continue;
      faces.insert(f);
      for (Slot e : Below({EntityKind::kFace, f}, EntityKind::kEdge)) edges.insert(e);
    }
    for (Slot e : entities_[1]) {
      if (Uses(EntityKind::kFace, {EntityKind::kEdge, e}) == 1) edges.insert(e);
    }
    for (Slot e : edges) {
      for (Slot v : Below({EntityKind::kEdge, e}, EntityKind::kVertex)) vertices.insert(v);
    }
    return kind == EntityKind::kVertex ? vertices : kind == EntityKind::kEdge ? edges : faces;
  }

  const std::vector<Slot>& entities(EntityKind kind) const { return entities_[Dimension(kind)]; }

 private:
  void AddEntity(EntityId id) {
    entities_[Dimension(id.kind)].push_back(id.slot);
    if (id.kind == EntityKind::kCell || mesh_.IsDuplicate(id)) return;
    const auto vertices = mesh_.VerticesOf(id);
    primaries_[Dimension(id.kind)][KeyOfCycle({vertices.begin(), vertices.end()})] = id.slot;
  }

  bool Adjacent(EntityId a, EntityId b) const {
    if (a.kind == EntityKind::kVertex) {
      return std::any_of(entities_[1].begin(), entities_[1].end(), [&](Slot e) {
        const auto ends = Below({EntityKind::kEdge, e}, EntityKind::kVertex);
        return ends.count(a.slot) && ends.count(b.slot);
      });
    }
    const EntityKind through = kEntityKinds[Dimension(a.kind) - 1];
    const auto below = Below(a, through);
    for (Slot slot : Below(b, through)) {
      if (below.count(slot)) return true;
    }
    return false;
  }

  /// How often entities of `kind` use `id`, counting repeats within one.
  int Uses(EntityKind kind, EntityId id) const {
    int uses = 0;
    for (Slot slot : entities_[Dimension(kind)]) {
      const EntityId user(kind, slot);
      const auto keys = kind == EntityKind::kFace ? EdgeKeys(mesh_.Type(user), mesh_.VerticesOf(user))
                                                  : FaceKeys(mesh_.Type(user), mesh_.VerticesOf(user));
      for (const Key& key : keys) uses += primaries_[Dimension(id.kind)].at(key) == id.slot;
    }
    return uses;
  }

  const Mesh& mesh_;
  std::array<std::vector<Slot>, kNumEntityKinds> entities_;
  std::array<std::map<Key, Slot>, kNumEntityKinds> primaries_;
};

void ExpectSameEntities(const Mesh& mesh, const ElementModel& model) {
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace}) {
    std::map<Key, int> actual;
    mesh.slots(kind).live().ForEach([&](Slot slot) {
      const auto vertices = mesh.VerticesOf({kind, slot});
      actual[KeyOfCycle({vertices.begin(), vertices.end()})] += mesh.IsElement({kind, slot});
    });
    EXPECT_EQ(actual, ElementsByCycle(model, kind)) << EntityKindName(kind);
  }
}

void ExpectSameRelations(const Mesh& mesh, const Oracle& oracle) {
  for (EntityKind from : kEntityKinds) {
    for (EntityKind to : kEntityKinds) {
      for (Slot slot : oracle.entities(from)) {
        std::vector<Slot> actual;
        AppendNeighbors(mesh, {from, to}, slot, actual);
        const std::set<Slot> actual_set(actual.begin(), actual.end());
        EXPECT_EQ(actual_set, oracle.Neighbors({from, slot}, to))
            << EntityKindName(from) << " " << slot << " -> " << EntityKindName(to);
        if (to >= from) {
          EXPECT_EQ(actual, std::vector<Slot>(actual_set.begin(), actual_set.end()));
        }
      }
    }
  }
}

void ExpectSameBoundary(const Mesh& mesh, const Oracle& oracle) {
  for (EntityKind kind : {EntityKind::kVertex, EntityKind::kEdge, EntityKind::kFace}) {
    std::set<Slot> actual;
    mesh.Boundary(kind).ForEach([&](Slot slot) { actual.insert(slot); });
    EXPECT_EQ(actual, oracle.Boundary(kind)) << EntityKindName(kind);
  }
}

}  // namespace

ElementModel ModelOf(const Mesh& mesh) {
  ElementModel model;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    model.vertices[VertexId(slot)] = mesh.Position(VertexId(slot));
  });
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    mesh.slots(kind).live().ForEach([&](Slot slot) {
      const EntityId id(kind, slot);
      const auto vertices = mesh.VerticesOf(id);
      if (mesh.IsElement(id)) model.elements[id] = {mesh.Type(id), {vertices.begin(), vertices.end()}};
    });
  }
  return model;
}

ElementModel ModelOf(const Mirror& mirror) {
  ElementModel model;
  for (Slot slot = 0; slot < mirror.SlotLimit(EntityKind::kVertex); ++slot) {
    if (mirror.HasVertex(VertexId(slot))) model.vertices[VertexId(slot)] = mirror.Position(VertexId(slot));
  }
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    for (Slot slot = 0; slot < mirror.SlotLimit(kind); ++slot) {
      const ElementType type = mirror.TypeAt(kind, slot);
      if (type == ElementType::kUnspecified) continue;
      const auto vertices = mirror.VerticesAt(kind, slot);
      model.elements[{kind, slot}] = {type, {vertices.begin(), vertices.end()}};
    }
  }
  return model;
}

void ExpectEqualsOracle(const Mesh& mesh, const ElementModel& model) {
  for (const std::string& violation : Validate(mesh)) ADD_FAILURE() << violation;
  EXPECT_TRUE(ModelOf(mesh) == model) << "the mesh holds other elements than were put in";
  if (::testing::Test::HasFailure()) return;
  ExpectSameEntities(mesh, model);
  const Oracle oracle(mesh, model);
  ExpectSameRelations(mesh, oracle);
  ExpectSameBoundary(mesh, oracle);
}

std::string Describe(const Mesh& mesh) {
  std::string text = absl::StrCat("revision ", mesh.revision(), " checksum ", mesh.checksum().topology, " ",
                                  mesh.checksum().geometry, "\n");
  for (EntityKind kind : kEntityKinds) {
    absl::StrAppend(&text, EntityKindName(kind), " limit ", mesh.slots(kind).limit(), " elements ",
                    mesh.NumElements(kind), "\n");
    for (Slot slot = 0; slot < mesh.slots(kind).limit(); ++slot) {
      const EntityId id(kind, slot);
      absl::StrAppend(&text, "  ", slot, " live ", mesh.IsLive(id), " born ", mesh.slots(kind).Born(slot), " changed ",
                      mesh.changed(kind).At(slot), " boundary ", mesh.IsOnBoundary(id));
      if (mesh.IsLive(id) && kind != EntityKind::kVertex) {
        absl::StrAppend(&text, " element ", mesh.IsElement(id), " duplicate ", mesh.IsDuplicate(id), " vertices");
        for (VertexId v : mesh.VerticesOf(id)) absl::StrAppend(&text, " ", v.slot());
      } else if (mesh.IsLive(id)) {
        for (double x : mesh.Position(VertexId(slot))) absl::StrAppend(&text, " ", x);
      }
      for (EntityKind to : kEntityKinds) {
        if (!mesh.IsLive(id)) break;
        std::vector<Slot> neighbors;
        AppendNeighbors(mesh, {kind, to}, slot, neighbors);
        absl::StrAppend(&text, " ->", EntityKindName(to));
        for (Slot neighbor : neighbors) absl::StrAppend(&text, " ", neighbor);
      }
      absl::StrAppend(&text, "\n");
    }
  }
  for (const AttributeColumn& column : mesh.attributes()) {
    absl::StrAppend(&text, "attribute ", column.spec().name, "\n");
    for (Slot slot = 0; slot < mesh.slots(column.spec().kind).limit(); ++slot) {
      absl::StrAppend(&text, "  ", column.stamps().At(slot));
      for (uint8_t byte : column.Row(slot)) absl::StrAppend(&text, " ", int{byte});
      absl::StrAppend(&text, "\n");
    }
  }
  return text;
}

}  // namespace dynmesh::testing
