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

/// Everything below, above and beside each entity, found by comparing vertices only.
class Oracle {
 public:
  Oracle(const Mesh& mesh, const ElementModel& model) : mesh_(mesh) {
    for (const auto& [v, position] : model.vertices) entities_[0].push_back(v.slot());
    for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
      mesh.slots(kind).live().ForEach([&](Slot slot) { AddEntity({kind, slot}); });
    }
    for (EntityKind from : kEntityKinds) {
      for (Slot slot : entities_[Dimension(from)]) AddBelow({from, slot});
    }
  }

  std::set<Slot> Neighbors(EntityId id, EntityKind to) const {
    if (to < id.kind) return Distinct(Uses(id, to));
    if (to > id.kind) return Distinct(Users(id, to));
    const EntityKind through = kEntityKinds[id.kind == EntityKind::kVertex ? 1 : Dimension(id.kind) - 1];
    std::set<Slot> result;
    for (Slot slot : through > id.kind ? Users(id, through) : Uses(id, through)) {
      const EntityId between(through, slot);
      const auto& beside = through > id.kind ? Uses(between, to) : Users(between, to);
      result.insert(beside.begin(), beside.end());
    }
    result.erase(id.slot);
    return result;
  }

  std::set<Slot> Boundary(EntityKind kind) const {
    std::set<Slot> faces, edges, vertices;
    for (Slot f : entities_[2]) {
      const EntityId face(EntityKind::kFace, f);
      if (Users(face, EntityKind::kCell).size() != 1) continue;
      faces.insert(f);
      for (Slot e : Uses(face, EntityKind::kEdge)) edges.insert(e);
    }
    for (Slot e : entities_[1]) {
      if (Users({EntityKind::kEdge, e}, EntityKind::kFace).size() == 1) edges.insert(e);
    }
    for (Slot e : edges) {
      for (Slot v : Uses({EntityKind::kEdge, e}, EntityKind::kVertex)) vertices.insert(v);
    }
    return kind == EntityKind::kVertex ? vertices : kind == EntityKind::kEdge ? edges : faces;
  }

  const std::vector<Slot>& entities(EntityKind kind) const { return entities_[Dimension(kind)]; }

 private:
  /// Slots by entity; one that is used twice stands there twice.
  using Table = std::map<Slot, std::vector<Slot>>;
  using Tables = std::array<std::array<Table, kNumEntityKinds>, kNumEntityKinds>;

  void AddEntity(EntityId id) {
    entities_[Dimension(id.kind)].push_back(id.slot);
    if (id.kind == EntityKind::kCell || mesh_.IsDuplicate(id)) return;
    const auto vertices = mesh_.VerticesOf(id);
    primaries_[Dimension(id.kind)][KeyOfCycle({vertices.begin(), vertices.end()})] = id.slot;
  }

  /// Lower entities, through primaries, and the way back.
  void AddBelow(EntityId id) {
    if (id.kind == EntityKind::kVertex) return;
    const auto vertices = mesh_.VerticesOf(id);
    const ElementType type = mesh_.Type(id);
    for (VertexId v : vertices) AddUse(id, {EntityKind::kVertex, v.slot()});
    if (id.kind == EntityKind::kEdge) return;
    for (const Key& key : EdgeKeys(type, vertices)) AddUse(id, {EntityKind::kEdge, primaries_[1].at(key)});
    if (id.kind == EntityKind::kFace) return;
    for (const Key& key : FaceKeys(type, vertices)) AddUse(id, {EntityKind::kFace, primaries_[2].at(key)});
  }

  void AddUse(EntityId user, EntityId used) {
    uses_[Dimension(user.kind)][Dimension(used.kind)][user.slot].push_back(used.slot);
    users_[Dimension(used.kind)][Dimension(user.kind)][used.slot].push_back(user.slot);
  }

  static const std::vector<Slot>& Find(const Tables& tables, EntityId id, EntityKind to) {
    static const std::vector<Slot> none;
    const Table& table = tables[Dimension(id.kind)][Dimension(to)];
    const auto found = table.find(id.slot);
    return found == table.end() ? none : found->second;
  }

  const std::vector<Slot>& Uses(EntityId id, EntityKind lower) const { return Find(uses_, id, lower); }
  const std::vector<Slot>& Users(EntityId id, EntityKind higher) const { return Find(users_, id, higher); }

  static std::set<Slot> Distinct(const std::vector<Slot>& slots) { return {slots.begin(), slots.end()}; }

  const Mesh& mesh_;
  std::array<std::vector<Slot>, kNumEntityKinds> entities_;
  std::array<std::map<Key, Slot>, kNumEntityKinds> primaries_;
  Tables uses_;
  Tables users_;
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

void ExpectSameRelation(const Mesh& mesh, const Oracle& oracle, Relation relation) {
  for (Slot slot : oracle.entities(relation.from)) {
    std::vector<Slot> actual;
    AppendNeighbors(mesh, relation, slot, actual);
    const std::set<Slot> actual_set(actual.begin(), actual.end());
    EXPECT_EQ(actual_set, oracle.Neighbors({relation.from, slot}, relation.to))
        << EntityKindName(relation.from) << " " << slot << " -> " << EntityKindName(relation.to);
    if (relation.to < relation.from) continue;
    EXPECT_EQ(actual, std::vector<Slot>(actual_set.begin(), actual_set.end()));
  }
}

void ExpectSameRelations(const Mesh& mesh, const Oracle& oracle) {
  for (EntityKind from : kEntityKinds) {
    for (EntityKind to : kEntityKinds) ExpectSameRelation(mesh, oracle, {from, to});
  }
}

void ExpectSameBoundary(const Mesh& mesh, const Oracle& oracle) {
  for (EntityKind kind : {EntityKind::kVertex, EntityKind::kEdge, EntityKind::kFace}) {
    std::set<Slot> actual;
    mesh.Boundary(kind).ForEach([&](Slot slot) { actual.insert(slot); });
    EXPECT_EQ(actual, oracle.Boundary(kind)) << EntityKindName(kind);
  }
}

void AppendEntity(const Mesh& mesh, EntityId id, std::string& text) {
  if (id.kind == EntityKind::kVertex) {
    for (double x : mesh.Position(VertexId(id.slot))) absl::StrAppend(&text, " ", x);
  } else {
    absl::StrAppend(&text, " element ", mesh.IsElement(id), " duplicate ", mesh.IsDuplicate(id), " vertices");
    for (VertexId v : mesh.VerticesOf(id)) absl::StrAppend(&text, " ", v.slot());
  }
  for (EntityKind to : kEntityKinds) {
    std::vector<Slot> neighbors;
    AppendNeighbors(mesh, {id.kind, to}, id.slot, neighbors);
    absl::StrAppend(&text, " ->", EntityKindName(to));
    for (Slot neighbor : neighbors) absl::StrAppend(&text, " ", neighbor);
  }
}

void AppendRow(const AttributeColumn& column, Slot slot, std::string& text) {
  for (uint8_t byte : column.Row(slot)) absl::StrAppend(&text, " ", int{byte});
  absl::StrAppend(&text, "\n");
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
      absl::StrAppend(&text, "  ", slot, " live ", mesh.IsLive(id), " born ", mesh.slots(kind).Born(slot),
                      " changed ", mesh.changed(kind).At(slot), " boundary ", mesh.IsOnBoundary(id));
      if (mesh.IsLive(id)) AppendEntity(mesh, id, text);
      absl::StrAppend(&text, "\n");
    }
  }
  for (const AttributeColumn& column : mesh.attributes()) {
    absl::StrAppend(&text, "attribute ", column.spec().name, "\n");
    for (Slot slot = 0; slot < mesh.slots(column.spec().kind).limit(); ++slot) {
      absl::StrAppend(&text, "  ", column.stamps().At(slot));
      AppendRow(column, slot, text);
    }
  }
  return text;
}

std::string DescribeContent(const Mesh& mesh, size_t num_columns) {
  std::string text =
      absl::StrCat("checksum ", mesh.checksum().topology, " ", mesh.checksum().geometry, "\n");
  for (EntityKind kind : kEntityKinds) {
    absl::StrAppend(&text, EntityKindName(kind), " elements ", mesh.NumElements(kind), "\n");
    mesh.slots(kind).live().ForEach([&](Slot slot) {
      absl::StrAppend(&text, "  ", slot, " boundary ", mesh.IsOnBoundary({kind, slot}));
      AppendEntity(mesh, {kind, slot}, text);
      absl::StrAppend(&text, "\n");
    });
  }
  for (size_t i = 0; i < num_columns; ++i) {
    const AttributeColumn& column = mesh.attributes()[i];
    absl::StrAppend(&text, "attribute ", column.spec().name, "\n");
    mesh.slots(column.spec().kind).live().ForEach([&](Slot slot) {
      absl::StrAppend(&text, "  ", slot);
      AppendRow(column, slot, text);
    });
  }
  return text;
}

}  // namespace dynmesh::testing
