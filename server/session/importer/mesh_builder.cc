#include "server/session/importer/mesh_builder.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

// Between two looks at the monitor and at the memory.
constexpr uint64_t kItemsPerTick = 16384;

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
  Reserve(staged);
  DYNMESH_RETURN_IF_ERROR(AddVertices(staged.positions()));
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    std::list<StagedRun>& runs = staged.runs(kind);
    for (; !runs.empty(); runs.pop_front()) DYNMESH_RETURN_IF_ERROR(AddRun(runs.front()));
  }
  for (StagedColumn& column : staged.columns()) DYNMESH_RETURN_IF_ERROR(AddColumn(column));
  DYNMESH_RETURN_IF_ERROR(mesh_.Commit());
  return std::move(mesh_);
}

void MeshBuilder::Reserve(const StagedMesh& staged) {
  auto counts = EstimateCounts(staged.num_vertices(), staged.type_counts());
  for (EntityKind kind : kEntityKinds) {
    // Pages that are reserved and never touched cost nothing; growing by doubling would.
    uint64_t& count = counts[Dimension(kind)];
    count = std::min<uint64_t>(count + count / 32, limits_.max_slots(kind));
  }
  mesh_.Reserve(counts);
}

absl::Status MeshBuilder::AddVertices(ByteQueue& positions) {
  while (!positions.empty()) {
    const std::string block = positions.TakeFront();
    for (size_t offset = 0; offset < block.size(); offset += sizeof(Point)) {
      Point position;
      std::memcpy(&position, block.data() + offset, sizeof(position));
      DYNMESH_RETURN_IF_ERROR(mesh_.AddVertex(position).status());
      DYNMESH_RETURN_IF_ERROR(Tick());
    }
  }
  return absl::OkStatus();
}

absl::Status MeshBuilder::AddRun(StagedRun& run) {
  const size_t record = NumVertices(run.type) * sizeof(Slot);
  uint64_t index = run.first_index;
  while (!run.vertices.empty()) {
    const std::string block = run.vertices.TakeFront();
    for (size_t offset = 0; offset < block.size(); offset += record, ++index) {
      const absl::Status added = AddElement(run.type, block.data() + offset, index);
      if (!added.ok()) return WithMetadata(added, "index", absl::StrCat(index));
      DYNMESH_RETURN_IF_ERROR(Tick());
    }
  }
  return absl::OkStatus();
}

absl::Status MeshBuilder::AddElement(ElementType type, const char* ids, uint64_t index) {
  const size_t size = NumVertices(type);
  std::array<VertexId, kMaxElementVertices> vertices;
  for (size_t k = 0; k < size; ++k) {
    Slot slot;
    std::memcpy(&slot, ids + k * sizeof(Slot), sizeof(slot));
    if (slot >= num_vertices_) return VertexOutOfRange(slot, num_vertices_, index);
    vertices[k] = VertexId(slot);
  }
  DYNMESH_ASSIGN_OR_RETURN(const EntityId id,
                           mesh_.AddElement(type, absl::MakeConstSpan(vertices.data(), size)));
  if (mesh_.IsDegenerate(id)) warnings_.Add(WarningKind::kDegenerateElement, id);
  const bool twin = id.kind == EntityKind::kCell && mesh_.FindTwin(CellId(id.slot)).valid();
  if (twin || mesh_.IsDuplicate(id)) warnings_.Add(WarningKind::kDuplicateElement, id);
  return absl::OkStatus();
}

absl::Status MeshBuilder::AddColumn(StagedColumn& column) {
  DYNMESH_RETURN_IF_ERROR(mesh_.AddAttribute(column.spec));
  const int index = mesh_.FindAttribute(column.spec.name, column.spec.kind);
  const size_t row_bytes = column.spec.row_bytes();
  Slot slot = 0;
  while (!column.rows.empty()) {
    const std::string block = column.rows.TakeFront();
    const auto* rows = reinterpret_cast<const uint8_t*>(block.data());
    for (size_t offset = 0; offset < block.size(); offset += row_bytes, ++slot) {
      DYNMESH_RETURN_IF_ERROR(mesh_.SetAttribute(index, slot, absl::MakeConstSpan(rows + offset, row_bytes)));
    }
    if (monitor_.cancelled()) return CallCancelled();
  }
  return absl::OkStatus();
}

absl::Status MeshBuilder::Tick() {
  if (++done_ % kItemsPerTick != 0) return absl::OkStatus();
  if (monitor_.cancelled()) return CallCancelled();
  monitor_.OnProgress(done_, total_);
  const uint64_t bytes = mesh_.memory_bytes();
  if (bytes <= limits_.max_session_bytes) return absl::OkStatus();
  return LimitExceeded("max_session_bytes", limits_.max_session_bytes, bytes);
}

}  // namespace dynmesh
