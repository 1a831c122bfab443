#ifndef DYNMESH_SERVER_SESSION_IMPORTER_STAGED_MESH_H_
#define DYNMESH_SERVER_SESSION_IMPORTER_STAGED_MESH_H_

#include <array>
#include <cstdint>
#include <list>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/estimate.h"
#include "core/mesh/mesh.h"
#include "server/session/budget.h"
#include "server/session/importer/byte_queue.h"
#include "server/session/limits.h"

namespace dynmesh {

/// A run of elements of one type, as they arrived.
struct StagedRun {
  ElementType type;
  uint64_t first_index;  ///< position of its first element among all elements of the import
  ByteQueue vertices;    ///< u32 ids
};

/// Rows of one attribute, for entities 0, 1, 2, ...
struct StagedColumn {
  AttributeSpec spec;
  ByteQueue rows;
};

/// What an import has received: checked piece by piece as far as a piece can be judged alone, and kept in the
/// bytes that arrived. Memory grows with those and with nothing that a peer merely claims.
///
/// Methods that add: INVALID_ARGUMENT with metadata "index", the position of the offender among the vertices,
/// elements or rows of the whole import; RESOURCE_EXHAUSTED LIMIT_EXCEEDED. After an error the import is
/// over. Thread safety: that of std::vector.
class StagedMesh {
 public:
  /// `lease`: grows by what is staged.
  explicit StagedMesh(const Limits& limits, Lease lease = {}) : limits_(limits), lease_(std::move(lease)) {}

  /// f64[3 * n]. Errors: BAD_ARRAY_LENGTH, NON_FINITE_VALUE, LIMIT_EXCEEDED (max_vertices).
  absl::Status AddPositions(std::string bytes);
  /// u32[n * k]. Errors: BAD_ELEMENT_TYPE, BAD_ARRAY_LENGTH, LIMIT_EXCEEDED.
  absl::Status AddElements(ElementType type, std::string bytes);
  /// Errors: BAD_ARGUMENT, BAD_ARRAY_LENGTH, NON_FINITE_VALUE, LIMIT_EXCEEDED (max_attributes).
  absl::Status AddRows(const AttributeSpec& spec, std::string bytes);

  /// INVALID_ARGUMENT COUNT_MISMATCH unless every column has a row for each vertex or element of its kind.
  absl::Status CheckColumns() const;

  uint64_t num_vertices() const { return num_vertices_; }
  uint64_t num_elements() const;
  uint64_t NumElements(EntityKind kind) const;
  const ElementTypeCounts& type_counts() const { return type_counts_; }
  /// The same for the same content, however it was cut into pieces.
  uint64_t Fingerprint() const;

  /// What has arrived, for the builder to take.
  ByteQueue& positions() { return positions_; }
  std::list<StagedRun>& runs(EntityKind kind) { return runs_[Dimension(kind)]; }
  std::vector<StagedColumn>& columns() { return columns_; }

 private:
  absl::Status ChargeMemory(uint64_t bytes);
  StagedRun& RunFor(ElementType type);
  absl::Status ColumnFor(const AttributeSpec& spec, StagedColumn** column);

  const Limits limits_;
  uint64_t num_vertices_ = 0;
  uint64_t bytes_ = 0;
  Lease lease_;
  ElementTypeCounts type_counts_ = {};
  ByteQueue positions_;
  std::array<std::list<StagedRun>, kNumEntityKinds> runs_;
  StagedRun* last_run_ = nullptr;
  std::vector<StagedColumn> columns_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_IMPORTER_STAGED_MESH_H_
