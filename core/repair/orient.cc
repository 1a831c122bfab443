#include "core/repair/orient.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/edit/geometry.h"
#include "core/mesh/error.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// A mirror image of each type's template: the same faces, each the other way round.
absl::Span<const uint8_t> ReversedOrder(ElementType type) {
  static constexpr uint8_t kOrders[kNumElementTypes + 1][kMaxElementVertices] = {
      {},           {1, 0},          {0, 2, 1},          {0, 3, 2, 1},
      {0, 2, 1, 3}, {0, 3, 2, 1, 4}, {0, 2, 1, 3, 5, 4}, {0, 3, 2, 1, 4, 7, 6, 5}};
  return absl::MakeConstSpan(kOrders[static_cast<int>(type)], NumVertices(type));
}

NewElement Reversed(const Mesh& mesh, EntityId id) {
  const auto vertices = mesh.VerticesOf(id);
  NewElement reversed(mesh.Type(id), vertices);
  const auto order = ReversedOrder(reversed.type);
  for (size_t k = 0; k < order.size(); ++k) reversed.ids[k] = vertices[order[k]];
  return reversed;
}

/// An element next to another one, and whether the two turn alike.
struct Neighbour {
  Slot slot;
  bool alike;
};

/// Neighbours of an element, and how many of its sides have none, or more than one.
struct Neighbours {
  absl::InlinedVector<Neighbour, kMaxElementFaces> across;
  int open_sides = 0;
  uint64_t looked_at = 0;
};

/// The two different elements of a list, or nothing if there are more or fewer.
class PairFinder {
 public:
  /// False when it is no pair any more.
  bool Add(Slot slot) {
    if (count_ < 2) slots_[count_] = slot;
    return ++count_ <= 2;
  }
  bool found() const { return count_ == 2 && slots_[0] != slots_[1]; }
  Slot Other(Slot slot) const { return slots_[0] == slot ? slots_[1] : slots_[0]; }

 private:
  std::array<Slot, 2> slots_ = {kNoSlot, kNoSlot};
  int count_ = 0;
};

/// Whether a face goes along an edge in the direction in which the edge is stored.
bool FollowsEdge(const Mesh& mesh, FaceId f, EdgeId e) {
  const auto edges = mesh.Edges(f);
  const size_t k = std::find(edges.begin(), edges.end(), e) - edges.begin();
  return mesh.Vertices(f)[k] == mesh.Vertices(e)[0];
}

Neighbours NeighboursOf(const Mesh& mesh, FaceId f) {
  Neighbours neighbours;
  for (EdgeId e : mesh.Edges(f)) {
    PairFinder pair;
    for (FaceId other : mesh.IncidentFaces(e)) {
      ++neighbours.looked_at;
      if (mesh.IsElement(other) && !pair.Add(other.slot())) break;
    }
    const FaceId other(pair.Other(f.slot()));
    if (pair.found() && !mesh.IsDegenerate(other)) {
      neighbours.across.push_back({other.slot(), FollowsEdge(mesh, f, e) != FollowsEdge(mesh, other, e)});
    } else {
      ++neighbours.open_sides;
    }
  }
  return neighbours;
}

Neighbours NeighboursOf(const Mesh& mesh, CellId c) {
  Neighbours neighbours;
  for (OrientedFace ours : mesh.Faces(c)) {
    const auto uses = mesh.IncidentCells(ours.face());
    ++neighbours.looked_at;
    if (uses.size() != 2 || uses[0] == uses[1]) continue;
    const CellId other = uses[0] == c ? uses[1] : uses[0];
    if (mesh.IsDegenerate(other)) continue;
    for (OrientedFace theirs : mesh.Faces(other)) {
      if (theirs.face() != ours.face()) continue;
      neighbours.across.push_back({other.slot(), theirs.code().flipped() != ours.code().flipped()});
    }
  }
  return neighbours;
}

/// Volume between cycles and points, that is exactly (but for rounding) the opposite for cycles that turn the
/// other way: quads count as the mean of their two halvings.
class Volume {
 public:
  /// `turn` is 1, or -1 for the other way. REQUIRES: three or four vertices.
  void Add(const Mesh& mesh, absl::Span<const VertexId> face, const Point& origin, int turn) {
    std::array<Point, kMaxFaceVertices> cycle;
    for (size_t k = 0; k < face.size(); ++k) cycle[k] = mesh.Position(face[k]) - origin;
    Add(absl::MakeConstSpan(cycle.data(), face.size()), turn);
  }

  /// 1, -1, or 0 where rounding may be all that there is.
  int Sign() const {
    const bool some = std::abs(signed_) > kFlat * size_;
    return !some ? 0 : signed_ > 0 ? 1 : -1;
  }

 private:
  void Add(absl::Span<const Point> cycle, int turn) {
    const size_t n = cycle.size();
    for (size_t k = 0; k < (n == 3 ? 1 : n); ++k) {
      const double part = Dot(cycle[k], Cross(cycle[(k + 1) % n], cycle[(k + 2) % n])) / (n == 3 ? 1 : 2);
      signed_ += turn * part;
      size_ += std::abs(part);
    }
  }

  double signed_ = 0, size_ = 0;
};

/// Adds what lies between a face and the first vertex of its surface.
void AddVolume(const Mesh& mesh, FaceId f, VertexId first, int turn, Volume& volume) {
  volume.Add(mesh, mesh.Vertices(f), mesh.Position(first), turn);
}

/// Adds a cell, as seen from its own first vertex: of cells far away there is no more rounding than of
/// others.
void AddVolume(const Mesh& mesh, CellId c, VertexId, int turn, Volume& volume) {
  const auto vertices = mesh.Vertices(c);
  const ElementTemplate& shape = TemplateOf(mesh.Type(c));
  for (int i = 0; i < shape.num_faces; ++i) {
    volume.Add(mesh, FaceVertices(shape.faces[i], vertices).span(), mesh.Position(vertices[0]), turn);
  }
}

/// Orients all elements of one kind, component by component.
template <typename Id>
class Orienter {
 public:
  Orienter(RepairWork& work, const OrientOptions& options, RepairReport& report)
      : work_(work),
        mesh_(work.mesh()),
        options_(options),
        report_(report),
        turns_(mesh_.slots(Id::kKind).limit(), 0) {}

  absl::Status Run() {
    DYNMESH_RETURN_IF_ERROR(work_.ChargeBytes(turns_.size()));
    const Slot limit = mesh_.slots(Id::kKind).limit();
    for (Slot slot = mesh_.slots(Id::kKind).live().Next(0); slot < limit;
         slot = mesh_.slots(Id::kKind).live().Next(slot + 1)) {
      DYNMESH_RETURN_IF_ERROR(work_.Charge(1));
      if (!mesh_.IsElement(Id(slot)) || mesh_.IsDegenerate(Id(slot)) || turns_[slot] != 0) continue;
      DYNMESH_RETURN_IF_ERROR(GatherComponent(Id(slot)));
      DYNMESH_RETURN_IF_ERROR(Settle());
    }
    return ReverseAll();
  }

 private:
  /// All that `first` is connected to, each with the sense in which it turns against `first`.
  absl::Status GatherComponent(Id first) {
    component_ = {first};
    orientable_ = closed_ = true;
    turns_[first.slot()] = 1;
    for (size_t i = 0; i < component_.size(); ++i) {
      const Id id = component_[i];
      const Neighbours neighbours = NeighboursOf(mesh_, id);
      DYNMESH_RETURN_IF_ERROR(work_.Charge(1 + neighbours.looked_at));
      closed_ &= neighbours.open_sides == 0;
      for (const auto& [slot, alike] : neighbours.across) {
        const int8_t expected = alike ? turns_[id.slot()] : -turns_[id.slot()];
        if (turns_[slot] == 0) {
          turns_[slot] = expected;
          component_.emplace_back(slot);
        } else {
          orientable_ &= turns_[slot] == expected;
        }
      }
    }
    return absl::OkStatus();
  }

  /// Notes the elements of the component that have to be reversed.
  absl::Status Settle() {
    if (!orientable_) {
      report_.Add(RepairFinding::kNotOrientable, component_[0]);
      return absl::OkStatus();
    }
    const int wanted = WantedTurn();
    const size_t before = reversed_.size();
    for (Id id : component_) {
      if (turns_[id.slot()] != wanted) reversed_.push_back(id);
    }
    return work_.ChargeBytes((reversed_.size() - before) * sizeof(Id));
  }

  int WantedTurn() const {
    const VertexId first = mesh_.Vertices(component_[0])[0];
    Volume volume;
    int64_t majority = 0;
    for (Id id : component_) {
      AddVolume(mesh_, id, first, turns_[id.slot()], volume);
      majority += turns_[id.slot()];
    }
    if (options_.outward && closed_ && volume.Sign() != 0) return volume.Sign();
    return majority >= 0 ? 1 : -1;
  }

  absl::Status ReverseAll() {
    Patch patch;
    for (Id id : reversed_) {
      const NewElement reversed = Reversed(mesh_, id);
      patch.Remove(id);
      patch.Add(reversed.type, reversed.vertices());
      if (patch.removed.size() == kPiece) DYNMESH_RETURN_IF_ERROR(Apply(patch));
    }
    return Apply(patch);
  }

  absl::Status Apply(Patch& patch) {
    DYNMESH_RETURN_IF_ERROR(work_.Apply(patch));
    for (EntityId id : work_.applied().added) report_.Add(RepairFinding::kReversed, id);
    return absl::OkStatus();
  }

  static constexpr size_t kPiece = 256;

  RepairWork& work_;
  const Mesh& mesh_;
  const OrientOptions& options_;
  RepairReport& report_;
  std::vector<int8_t> turns_;  ///< by slot: 0 not seen yet, 1 as the first of its component, -1 the other way
  std::vector<Id> component_;
  bool orientable_ = true, closed_ = true;
  std::vector<Id> reversed_;
};

}  // namespace

absl::StatusOr<RepairReport> OrientElements(RepairWork& work, const OrientOptions& options) {
  RepairReport report;
  DYNMESH_RETURN_IF_ERROR(Orienter<FaceId>(work, options, report).Run());
  DYNMESH_RETURN_IF_ERROR(Orienter<CellId>(work, options, report).Run());
  return report;
}

}  // namespace dynmesh
