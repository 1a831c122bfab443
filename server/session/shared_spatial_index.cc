#include "server/session/shared_spatial_index.h"

#include "core/mesh/error.h"

namespace dynmesh {

absl::Status SharedSpatialIndex::Read(const Mesh& mesh, EntityKind kind, WorkMeter& meter,
                                      absl::FunctionRef<absl::Status(const SpatialIndex&)> fn) {
  OfKind& own = kinds_[Dimension(kind)];
  if (!IsCurrent(kind, mesh.revision())) DYNMESH_RETURN_IF_ERROR(CatchUp(mesh, meter, own));
  ReaderMutexLock lock(&own.mu);
  return fn(own.index);
}

absl::Status SharedSpatialIndex::CatchUp(const Mesh& mesh, WorkMeter& meter, OfKind& own) {
  WriterMutexLock lock(&own.mu);
  if (own.index.revision() < 0) DYNMESH_RETURN_IF_ERROR(CheckRoom(mesh, own.index.kind()));
  const absl::Status caught_up = own.index.CatchUp(mesh, meter);
  own.bytes.store(own.index.memory_bytes());
  own.revision.store(own.index.revision());
  return caught_up;
}

absl::Status SharedSpatialIndex::CheckRoom(const Mesh& mesh, EntityKind kind) const {
  const uint64_t bytes =
      mesh.memory_bytes() + memory_bytes() + mesh.NumLive(kind) * uint64_t{SpatialIndex::kTypicalEntryBytes};
  return bytes <= max_bytes_ ? absl::OkStatus() : LimitExceeded("max_session_bytes", max_bytes_, bytes);
}

uint64_t SharedSpatialIndex::memory_bytes() const {
  uint64_t bytes = 0;
  for (const OfKind& of_kind : kinds_) bytes += of_kind.bytes.load();
  return bytes;
}

void SharedSpatialIndex::Clear() {
  for (OfKind& own : kinds_) {
    WriterMutexLock lock(&own.mu);
    own.index = SpatialIndex(own.index.kind());
    own.revision.store(-1);
    own.bytes.store(0);
  }
}

}  // namespace dynmesh
