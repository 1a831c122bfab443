#include "core/edit/apply_patch.h"

#include <algorithm>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "core/edit/run_batch.h"
#include "core/edit/star.h"

namespace dynmesh {
namespace {

constexpr uint64_t kBytesOfRow = 32;  ///< its stamp and journal entry

int64_t EulerCharacteristic(const Mesh& mesh) {
  int64_t sum = 0;
  for (EntityKind kind : kEntityKinds)
    sum += (Dimension(kind) % 2 == 0 ? 1 : -1) * int64_t{mesh.NumLive(kind)};
  return sum;
}

/// Sets a row unless it is as wanted already; counts the bytes.
absl::Status SetRow(Mesh& mesh, int column, Slot slot, absl::Span<const uint8_t> row, uint64_t& bytes) {
  if (mesh.attributes()[column].Row(slot) == row) return absl::OkStatus();
  bytes += kBytesOfRow + 2 * row.size();  // in the column and in the journal
  return mesh.SetAttribute(column, slot, row);
}

/// Rows that outlive the entities which had them.
class SavedRows {
 public:
  SavedRows(const Mesh& mesh, absl::Span<const EntityId> entities) {
    if (mesh.attributes().empty()) return;
    for (EntityId id : entities) {
      begins_.push_back(rows_.size());
      for (size_t column = 0; column < mesh.attributes().size(); ++column) {
        if (mesh.attributes()[column].spec().kind == id.kind) Save(mesh, column, id.slot);
      }
    }
    begins_.push_back(rows_.size());
  }

  /// Gives `to` the rows of the i-th entity, which is of the same kind.
  absl::Status CopyTo(Mesh& mesh, size_t i, EntityId to, uint64_t& bytes) const {
    if (begins_.empty()) return absl::OkStatus();
    size_t next = begins_[i];
    for (int column = 0; column < static_cast<int>(mesh.attributes().size()); ++column) {
      const AttributeSpec& spec = mesh.attributes()[column].spec();
      if (spec.kind != to.kind) continue;
      const bool saved = next < begins_[i + 1] && rows_[next].column == column;
      const std::vector<uint8_t> row = saved ? rows_[next++].bytes : std::vector<uint8_t>(spec.row_bytes());
      DYNMESH_RETURN_IF_ERROR(SetRow(mesh, column, to.slot, row, bytes));
    }
    return absl::OkStatus();
  }

 private:
  struct Row {
    int column;
    std::vector<uint8_t> bytes;
  };

  void Save(const Mesh& mesh, int column, Slot slot) {
    const auto bytes = mesh.attributes()[column].Row(slot);
    const bool zero = std::all_of(bytes.begin(), bytes.end(), [](uint8_t byte) { return byte == 0; });
    if (!zero) rows_.push_back({column, {bytes.begin(), bytes.end()}});
  }

  std::vector<Row> rows_;       ///< that are not all zeros: of one entity after the other, by column
  std::vector<size_t> begins_;  ///< of each entity, and the end
};

std::vector<uint8_t> BlendRows(const AttributeColumn& column, const Blend& blend) {
  const size_t heaviest =
      std::max_element(blend.weights.begin(), blend.weights.end()) - blend.weights.begin();
  const auto copied = column.Row(blend.vertices[heaviest].slot());
  std::vector<uint8_t> row(copied.begin(), copied.end());
  if (column.spec().type != AttributeType::kFloat64) return row;
  std::vector<double> sum(column.spec().components);
  for (size_t i = 0; i < blend.vertices.size(); ++i) {
    const auto bytes = column.Row(blend.vertices[i].slot());
    for (size_t k = 0; k < sum.size(); ++k) {
      double value;
      std::memcpy(&value, &bytes[k * sizeof(value)], sizeof(value));
      sum[k] += blend.weights[i] * value;
    }
  }
  std::memcpy(row.data(), sum.data(), row.size());
  return row;
}

absl::Status BlendAttributes(Mesh& mesh, const Blend& blend, VertexId to, uint64_t& bytes) {
  if (blend.vertices.empty()) return absl::OkStatus();
  for (size_t column = 0; column < mesh.attributes().size(); ++column) {
    if (mesh.attributes()[column].spec().kind != EntityKind::kVertex) continue;
    DYNMESH_RETURN_IF_ERROR(
        SetRow(mesh, column, to.slot(), BlendRows(mesh.attributes()[column], blend), bytes));
  }
  return absl::OkStatus();
}

absl::Status PlaceVertices(Mesh& mesh, const Patch& patch, AppliedPatch& applied) {
  for (const Patch::NewVertex& vertex : patch.new_vertices) {
    DYNMESH_ASSIGN_OR_RETURN(const VertexId v, mesh.AddVertex(vertex.position));
    DYNMESH_RETURN_IF_ERROR(BlendAttributes(mesh, vertex.blend, v, applied.attribute_bytes));
    applied.new_vertices.push_back(v);
  }
  for (const Patch::Move& move : patch.moves) {
    DYNMESH_RETURN_IF_ERROR(mesh.MoveVertex(move.vertex, move.position));
    DYNMESH_RETURN_IF_ERROR(BlendAttributes(mesh, move.blend, move.vertex, applied.attribute_bytes));
  }
  return absl::OkStatus();
}

absl::Status ReplaceElements(Mesh& mesh, const Patch& patch, AppliedPatch& applied) {
  std::vector<NewElement> added = patch.added;
  for (NewElement& element : added) {
    for (VertexId& v : element.mutable_vertices()) {
      if (v.slot() & kNewVertex) v = applied.new_vertices[v.slot() & ~kNewVertex];
    }
  }
  const SavedRows rows(mesh, patch.removed);
  applied.added.resize(added.size());
  DYNMESH_RETURN_IF_ERROR(
      mesh.ReplaceElements(patch.removed, added, [&](size_t i, EntityId id) { applied.added[i] = id; }));
  for (size_t i = 0; i < added.size(); ++i) {
    DYNMESH_RETURN_IF_ERROR(rows.CopyTo(mesh, patch.parents[i], applied.added[i], applied.attribute_bytes));
  }
  return absl::OkStatus();
}

absl::Status Apply(Mesh& mesh, const Patch& patch, AppliedPatch& applied) {
  const int64_t before = EulerCharacteristic(mesh);
  DYNMESH_RETURN_IF_ERROR(PlaceVertices(mesh, patch, applied));
  DYNMESH_RETURN_IF_ERROR(ReplaceElements(mesh, patch, applied));
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

absl::Status ApplyPatch(Mesh& mesh, const Patch& patch, AppliedPatch& applied) {
  const Mesh::Savepoint savepoint = mesh.MakeSavepoint();
  applied.new_vertices.clear();
  applied.added.clear();
  applied.attribute_bytes = 0;
  absl::Status status = Apply(mesh, patch, applied);
  if (!status.ok()) PutBackTo(mesh, savepoint);
  return status;
}

}  // namespace dynmesh
