#include "tests/bench/fixture.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "tests/bench/digest.h"

namespace dynmesh::bench {
namespace {

using Ids = std::vector<uint32_t>;

/// Renumbers flat arrays to the ids that a mesh of the same input gave its faces and edges.
class Renumbering {
 public:
  Renumbering(const Mesh& mesh, const FlatMesh& flat) {
    for (EntityKind kind : kEntityKinds) ids_[Dimension(kind)].assign(mesh.slots(kind).limit(), kNoSlot);
    for (int kind : {0, 3}) NumberAsTheyCome(ids_[kind]);
    flat.has_cells() ? MatchFaces(mesh, flat) : NumberAsTheyCome(ids_[2]);
    MatchEdges(mesh, flat);
    for (Ids& ids : ids_) CheckPermutation(ids);
  }

  FlatRows Apply(Relation relation, const FlatRows& rows) const {
    const Ids& from = ids_[Dimension(relation.from)];
    const Ids& to = ids_[Dimension(relation.to)];
    std::vector<uint32_t> row_of(from.size());
    for (uint32_t i = 0; i < from.size(); ++i) row_of[from[i]] = i;
    FlatRows renumbered;
    renumbered.stride = rows.stride;
    renumbered.ids.reserve(rows.ids.size());
    if (rows.stride == 0) renumbered.offsets.push_back(0);
    for (uint32_t i : row_of) {
      for (uint32_t id : rows.Row(i)) renumbered.ids.push_back(to[id]);
      if (rows.stride == 0) renumbered.offsets.push_back(renumbered.ids.size());
    }
    if (relation.to >= relation.from) SortRows(renumbered);
    return renumbered;
  }

 private:
  static void NumberAsTheyCome(Ids& ids) {
    for (uint32_t i = 0; i < ids.size(); ++i) ids[i] = i;
  }

  static void CheckPermutation(Ids ids) {
    std::sort(ids.begin(), ids.end());
    for (uint32_t i = 0; i < ids.size(); ++i) CheckSame(ids[i] == i, "numbering", "limit");
  }

  static void SortRows(FlatRows& rows) {
    for (size_t i = 0; i < rows.size(); ++i) {
      std::sort(rows.ids.begin() + rows.offsets[i], rows.ids.begin() + rows.offsets[i + 1]);
    }
  }

  void MatchFaces(const Mesh& mesh, const FlatMesh& flat) {
    const FlatRows& faces = flat.rows[3][2];
    CheckSame(flat.num_faces() == ids_[2].size(), "number of faces", "limit");
    for (uint32_t c = 0; c < faces.size(); ++c) {
      const auto row = mesh.Faces(CellId(c));
      for (size_t i = 0; i < row.size(); ++i) ids_[2][faces.Row(c)[i]] = row[i].face().slot();
    }
  }

  void MatchEdges(const Mesh& mesh, const FlatMesh& flat) {
    const FlatRows& edges = flat.rows[2][1];
    CheckSame(flat.num_edges() == ids_[1].size(), "number of edges", "limit");
    for (uint32_t f = 0; f < edges.size(); ++f) {
      const auto row = mesh.Edges(FaceId(ids_[2][f]));
      for (size_t i = 0; i < row.size(); ++i) ids_[1][edges.Row(f)[i]] = row[i].slot();
    }
  }

  std::array<Ids, kNumEntityKinds> ids_;
};

FlatMesh BuildFlat(const MeshInput& input, const Mesh& mesh) {
  FlatMesh flat = BuildFlatDefault(input);
  AddFlatStorable(flat);
  AddFlatAdjacent(flat);
  const Renumbering renumbering(mesh, flat);
  for (EntityKind from : kEntityKinds) {
    for (EntityKind to : kEntityKinds) {
      FlatRows& rows = flat.of({from, to});
      if (rows.size() > 0) rows = renumbering.Apply({from, to}, rows);
    }
  }
  return flat;
}

}  // namespace

void CheckSame(bool same, const char* task, const char* what) {
  if (same) return;
  std::cerr << "Not the same answer, so no figures: " << task << ", " << what << '\n';
  std::exit(1);
}

std::string NameOf(Relation relation) {
  constexpr char kLetters[] = "vefc";
  return {kLetters[Dimension(relation.from)], '_', kLetters[Dimension(relation.to)]};
}

Mesh BuildMesh(const MeshInput& input, SlotOrder order) {
  BulkOptions options;
  options.order = order;
  BulkBuilder builder(options);
  Must(builder.AddVertices(input.points));
  Must(builder.AddElements(input.type, input.elements));
  Mesh mesh = std::move(Must(std::move(builder).Finish()).mesh);
  Must(mesh.Commit());
  return mesh;
}

Fixture::Fixture(MeshInput mesh_input)
    : input(std::move(mesh_input)),
      mesh(BuildMesh(input)),
      stored(mesh.Clone()),
      flat(BuildFlat(input, mesh)) {
  for (Relation relation : kStorableRelations) Must(stored.StoreRelation(relation, true));
}

}  // namespace dynmesh::bench
