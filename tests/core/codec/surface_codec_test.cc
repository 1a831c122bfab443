#include "core/codec/surface_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "core/mesh/error.h"

namespace dynmesh {
namespace {

using Triangle = std::array<uint32_t, 3>;

TriangleSurface Table(std::vector<Slot> slots, std::vector<Triangle> triangles) {
  TriangleSurface surface;
  for (Slot slot : slots) {
    surface.vertex_slots.emplace_back(slot);
    const double i = surface.positions.size();
    surface.positions.push_back({std::cos(i), std::sin(2 * i), 0.1 * i});
  }
  surface.triangles = std::move(triangles);
  return surface;
}

// A wavy sheet of n * n squares.
TriangleSurface Sheet(uint32_t n, Slot slot_stride) {
  TriangleSurface surface;
  for (uint32_t i = 0; i < (n + 1) * (n + 1); ++i) {
    const double x = i % (n + 1), y = i / (n + 1);
    surface.vertex_slots.emplace_back(slot_stride * i);
    surface.positions.push_back({x, y, std::sin(x) * std::cos(y)});
  }
  for (uint32_t i = 0; i < n * n; ++i) {
    const uint32_t corner = i / n * (n + 1) + i % n;
    surface.triangles.push_back({corner, corner + 1, corner + n + 2});
    surface.triangles.push_back({corner, corner + n + 2, corner + n + 1});
  }
  return surface;
}

// Triangles as slots, each turned so that its smallest slot comes first.
std::multiset<std::array<Slot, 3>> BySlot(const TriangleSurface& surface) {
  std::multiset<std::array<Slot, 3>> triangles;
  for (Triangle t : surface.triangles) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    const auto slot = [&](int k) { return surface.vertex_slots[t[k]].slot(); };
    triangles.insert({slot(0), slot(1), slot(2)});
  }
  return triangles;
}

TriangleSurface RoundTrip(const TriangleSurface& surface, int bits) {
  const absl::StatusOr<std::string> bytes = EncodeSurface(surface, bits);
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  absl::StatusOr<TriangleSurface> back = DecodeSurface(bytes.ok() ? *bytes : std::string());
  EXPECT_TRUE(back.ok()) << back.status();
  return back.ok() ? *back : TriangleSurface();
}

void ExpectNear(const TriangleSurface& surface, const TriangleSurface& back, double tolerance) {
  std::map<VertexId, Point> positions;
  for (size_t v = 0; v < back.positions.size(); ++v) positions[back.vertex_slots[v]] = back.positions[v];
  for (size_t v = 0; v < surface.positions.size(); ++v) {
    const Point& there = positions.at(surface.vertex_slots[v]);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(there[axis], surface.positions[v][axis], tolerance);
  }
}

TEST(SurfaceCodecTest, ASheetComesBackBySlot) {
  const TriangleSurface sheet = Sheet(20, 3);
  const TriangleSurface back = RoundTrip(sheet, 14);
  EXPECT_EQ(back.vertex_slots, sheet.vertex_slots);
  EXPECT_EQ(BySlot(back), BySlot(sheet));
  ExpectNear(sheet, back, 20.0 / (1 << 14));
}

TEST(SurfaceCodecTest, MoreBitsAreNearer) {
  const TriangleSurface sheet = Sheet(8, 1);
  for (int bits : {1, 8, 16, 24, 30}) {
    ExpectNear(sheet, RoundTrip(sheet, bits), 8.0 / ((1u << bits) - 1) + 1e-5);
  }
}

TEST(SurfaceCodecTest, LargeSlotsComeBackWithoutLongTables) {
  const TriangleSurface sheet = Sheet(10, 34000000);
  EXPECT_EQ(BySlot(RoundTrip(sheet, 10)), BySlot(sheet));
  const TriangleSurface last = Table({0, 0x7fffffff, 0x80000000, kNoSlot - 1}, {{0, 1, 2}, {2, 1, 3}});
  EXPECT_EQ(BySlot(RoundTrip(last, 10)), BySlot(last));
}

TEST(SurfaceCodecTest, ANonManifoldEdgeKeepsItsTriangles) {
  const TriangleSurface book = Table({1, 2, 3, 4, 5}, {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}});
  const TriangleSurface back = RoundTrip(book, 14);
  EXPECT_EQ(back.vertex_slots, book.vertex_slots);
  EXPECT_EQ(BySlot(back), BySlot(book));
}

TEST(SurfaceCodecTest, ABowTieVertexKeepsItsTriangles) {
  const TriangleSurface bow_tie = Table({5, 6, 7, 8, 9}, {{0, 1, 2}, {0, 3, 4}});
  EXPECT_EQ(BySlot(RoundTrip(bow_tie, 14)), BySlot(bow_tie));
}

TEST(SurfaceCodecTest, DegenerateTrianglesAndLooseVerticesAreLeftOut) {
  const TriangleSurface surface = Table({1, 2, 3, 4, 9}, {{0, 0, 1}, {1, 2, 3}, {3, 3, 3}});
  const TriangleSurface back = RoundTrip(surface, 14);
  EXPECT_THAT(back.vertex_slots, testing::ElementsAre(VertexId(2), VertexId(3), VertexId(4)));
  EXPECT_EQ(BySlot(back), (std::multiset<std::array<Slot, 3>>{{2, 3, 4}}));
}

TEST(SurfaceCodecTest, ASurfaceWithoutATriangleIsRefused) {
  for (const TriangleSurface& surface : {TriangleSurface(), Table({1, 2}, {{0, 1, 0}})}) {
    EXPECT_EQ(EncodeSurface(surface, 14).status().code(), absl::StatusCode::kFailedPrecondition);
  }
}

TEST(SurfaceCodecTest, BadArgumentsAreRefusedByReason) {
  TriangleSurface surface = Table({1, 2, 3}, {{0, 1, 2}});
  EXPECT_EQ(ErrorReason(EncodeSurface(surface, 0).status()), reason::kBadArgument);
  EXPECT_EQ(ErrorReason(EncodeSurface(surface, 31).status()), reason::kBadArgument);
  surface.triangles[0][1] = 3;
  EXPECT_EQ(EncodeSurface(surface, 14).status().code(), absl::StatusCode::kInvalidArgument);
  surface.positions.pop_back();
  EXPECT_EQ(ErrorReason(EncodeSurface(surface, 14).status()), reason::kBadArrayLength);
  surface = Table({1, 2, 3}, {{0, 1, 2}});
  surface.positions[1][0] = 1e300;
  EXPECT_EQ(ErrorReason(EncodeSurface(surface, 14).status()), reason::kNonFinite);
}

TEST(SurfaceCodecTest, BytesThatAreNoSurfaceAreRefused) {
  for (const std::string& bytes : {std::string(), std::string("DRACO"), std::string(100, '\0')}) {
    EXPECT_EQ(ErrorReason(DecodeSurface(bytes).status()), reason::kCorruptPayload);
  }
}

TEST(SurfaceCodecTest, DracosOwnDecoderOpensTheFile) {
  if (std::system("command -v draco_decoder > /dev/null") != 0) {
    GTEST_SKIP() << "draco_decoder is not installed";
  }
  std::string directory = (std::filesystem::temp_directory_path() / "dynmesh_surface_XXXXXX").string();
  ASSERT_NE(mkdtemp(directory.data()), nullptr);
  const std::string drc = directory + "/sheet.drc";
  const std::string obj = directory + "/sheet.obj";
  std::ofstream(drc, std::ios::binary) << *EncodeSurface(Sheet(6, 1), 14);
  const int exit = std::system(("draco_decoder -i " + drc + " -o " + obj + " > /dev/null").c_str());
  EXPECT_TRUE(WIFEXITED(exit) && WEXITSTATUS(exit) == 0);
  std::ifstream lines(obj);
  std::map<std::string, int> kinds;
  for (std::string line; std::getline(lines, line);) ++kinds[line.substr(0, line.find(' '))];
  EXPECT_EQ(kinds["v"], 49);
  EXPECT_EQ(kinds["f"], 72);
  std::filesystem::remove_all(directory);
}

TEST(SurfaceCodecTest, CoordinatesBeyondDracosRangeAreRefused) {
  for (double big : {1.0e38, 1.8e38, 3.0e38, 1.0e300}) {
    TriangleSurface surface;
    for (Slot slot = 0; slot < 4; ++slot) surface.vertex_slots.emplace_back(slot);
    surface.positions = {{-big, 0, 0}, {big, 0, 0}, {0, big, 0}, {0, -big, 1}};
    surface.triangles = {{0, 1, 2}, {0, 3, 1}};
    EXPECT_EQ(ErrorReason(EncodeSurface(surface, 14).status()), reason::kNonFinite) << big;
    for (Point& p : surface.positions) p = {p[0] * (1e37 / big), p[1] * (1e37 / big), p[2]};
    EXPECT_TRUE(EncodeSurface(surface, 14).ok());
  }
}

}  // namespace
}  // namespace dynmesh
