#include "core/edit/transaction.h"

#include <algorithm>
#include <new>
#include <stdexcept>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/edit/apply_patch.h"
#include "core/edit/collapse.h"
#include "core/edit/merge.h"
#include "core/edit/split.h"
#include "core/edit/star.h"
#include "core/edit/swap.h"
#include "core/mesh/spatial_order.h"
#include "core/mesh/validate.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// Fewer new vertices of one edit take slots in the order they came, more along a Hilbert curve.
constexpr size_t kFewVertices = 32;

/// Of an operator, whatever it looks at.
constexpr uint64_t kWorkOfItem = 10;

/// Of each element that it removes or adds: checking it, linking it, and perhaps putting it back.
constexpr uint64_t kWorkToReplace = 10;

absl::Status BadLength(absl::string_view what, size_t expected, size_t actual) {
  return InvalidArgument(reason::kBadArrayLength,
                         absl::StrCat(what, ": expected ", expected, " entries, got ", actual));
}

/// Applies the edits of one batch to a mesh whose journal is open. One visitor call for each edit.
class BatchApplier {
 public:
  BatchApplier(Mesh& mesh, const BatchOptions& options, BatchResult& result)
      : mesh_(mesh),
        as_of_(std::min(options.as_of_revision, mesh.revision())),
        options_(options),
        result_(result) {}

  absl::Status operator()(const AddVerticesEdit& edit) {
    const size_t count = edit.positions.size();
    const Permutation order = count < kFewVertices ? Permutation() : FiniteOrder(edit.positions);
    std::vector<VertexId> added(count);
    DYNMESH_RETURN_IF_ERROR(ForEach(count, [&](size_t k) -> absl::Status {
      const size_t i = order.empty() ? k : order[k];
      DYNMESH_ASSIGN_OR_RETURN(added[i], mesh_.AddVertex(edit.positions[i]));
      return absl::OkStatus();
    }));
    for (VertexId v : added) AddNewSlot(v.slot());
    new_vertices_.insert(new_vertices_.end(), added.begin(), added.end());
    return absl::OkStatus();
  }

  absl::Status operator()(const RemoveVerticesEdit& edit) {
    return ForEach(edit.vertices.size(), [&](size_t i) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(const VertexId v, Resolve(edit.vertices[i]));
      return mesh_.RemoveVertex(v);
    });
  }

  absl::Status operator()(const MoveVerticesEdit& edit) {
    if (edit.positions.size() != edit.vertices.size()) {
      return BadLength("positions", edit.vertices.size(), edit.positions.size());
    }
    return ForEach(edit.vertices.size(), [&](size_t i) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(const VertexId v, Resolve(edit.vertices[i]));
      return mesh_.MoveVertex(v, edit.positions[i]);
    });
  }

  absl::Status operator()(const AddElementsEdit& edit) {
    if (!IsElementType(static_cast<int>(edit.type))) {
      return InvalidArgument(reason::kBadElementType,
                             absl::StrCat("element type ", static_cast<int>(edit.type), " is none of 1-7"));
    }
    const size_t size = NumVertices(edit.type);
    if (edit.vertices.size() % size != 0) {
      return InvalidArgument(reason::kBadArrayLength,
                             absl::StrCat(edit.vertices.size(), " vertex ids are no whole number of ",
                                          ElementTypeName(edit.type), " elements"));
    }
    std::vector<VertexId> vertices(edit.vertices.size());
    DYNMESH_RETURN_IF_ERROR(
        ForEach(vertices.size() / size, [&](size_t i) { return ResolveAll(edit, i, vertices); }));
    return AddElements(edit.type, vertices);
  }

  absl::Status operator()(const RemoveElementsEdit& edit) {
    if (!IsEntityKind(edit.kind)) return BadKind(edit.kind);
    DYNMESH_RETURN_IF_ERROR(ForEach(edit.elements.size(), [&](size_t i) {
      return CheckElement({edit.kind, edit.elements[i]});
    }));
    return mesh_.RemoveElements(edit.kind, edit.elements);
  }

  absl::Status operator()(const AddAttributeEdit& edit) { return mesh_.AddAttribute(edit.spec); }

  absl::Status operator()(const SetAttributeEdit& edit) {
    if (!IsEntityKind(edit.spec.kind)) return BadKind(edit.spec.kind);
    const int column = mesh_.FindAttribute(edit.spec.name, edit.spec.kind);
    if (column < 0 || mesh_.attributes()[column].spec() != edit.spec) return UnknownAttribute(edit.spec);
    const size_t row_bytes = edit.spec.row_bytes();
    if (edit.rows.size() != edit.slots.size() * row_bytes) {
      return BadLength("bytes of attribute rows", edit.slots.size() * row_bytes, edit.rows.size());
    }
    return ForEach(edit.slots.size(), [&](size_t i) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(const EntityId id, ResolveEntity(edit.spec.kind, edit.slots[i]));
      return mesh_.SetAttribute(column, id.slot,
                                absl::MakeConstSpan(edit.rows).subspan(i * row_bytes, row_bytes));
    });
  }

  absl::Status operator()(const SplitEdgesEdit& edit) {
    DYNMESH_RETURN_IF_ERROR(CheckPlaces(edit, [](double t) { return t > 0 && t < 1; }));
    return Operate({edit.edges.size(), 1}, edit.limits, [&](size_t i) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(const EdgeId e, ResolveEdge(edit.edges, i));
      SplitPlace place;
      if (!edit.parameters.empty()) place.parameter = edit.parameters[i];
      place.position = PositionAt(edit.positions, i);
      place.origin = OriginOf(edit.edges, i);
      return PlanSplitEdge(mesh_, e, place, patch_);
    });
  }

  absl::Status operator()(const CollapseEdgesEdit& edit) {
    DYNMESH_RETURN_IF_ERROR(CheckPlaces(edit, [](double t) { return t >= 0 && t <= 1; }));
    return Operate({edit.edges.size(), 0}, edit.limits, [&](size_t i) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(const EdgeId e, ResolveEdge(edit.edges, i));
      CollapsePlace place;
      place.origin = OriginOf(edit.edges, i);
      place.parameter = edit.parameters.empty() ? DefaultParameter(e, place.origin) : edit.parameters[i];
      place.position = PositionAt(edit.positions, i);
      return PlanCollapseEdge(mesh_, e, place, patch_);
    });
  }

  absl::Status operator()(const SwapEdgesEdit& edit) {
    DYNMESH_RETURN_IF_ERROR(CheckNames(edit.edges));
    return Operate({edit.edges.size(), 0}, edit.limits, [&](size_t i) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(const EdgeId e, ResolveEdge(edit.edges, i));
      return PlanSwapEdge(mesh_, e, patch_);
    });
  }

  absl::Status operator()(const SwapFacesEdit& edit) {
    return Operate({edit.faces.size(), 0}, edit.limits, [&](size_t i) -> absl::Status {
      DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive(FaceId(edit.faces[i]), as_of_));
      return PlanSwapFace(mesh_, FaceId(edit.faces[i]), patch_);
    });
  }

  absl::Status operator()(const SplitElementsEdit& edit) {
    if (!IsEntityKind(edit.kind)) return BadKind(edit.kind);
    if (edit.kind == EntityKind::kVertex) {
      return InvalidArgument(reason::kBadEntityKind, "vertices are no elements", {{"field", "kind"}});
    }
    DYNMESH_RETURN_IF_ERROR(CheckPositions(edit.positions, edit.elements.size()));
    return Operate({edit.elements.size(), 1}, edit.limits, [&](size_t i) -> absl::Status {
      const EntityId id(edit.kind, edit.elements[i]);
      DYNMESH_RETURN_IF_ERROR(CheckElement(id));
      return PlanSplitElement(mesh_, id, PositionAt(edit.positions, i), patch_);
    });
  }

  absl::Status operator()(const MergeVerticesEdit& edit) {
    const size_t count = edit.pairs.size() / 2;
    if (edit.pairs.size() % 2 != 0) return BadLength("vertices of pairs", 2 * count + 2, edit.pairs.size());
    DYNMESH_RETURN_IF_ERROR(CheckPositions(edit.positions, count));
    return Operate({count, 0}, edit.limits, [&](size_t i) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(const VertexId kept, ResolveLive(edit.pairs[2 * i]));
      DYNMESH_ASSIGN_OR_RETURN(const VertexId gone, ResolveLive(edit.pairs[2 * i + 1]));
      return PlanMergeVertices(mesh_, kept, gone, PositionAt(edit.positions, i), patch_);
    });
  }

 private:
  // ---- Operators ----

  /// Items of an operator, and the vertices that each is known to add, which later edits can name.
  struct Items {
    size_t count;
    size_t new_vertices;
  };

  /// Plans, checks and carries out each item's patch, before the next one is planned.
  template <typename Plan>
  absl::Status Operate(const Items& items, const PatchLimits& limits, Plan plan) {
    if (!(limits.min_quality >= 0 && limits.min_quality <= 1)) {
      return InvalidArgument(reason::kBadArgument,
                             absl::StrCat("a quality is from 0 to 1, not ", limits.min_quality),
                             {{"field", "min_quality"}});
    }
    for (size_t i = 0; i < items.count; ++i) {
      patch_.Clear();
      absl::Status status = plan(i);
      if (const absl::Status charged = Charge(); !charged.ok())
        return WithMetadata(charged, "index", absl::StrCat(i));
      if (status.ok()) status = CheckPatch(mesh_, patch_, limits);
      if (status.ok()) status = ApplyPatch(mesh_, patch_, applied_);
      if (status.ok()) {
        attribute_bytes_ += applied_.attribute_bytes;
        if (attribute_bytes_ > options_.max_attribute_bytes) {
          return LimitExceeded("max_session_bytes", options_.max_attribute_bytes, attribute_bytes_);
        }
        DYNMESH_RETURN_IF_ERROR(Report(items));
      } else if (options_.skip_refused && IsRefusal(status)) {
        Skip(items, i, std::move(status));
      } else {
        return WithMetadata(status, "index", absl::StrCat(i));
      }
    }
    return absl::OkStatus();
  }

  /// Whether the state of the mesh speaks against an item, and not what the caller wrote, or a limit.
  static bool IsRefusal(const absl::Status& status) {
    return absl::IsFailedPrecondition(status) || absl::IsNotFound(status);
  }

  /// Counts what was planned, so that few items cannot take long or fill the memory.
  absl::Status Charge() {
    work_ += kWorkOfItem + patch_.work + kWorkToReplace * (patch_.removed.size() + patch_.added.size());
    result_.num_made += patch_.added.size();
    if (work_ > options_.max_work) return LimitExceeded("max_batch_work", options_.max_work, work_);
    if (result_.num_made > options_.max_made) {
      return LimitExceeded("max_batch_items", options_.max_made, result_.num_made);
    }
    return absl::OkStatus();
  }

  /// Vertices that were not made keep their places, so that later ones can be counted on.
  void Skip(const Items& items, uint32_t index, absl::Status status) {
    EditResult& result = result_.results.back();
    new_vertices_.insert(new_vertices_.end(), items.new_vertices, VertexId());
    result.new_slots.insert(result.new_slots.end(), items.new_vertices, kNoSlot);
    result.skipped.push_back(index);
    if (num_refusals_++ < kMaxRefusals) result.refusals.push_back({index, std::move(status)});
  }

  absl::Status Report(const Items& items) {
    EditResult& result = result_.results.back();
    for (VertexId v : applied_.new_vertices) result.new_slots.push_back(v.slot());
    const auto first = applied_.new_vertices.begin();
    new_vertices_.insert(new_vertices_.end(), first, first + items.new_vertices);
    if (options_.max_lineage == 0) return absl::OkStatus();
    num_lineage_ += applied_.added.size();
    if (num_lineage_ > options_.max_lineage) {
      return LimitExceeded("max_lineage", options_.max_lineage, num_lineage_);
    }
    for (size_t k = 0; k < applied_.added.size(); ++k) {
      result.lineage.push_back({applied_.added[k], patch_.removed[patch_.parents[k]]});
    }
    return absl::OkStatus();
  }

  static absl::Status CheckNames(const EdgeNames& edges) {
    if (!edges.ids.empty() && !edges.ends.empty()) {
      return InvalidArgument(reason::kBadArgument, "edges are named by ids or by their ends, not both",
                             {{"field", "edges"}});
    }
    return edges.ends.size() % 2 == 0 ? absl::OkStatus()
                                      : BadLength("ends of edges", edges.ends.size() + 1, edges.ends.size());
  }

  /// Of SplitEdges and CollapseEdges. All items are checked before the first one is carried out.
  template <typename EdgesEdit>
  static absl::Status CheckPlaces(const EdgesEdit& edit, absl::FunctionRef<bool(double)> is_parameter) {
    DYNMESH_RETURN_IF_ERROR(CheckNames(edit.edges));
    const size_t count = edit.edges.size();
    if (!edit.parameters.empty() && edit.parameters.size() != count) {
      return BadLength("parameters", count, edit.parameters.size());
    }
    for (size_t i = 0; i < edit.parameters.size(); ++i) {
      if (is_parameter(edit.parameters[i])) continue;
      return InvalidArgument(reason::kBadArgument,
                             absl::StrCat("parameter ", edit.parameters[i], " is not on the edge"),
                             {{"field", "parameters"}, {"index", absl::StrCat(i)}});
    }
    return CheckPositions(edit.positions, count);
  }

  static absl::Status CheckPositions(absl::Span<const Point> positions, size_t count) {
    if (!positions.empty() && positions.size() != count)
      return BadLength("positions", count, positions.size());
    for (size_t i = 0; i < positions.size(); ++i) {
      if (IsFinite(positions[i])) continue;
      return InvalidArgument(reason::kNonFinite, "a coordinate is NaN or infinite",
                             {{"field", "positions"}, {"index", absl::StrCat(i)}});
    }
    return absl::OkStatus();
  }

  static absl::optional<Point> PositionAt(absl::Span<const Point> positions, size_t i) {
    return positions.empty() ? absl::nullopt : absl::optional<Point>(positions[i]);
  }

  /// By default the middle, but where just one end is on the boundary that end, so that the boundary stays.
  double DefaultParameter(EdgeId e, VertexId origin) const {
    const auto ends = EndsFrom(mesh_, e, origin);
    const bool first = mesh_.IsOnBoundary(ends[0]), second = mesh_.IsOnBoundary(ends[1]);
    return first == second ? 0.5 : first ? 0 : 1;
  }

  /// Resolve for a vertex that must still be there: one that the batch made may be gone again.
  absl::StatusOr<VertexId> ResolveLive(Slot slot) const {
    DYNMESH_ASSIGN_OR_RETURN(const VertexId v, Resolve(slot));
    DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive(v));
    return v;
  }

  /// The end that was named first. REQUIRES: ResolveEdge succeeded.
  VertexId OriginOf(const EdgeNames& edges, size_t i) const {
    return edges.ends.empty() ? VertexId() : *Resolve(edges.ends[2 * i]);
  }

  absl::StatusOr<EdgeId> ResolveEdge(const EdgeNames& edges, size_t i) const {
    if (!edges.ids.empty()) {
      DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive(EdgeId(edges.ids[i]), as_of_));
      return EdgeId(edges.ids[i]);
    }
    DYNMESH_ASSIGN_OR_RETURN(const VertexId a, Resolve(edges.ends[2 * i]));
    DYNMESH_ASSIGN_OR_RETURN(const VertexId b, Resolve(edges.ends[2 * i + 1]));
    const EdgeId e = mesh_.FindEdge(a, b);
    if (e.valid()) return e;
    return MakeError(absl::StatusCode::kNotFound, reason::kUnknownEntity,
                     absl::StrCat("no edge joins vertices ", a.slot(), " and ", b.slot()),
                     {{"kind", "vertex"}, {"ids", JoinSlots({a.slot(), b.slot()})}});
  }

  // ---- Names ----

  /// Calls fn(0), fn(1), ... until one fails, and says which.
  template <typename Fn>
  absl::Status ForEach(size_t count, Fn fn) {
    for (size_t i = 0; i < count; ++i) {
      if (absl::Status status = fn(i); !status.ok()) return WithMetadata(status, "index", absl::StrCat(i));
    }
    return absl::OkStatus();
  }

  /// The vertex that a caller's id names: one that was there, or kNewVertex | k.
  absl::StatusOr<VertexId> Resolve(Slot slot) const {
    if (slot & kNewVertex) {
      const Slot k = slot & ~kNewVertex;
      if (k >= new_vertices_.size()) {
        return InvalidArgument(reason::kUnknownEntity,
                               absl::StrCat("the batch has added ", new_vertices_.size(),
                                            " vertices so far, there is no new vertex ", k),
                               {{"kind", "vertex"}, {"ids", absl::StrCat(slot)}});
      }
      if (new_vertices_[k].valid()) return new_vertices_[k];
      return MakeError(absl::StatusCode::kNotFound, reason::kUnknownEntity,
                       absl::StrCat("new vertex ", k, " was not made: its item was refused"),
                       {{"kind", "vertex"}, {"ids", absl::StrCat(slot)}});
    }
    DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive(VertexId(slot), as_of_));
    return VertexId(slot);
  }

  /// An element is as old as its last addition: a face may have lived on as a derived one in between.
  absl::Status CheckElement(EntityId id) const {
    if (id.kind == EntityKind::kVertex) return absl::OkStatus();  // RemoveElement refuses it
    DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive(id, as_of_));
    const bool same = !mesh_.IsElement(id) || mesh_.changed(id.kind).At(id.slot) <= as_of_;
    return same ? absl::OkStatus() : EntityNotFound(reason::kEntityRemoved, id);
  }

  static absl::Status BadKind(EntityKind kind) {
    return InvalidArgument(reason::kBadEntityKind,
                           absl::StrCat("entity kind ", Dimension(kind), " is none of 0-3"));
  }

  absl::StatusOr<EntityId> ResolveEntity(EntityKind kind, Slot slot) const {
    if (kind == EntityKind::kVertex) {
      DYNMESH_ASSIGN_OR_RETURN(const VertexId v, Resolve(slot));
      return EntityId(v);
    }
    DYNMESH_RETURN_IF_ERROR(mesh_.CheckLive({kind, slot}, as_of_));
    return EntityId(kind, slot);
  }

  /// Resolves the vertices of the i-th element.
  absl::Status ResolveAll(const AddElementsEdit& edit, size_t i, std::vector<VertexId>& vertices) const {
    const size_t size = NumVertices(edit.type);
    for (size_t k = i * size; k < (i + 1) * size; ++k) {
      DYNMESH_ASSIGN_OR_RETURN(vertices[k], Resolve(edit.vertices[k]));
    }
    return absl::OkStatus();
  }

  absl::Status AddElements(ElementType type, absl::Span<const VertexId> vertices) {
    struct Added {
      EntityId id;
      bool duplicate;
    };
    std::vector<Added> added(vertices.size() / NumVertices(type));
    DYNMESH_RETURN_IF_ERROR(mesh_.AddElements(type, vertices, [&](size_t i, EntityId id) {
      const bool twin = id.kind == EntityKind::kCell && mesh_.FindTwin(CellId(id.slot)).valid();
      added[i] = {id, twin || mesh_.IsDuplicate(id)};
    }));
    for (const auto& [id, duplicate] : added) {
      AddNewSlot(id.slot);
      if (mesh_.IsDegenerate(id)) result_.degenerate.push_back(id);
      if (duplicate) result_.duplicate.push_back(id);
    }
    return absl::OkStatus();
  }

  /// Hilbert order, or none when a position is not finite and so will be refused.
  static Permutation FiniteOrder(absl::Span<const Point> positions) {
    const bool finite = std::all_of(positions.begin(), positions.end(), IsFinite);
    return finite ? HilbertOrder(positions) : Permutation();
  }

  static absl::Status UnknownAttribute(const AttributeSpec& spec) {
    return MakeError(absl::StatusCode::kNotFound, reason::kUnknownAttribute,
                     absl::StrCat("no ", EntityKindName(spec.kind), " attribute '", spec.name,
                                  "' of this type and number of components"),
                     {{"attribute", spec.name}});
  }

  void AddNewSlot(Slot slot) { result_.results.back().new_slots.push_back(slot); }

  Mesh& mesh_;
  const int64_t as_of_;
  const BatchOptions& options_;
  BatchResult& result_;
  std::vector<VertexId> new_vertices_;
  size_t num_lineage_ = 0;
  uint64_t work_ = 0;
  size_t num_refusals_ = 0;
  uint64_t attribute_bytes_ = 0;
  Patch patch_;
  AppliedPatch applied_;
};

absl::Status ApplyAll(Mesh& mesh, absl::Span<const Edit> edits, const BatchOptions& options,
                      BatchResult& result) {
  BatchApplier applier(mesh, options, result);
  for (size_t i = 0; i < edits.size(); ++i) {
    result.results.emplace_back();
    if (absl::Status status = std::visit(applier, edits[i]); !status.ok()) {
      return WithMetadata(status, "edit", absl::StrCat(i));
    }
  }
  return absl::OkStatus();
}

/// Memory that runs out in the middle is a refusal like others, if the mesh can be put back.
absl::Status TryApplyAll(Mesh& mesh, absl::Span<const Edit> edits, const BatchOptions& options,
                         BatchResult& result, bool& ran_out) try {
  return ApplyAll(mesh, edits, options, result);
} catch (const std::bad_alloc&) {
  ran_out = true;
  return MakeError(absl::StatusCode::kResourceExhausted, reason::kLimitExceeded, "memory ran out",
                   {{"limit", "memory"}});
}

/// Puts the mesh back. Where an allocation failed, an entity may have been left half made, which no journal
/// knows: then all of the mesh is looked at, and one that is damaged is not kept in service.
void PutBack(Mesh& mesh, bool ran_out) {
  mesh.Rollback();
  if (ran_out && !Validate(mesh, {.max_violations = 1}).empty()) {
    throw std::runtime_error("memory ran out in the middle of an edit");
  }
}

}  // namespace

absl::StatusOr<BatchResult> ApplyBatch(Mesh& mesh, absl::Span<const Edit> edits,
                                       const BatchOptions& options) {
  BatchResult result;
  mesh.BeginBatch();
  bool ran_out = false;
  absl::Status status = TryApplyAll(mesh, edits, options, result, ran_out);
  if (!status.ok()) {
    PutBack(mesh, ran_out);
    return status;
  }
  result.checksum = mesh.checksum();
  for (EntityKind kind : kEntityKinds) result.counts[Dimension(kind)] = mesh.NumLive(kind);
  if (options.dry_run || edits.empty()) {
    mesh.Rollback();
  } else if (status = mesh.Commit(); !status.ok()) {
    mesh.Rollback();
    return status;
  }
  result.revision = mesh.revision();
  return result;
}

}  // namespace dynmesh
