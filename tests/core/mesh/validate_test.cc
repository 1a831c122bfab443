#include "core/mesh/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/meshes.h"

namespace dynmesh {

class MeshTestPeer {
 public:
  static void ListTwice(Mesh& mesh) { mesh.vertex_edges_.Add(1, mesh.vertex_edges_.Of(1)[0]); }
  static void ListNot(Mesh& mesh) { mesh.edge_faces_.Remove(2, mesh.edge_faces_.Of(2)[0]); }
  static void ListAnother(Mesh& mesh) {
    ListTwice(mesh);
    mesh.vertex_edges_.Remove(1, mesh.vertex_edges_.Of(1).back());
  }
  static void ListInNoOrder(Mesh& mesh) {
    const auto entries = mesh.vertex_edges_.Of(1);
    std::swap(const_cast<EdgeId&>(entries[0]), const_cast<EdgeId&>(entries[1]));
  }
  /// Of two equal triangles.
  static void MakeBothPrimary(Mesh& mesh) { mesh.flags_[2][1] &= ~Mesh::kDuplicateFlag; }
  static void MakeNonePrimary(Mesh& mesh) { mesh.flags_[2][0] |= Mesh::kDuplicateFlag; }
  static void ForgetDuplicates(Mesh& mesh) { mesh.duplicates_[2].clear(); }
  static void SwapCode(Mesh& mesh) {
    const OrientedFace oriented = mesh.cell_faces_[1];
    mesh.cell_faces_[1] =
        OrientedFace(oriented.face(), FaceCode{static_cast<uint8_t>(oriented.code().value ^ 4)});
  }
};

namespace testing {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

std::vector<std::string> DamagedBy(void (*damage)(Mesh&), Mesh mesh) {
  EXPECT_THAT(Validate(mesh), IsEmpty());
  damage(mesh);
  return Validate(mesh);
}

Mesh TwoEqualTriangles() {
  Mesh mesh;
  AddVertices(mesh, 3);
  Add(mesh, ElementType::kTriangle, {0, 1, 2});
  Add(mesh, ElementType::kTriangle, {2, 1, 0});
  Commit(mesh);
  return mesh;
}

TEST(ValidateTest, NamesTheUserThatAListHasTooOftenOrTooRarely) {
  EXPECT_THAT(DamagedBy(MeshTestPeer::ListTwice, OneTet()), Contains("vertex 1 lists its user 0 too often"));
  EXPECT_THAT(DamagedBy(MeshTestPeer::ListNot, OneTet()), Contains(HasSubstr("edge 2 lists its user")));
  EXPECT_THAT(DamagedBy(MeshTestPeer::ListNot, OneTet()), Contains(HasSubstr("too rarely")));
  const auto swapped = DamagedBy(MeshTestPeer::ListAnother, OneTet());
  EXPECT_THAT(swapped, UnorderedElementsAre("vertex 1 lists its user 0 too often", HasSubstr("too rarely")));
  EXPECT_THAT(DamagedBy(MeshTestPeer::ListInNoOrder, OneTet()),
              UnorderedElementsAre("vertex 1 lists its users in no order"));
  EXPECT_THAT(DamagedBy(MeshTestPeer::SwapCode, OneTet()), Contains(HasSubstr("wrong orientation code")));
}

TEST(ValidateTest, SeesWhoIsPrimary) {
  EXPECT_THAT(
      DamagedBy(MeshTestPeer::MakeBothPrimary, TwoEqualTriangles()),
      UnorderedElementsAre("two primaries, one is face 1", "wrong number of face duplicates indexed"));
  EXPECT_THAT(DamagedBy(MeshTestPeer::MakeNonePrimary, TwoEqualTriangles()),
              UnorderedElementsAre("duplicate face 0 without primary", "duplicate face 0 is not indexed"));
  EXPECT_THAT(
      DamagedBy(MeshTestPeer::ForgetDuplicates, TwoEqualTriangles()),
      UnorderedElementsAre("wrong number of face duplicates indexed", "duplicate face 1 is not indexed"));
}

TEST(ValidateTest, ReportsAreLimited) {
  Mesh mesh = OneTet();
  MeshTestPeer::ListAnother(mesh);
  EXPECT_GT(Validate(mesh).size(), 1u);
  EXPECT_EQ(Validate(mesh, {.max_violations = 1}).size(), 1u);
}

TEST(ValidateTest, EndsBetweenGroupsWhenItShall) {
  Mesh mesh = TetGrid(2, 2, 2);
  int asked = 0;
  Validate(mesh, {.goes_on = [&] { return ++asked > 0; }});
  const int groups = asked;
  EXPECT_GT(groups, 10);
  MeshTestPeer::ListTwice(mesh);
  asked = 0;
  EXPECT_THAT(Validate(mesh, {.goes_on = [&] { return ++asked < 4; }}), IsEmpty());
  EXPECT_THAT(Validate(mesh), ::testing::Not(IsEmpty()));
}

TEST(MeshCloneTest, ACloneIsEqualAndApart) {
  for (NamedMesh& named : AllMeshes()) {
    SCOPED_TRACE(named.name);
    Mesh clone = named.mesh.Clone();
    EXPECT_EQ(clone.checksum(), named.mesh.checksum());
    EXPECT_EQ(clone.revision(), named.mesh.revision());
    EXPECT_THAT(Validate(clone), IsEmpty());
    const Checksum before = named.mesh.checksum();
    ASSERT_TRUE(clone.AddVertex({1, 2, 3}).ok());
    Commit(clone);
    EXPECT_EQ(named.mesh.checksum(), before);
    EXPECT_NE(clone.checksum(), before);
    EXPECT_THAT(Validate(named.mesh), IsEmpty());
  }
}

}  // namespace
}  // namespace testing
}  // namespace dynmesh
