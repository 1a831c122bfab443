#ifndef DYNMESH_SERVER_SESSION_IMPORTER_MESH_BUILDER_H_
#define DYNMESH_SERVER_SESSION_IMPORTER_MESH_BUILDER_H_

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/bulk_build.h"
#include "core/mesh/mesh.h"
#include "server/session/importer/staged_mesh.h"
#include "server/session/mesh_warnings.h"

namespace dynmesh {

/// Who watches a long build. Called from the thread that builds.
class ImportMonitor {
 public:
  virtual ~ImportMonitor() = default;
  /// `done` of `total` vertices and elements are built. Must not block.
  virtual void OnProgress(uint64_t done, uint64_t total) = 0;
  /// Whether the result is no longer wanted.
  virtual bool cancelled() = 0;
};

/// Turns what an import has staged into a mesh at revision 1, and frees it on the way.
///
/// Vertices first, then elements by ascending dimension, in bulk. To be used once.
class MeshBuilder {
 public:
  MeshBuilder(const BulkOptions& options, const Limits& limits, ImportMonitor& monitor)
      : options_(options), limits_(limits), monitor_(monitor) {
    options_.progress = [this](uint64_t done, uint64_t total) { return OnProgress(done, total); };
  }
  MeshBuilder(const MeshBuilder&) = delete;
  MeshBuilder& operator=(const MeshBuilder&) = delete;

  /// Errors: INVALID_ARGUMENT UNKNOWN_ENTITY (a vertex id out of range; metadata index, ids),
  /// DUPLICATE_ELEMENT (if so opted; metadata index); RESOURCE_EXHAUSTED LIMIT_EXCEEDED; CANCELLED.
  absl::StatusOr<Mesh> Build(StagedMesh staged);

  /// Of the mesh that Build made.
  const std::vector<MeshWarning>& warnings() const { return warnings_.warnings(); }
  /// As BulkResult::slots.
  std::array<Permutation, kNumEntityKinds>& slots() { return slots_; }

 private:
  /// `count` elements of a kind that follow each other in the import.
  struct RunPlace {
    EntityKind kind;
    uint64_t count;
    uint64_t first_index;
  };

  absl::Status AddVertices(ByteQueue& positions, BulkBuilder& builder);
  absl::Status AddRun(StagedRun& run, BulkBuilder& builder);
  absl::Status AddColumn(StagedColumn& column, Mesh& mesh);
  void CollectWarnings(const BulkResult& result);
  absl::Status OnProgress(uint64_t done, uint64_t total);
  absl::Status CheckCancelled() const;
  absl::Status CheckMemory(uint64_t bytes) const;
  /// A "position" among the elements of a kind, as "index" among all elements of the import.
  absl::Status WithImportIndex(const absl::Status& status) const;

  BulkOptions options_;
  const Limits limits_;
  ImportMonitor& monitor_;
  WarningCollector warnings_;
  std::array<Permutation, kNumEntityKinds> slots_;
  std::vector<RunPlace> places_;
  uint64_t num_vertices_ = 0;
  uint64_t total_ = 0;
  uint64_t reported_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_IMPORTER_MESH_BUILDER_H_
