#include "core/check/local_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "core/check/incidence.h"
#include "core/check/pieces.h"
#include "core/mesh/error.h"
#include "tests/support/count_down.h"
#include "tests/support/meshes.h"
#include "tests/support/random_edits.h"

namespace dynmesh {
namespace {

using ::dynmesh::testing::Add;
using ::dynmesh::testing::Book;
using ::dynmesh::testing::BowTie;
using ::dynmesh::testing::Commit;
using ::dynmesh::testing::CountDown;
using ::dynmesh::testing::ElementModel;
using ::dynmesh::testing::MoebiusStrip;
using ::dynmesh::testing::Octahedron;
using ::dynmesh::testing::OneTet;
using ::dynmesh::testing::RandomEditor;
using ::dynmesh::testing::TetWheel;
using ::dynmesh::testing::TwoHexes;

absl::optional<double> ValueAt(const Mesh& mesh, CheckKind check, EntityId id) {
  const auto value = MeasureEntity(mesh, check, id, WorkMeter::Unlimited());
  EXPECT_TRUE(value.ok()) << value.status();
  return *value;
}

/// The sorted values of a check, wherever it says something.
std::multiset<double> ValuesOf(const Mesh& mesh, CheckKind check) {
  std::multiset<double> values;
  for (EntityKind kind : kEntityKinds) {
    mesh.slots(kind).live().ForEach([&](Slot slot) {
      if (const auto value = ValueAt(mesh, check, {kind, slot})) values.insert(*value);
    });
  }
  return values;
}

std::multiset<double> Times(size_t count, double value) {
  std::multiset<double> values;
  for (size_t i = 0; i < count; ++i) values.insert(value);
  return values;
}

Mesh MakeMesh(int num_vertices) {
  Mesh mesh;
  testing::AddVertices(mesh, num_vertices);
  return mesh;
}

TEST(LocalCheckTest, EveryCheckHasANameOfItsOwnAndTakesItsDefault) {
  std::set<absl::string_view> names;
  for (CheckKind check : AllChecks()) {
    const CheckTraits& traits = TraitsOf(check);
    EXPECT_EQ(traits.check, check);
    EXPECT_TRUE(names.insert(traits.name).second) << traits.name;
    EXPECT_EQ(FindCheck(traits.name), check);
    CheckSettings settings;
    EXPECT_TRUE(settings.Set(check, {Severity::kWarn, traits.default_threshold}).ok()) << traits.name;
    EXPECT_TRUE(settings.IsOn(check));
    for (double threshold : {traits.min_threshold - 1, traits.max_threshold + 1, std::nan("")}) {
      EXPECT_EQ(ErrorReason(settings.Set(check, {Severity::kWarn, threshold})), reason::kBadArgument);
    }
  }
  EXPECT_EQ(FindCheck("no_such"), CheckKind::kUnspecified);
  EXPECT_FALSE(CheckSettings().AnyOn());
}

TEST(LocalCheckTest, WhatIsNoNumberIsBadOnEitherSide) {
  EXPECT_TRUE(Fails(CheckKind::kQuality, std::nan(""), 0.5));
  EXPECT_TRUE(Fails(CheckKind::kAspectRatio, std::nan(""), 0.5));
  EXPECT_FALSE(Fails(CheckKind::kQuality, 0.5, 0.5));
  EXPECT_FALSE(Fails(CheckKind::kAspectRatio, 0.5, 0.5));
}

TEST(LocalCheckTest, ATetrahedronThatLiesAgainstItsTemplateIsInverted) {
  Mesh mesh = OneTet();
  const double before = *ValueAt(mesh, CheckKind::kInverted, CellId(0));
  Mesh other = MakeMesh(4);
  Add(other, ElementType::kTetrahedron, {1, 0, 2, 3});
  Commit(other);
  EXPECT_NEAR(*ValueAt(other, CheckKind::kInverted, CellId(0)), -before, 0.5);
  EXPECT_LT(before * *ValueAt(other, CheckKind::kInverted, CellId(0)), 0);
}

TEST(LocalCheckTest, ABookHasAsManyFacesAtItsSpineAsPages) {
  const Mesh mesh = Book(5);
  const EdgeId spine = mesh.FindEdge(VertexId(0), VertexId(1));
  EXPECT_EQ(ValueAt(mesh, CheckKind::kEdgeFaces, spine), 5);
  EXPECT_EQ(ValuesOf(mesh, CheckKind::kEdgeFaces).count(1), 10u);
}

TEST(LocalCheckTest, FacesOfCellsAreNoSurfaceUntilTheyAreElements) {
  Mesh mesh = OneTet();
  EXPECT_TRUE(ValuesOf(mesh, CheckKind::kEdgeFaces).empty());
  mesh.BeginBatch();
  for (auto face : {std::vector<Slot>{0, 1, 2}, {0, 3, 1}}) {
    Add(mesh, ElementType::kTriangle, {face[0], face[1], face[2]});
  }
  Commit(mesh);
  EXPECT_EQ(ValueAt(mesh, CheckKind::kEdgeFaces, mesh.FindEdge(VertexId(0), VertexId(1))), 2);
}

TEST(LocalCheckTest, ThreeCellsAtAFaceAreCounted) {
  Mesh mesh = MakeMesh(6);
  for (Slot apex : {3, 4, 5}) Add(mesh, ElementType::kTetrahedron, {0, 1, 2, apex});
  Commit(mesh);
  EXPECT_EQ(ValueAt(mesh, CheckKind::kFaceCells, mesh.FindFace({VertexId(0), VertexId(1), VertexId(2)})), 3);
  EXPECT_EQ(ValueAt(mesh, CheckKind::kOrientation, mesh.FindFace({VertexId(0), VertexId(1), VertexId(2)})),
            absl::nullopt);
}

TEST(LocalCheckTest, ABowTieFallsApartAtItsVertex) {
  const Mesh mesh = BowTie();
  EXPECT_EQ(ValueAt(mesh, CheckKind::kVertexLink, VertexId(0)), 2);
  EXPECT_EQ(ValuesOf(mesh, CheckKind::kVertexLink).count(1), 6u);
}

TEST(LocalCheckTest, TetrahedraThatShareJustAnEdgeAreTwoFansThere) {
  Mesh mesh = MakeMesh(6);
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  Add(mesh, ElementType::kTetrahedron, {0, 1, 4, 5});
  Commit(mesh);
  EXPECT_EQ(ValueAt(mesh, CheckKind::kEdgeLink, mesh.FindEdge(VertexId(0), VertexId(1))), 2);
  EXPECT_EQ(ValueAt(mesh, CheckKind::kVertexLink, VertexId(0)), 2);
  EXPECT_EQ(ValueAt(mesh, CheckKind::kVertexLink, VertexId(2)), 1);
  const Mesh wheel = TetWheel(6);
  EXPECT_EQ(ValueAt(wheel, CheckKind::kEdgeLink, wheel.FindEdge(VertexId(0), VertexId(1))), 1);
}

TEST(LocalCheckTest, NeighboursThatTurnDifferentlyAreTold) {
  EXPECT_EQ(ValuesOf(Octahedron(), CheckKind::kOrientation), Times(12, 0));
  EXPECT_EQ(ValuesOf(TwoHexes(), CheckKind::kOrientation), Times(1, 0));
  EXPECT_EQ(ValuesOf(MoebiusStrip(5), CheckKind::kOrientation).count(1), 1u);
  Mesh mesh = MakeMesh(5);
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 4});
  Commit(mesh);
  EXPECT_EQ(ValuesOf(mesh, CheckKind::kOrientation), Times(1, 1));
}

TEST(LocalCheckTest, DuplicatesDegenerateElementsAndIsolatedVerticesAreTold) {
  Mesh mesh = MakeMesh(6);
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  Add(mesh, ElementType::kTetrahedron, {1, 2, 0, 3});
  Add(mesh, ElementType::kTriangle, {0, 1, 4});
  const EntityId second = Add(mesh, ElementType::kTriangle, {1, 0, 4});
  const EntityId folded = Add(mesh, ElementType::kTriangle, {0, 0, 4});
  Commit(mesh);
  EXPECT_EQ(ValuesOf(mesh, CheckKind::kDuplicate).count(1), 3u);  // both cells, one triangle
  EXPECT_EQ(ValueAt(mesh, CheckKind::kDuplicate, second), 1);
  EXPECT_EQ(ValueAt(mesh, CheckKind::kDegenerate, folded), 1);
  EXPECT_EQ(ValuesOf(mesh, CheckKind::kDegenerate).count(1), 1u);
  EXPECT_EQ(ValueAt(mesh, CheckKind::kIsolatedVertex, VertexId(5)), 1);
  EXPECT_EQ(ValuesOf(mesh, CheckKind::kIsolatedVertex).count(1), 1u);
}

TEST(LocalCheckTest, WhatCostsTooMuchIsNotGoneOnWith) {
  const Mesh mesh = TetWheel(300);
  for (CheckKind check : {CheckKind::kVertexLink, CheckKind::kIsolatedVertex}) {
    CountDown meter(0);
    EXPECT_EQ(MeasureEntity(mesh, check, VertexId(0), meter).status(), CountDown::error());
    EXPECT_EQ(meter.charges_after_end(), 0);
  }
  CountDown meter(100);
  EXPECT_FALSE(MeasureEntity(mesh, CheckKind::kVertexLink, VertexId(0), meter).ok());
}

/// A sliver that is turned over, with edges of about `size`.
Mesh Sliver(double size) {
  Mesh mesh = MakeMesh(4);
  Add(mesh, ElementType::kTetrahedron, {0, 1, 2, 3});
  const Point corners[] = {{-1, -1, -1}, {-1, 1, -1}, {1, -1, -1}, {1, 1, -0.9375}};
  for (Slot v = 0; v < 4; ++v) {
    Point p = corners[v];
    for (double& x : p) x *= size;
    EXPECT_TRUE(mesh.MoveVertex(VertexId(v), p).ok());
  }
  Commit(mesh);
  return mesh;
}

TEST(LocalCheckTest, NothingDependsOnTheSizeOfAnElementWhateverItIs) {
  const Mesh usual = Sliver(1);
  for (double size : {0x1p1023, 0x1p520, 0x1p130, 0x1p-130, 0x1p-530, 0x1p-1060}) {
    const Mesh mesh = Sliver(size);
    for (CheckKind check : AllChecks()) {
      for (EntityId id : {EntityId(CellId(0)), EntityId(FaceId(0))}) {
        if (!IsLocal(check) || !LooksAt(check, id.kind)) continue;
        EXPECT_EQ(ValueAt(mesh, check, id), ValueAt(usual, check, id))
            << TraitsOf(check).name << " at " << size;
      }
    }
  }
}

TEST(LocalCheckTest, AnElementThatIsTurnedOverIsBadWhateverItsSize) {
  for (double size : {0x1p1023, 1.0, 0x1p-1060}) {
    const Mesh mesh = Sliver(size);
    EXPECT_LT(*ValueAt(mesh, CheckKind::kInverted, CellId(0)), 0) << size;
    EXPECT_LT(*ValueAt(mesh, CheckKind::kMinDihedral, CellId(0)), 5) << size;
    EXPECT_GT(*ValueAt(mesh, CheckKind::kMaxDihedral, CellId(0)), 170) << size;
  }
}

// ---- Against brute force, which knows the vertices of elements only ----

using Cycle = std::vector<VertexId>;

Cycle Canonical(absl::Span<const VertexId> cycle) {
  const CycleKey key = CanonicalCycle(cycle);
  return Cycle(key.begin(), key.begin() + cycle.size());
}

class BruteForce {
 public:
  explicit BruteForce(const Mesh& mesh) : mesh_(mesh) {
    mesh.slots(EntityKind::kFace).live().ForEach([&](Slot f) {
      if (IsSurfaceFace(mesh, FaceId(f))) surface_.push_back(FaceId(f));
    });
  }

  double FacesAt(EdgeId e) const { return SurfaceAt(e).size(); }

  double CellsAt(FaceId f) const {
    double uses = 0;
    mesh_.slots(EntityKind::kCell).live().ForEach([&](Slot c) {
      for (const Cycle& cycle : FacesOf(CellId(c))) {
        uses += !mesh_.IsDuplicate(f) && cycle == Canonical(mesh_.Vertices(f));
      }
    });
    return uses;
  }

  /// Fans of the cells with these vertices (of an edge of theirs, or one).
  double CellFansAt(const std::set<VertexId>& vertices) const {
    std::vector<CellId> cells;
    mesh_.slots(EntityKind::kCell).live().ForEach([&](Slot c) {
      if (!FacesAround(CellId(c), vertices).empty()) cells.emplace_back(c);
    });
    return CountFans(cells.size(), [&](size_t a, size_t b) {
      const auto first = FacesAround(cells[a], vertices), second = FacesAround(cells[b], vertices);
      return std::any_of(first.begin(), first.end(), [&](const Cycle& cycle) { return second.count(cycle); });
    });
  }

  double SurfaceFansAt(VertexId v) const {
    std::vector<FaceId> faces;
    for (FaceId f : surface_) {
      const auto vertices = mesh_.Vertices(f);
      if (std::find(vertices.begin(), vertices.end(), v) != vertices.end()) faces.push_back(f);
    }
    return CountFans(faces.size(), [&](size_t a, size_t b) {
      for (const auto& ends : EdgesOf(faces[a])) {
        if (ends.count(v) && EdgesOf(faces[b]).count(ends)) return true;
      }
      return false;
    });
  }

  absl::optional<double> OrientationAt(EdgeId e) const {
    const auto faces = SurfaceAt(e);
    if (faces.size() != 2) return absl::nullopt;
    return Runs(faces[0], e) == Runs(faces[1], e);
  }

 private:
  std::set<std::set<VertexId>> EdgesOf(FaceId f) const {
    std::set<std::set<VertexId>> edges;
    const auto v = mesh_.Vertices(f);
    for (size_t k = 0; k < v.size(); ++k) edges.insert({v[k], v[(k + 1) % v.size()]});
    return edges;
  }

  std::vector<FaceId> SurfaceAt(EdgeId e) const {
    std::vector<FaceId> faces;
    const auto ends = mesh_.Vertices(e);
    if (mesh_.IsDuplicate(e)) return faces;
    for (FaceId f : surface_) {
      if (EdgesOf(f).count({ends[0], ends[1]})) faces.push_back(f);
    }
    return faces;
  }

  bool Runs(FaceId f, EdgeId e) const {
    const auto v = mesh_.Vertices(f), ends = mesh_.Vertices(e);
    const size_t at = std::find(v.begin(), v.end(), ends[0]) - v.begin();
    return v[(at + 1) % v.size()] == ends[1];
  }

  std::vector<Cycle> FacesOf(CellId c) const {
    std::vector<Cycle> cycles;
    const ElementTemplate& shape = TemplateOf(mesh_.Type(c));
    for (int i = 0; i < shape.num_faces; ++i) {
      cycles.push_back(Canonical(FaceVertices(shape.faces[i], mesh_.Vertices(c)).span()));
    }
    return cycles;
  }

  /// Faces of a cell with an edge between `vertices`, or with the one vertex.
  std::set<Cycle> FacesAround(CellId c, const std::set<VertexId>& vertices) const {
    std::set<Cycle> around;
    for (const Cycle& cycle : FacesOf(c)) {
      for (size_t k = 0; k < cycle.size(); ++k) {
        const VertexId next = cycle[(k + 1) % cycle.size()];
        const bool here = vertices.size() == 1 ? vertices.count(cycle[k]) != 0
                                               : std::set<VertexId>{cycle[k], next} == vertices;
        if (here) around.insert(cycle);
      }
    }
    return around;
  }

  /// Classes of n things, by comparing each with each until nothing changes.
  template <typename Touches>
  static double CountFans(size_t n, Touches touches) {
    std::vector<size_t> fan(n);
    for (size_t i = 0; i < n; ++i) fan[i] = i;
    for (bool changed = true; changed;) {
      changed = false;
      for (size_t a = 0; a < n; ++a) {
        for (size_t b = 0; b < a; ++b) {
          if (fan[a] == fan[b] || !touches(a, b)) continue;
          fan[a] = fan[b] = std::min(fan[a], fan[b]);
          changed = true;
        }
      }
    }
    return std::set<size_t>(fan.begin(), fan.end()).size();
  }

  const Mesh& mesh_;
  std::vector<FaceId> surface_;
};

absl::optional<double> Unless0(double value) {
  return value == 0 ? absl::nullopt : absl::optional<double>(value);
}

void ExpectEqualsBruteForce(const Mesh& mesh) {
  const BruteForce brute(mesh);
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    const VertexId v(slot);
    const double fans = std::max(brute.CellFansAt({v}), brute.SurfaceFansAt(v));
    EXPECT_EQ(ValueAt(mesh, CheckKind::kVertexLink, v), Unless0(fans)) << "vertex " << slot;
  });
  mesh.slots(EntityKind::kEdge).live().ForEach([&](Slot slot) {
    const EdgeId e(slot);
    const auto ends = mesh.Vertices(e);
    EXPECT_EQ(ValueAt(mesh, CheckKind::kEdgeFaces, e), Unless0(brute.FacesAt(e))) << "edge " << slot;
    EXPECT_EQ(ValueAt(mesh, CheckKind::kOrientation, e), brute.OrientationAt(e)) << "edge " << slot;
    if (mesh.IsDuplicate(e) || ends[0] == ends[1]) return;
    EXPECT_EQ(ValueAt(mesh, CheckKind::kEdgeLink, e), Unless0(brute.CellFansAt({ends[0], ends[1]})))
        << "edge " << slot;
  });
  mesh.slots(EntityKind::kFace).live().ForEach([&](Slot slot) {
    EXPECT_EQ(ValueAt(mesh, CheckKind::kFaceCells, FaceId(slot)), Unless0(brute.CellsAt(FaceId(slot))))
        << "face " << slot;
  });
}

TEST(LocalCheckTest, IncidencesAreThoseOfBruteForceOnRandomMeshes) {
  for (uint32_t seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    Mesh mesh;
    ElementModel model;
    RandomEditor editor(mesh, model, seed, {.max_vertices = 9});
    for (int round = 0; round < 4; ++round) {
      for (int edit = 0; edit < 25; ++edit) editor.Edit();
      ExpectEqualsBruteForce(mesh);
      if (::testing::Test::HasFailure()) return;
    }
  }
}

}  // namespace
}  // namespace dynmesh
