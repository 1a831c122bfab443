#include "core/edit/transaction.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/mesh/spatial_order.h"

namespace dynmesh {
namespace {

/// Fewer new vertices of one edit take slots in the order they came, more along a Hilbert curve.
constexpr size_t kFewVertices = 32;

absl::Status BadLength(absl::string_view what, size_t expected, size_t actual) {
  return InvalidArgument(reason::kBadArrayLength,
                         absl::StrCat(what, ": expected ", expected, " entries, got ", actual));
}

/// Applies the edits of one batch to a mesh whose journal is open. One visitor call for each edit.
class BatchApplier {
 public:
  BatchApplier(Mesh& mesh, const BatchOptions& options, BatchResult& result)
      : mesh_(mesh), as_of_(std::min(options.as_of_revision, mesh.revision())), result_(result) {}

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

 private:
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
      return new_vertices_[k];
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
    const bool finite = std::all_of(positions.begin(), positions.end(), [](const Point& p) {
      return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
    });
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
  BatchResult& result_;
  std::vector<VertexId> new_vertices_;
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

/// Memory that runs out in the middle is a refusal like others: the batch is rolled back, which needs next to
/// none.
absl::Status TryApplyAll(Mesh& mesh, absl::Span<const Edit> edits, const BatchOptions& options,
                         BatchResult& result) try {
  return ApplyAll(mesh, edits, options, result);
} catch (const std::bad_alloc&) {
  return MakeError(absl::StatusCode::kResourceExhausted, reason::kLimitExceeded, "memory ran out",
                   {{"limit", "memory"}});
}

}  // namespace

uint64_t NumItems(const Edit& edit) {
  struct Counter {
    uint64_t operator()(const AddVerticesEdit& e) const { return e.positions.size(); }
    uint64_t operator()(const RemoveVerticesEdit& e) const { return e.vertices.size(); }
    uint64_t operator()(const MoveVerticesEdit& e) const { return e.vertices.size(); }
    uint64_t operator()(const AddElementsEdit& e) const {
      return IsElementType(static_cast<int>(e.type)) ? e.vertices.size() / NumVertices(e.type)
                                                     : e.vertices.size();
    }
    uint64_t operator()(const RemoveElementsEdit& e) const { return e.elements.size(); }
    uint64_t operator()(const AddAttributeEdit&) const { return 1; }
    uint64_t operator()(const SetAttributeEdit& e) const { return e.slots.size(); }
  };
  return std::visit(Counter(), edit);
}

absl::StatusOr<BatchResult> ApplyBatch(Mesh& mesh, absl::Span<const Edit> edits,
                                       const BatchOptions& options) {
  BatchResult result;
  mesh.BeginBatch();
  absl::Status status = TryApplyAll(mesh, edits, options, result);
  if (!status.ok()) {
    mesh.Rollback();
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
