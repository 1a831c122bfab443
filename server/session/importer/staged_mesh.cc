#include "server/session/importer/staged_mesh.h"

#include <cmath>
#include <cstring>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "server/session/fingerprint.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

constexpr size_t kPositionBytes = sizeof(Point);
// What a run or a piece costs besides its bytes, so that many tiny ones are not free.
constexpr uint64_t kPieceOverheadBytes = 128;

absl::Status BadLength(absl::string_view what, size_t bytes, size_t record_bytes, uint64_t index) {
  return InvalidArgument(reason::kBadArrayLength,
                         absl::StrCat(bytes, " bytes of ", what, " are no multiple of ", record_bytes),
                         {{"index", absl::StrCat(index)}});
}

/// Index of the first of the f64 in `bytes` that is not finite, or -1.
int64_t FindNonFinite(const std::string& bytes) {
  for (size_t offset = 0; offset < bytes.size(); offset += sizeof(double)) {
    double value;
    std::memcpy(&value, bytes.data() + offset, sizeof(value));
    if (!std::isfinite(value)) return offset / sizeof(double);
  }
  return -1;
}

absl::Span<const uint8_t> AsBytes(const std::string& bytes) {
  return absl::MakeConstSpan(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
}

/// `status` with its metadata "index" counted from `base`.
absl::Status ShiftIndex(const absl::Status& status, uint64_t base) {
  uint64_t index = 0;
  absl::optional<ErrorDetail> detail = GetErrorDetail(status);
  if (!detail || !absl::SimpleAtoi(detail->Find("index"), &index)) return status;
  for (auto& [key, value] : detail->metadata) {
    if (key == "index") value = absl::StrCat(base + index);
  }
  return MakeError(status.code(), detail->reason, status.message(), detail->metadata);
}

}  // namespace

absl::Status StagedMesh::AddPositions(std::string bytes) {
  if (bytes.size() % kPositionBytes != 0) {
    return BadLength("positions", bytes.size(), kPositionBytes,
                     num_vertices_ + bytes.size() / kPositionBytes);
  }
  const uint64_t total = num_vertices_ + bytes.size() / kPositionBytes;
  if (total > limits_.max_vertices) return LimitExceeded("max_vertices", limits_.max_vertices, total);
  if (const int64_t bad = FindNonFinite(bytes); bad >= 0) {
    const std::string index = absl::StrCat(num_vertices_ + bad / 3);
    return InvalidArgument(reason::kNonFinite,
                           absl::StrCat("the position of vertex ", index, " is not finite"),
                           {{"kind", "vertex"}, {"index", index}});
  }
  DYNMESH_RETURN_IF_ERROR(ChargeMemory(bytes.size()));
  num_vertices_ = total;
  positions_.Append(std::move(bytes));
  return absl::OkStatus();
}

absl::Status StagedMesh::AddElements(ElementType type, std::string bytes) {
  const uint64_t index = num_elements();
  if (!IsElementType(static_cast<int>(type))) {
    return InvalidArgument(reason::kBadElementType,
                           absl::StrCat("element type ", static_cast<int>(type), " is none of 1-7"),
                           {{"index", absl::StrCat(index)}});
  }
  const size_t record = NumVertices(type) * sizeof(Slot);
  if (bytes.size() % record != 0) {
    return BadLength(absl::StrCat(ElementTypeName(type), " elements"), bytes.size(), record,
                     index + bytes.size() / record);
  }
  const EntityKind kind = KindOf(type);
  const uint64_t total = NumElements(kind) + bytes.size() / record;
  if (total > limits_.max_slots(kind)) {
    return LimitExceeded(kSlotLimitNames[Dimension(kind)], limits_.max_slots(kind), total);
  }
  DYNMESH_RETURN_IF_ERROR(ChargeMemory(bytes.size()));
  StagedRun& run = RunFor(type);
  type_counts_[static_cast<int>(type)] += bytes.size() / record;
  run.vertices.Append(std::move(bytes));
  return absl::OkStatus();
}

absl::Status StagedMesh::AddRows(const AttributeSpec& spec, std::string bytes) {
  StagedColumn* column = nullptr;
  DYNMESH_RETURN_IF_ERROR(ColumnFor(spec, &column));
  const uint64_t index = column->rows.size() / spec.row_bytes();
  if (bytes.size() % spec.row_bytes() != 0) {
    return BadLength(absl::StrCat("attribute ", spec.name), bytes.size(), spec.row_bytes(),
                     index + bytes.size() / spec.row_bytes());
  }
  DYNMESH_RETURN_IF_ERROR(ShiftIndex(CheckFinite(spec, AsBytes(bytes)), index));
  DYNMESH_RETURN_IF_ERROR(ChargeMemory(bytes.size()));
  column->rows.Append(std::move(bytes));
  return absl::OkStatus();
}

absl::Status StagedMesh::CheckColumns() const {
  for (const StagedColumn& column : columns_) {
    const EntityKind kind = column.spec.kind;
    const uint64_t expected = kind == EntityKind::kVertex ? num_vertices_ : NumElements(kind);
    const uint64_t rows = column.rows.size() / column.spec.row_bytes();
    if (rows == expected) continue;
    return InvalidArgument(reason::kCountMismatch,
                           absl::StrCat("attribute ", column.spec.name, " has ", rows, " rows for ", expected,
                                        " ", EntityKindName(kind), " entities"),
                           {{"attribute", column.spec.name},
                            {"expected", absl::StrCat(expected)},
                            {"actual", absl::StrCat(rows)}});
  }
  return absl::OkStatus();
}

uint64_t StagedMesh::num_elements() const {
  uint64_t total = 0;
  for (uint64_t count : type_counts_) total += count;
  return total;
}

uint64_t StagedMesh::NumElements(EntityKind kind) const {
  uint64_t total = 0;
  for (ElementType type : kElementTypes) {
    if (KindOf(type) == kind) total += type_counts_[static_cast<int>(type)];
  }
  return total;
}

uint64_t StagedMesh::Fingerprint() const {
  dynmesh::Fingerprint fingerprint;
  const auto add = [&](const ByteQueue& queue) {
    fingerprint.AddNumber(queue.size());
    for (const std::string& block : queue.blocks()) fingerprint.AddBytes(block.data(), block.size());
  };
  add(positions_);
  for (const auto& runs : runs_) {
    for (const StagedRun& run : runs) {
      fingerprint.AddNumber(static_cast<uint64_t>(run.type));
      add(run.vertices);
    }
  }
  for (const StagedColumn& column : columns_) {
    fingerprint.AddSpec(column.spec);
    add(column.rows);
  }
  return fingerprint.value();
}

absl::Status StagedMesh::ChargeMemory(uint64_t bytes) {
  bytes_ += bytes + kPieceOverheadBytes;
  DYNMESH_RETURN_IF_ERROR(lease_.Grow(bytes + kPieceOverheadBytes));
  if (bytes_ <= limits_.max_session_bytes) return absl::OkStatus();
  return LimitExceeded("max_session_bytes", limits_.max_session_bytes, bytes_);
}

StagedRun& StagedMesh::RunFor(ElementType type) {
  if (last_run_ == nullptr || last_run_->type != type) {
    last_run_ = &runs(KindOf(type)).emplace_back(StagedRun{type, num_elements(), {}});
  }
  return *last_run_;
}

absl::Status StagedMesh::ColumnFor(const AttributeSpec& spec, StagedColumn** column) {
  DYNMESH_RETURN_IF_ERROR(CheckAttributeSpec(spec));
  for (StagedColumn& known : columns_) {
    if (known.spec.name != spec.name || known.spec.kind != spec.kind) continue;
    if (known.spec != spec) {
      return InvalidArgument(reason::kBadArgument,
                             absl::StrCat("attribute ", spec.name, " is described otherwise than before"),
                             {{"attribute", spec.name}});
    }
    *column = &known;
    return absl::OkStatus();
  }
  if (columns_.size() >= kMaxAttributeColumns) {
    return LimitExceeded("max_attributes", kMaxAttributeColumns, columns_.size() + 1);
  }
  *column = &columns_.emplace_back(StagedColumn{spec, {}});
  return absl::OkStatus();
}

}  // namespace dynmesh
