// The surface is cut along edges at which other than two faces meet. Then a corner class (corners of faces
// that are joined round a vertex) is a vertex of the cut surface, and Euler's formula holds for each piece:
// vertices - edges + faces = 2 - 2 * genus - loops.

#include "core/check/surface_pieces.h"

#include <algorithm>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/check/incidence.h"
#include "core/check/pieces.h"

namespace dynmesh {
namespace {

class SurfaceAnalyzer {
 public:
  SurfaceAnalyzer(const Mesh& mesh, WorkMeter& meter, const std::vector<FaceId>& members)
      : mesh_(mesh),
        meter_(meter),
        members_(members),
        faces_(members.size()),
        corners_(kMaxFaceVertices * members.size()) {}

  absl::StatusOr<SurfaceSummary> Run() && {
    NumberMembers();
    DYNMESH_RETURN_IF_ERROR(JoinAcrossEdges());
    DYNMESH_RETURN_IF_ERROR(JoinSides());
    DYNMESH_RETURN_IF_ERROR(CountPieces());
    return Sum();
  }

 private:
  /// One face at an edge: member `face` along its k-th edge.
  struct Side {
    uint32_t face;
    int k;
  };
  /// A side along which the surface ends or was cut.
  struct RimSide {
    Side side;
    bool is_cut;
  };
  struct Piece {
    int64_t twice_euler = 0;
    uint64_t loops = 0;  ///< also of cuts
    bool is_manifold = true;
    bool is_orientable = true;
  };

  void NumberMembers() {
    number_.resize(mesh_.slots(EntityKind::kFace).limit(), kNoSlot);
    for (size_t i = 0; i < members_.size(); ++i) number_[members_[i].slot()] = i;
  }

  int SizeOf(uint32_t face) const { return mesh_.Vertices(members_[face]).size(); }
  static uint32_t CornerOf(uint32_t face, int k) { return kMaxFaceVertices * face + k; }
  uint32_t Tail(const Side& side) const { return CornerOf(side.face, side.k); }
  uint32_t Head(const Side& side) const { return CornerOf(side.face, (side.k + 1) % SizeOf(side.face)); }
  bool RunsForward(const Side& side) const {
    return dynmesh::RunsForward(mesh_, members_[side.face], side.k);
  }

  absl::Status JoinAcrossEdges() {
    const BitSet& edges = mesh_.slots(EntityKind::kEdge).live();
    std::vector<Side> sides;
    for (Slot slot = edges.Next(0); slot != kNoSlot; slot = edges.Next(slot + 1)) {
      DYNMESH_RETURN_IF_ERROR(GatherSides(EdgeId(slot), sides));
      if (sides.size() == 2) {
        Join(sides[0], sides[1]);
      } else {
        for (const Side& side : sides) rim_.push_back({side, sides.size() > 1});
      }
    }
    return absl::OkStatus();
  }

  absl::Status GatherSides(EdgeId e, std::vector<Side>& sides) {
    sides.clear();
    const auto faces = mesh_.IncidentFaces(e);
    DYNMESH_RETURN_IF_ERROR(meter_.ChargeManySteps(1 + faces.size()));
    for (FaceId f : faces) {
      if (number_[f.slot()] == kNoSlot) continue;
      const auto edges = mesh_.Edges(f);
      sides.push_back(
          {number_[f.slot()], static_cast<int>(std::find(edges.begin(), edges.end(), e) - edges.begin())});
    }
    return absl::OkStatus();
  }

  void Join(const Side& a, const Side& b) {
    const bool agree = RunsForward(a) != RunsForward(b);
    if (!faces_.Join(a.face, b.face, agree ? Pieces::Turn::kSame : Pieces::Turn::kOpposite)) {
      twisted_.push_back(a.face);
    }
    corners_.Join(Tail(a), agree ? Head(b) : Tail(b));
    corners_.Join(Head(a), agree ? Tail(b) : Head(b));
  }

  /// Sides of a rim follow each other where they share a corner of the cut surface.
  absl::Status JoinSides() {
    Pieces loops(rim_.size());
    absl::flat_hash_map<uint32_t, uint32_t> first;  // side at each corner
    for (uint32_t i = 0; i < rim_.size(); ++i) {
      DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(1));
      for (uint32_t corner : {Tail(rim_[i].side), Head(rim_[i].side)}) {
        const auto [it, is_new] = first.try_emplace(corners_.Find(corner), i);
        if (!is_new) loops.Join(it->second, i);
      }
    }
    loop_is_open_.resize(rim_.size());
    for (uint32_t i = 0; i < rim_.size(); ++i) {
      if (!rim_[i].is_cut) loop_is_open_[loops.Find(i)] = true;
      if (loops.Find(i) == i) loops_.push_back(i);
    }
    return absl::OkStatus();
  }

  Piece& PieceOf(uint32_t face) { return pieces_[faces_.Find(face)]; }

  absl::Status CountPieces() {
    for (uint32_t face = 0; face < members_.size(); ++face) {
      DYNMESH_RETURN_IF_ERROR(meter_.ChargeSteps(1));
      Piece& piece = PieceOf(face);
      // Each of its edges is half an edge of the piece, those of the rim a whole one: below.
      piece.twice_euler += 2 - SizeOf(face);
      for (int k = 0; k < SizeOf(face); ++k) {
        const uint32_t corner = CornerOf(face, k);
        piece.twice_euler += corners_.Find(corner) == corner ? 2 : 0;
      }
    }
    for (const RimSide& rim : rim_) {
      Piece& piece = PieceOf(rim.side.face);
      piece.twice_euler -= 1;
      piece.is_manifold &= !rim.is_cut;
    }
    for (uint32_t i : loops_) ++PieceOf(rim_[i].side.face).loops;
    for (uint32_t face : twisted_) PieceOf(face).is_orientable = false;
    return absl::OkStatus();
  }

  SurfaceSummary Sum() const {
    SurfaceSummary sum;
    sum.pieces = pieces_.size();
    sum.holes = std::count_if(loops_.begin(), loops_.end(), [this](uint32_t i) { return loop_is_open_[i]; });
    for (const auto& [root, piece] : pieces_) {
      const int64_t euler = piece.twice_euler / 2;
      sum.euler_characteristic += euler;
      sum.non_manifold += !piece.is_manifold;
      sum.non_orientable += !piece.is_orientable;
      if (piece.is_orientable) sum.genus += (2 - euler - static_cast<int64_t>(piece.loops)) / 2;
    }
    return sum;
  }

  const Mesh& mesh_;
  WorkMeter& meter_;
  const std::vector<FaceId>& members_;
  std::vector<uint32_t> number_;  ///< of the member at a slot, or kNoSlot
  Pieces faces_;
  Pieces corners_;
  std::vector<RimSide> rim_;
  std::vector<uint32_t> twisted_;                ///< faces that cannot be turned to agree
  std::vector<bool> loop_is_open_;               ///< by the side that stands for the loop
  std::vector<uint32_t> loops_;                  ///< the sides that stand for loops
  absl::flat_hash_map<uint32_t, Piece> pieces_;  ///< by the face that stands for it
};

}  // namespace

absl::StatusOr<SurfaceSummary> SummarizeSurface(const Mesh& mesh, absl::FunctionRef<bool(FaceId)> is_member,
                                                WorkMeter& meter) {
  std::vector<FaceId> members;
  const BitSet& faces = mesh.slots(EntityKind::kFace).live();
  for (Slot slot = faces.Next(0); slot != kNoSlot; slot = faces.Next(slot + 1)) {
    DYNMESH_RETURN_IF_ERROR(meter.ChargeSteps(1));
    if (is_member(FaceId(slot))) members.push_back(FaceId(slot));
  }
  if (members.empty()) return SurfaceSummary();
  return SurfaceAnalyzer(mesh, meter, members).Run();
}

}  // namespace dynmesh
