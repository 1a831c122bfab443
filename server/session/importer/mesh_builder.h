#ifndef DYNMESH_SERVER_SESSION_IMPORTER_MESH_BUILDER_H_
#define DYNMESH_SERVER_SESSION_IMPORTER_MESH_BUILDER_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
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
/// Vertices first, then elements by ascending dimension: so no derived entity takes a slot before the
/// elements of its kind, and element i of a kind gets slot i.
class MeshBuilder {
 public:
  MeshBuilder(const MeshOptions& options, const Limits& limits, ImportMonitor& monitor)
      : limits_(limits), monitor_(monitor), mesh_(options) {}

  /// Errors: INVALID_ARGUMENT UNKNOWN_ENTITY (a vertex id out of range; metadata index, ids), those of
  /// Mesh::AddElement with metadata index; RESOURCE_EXHAUSTED LIMIT_EXCEEDED; CANCELLED.
  absl::StatusOr<Mesh> Build(StagedMesh staged);

  /// Of the mesh that Build made.
  const std::vector<MeshWarning>& warnings() const { return warnings_.warnings(); }

 private:
  void Reserve(const StagedMesh& staged);
  absl::Status AddVertices(ByteQueue& positions);
  absl::Status AddRun(StagedRun& run);
  absl::Status AddElement(ElementType type, const char* ids, uint64_t index);
  absl::Status AddColumn(StagedColumn& column);
  absl::Status Tick();

  const Limits limits_;
  ImportMonitor& monitor_;
  Mesh mesh_;
  WarningCollector warnings_;
  uint64_t num_vertices_ = 0;
  uint64_t done_ = 0;
  uint64_t total_ = 0;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_IMPORTER_MESH_BUILDER_H_
