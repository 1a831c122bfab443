#include "server/session/importer/mesh_builder.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

absl::Status VertexOutOfRange(Slot vertex, uint64_t num_vertices, uint64_t index) {
  return InvalidArgument(reason::kUnknownEntity,
                         absl::StrCat("element ", index, " names vertex ", vertex, ", but there are ",
                                      num_vertices, " vertices"),
                         {{"kind", "vertex"}, {"ids", absl::StrCat(vertex)}, {"index", absl::StrCat(index)}});
}

}  // namespace

absl::StatusOr<Mesh> MeshBuilder::Build(StagedMesh staged) {
  num_vertices_ = staged.num_vertices();
  total_ = staged.num_vertices() + staged.num_elements();
  BulkBuilder builder(options_);
  DYNMESH_RETURN_IF_ERROR(AddVertices(staged.positions(), builder));
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    std::list<StagedRun>& runs = staged.runs(kind);
    for (; !runs.empty(); runs.pop_front()) DYNMESH_RETURN_IF_ERROR(AddRun(runs.front(), builder));
  }
  DYNMESH_RETURN_IF_ERROR(CheckMemory(builder.memory_bytes()));
  absl::StatusOr<BulkResult> result = std::move(builder).Finish();
  if (!result.ok()) return WithImportIndex(result.status());
  CollectWarnings(*result);
  slots_ = std::move(result->slots);
  DYNMESH_RETURN_IF_ERROR(CheckMemory(result->mesh.memory_bytes()));
  for (StagedColumn& column : staged.columns()) DYNMESH_RETURN_IF_ERROR(AddColumn(column, result->mesh));
  DYNMESH_RETURN_IF_ERROR(result->mesh.Commit());
  return std::move(result->mesh);
}

void MeshBuilder::CollectWarnings(const BulkResult& result) {
  auto degenerate = result.degenerate.begin();
  for (EntityId id : result.duplicate) {
    for (; degenerate != result.degenerate.end() && *degenerate <= id; ++degenerate) {
      warnings_.Add(WarningKind::kDegenerateElement, *degenerate);
    }
    warnings_.Add(WarningKind::kDuplicateElement, id);
  }
  for (; degenerate != result.degenerate.end(); ++degenerate) {
    warnings_.Add(WarningKind::kDegenerateElement, *degenerate);
  }
}

absl::Status MeshBuilder::AddVertices(ByteQueue& positions, BulkBuilder& builder) {
  while (!positions.empty()) {
    const std::string block = positions.TakeFront();
    std::vector<Point> points(block.size() / sizeof(Point));
    std::memcpy(points.data(), block.data(), points.size() * sizeof(Point));
    DYNMESH_RETURN_IF_ERROR(builder.AddVertices(points));
    DYNMESH_RETURN_IF_ERROR(CheckCancelled());
  }
  return absl::OkStatus();
}

absl::Status MeshBuilder::AddRun(StagedRun& run, BulkBuilder& builder) {
  const size_t size = NumVertices(run.type);
  uint64_t index = run.first_index;
  while (!run.vertices.empty()) {
    const std::string block = run.vertices.TakeFront();
    std::vector<VertexId> vertices(block.size() / sizeof(VertexId));
    std::memcpy(static_cast<void*>(vertices.data()), block.data(), vertices.size() * sizeof(VertexId));
    for (size_t i = 0; i < vertices.size(); ++i) {
      if (vertices[i].slot() >= num_vertices_) {
        return VertexOutOfRange(vertices[i].slot(), num_vertices_, index + i / size);
      }
    }
    const absl::Status added = builder.AddElements(run.type, vertices);
    if (!added.ok()) return WithMetadata(added, "index", absl::StrCat(index));
    places_.push_back({KindOf(run.type), vertices.size() / size, index});
    index += vertices.size() / size;
    DYNMESH_RETURN_IF_ERROR(CheckCancelled());
  }
  return absl::OkStatus();
}

absl::Status MeshBuilder::WithImportIndex(const absl::Status& status) const {
  const auto detail = GetErrorDetail(status);
  uint64_t position = 0;
  if (!detail || !absl::SimpleAtoi(detail->Find("position"), &position)) return status;
  for (const RunPlace& place : places_) {
    if (EntityKindName(place.kind) != detail->Find("kind")) continue;
    if (position < place.count)
      return WithMetadata(status, "index", absl::StrCat(place.first_index + position));
    position -= place.count;
  }
  return status;
}

absl::Status MeshBuilder::AddColumn(StagedColumn& column, Mesh& mesh) {
  DYNMESH_RETURN_IF_ERROR(mesh.AddAttribute(column.spec));
  const int index = mesh.FindAttribute(column.spec.name, column.spec.kind);
  const size_t row_bytes = column.spec.row_bytes();
  const Permutation& slots = slots_[Dimension(column.spec.kind)];
  size_t item = 0;
  while (!column.rows.empty()) {
    const std::string block = column.rows.TakeFront();
    const auto* rows = reinterpret_cast<const uint8_t*>(block.data());
    for (size_t offset = 0; offset < block.size(); offset += row_bytes, ++item) {
      const Slot slot = slots.empty() ? item : slots[item];
      DYNMESH_RETURN_IF_ERROR(mesh.SetAttribute(index, slot, absl::MakeConstSpan(rows + offset, row_bytes)));
    }
    DYNMESH_RETURN_IF_ERROR(CheckCancelled());
  }
  return absl::OkStatus();
}

absl::Status MeshBuilder::OnProgress(uint64_t done, uint64_t total) {
  DYNMESH_RETURN_IF_ERROR(CheckCancelled());
  // What a builder counts are passes over elements; the peer is told of vertices and elements.
  const double share = static_cast<double>(done) / std::max<uint64_t>(total, 1);
  const uint64_t items = static_cast<uint64_t>(share * total_);
  if (items > reported_) monitor_.OnProgress(reported_ = items, total_);
  return absl::OkStatus();
}

absl::Status MeshBuilder::CheckCancelled() const {
  return monitor_.cancelled() ? CallCancelled() : absl::OkStatus();
}

absl::Status MeshBuilder::CheckMemory(uint64_t bytes) const {
  if (bytes <= limits_.max_session_bytes) return absl::OkStatus();
  return LimitExceeded("max_session_bytes", limits_.max_session_bytes, bytes);
}

}  // namespace dynmesh
