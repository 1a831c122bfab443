#include "core/mesh/validate.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "absl/container/inlined_vector.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/relations.h"
#include "core/mesh/row_block.h"

namespace dynmesh {

/// Collects violations; one method for each group of invariants.
class MeshValidator {
 public:
  MeshValidator(const Mesh& mesh, const ValidateOptions& options) : mesh_(mesh), options_(options) {}

  std::vector<std::string> Run() {
    using Check = void (MeshValidator::*)();
    constexpr Check kDownward[] = {&MeshValidator::CheckEdges, &MeshValidator::CheckFaces,
                                   &MeshValidator::CheckCells};
    constexpr Check kRest[] = {&MeshValidator::CheckVertexEdges,     &MeshValidator::CheckEdgeFaces,
                               &MeshValidator::CheckFaceCells,       &MeshValidator::CheckHubEdges,
                               &MeshValidator::CheckHubFaces,        &MeshValidator::CheckPrimaryEdges,
                               &MeshValidator::CheckPrimaryFaces,    &MeshValidator::CheckBoundary,
                               &MeshValidator::CheckCountsAndStamps, &MeshValidator::CheckDegenerate,
                               &MeshValidator::CheckStoredRelations, &MeshValidator::CheckAttributes,
                               &MeshValidator::CheckChecksum};
    for (Check check : kDownward) {
      if (options_.goes_on()) (this->*check)();
    }
    if (!violations_.empty()) return std::move(violations_);  // the rest follows references
    for (Check check : kRest) {
      if (options_.goes_on()) (this->*check)();
    }
    return std::move(violations_);
  }

 private:
  template <typename... Args>
  void Report(const Args&... args) {
    if (violations_.size() < options_.max_violations) violations_.push_back(absl::StrCat(args...));
  }

  template <typename UpperId, typename Fn>
  void ForEachLive(EntityKind kind, Fn fn) const {
    mesh_.slots(kind).live().ForEach([&](Slot slot) { fn(UpperId(slot)); });
  }

  std::array<VertexId, 2> PairKey(EdgeId e) const {
    const auto ends = mesh_.Vertices(e);
    return {std::min(ends[0], ends[1]), std::max(ends[0], ends[1])};
  }

  // ---- Downward references ----

  void CheckLiveVertices(EntityId id) {
    for (VertexId v : mesh_.VerticesOf(id)) {
      if (!mesh_.IsLive(v)) Report(EntityKindName(id.kind), " ", id.slot, " has dead vertex ", v.slot());
    }
  }

  void CheckEdges() {
    ForEachLive<EdgeId>(EntityKind::kEdge, [&](EdgeId e) {
      CheckLiveVertices(e);
      if (mesh_.Type(e) != ElementType::kWireEdge) Report("edge ", e.slot(), " has another type");
      if (!mesh_.IsElement(e) && mesh_.IncidentFaces(e).empty()) Report("edge ", e.slot(), " is unused");
    });
  }

  void CheckFaces() {
    ForEachLive<FaceId>(EntityKind::kFace, [&](FaceId f) {
      CheckLiveVertices(f);
      if (!mesh_.IsElement(f) && mesh_.IncidentCells(f).empty()) Report("face ", f.slot(), " is unused");
      const auto vertices = mesh_.Vertices(f);
      const auto edges = mesh_.Edges(f);
      for (size_t k = 0; k < edges.size(); ++k) {
        CheckJoins(f, edges[k], vertices[k], vertices[(k + 1) % vertices.size()]);
      }
    });
  }

  void CheckJoins(EntityId user, EdgeId e, VertexId a, VertexId b) {
    if (!mesh_.IsLive(e))
      return Report(EntityKindName(user.kind), " ", user.slot, " has dead edge ", e.slot());
    if (PairKey(e) != std::array<VertexId, 2>{std::min(a, b), std::max(a, b)}) {
      Report("edge ", e.slot(), " of ", EntityKindName(user.kind), " ", user.slot, " does not join ",
             a.slot(), " and ", b.slot());
    }
    if (mesh_.IsDuplicate(e))
      Report(EntityKindName(user.kind), " ", user.slot, " uses duplicate edge ", e.slot());
  }

  void CheckCells() {
    ForEachLive<CellId>(EntityKind::kCell, [&](CellId c) {
      CheckLiveVertices(c);
      if (!mesh_.IsElement(c) || mesh_.IsDuplicate(c)) Report("cell ", c.slot(), " has wrong flags");
      bool sound = true;
      for (int i = 0; i < TemplateOf(mesh_.Type(c)).num_faces; ++i) sound = CheckCellFace(c, i) && sound;
      if (sound) CheckCellEdges(c);
    });
  }

  bool CheckCellFace(CellId c, int local_face) {
    const LocalFace& face = TemplateOf(mesh_.Type(c)).faces[local_face];
    const OrientedFace oriented = mesh_.Faces(c)[local_face];
    const FaceId f = oriented.face();
    if (!mesh_.IsLive(f) || mesh_.Vertices(f).size() != face.size) {
      Report("cell ", c.slot(), " has dead or misfit face ", f.slot());
      return false;
    }
    if (mesh_.IsDuplicate(f)) Report("cell ", c.slot(), " uses duplicate face ", f.slot());
    for (int k = 0; k < face.size; ++k) {
      const VertexId stored = mesh_.Vertices(f)[oriented.code().StoredVertex(k, face.size)];
      if (stored == mesh_.Vertices(c)[face.vertices[k]]) continue;
      Report("cell ", c.slot(), " has a wrong orientation code for face ", f.slot());
      return false;
    }
    return true;
  }

  void CheckCellEdges(CellId c) {
    const ElementTemplate& shape = TemplateOf(mesh_.Type(c));
    for (int e = 0; e < shape.num_edges; ++e) {
      CheckJoins(c, mesh_.Edge(c, e), mesh_.Vertices(c)[shape.edges[e].vertices[0]],
                 mesh_.Vertices(c)[shape.edges[e].vertices[1]]);
    }
    for (int i = 0; i < shape.num_faces; ++i) {
      const OrientedFace oriented = mesh_.Faces(c)[i];
      const auto edges = mesh_.Edges(oriented.face());
      for (int k = 0; k < shape.faces[i].size; ++k) {
        if (edges[oriented.code().StoredEdge(k, edges.size())] == mesh_.Edge(c, shape.faces[i].edges[k]))
          continue;
        Report("cell ", c.slot(), " sees different edges through face ", oriented.face().slot());
      }
    }
  }

  // ---- Upward lists: exactly the inverse of the downward references ----

  void CheckVertexEdges() {
    CheckUpwardLists<VertexId, EdgeId>(
        EntityKind::kVertex, EntityKind::kEdge, [this](EdgeId e) { return mesh_.Vertices(e); },
        [this](VertexId v) { return mesh_.IncidentEdges(v); });
  }

  void CheckEdgeFaces() {
    CheckUpwardLists<EdgeId, FaceId>(
        EntityKind::kEdge, EntityKind::kFace, [this](FaceId f) { return mesh_.Edges(f); },
        [this](EdgeId e) { return mesh_.IncidentFaces(e); });
  }

  void CheckFaceCells() {
    const auto faces_of = [this](CellId c) {
      absl::InlinedVector<FaceId, kMaxElementFaces> faces;
      for (OrientedFace oriented : mesh_.Faces(c)) faces.push_back(oriented.face());
      return faces;
    };
    CheckUpwardLists<FaceId, CellId>(EntityKind::kFace, EntityKind::kCell, faces_of,
                                     [this](FaceId f) { return mesh_.IncidentCells(f); });
  }

  /// Users of each lower entity, ascending, as compressed sparse rows: a counting sort of the downward
  /// references.
  template <typename UpperId, typename PartsOf>
  CsrTable CountUses(EntityKind lower, EntityKind upper, PartsOf parts_of) const {
    CsrTable uses;
    uses.offsets.assign(size_t{mesh_.slots(lower).limit()} + 2, 0);
    ForEachLive<UpperId>(upper, [&](UpperId user) {
      for (auto part : parts_of(user)) ++uses.offsets[part.slot() + 2];
    });
    std::partial_sum(uses.offsets.begin(), uses.offsets.end(), uses.offsets.begin());
    uses.ids.resize(uses.offsets.back());
    ForEachLive<UpperId>(upper, [&](UpperId user) {
      for (auto part : parts_of(user)) uses.ids[uses.offsets[part.slot() + 1]++] = user.slot();
    });
    return uses;
  }

  template <typename LowerId, typename UpperId, typename PartsOf, typename ListOf>
  void CheckUpwardLists(EntityKind lower, EntityKind upper, PartsOf parts_of, ListOf list_of) {
    const CsrTable uses = CountUses<UpperId>(lower, upper, parts_of);
    std::vector<Slot> listed;
    ForEachLive<LowerId>(lower, [&](LowerId id) {
      listed.clear();
      for (auto user : list_of(id)) listed.push_back(user.slot());
      if (listed.size() <= Mesh::kSortedIncident && !std::is_sorted(listed.begin(), listed.end())) {
        Report(EntityKindName(lower), " ", id.slot(), " lists its users in no order");
      }
      std::sort(listed.begin(), listed.end());
      const auto expected = uses.Row(id.slot());
      if (!std::equal(listed.begin(), listed.end(), expected.begin(), expected.end())) {
        ReportDifferences({lower, id.slot()}, expected, listed);
      }
    });
  }

  /// Both ascend.
  void ReportDifferences(EntityId lower, absl::Span<const Slot> expected, absl::Span<const Slot> listed) {
    for (size_t e = 0, l = 0; e < expected.size() || l < listed.size();) {
      const Slot user =
          std::min(e < expected.size() ? expected[e] : kNoSlot, l < listed.size() ? listed[l] : kNoSlot);
      size_t times_expected = 0;
      size_t times_listed = 0;
      for (; e < expected.size() && expected[e] == user; ++e) ++times_expected;
      for (; l < listed.size() && listed[l] == user; ++l) ++times_listed;
      if (times_expected == times_listed) continue;
      Report(EntityKindName(lower.kind), " ", lower.slot, " lists its user ", user, " ",
             times_expected > times_listed ? "too rarely" : "too often");
    }
  }

  void CheckHubEdges() {
    size_t expected = 0;
    ForEachLive<EdgeId>(EntityKind::kEdge, [&](EdgeId e) {
      const auto [a, b] = PairKey(e);
      const bool hubs = mesh_.IncidentEdges(a).size() > Mesh::kHubDegree &&
                        mesh_.IncidentEdges(b).size() > Mesh::kHubDegree;
      if (!hubs || mesh_.IsDuplicate(e)) return;
      ++expected;
      const auto it = mesh_.hub_edges_.find({a, b});
      if (it == mesh_.hub_edges_.end() || it->second != e) Report("hub edge ", e.slot(), " is not indexed");
    });
    if (mesh_.hub_edges_.size() < expected) Report("the hub index is too small");
    for (const auto& [pair, e] : mesh_.hub_edges_) {
      const std::array<VertexId, 2> ends = {pair.first, pair.second};
      if (!mesh_.IsLive(e) || PairKey(e) != ends) Report("hub index holds wrong edge ", e.slot());
    }
  }

  void CheckHubFaces() {
    size_t expected = 0;
    ForEachLive<FaceId>(EntityKind::kFace, [&](FaceId f) {
      const auto edges = mesh_.Edges(f);
      const bool hubs = std::all_of(edges.begin(), edges.end(), [this](EdgeId e) {
        return mesh_.IncidentFaces(e).size() > Mesh::kHubDegree;
      });
      if (!hubs || mesh_.IsDuplicate(f)) return;
      ++expected;
      const auto it = mesh_.hub_faces_.find(CanonicalCycle(mesh_.Vertices(f)));
      if (it == mesh_.hub_faces_.end() || it->second != f) Report("hub face ", f.slot(), " is not indexed");
    });
    if (mesh_.hub_faces_.size() < expected) Report("the index of hub faces is too small");
    for (const auto& [key, f] : mesh_.hub_faces_) {
      if (!mesh_.IsLive(f) || CanonicalCycle(mesh_.Vertices(f)) != key)
        Report("hub index holds wrong face ", f.slot());
    }
  }

  // ---- Duplicates ----

  void CheckPrimaryEdges() { CheckPrimaries(EntityKind::kEdge); }
  void CheckPrimaryFaces() { CheckPrimaries(EntityKind::kFace); }

  using KeyedSlot = std::pair<CycleKey, Slot>;

  /// Edges or faces with their cycles, sorted by both: by the smallest vertex through buckets, which are
  /// small.
  std::vector<KeyedSlot> SortByCycle(EntityKind kind) const {
    std::vector<uint32_t> begins(size_t{mesh_.slots(EntityKind::kVertex).limit()} + 2, 0);
    std::vector<KeyedSlot> unsorted;
    unsorted.reserve(mesh_.NumLive(kind));
    mesh_.slots(kind).live().ForEach([&](Slot slot) {
      unsorted.push_back({CanonicalCycle(mesh_.VerticesOf({kind, slot})), slot});
      ++begins[unsorted.back().first[0].slot() + 2];
    });
    std::partial_sum(begins.begin(), begins.end(), begins.begin());
    std::vector<KeyedSlot> sorted(unsorted.size());
    for (const KeyedSlot& keyed : unsorted) sorted[begins[keyed.first[0].slot() + 1]++] = keyed;
    for (size_t v = 0; v + 1 < begins.size(); ++v) {
      if (begins[v + 1] - begins[v] > 1)
        std::sort(sorted.begin() + begins[v], sorted.begin() + begins[v + 1]);
    }
    return sorted;
  }

  void CheckPrimaries(EntityKind kind) {
    const std::vector<KeyedSlot> sorted = SortByCycle(kind);
    size_t cycles_with_duplicates = 0;
    for (size_t begin = 0; begin < sorted.size();) {
      size_t end = begin + 1;
      while (end < sorted.size() && sorted[end].first == sorted[begin].first) ++end;
      cycles_with_duplicates += CheckOneCycle(kind, absl::MakeConstSpan(sorted).subspan(begin, end - begin));
      begin = end;
    }
    if (mesh_.duplicates_[Dimension(kind)].size() != cycles_with_duplicates) {
      Report("wrong number of ", EntityKindName(kind), " duplicates indexed");
    }
  }

  /// Whether there are duplicates among those that share a cycle.
  bool CheckOneCycle(EntityKind kind, absl::Span<const KeyedSlot> sharing) {
    int primaries = 0;
    std::vector<Slot> duplicates;
    for (const auto& [key, slot] : sharing) {
      const EntityId id(kind, slot);
      if (mesh_.IsDuplicate(id)) {
        duplicates.push_back(slot);
        if (!mesh_.IsElement(id)) Report("derived duplicate ", EntityKindName(kind), " ", slot);
      } else if (++primaries > 1) {
        Report("two primaries, one is ", EntityKindName(kind), " ", slot);
      }
    }
    if (duplicates.empty()) return false;
    if (primaries == 0) Report("duplicate ", EntityKindName(kind), " ", duplicates[0], " without primary");
    const auto& index = mesh_.duplicates_[Dimension(kind)];
    const auto it = index.find(sharing[0].first);
    const bool indexed = it != index.end() && std::equal(duplicates.begin(), duplicates.end(),
                                                         it->second.begin(), it->second.end());
    if (!indexed) Report("duplicate ", EntityKindName(kind), " ", duplicates[0], " is not indexed");
    return true;
  }

  // ---- Boundary ----

  void CheckBoundary() {
    std::vector<uint32_t> of_vertices(mesh_.slots(EntityKind::kVertex).limit());
    std::vector<uint32_t> of_edges(mesh_.slots(EntityKind::kEdge).limit());
    ForEachLive<FaceId>(EntityKind::kFace, [&](FaceId f) {
      const bool expected = mesh_.IncidentCells(f).size() == 1;
      if (mesh_.IsOnBoundary(f) != expected) Report("face ", f.slot(), " has a wrong boundary bit");
      if (!expected) return;
      for (EdgeId e : mesh_.Edges(f)) ++of_edges[e.slot()];
    });
    ForEachLive<EdgeId>(EntityKind::kEdge, [&](EdgeId e) {
      of_edges[e.slot()] += mesh_.IncidentFaces(e).size() == 1;
      if (of_edges[e.slot()] == 0) return;
      for (VertexId v : mesh_.Vertices(e)) ++of_vertices[v.slot()];
    });
    CheckBoundaryUses(EntityKind::kVertex, of_vertices);
    CheckBoundaryUses(EntityKind::kEdge, of_edges);
    if (!mesh_.Boundary(EntityKind::kCell).empty()) Report("cells on the boundary");
    CheckNoDeadBits();
  }

  void CheckBoundaryUses(EntityKind kind, const std::vector<uint32_t>& expected) {
    for (Slot slot = 0; slot < expected.size(); ++slot) {
      if (mesh_.boundary_uses_[Dimension(kind)][slot] != expected[slot]) {
        Report(EntityKindName(kind), " ", slot, " has a wrong boundary counter");
      }
      if (mesh_.IsOnBoundary({kind, slot}) != (expected[slot] > 0)) {
        Report(EntityKindName(kind), " ", slot, " has a wrong boundary bit");
      }
    }
  }

  void CheckNoDeadBits() {
    for (EntityKind kind : kEntityKinds) {
      mesh_.Boundary(kind).ForEach([&](Slot slot) {
        if (!mesh_.IsLive({kind, slot})) Report("dead ", EntityKindName(kind), " ", slot, " on the boundary");
      });
    }
  }

  // ---- Counts, stamps, checksums ----

  void CheckCountsAndStamps() {
    for (EntityKind kind : kEntityKinds) {
      uint32_t elements = 0;
      uint32_t live = 0;
      mesh_.slots(kind).live().ForEach([&](Slot slot) {
        ++live;
        elements += mesh_.IsElement({kind, slot});
        CheckStamps({kind, slot});
      });
      if (!mesh_.slots(kind).IsSound())
        Report("slots of kind ", EntityKindName(kind), " are both live and free");
      if (!mesh_.changed(kind).IsSound())
        Report("a page of kind ", EntityKindName(kind), " hides a later stamp");
      if (live != mesh_.NumLive(kind)) Report("wrong count of live entities, kind ", EntityKindName(kind));
      if (elements != mesh_.NumElements(kind)) Report("wrong count of elements, kind ", EntityKindName(kind));
    }
  }

  void CheckDegenerate() {
    uint32_t degenerate = 0;
    for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
      mesh_.slots(kind).live().ForEach([&](Slot slot) {
        const EntityId id(kind, slot);
        if (mesh_.IsDegenerate(id) != HasRepeats(mesh_.VerticesOf(id))) {
          Report(EntityKindName(kind), " ", slot, " has a wrong degenerate flag");
        }
        degenerate += mesh_.IsElement(id) && mesh_.IsDegenerate(id);
      });
    }
    if (degenerate != mesh_.num_degenerate_) Report("wrong count of degenerate elements");
  }

  /// Each stored row is what brute force gathers, or open.
  void CheckStoredRelations() {
    for (Relation relation : kStorableRelations) {
      if (!mesh_.stored().Has(relation)) continue;
      mesh_.slots(relation.from).live().ForEach([&](Slot slot) { CheckStoredRow(relation, slot); });
    }
  }

  void CheckStoredRow(Relation relation, Slot slot) {
    const StoredRows* rows = mesh_.stored().Find(relation);
    if (rows != nullptr && rows->IsOpen(slot)) return;
    const auto stored = rows != nullptr ? rows->Row(slot) : mesh_.stored().cell_edges()->Row(slot);
    block_.Gather(mesh_, relation, {&slot, 1});
    if (stored == block_.Row(0)) return;
    Report("stored row ", EntityKindName(relation.from), " ", slot, " -> ", EntityKindName(relation.to),
           " is wrong");
  }

  void CheckAttributes() {
    for (const AttributeColumn& column : mesh_.attributes()) {
      const Slot limit = mesh_.slots(column.spec().kind).limit();
      bool sound = column.stamps().IsSound();
      column.stamps().ForEachSince(0, 0, column.stamps().size(), [&](Slot slot) {
        const bool live = slot < limit && mesh_.IsLive({column.spec().kind, slot});
        sound = sound && slot < limit && column.stamps().At(slot) <= mesh_.revision() + 1 &&
                (live || column.Row(slot) == column.default_row());
      });
      if (!sound) Report("attribute ", column.spec().name, " has impossible rows or stamps");
    }
  }

  void CheckStamps(EntityId id) {
    const int64_t born = mesh_.slots(id.kind).Born(id.slot);
    const int64_t changed = mesh_.changed(id.kind).At(id.slot);
    const bool has_changed = id.kind == EntityKind::kVertex || mesh_.IsElement(id);
    if (born < 1 || born > mesh_.revision() + 1 || (has_changed && changed < born) ||
        changed > mesh_.revision() + 1) {
      Report(EntityKindName(id.kind), " ", id.slot, " has impossible stamps: born ", born, ", changed ",
             changed);
    }
  }

  void CheckChecksum() {
    Checksum expected;
    ForEachLive<VertexId>(EntityKind::kVertex, [&](VertexId v) {
      expected.topology += Checksum::VertexTerm(v.slot());
      expected.geometry += Checksum::PositionTerm(v.slot(), mesh_.Position(v));
    });
    for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
      mesh_.slots(kind).live().ForEach([&](Slot slot) {
        const EntityId id(kind, slot);
        if (mesh_.IsElement(id))
          expected.topology += Checksum::ElementTerm(mesh_.Type(id), slot, mesh_.VerticesOf(id));
      });
    }
    if (expected.topology != mesh_.checksum().topology) Report("wrong topology checksum");
    if (expected.geometry != mesh_.checksum().geometry) Report("wrong geometry checksum");
  }

  const Mesh& mesh_;
  const ValidateOptions options_;
  std::vector<std::string> violations_;
  RowBlock block_;
};

std::vector<std::string> Validate(const Mesh& mesh, const ValidateOptions& options) {
  return MeshValidator(mesh, options).Run();
}

}  // namespace dynmesh
