#include "server/session/shared_spatial_index.h"

#include <algorithm>

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
  DYNMESH_RETURN_IF_ERROR(CheckRoom(mesh, own));
  absl::Status caught_up = own.index.CatchUp(mesh, meter);
  if (caught_up.ok() &&
      mesh.memory_bytes() + memory_bytes() - own.bytes.load() + own.index.memory_bytes() > max_bytes_) {
    own.index = SpatialIndex(own.index.kind());  // one that is packed anew takes less
    caught_up = own.index.CatchUp(mesh, meter);
  }
  own.bytes.store(own.index.memory_bytes());
  own.revision.store(own.index.revision());
  return caught_up;
}

// An index that is there already may grow, too: by the entities that changed.
absl::Status SharedSpatialIndex::CheckRoom(const Mesh& mesh, const OfKind& own) const {
  const uint64_t typical = mesh.NumLive(own.index.kind()) * uint64_t{SpatialIndex::kTypicalEntryBytes};
  const uint64_t grown = std::max(typical, own.bytes.load());
  const uint64_t bytes = mesh.memory_bytes() + memory_bytes() - own.bytes.load() + grown;
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
