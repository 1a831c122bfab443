#include "core/edit/transaction.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/edit/bad_argument.h"
#include "core/edit/batch_names.h"
#include "core/edit/conflicts.h"
#include "core/edit/convert_rows.h"
#include "core/edit/operator_runner.h"
#include "core/edit/run_batch.h"
#include "core/mesh/spatial_order.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// Fewer new vertices of one edit take slots in the order they came, more along a Hilbert curve.
constexpr size_t kFewVertices = 32;

/// Applies the edits of one batch to a mesh whose journal is open. One visitor call for each edit.
class BatchApplier {
 public:
  BatchApplier(Mesh& mesh, const BatchOptions& options, BatchResult& result)
      : mesh_(mesh),
        names_(mesh, std::min(options.as_of_revision, mesh.revision())),
        result_(result),
        operators_(mesh, options, names_, result),
        max_attribute_bytes_(options.max_attribute_bytes) {}
  BatchApplier(const BatchApplier&) = delete;  // the runner refers to the names

  absl::Status operator()(const AddVerticesEdit& edit) {
    const size_t count = edit.positions.size();
    const Permutation order = count < kFewVertices ? Permutation() : FiniteOrder(edit.positions);
    std::vector<VertexId> added(count);
    DYNMESH_RETURN_IF_ERROR(ForEach(count, [&](size_t k) -> absl::Status {
      const size_t i = order.empty() ? k : order[k];
      DYNMESH_ASSIGN_OR_RETURN(added[i], mesh_.AddVertex(edit.positions[i]));
      return absl::OkStatus();
    }));
    for (VertexId v : added) {
      AddNewSlot(v.slot());
      names_.AddNewVertex(v);
    }
    return absl::OkStatus();
  }

  absl::Status operator()(const RemoveVerticesEdit& edit) {
    return ForEach(edit.vertices.size(), [&](size_t i) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(const VertexId v, names_.Vertex(edit.vertices[i]));
      return mesh_.RemoveVertex(v);
    });
  }

  absl::Status operator()(const MoveVerticesEdit& edit) {
    if (edit.positions.size() != edit.vertices.size()) {
      return BadLength("positions", edit.vertices.size(), edit.positions.size());
    }
    return ForEach(edit.vertices.size(), [&](size_t i) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(const VertexId v, names_.Vertex(edit.vertices[i]));
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
      return names_.CheckElement({edit.kind, edit.elements[i]});
    }));
    return mesh_.RemoveElements(edit.kind, edit.elements);
  }

  absl::Status operator()(const AddAttributeEdit& edit) { return mesh_.AddAttribute(edit.spec); }

  absl::Status operator()(const SetAttributeEdit& edit) {
    if (!IsEntityKind(edit.spec.kind)) return BadKind(edit.spec.kind);
    const int column = mesh_.FindAttribute(edit.spec.name, edit.spec.kind);
    if (column < 0) return UnknownAttribute(edit.spec);
    DYNMESH_RETURN_IF_ERROR(CheckRowsFit(mesh_.attributes()[column].spec(), edit.spec));
    const size_t bytes = edit.slots.size() * edit.spec.row_bytes();
    if (edit.rows.size() != bytes) return BadLength("bytes of attribute rows", bytes, edit.rows.size());
    const AttributeSpec spec = mesh_.attributes()[column].spec();
    if (spec.type == edit.spec.type) return SetRows(column, edit.slots, edit.rows);
    DYNMESH_ASSIGN_OR_RETURN(const std::vector<uint8_t> rows, ConvertRows(edit.rows, edit.spec.type, spec));
    return SetRows(column, edit.slots, rows);
  }

  /// Operators have a runner of their own.
  template <typename OperatorEdit>
  absl::Status operator()(const OperatorEdit& edit) {
    return operators_.Run(edit);
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

  /// Resolves the vertices of the i-th element.
  absl::Status ResolveAll(const AddElementsEdit& edit, size_t i, std::vector<VertexId>& vertices) const {
    const size_t size = NumVertices(edit.type);
    for (size_t k = i * size; k < (i + 1) * size; ++k) {
      DYNMESH_ASSIGN_OR_RETURN(vertices[k], names_.Vertex(edit.vertices[k]));
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

  absl::Status SetRows(int column, absl::Span<const Slot> slots, absl::Span<const uint8_t> rows) {
    const EntityKind kind = mesh_.attributes()[column].spec().kind;
    const size_t row_bytes = mesh_.attributes()[column].spec().row_bytes();
    return ForEach(slots.size(), [&](size_t i) -> absl::Status {
      DYNMESH_ASSIGN_OR_RETURN(const EntityId id, names_.Entity(kind, slots[i]));
      DYNMESH_RETURN_IF_ERROR(ChargeRow(column, id.slot));
      return mesh_.SetAttribute(column, id.slot, rows.subspan(i * row_bytes, row_bytes));
    });
  }

  /// A row at a far slot takes a page, which is much more than what arrives.
  absl::Status ChargeRow(int column, Slot slot) {
    attribute_bytes_ += mesh_.attributes()[column].BytesToSet({&slot, 1});
    if (attribute_bytes_ <= max_attribute_bytes_) return absl::OkStatus();
    return LimitExceeded("max_session_bytes", max_attribute_bytes_, attribute_bytes_);
  }

  /// Hilbert order, or none when a position is not finite and so will be refused.
  static Permutation FiniteOrder(absl::Span<const Point> positions) {
    const bool finite = std::all_of(positions.begin(), positions.end(), IsFinite);
    return finite ? HilbertOrder(positions) : Permutation();
  }

  static absl::Status UnknownAttribute(const AttributeSpec& spec) {
    return MakeError(absl::StatusCode::kNotFound, reason::kUnknownAttribute,
                     absl::StrCat("no ", EntityKindName(spec.kind), " attribute '", spec.name, "'"),
                     {{"attribute", spec.name}});
  }

  static absl::Status CheckRowsFit(const AttributeSpec& column, const AttributeSpec& rows) {
    if (ScalarBytes(rows.type) == 0) {
      return InvalidArgument(reason::kBadArgument, "the values have no type that columns have",
                             {{"field", "type"}, {"attribute", rows.name}});
    }
    if (rows.components == column.components) return absl::OkStatus();
    return InvalidArgument(reason::kBadArgument,
                           absl::StrCat(EntityKindName(rows.kind), " attribute '", rows.name, "' has ",
                                        column.components, " components, not ", rows.components),
                           {{"field", "components"},
                            {"attribute", rows.name},
                            {"expected", absl::StrCat(column.components)},
                            {"actual", absl::StrCat(rows.components)}});
  }

  void AddNewSlot(Slot slot) { result_.results.back().new_slots.push_back(slot); }

  Mesh& mesh_;
  BatchNames names_;
  BatchResult& result_;
  OperatorRunner operators_;
  const uint64_t max_attribute_bytes_;
  uint64_t attribute_bytes_ = 0;  ///< of rows that were set
};

absl::Status ApplyAll(Mesh& mesh, absl::Span<const Edit> edits, const BatchOptions& options,
                      BatchResult& result) {
  BatchApplier applier(mesh, options, result);
  ConflictCheck conflicts(mesh, options.conflict_policy, options.as_of_revision);
  for (size_t i = 0; i < edits.size(); ++i) {
    result.results.emplace_back();
    const Mesh::Savepoint before = mesh.MakeSavepoint();
    absl::Status status = std::visit(applier, edits[i]);
    status = status.ok() ? conflicts.CheckSince(before) : conflicts.Explain(status);
    if (!status.ok()) return WithMetadata(status, "edit", absl::StrCat(i));
  }
  return absl::OkStatus();
}

/// Counts what a checker looks at, and asks BatchOptions::meter now and then.
class CheckMeter final : public WorkMeter {
 public:
  explicit CheckMeter(const BatchOptions& options) : options_(options) {}

  absl::Status ChargeSteps(uint64_t steps) override {
    work_ += steps;
    uncharged_ += steps;
    if (work_ > options_.max_work) return LimitExceeded("max_batch_work", options_.max_work, work_);
    return uncharged_ < kMaxCharge ? absl::OkStatus()
                                   : options_.meter.ChargeManySteps(std::exchange(uncharged_, 0));
  }
  absl::Status ChargeBytes(uint64_t) override { return absl::OkStatus(); }

 private:
  const BatchOptions& options_;
  uint64_t work_ = 0;
  uint64_t uncharged_ = 0;
};

absl::Status CheckAll(const Mesh& mesh, const BatchOptions& options, BatchResult& result) {
  if (options.checker == nullptr) return absl::OkStatus();
  CheckMeter meter(options);
  return options.checker->Check(mesh, meter, result.warnings);
}

}  // namespace

absl::StatusOr<BatchResult> ApplyBatch(Mesh& mesh, absl::Span<const Edit> edits,
                                       const BatchOptions& options) {
  BatchResult result;
  const absl::Status applied = RunInBatch(mesh, [&]() -> absl::Status {
    DYNMESH_RETURN_IF_ERROR(ApplyAll(mesh, edits, options, result));
    DYNMESH_RETURN_IF_ERROR(CheckAll(mesh, options, result));
    if (options.make_image && !options.dry_run) result.image = mesh.ImageSince(0);
    return absl::OkStatus();
  });
  if (!applied.ok()) return applied;
  result.checksum = mesh.checksum();
  for (EntityKind kind : kEntityKinds) result.counts[Dimension(kind)] = mesh.NumLive(kind);
  const bool leaves_no_trace = options.dry_run || edits.empty();
  const BatchEnding ending = leaves_no_trace ? BatchEnding::kRollBack : BatchEnding::kCommit;
  DYNMESH_RETURN_IF_ERROR(EndBatch(mesh, ending, options.keeper));
  result.revision = mesh.revision();
  return result;
}

}  // namespace dynmesh
