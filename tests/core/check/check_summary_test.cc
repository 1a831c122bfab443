#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "core/check/incidence.h"
#include "core/check/pieces.h"
#include "core/check/summary.h"
#include "tests/support/count_down.h"
#include "tests/support/meshes.h"
#include "tests/support/random_edits.h"

namespace dynmesh {
namespace {

using ::dynmesh::testing::Add;
using ::dynmesh::testing::AddVertices;
using ::dynmesh::testing::Book;
using ::dynmesh::testing::BowTie;
using ::dynmesh::testing::Commit;
using ::dynmesh::testing::CountDown;
using ::dynmesh::testing::Disk;
using ::dynmesh::testing::ElementModel;
using ::dynmesh::testing::HexGrid;
using ::dynmesh::testing::HybridOfFour;
using ::dynmesh::testing::MoebiusStrip;
using ::dynmesh::testing::Octahedron;
using ::dynmesh::testing::OneTet;
using ::dynmesh::testing::RandomEditor;
using ::dynmesh::testing::TetGrid;
using ::dynmesh::testing::TetWithDanglers;

MeshTopology TopologyOf(const Mesh& mesh) {
  const auto topology = SummarizeTopology(mesh, WorkMeter::Unlimited());
  EXPECT_TRUE(topology.ok()) << topology.status();
  return *topology;
}

void ExpectSurface(const SurfaceSummary& surface, const SurfaceSummary& expected) {
  EXPECT_EQ(surface.pieces, expected.pieces);
  EXPECT_EQ(surface.non_manifold, expected.non_manifold);
  EXPECT_EQ(surface.non_orientable, expected.non_orientable);
  EXPECT_EQ(surface.holes, expected.holes);
  EXPECT_EQ(surface.genus, expected.genus);
  EXPECT_EQ(surface.euler_characteristic, expected.euler_characteristic);
}

enum class Glue { kTorus, kKleinBottle };

/// n times n quads, opposite sides glued.
Mesh Glued(Slot n, Glue glue) {
  Mesh mesh;
  AddVertices(mesh, n * n);
  const auto at = [&](Slot i, Slot j) {
    const bool turned = glue == Glue::kKleinBottle && i == n;
    return (i % n) * n + (turned ? (n - j) % n : j % n);
  };
  for (Slot i = 0; i < n; ++i) {
    for (Slot j = 0; j < n; ++j) {
      Add(mesh, ElementType::kQuad, {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  Commit(mesh);
  return mesh;
}

/// A grid of hexahedra without some of them.
Mesh WithoutCells(int nx, int ny, int nz, const std::vector<Slot>& cells) {
  Mesh mesh = HexGrid(nx, ny, nz);
  mesh.BeginBatch();
  EXPECT_TRUE(mesh.RemoveElements(EntityKind::kCell, cells).ok());
  Commit(mesh);
  return mesh;
}

TEST(SummaryTest, SurfacesAreThoseOfTheTextbook) {
  ExpectSurface(TopologyOf(Octahedron()).surface, {.pieces = 1, .euler_characteristic = 2});
  ExpectSurface(TopologyOf(Disk(6)).surface, {.pieces = 1, .holes = 1, .euler_characteristic = 1});
  ExpectSurface(TopologyOf(MoebiusStrip(5)).surface, {.pieces = 1, .non_orientable = 1, .holes = 1});
  ExpectSurface(TopologyOf(Glued(4, Glue::kTorus)).surface, {.pieces = 1, .genus = 1});
  ExpectSurface(TopologyOf(Glued(4, Glue::kKleinBottle)).surface, {.pieces = 1, .non_orientable = 1});
}

TEST(SummaryTest, ATorusWithAHoleHasAHoleAndItsHandle) {
  Mesh mesh = Glued(4, Glue::kTorus);
  mesh.BeginBatch();
  ASSERT_TRUE(mesh.RemoveElement(FaceId(5)).ok());
  Commit(mesh);
  ExpectSurface(TopologyOf(mesh).surface, {.pieces = 1, .holes = 1, .genus = 1, .euler_characteristic = -1});
}

TEST(SummaryTest, FacesThatTurnDifferentlyCanBeOrientedAllTheSame) {
  Mesh mesh;
  AddVertices(mesh, 4);
  for (auto v : {std::vector<Slot>{0, 1, 2}, {0, 1, 3}, {1, 3, 2}, {2, 0, 3}}) {
    Add(mesh, ElementType::kTriangle, {v[0], v[1], v[2]});
  }
  Commit(mesh);
  ExpectSurface(TopologyOf(mesh).surface, {.pieces = 1, .euler_characteristic = 2});
}

TEST(SummaryTest, ABookIsCutAlongItsSpineWhichIsNoHole) {
  ExpectSurface(TopologyOf(Book(3)).surface,
                {.pieces = 3, .non_manifold = 3, .holes = 3, .euler_characteristic = 3});
  Mesh closed;  // two tetrahedral surfaces that share an edge
  AddVertices(closed, 6);
  for (auto v : {std::vector<Slot>{0, 1, 2},
                 {0, 3, 1},
                 {1, 3, 2},
                 {0, 2, 3},
                 {0, 1, 4},
                 {0, 5, 1},
                 {1, 5, 4},
                 {0, 4, 5}}) {
    Add(closed, ElementType::kTriangle, {v[0], v[1], v[2]});
  }
  Commit(closed);
  const SurfaceSummary surface = TopologyOf(closed).surface;
  EXPECT_EQ(surface.pieces, 2u);
  EXPECT_EQ(surface.holes, 0u);
  EXPECT_EQ(surface.genus, 0u);
}

TEST(SummaryTest, ABowTieIsOneComponentOfTwoPieces) {
  const MeshTopology topology = TopologyOf(BowTie());
  EXPECT_EQ(topology.components, 1u);
  EXPECT_EQ(topology.surface.pieces, 2u);
  EXPECT_EQ(topology.surface.holes, 2u);
}

TEST(SummaryTest, ABlockHasOneShellAndACavityIsAnother) {
  ExpectSurface(TopologyOf(TetGrid(2, 2, 2)).shells, {.pieces = 1, .euler_characteristic = 2});
  ExpectSurface(TopologyOf(HybridOfFour()).shells, {.pieces = 1, .euler_characteristic = 2});
  const MeshTopology hollow = TopologyOf(WithoutCells(3, 3, 3, {13}));
  ExpectSurface(hollow.shells, {.pieces = 2, .euler_characteristic = 4});
  EXPECT_EQ(hollow.bodies, 1u);
  EXPECT_EQ(hollow.components, 1u);
}

TEST(SummaryTest, ABlockWithATunnelHasAHandle) {
  const MeshTopology topology = TopologyOf(WithoutCells(3, 3, 1, {4}));
  ExpectSurface(topology.shells, {.pieces = 1, .genus = 1});
  EXPECT_EQ(topology.euler_characteristic, 0);
}

TEST(SummaryTest, ComponentsAndIsolatedVerticesAreCountedApart) {
  const MeshTopology topology = TopologyOf(TetWithDanglers());
  EXPECT_EQ(topology.components, 1u);
  EXPECT_EQ(topology.isolated_vertices, 1u);
  EXPECT_EQ(topology.bodies, 1u);
  const MeshTopology apart = TopologyOf(WithoutCells(3, 1, 1, {1}));
  EXPECT_EQ(apart.components, 2u);
  EXPECT_EQ(apart.bodies, 2u);
  EXPECT_EQ(apart.shells.pieces, 2u);
  EXPECT_EQ(TopologyOf(Mesh()).components, 0u);
}

TEST(SummaryTest, ARingOfCellsClosedWithATurnIsABodyThatCannotBeOriented) {
  Mesh mesh;  // prisms on a Moebius strip of quads: each layer is the quad 2 i, 2 i + 1 times an interval
  const int n = 5;
  AddVertices(mesh, 4 * n);
  const auto corner = [&](int i, int k) { return Slot(4 * (i % n) + (i == n ? (k ^ 1) : k)); };
  for (int i = 0; i < n; ++i) {
    Add(mesh, ElementType::kHexahedron,
        {corner(i, 0), corner(i + 1, 0), corner(i + 1, 1), corner(i, 1), corner(i, 2), corner(i + 1, 2),
         corner(i + 1, 3), corner(i, 3)});
  }
  Commit(mesh);
  const MeshTopology topology = TopologyOf(mesh);
  EXPECT_EQ(topology.bodies, 1u);
  EXPECT_EQ(topology.non_orientable_bodies, 1u);
  EXPECT_EQ(topology.shells.non_orientable, 1u);  // a Klein bottle
  EXPECT_EQ(ValueOf(CheckKind::kNonOrientable, topology), 1);
}

TEST(SummaryTest, EndsWhereItsMeterSaysSo) {
  const Mesh mesh = TetGrid(3, 3, 3);
  CountDown all(1'000'000);
  ASSERT_TRUE(SummarizeTopology(mesh, all).ok());
  const int64_t steps = 1'000'000 - all.left();
  for (int64_t left = 0; left < steps; left += steps / 20) {
    CountDown meter(left);
    EXPECT_EQ(SummarizeTopology(mesh, meter).status(), CountDown::error());
    EXPECT_EQ(meter.charges_after_end(), 0);
  }
}

TEST(PiecesTest, ItemsThatAreJoinedTwiceMustAgree) {
  Pieces pieces(6);
  EXPECT_TRUE(pieces.Join(4, 5, Pieces::Turn::kOpposite));
  EXPECT_TRUE(pieces.Join(5, 3, Pieces::Turn::kOpposite));
  EXPECT_TRUE(pieces.Join(3, 4));
  EXPECT_FALSE(pieces.Join(3, 4, Pieces::Turn::kOpposite));
  EXPECT_FALSE(pieces.Join(3, 5));
  EXPECT_EQ(pieces.Find(5), 3u);
  EXPECT_EQ(pieces.num_pieces(), 4u);
}

/// Pieces of what is adjacent, by flooding.
template <typename Adjacent>
size_t CountFloods(std::set<Slot> rest, Adjacent adjacent) {
  size_t floods = 0;
  while (!rest.empty()) {
    ++floods;
    std::vector<Slot> front = {*rest.begin()};
    rest.erase(rest.begin());
    while (!front.empty()) {
      const Slot here = front.back();
      front.pop_back();
      for (auto it = rest.begin(); it != rest.end();) {
        if (!adjacent(here, *it)) {
          ++it;
          continue;
        }
        front.push_back(*it);
        it = rest.erase(it);
      }
    }
  }
  return floods;
}

void ExpectPiecesOfFlooding(const Mesh& mesh) {
  const MeshTopology topology = TopologyOf(mesh);
  std::set<Slot> joined, surface, skin;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) {
    if (!mesh.IncidentEdges(VertexId(v)).empty()) joined.insert(v);
  });
  mesh.slots(EntityKind::kFace).live().ForEach([&](Slot f) {
    if (IsSurfaceFace(mesh, FaceId(f))) surface.insert(f);
    if (mesh.IncidentCells(FaceId(f)).size() == 1 && !mesh.IsDegenerate(FaceId(f))) skin.insert(f);
  });
  EXPECT_EQ(topology.components, CountFloods(joined, [&](Slot a, Slot b) {
              return mesh.FindEdge(VertexId(a), VertexId(b)).valid();
            }));
  const auto share_manifold_edge = [&](const std::set<Slot>& members) {
    return [&](Slot a, Slot b) {
      for (EdgeId e : mesh.Edges(FaceId(a))) {
        std::multiset<Slot> here;
        for (FaceId f : mesh.IncidentFaces(e)) {
          if (members.count(f.slot())) here.insert(f.slot());
        }
        if (here == std::multiset<Slot>{a, b}) return true;
      }
      return false;
    };
  };
  EXPECT_EQ(topology.surface.pieces, CountFloods(surface, share_manifold_edge(surface)));
  EXPECT_EQ(topology.shells.pieces, CountFloods(skin, share_manifold_edge(skin)));
}

TEST(SummaryTest, PiecesAreThoseOfFloodingOnRandomMeshes) {
  for (uint32_t seed = 1; seed <= 15; ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed, {.max_vertices = 16});
    for (int round = 0; round < 4; ++round) {
      for (int edit = 0; edit < 25; ++edit) editor.Edit();
      ExpectPiecesOfFlooding(mesh);
    }
  }
}

}  // namespace
}  // namespace dynmesh
