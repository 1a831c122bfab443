#include "core/edit/apply_patch.h"

#include "absl/container/inlined_vector.h"
#include "absl/strings/str_cat.h"
#include "core/edit/derived_rows.h"
#include "core/edit/mix_rows.h"
#include "core/edit/row_writer.h"
#include "core/edit/run_batch.h"
#include "core/edit/star.h"

namespace dynmesh {
namespace {

int64_t EulerCharacteristic(const Mesh& mesh) {
  int64_t sum = 0;
  for (EntityKind kind : kEntityKinds)
    sum += (Dimension(kind) % 2 == 0 ? 1 : -1) * int64_t{mesh.NumLive(kind)};
  return sum;
}

/// Rows of elements that outlive them.
class ElementRows {
 public:
  ElementRows(const Mesh& mesh, absl::Span<const EntityId> elements) {
    if (mesh.attributes().empty()) return;
    for (EntityId id : elements) {
      begins_.push_back(rows_.size());
      for (int column : ColumnsOf(mesh, id.kind)) Save(mesh.attributes()[column], column, id.slot);
    }
    begins_.push_back(rows_.size());
  }

  /// Gives `to` the rows of the i-th element, which is of the same kind.
  absl::Status PassOn(const Mesh& mesh, size_t i, EntityId to, RowWriter& writer) const {
    if (begins_.empty()) return absl::OkStatus();
    size_t next = begins_[i];
    for (int column : ColumnsOf(mesh, to.kind)) {
      const bool saved = next < begins_[i + 1] && rows_[next].column == column;
      const AttributeColumn& values = mesh.attributes()[column];
      const size_t size = values.spec().row_bytes();
      const auto row = saved ? pool_.At(rows_[next++].begin, size) : values.default_row();
      DYNMESH_RETURN_IF_ERROR(writer.Set(column, to.slot, row));
    }
    return absl::OkStatus();
  }

 private:
  struct Row {
    int column;
    size_t begin;  ///< in pool_
  };

  void Save(const AttributeColumn& values, int column, Slot slot) {
    const std::vector<uint8_t> row = MixRows(values, {RowShare{values.Row(slot)}});
    if (row != values.default_row()) rows_.push_back({column, pool_.Add(row)});
  }

  std::vector<Row> rows_;       ///< that are not the default: of one element after the other, by column
  std::vector<size_t> begins_;  ///< of each element, and the end
  RowPool pool_;
};

absl::Status BlendAttributes(const Mesh& mesh, const Blend& blend, VertexId to, RowWriter& writer) {
  if (mesh.attributes().empty() || blend.vertices.empty()) return absl::OkStatus();
  absl::InlinedVector<RowShare, 4> parents(blend.vertices.size());
  for (int column : ColumnsOf(mesh, EntityKind::kVertex)) {
    const AttributeColumn& values = mesh.attributes()[column];
    for (size_t i = 0; i < parents.size(); ++i) {
      parents[i] = {values.Row(blend.vertices[i].slot()), blend.weights[i]};
    }
    DYNMESH_RETURN_IF_ERROR(writer.Set(column, to.slot(), MixRows(values, parents)));
  }
  return absl::OkStatus();
}

/// New vertices may lie between those that others merge into, so these come first.
absl::Status PlaceVertices(Mesh& mesh, const Patch& patch, AppliedPatch& applied, RowWriter& writer) {
  for (const Patch::Merger& merger : patch.mergers) {
    const Blend blend{{merger.kept, merger.gone}, {1 - merger.weight, merger.weight}};
    DYNMESH_RETURN_IF_ERROR(BlendAttributes(mesh, blend, merger.kept, writer));
  }
  for (const Patch::NewVertex& vertex : patch.new_vertices) {
    DYNMESH_ASSIGN_OR_RETURN(const VertexId v, mesh.AddVertex(vertex.position));
    DYNMESH_RETURN_IF_ERROR(BlendAttributes(mesh, vertex.blend, v, writer));
    applied.new_vertices.push_back(v);
  }
  for (const Patch::Move& move : patch.moves) {
    DYNMESH_RETURN_IF_ERROR(mesh.MoveVertex(move.vertex, move.position));
  }
  return absl::OkStatus();
}

absl::Status ReplaceElements(Mesh& mesh, const Patch& patch, AppliedPatch& applied, RowWriter& writer) {
  std::vector<NewElement> added = patch.added;
  for (NewElement& element : added) {
    for (VertexId& v : element.mutable_vertices()) {
      if (v.slot() & kNewVertex) v = applied.new_vertices[v.slot() & ~kNewVertex];
    }
  }
  const DerivedRows derived(mesh, patch, applied.new_vertices);
  const ElementRows rows(mesh, patch.removed);
  applied.added.resize(added.size());
  DYNMESH_RETURN_IF_ERROR(
      mesh.ReplaceElements(patch.removed, added, [&](size_t i, EntityId id) { applied.added[i] = id; }));
  DYNMESH_RETURN_IF_ERROR(derived.PassOn(writer));
  for (size_t i = 0; i < added.size(); ++i) {
    DYNMESH_RETURN_IF_ERROR(rows.PassOn(mesh, patch.parents[i], applied.added[i], writer));
  }
  return absl::OkStatus();
}

absl::Status Apply(Mesh& mesh, const Patch& patch, AppliedPatch& applied, RowWriter& writer) {
  const int64_t before = EulerCharacteristic(mesh);
  DYNMESH_RETURN_IF_ERROR(PlaceVertices(mesh, patch, applied, writer));
  DYNMESH_RETURN_IF_ERROR(ReplaceElements(mesh, patch, applied, writer));
  for (VertexId v : patch.removed_vertices) DYNMESH_RETURN_IF_ERROR(mesh.RemoveVertex(v));
  const int64_t after = EulerCharacteristic(mesh);
  if (after == before || !patch.check_euler) return absl::OkStatus();
  const EntityKind kind = patch.removed.front().kind;
  std::vector<Slot> ids;
  for (EntityId id : patch.removed) {
    if (id.kind == kind) ids.push_back(id.slot);
  }
  return Refuse(reason::kWouldChangeTopology,
                absl::StrCat("the Euler characteristic would change by ", after - before), kind, ids);
}

}  // namespace

absl::Status ApplyPatch(Mesh& mesh, const Patch& patch, AppliedPatch& applied, uint64_t max_attribute_bytes) {
  const Mesh::Savepoint savepoint = mesh.MakeSavepoint();
  applied.new_vertices.clear();
  applied.added.clear();
  RowWriter writer(mesh, max_attribute_bytes);
  absl::Status status = Apply(mesh, patch, applied, writer);
  applied.attribute_bytes = writer.bytes();
  if (!status.ok()) PutBackTo(mesh, savepoint);
  return status;
}

}  // namespace dynmesh
