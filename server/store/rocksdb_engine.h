#ifndef DYNMESH_SERVER_STORE_ROCKSDB_ENGINE_H_
#define DYNMESH_SERVER_STORE_ROCKSDB_ENGINE_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/store/engine.h"

namespace rocksdb {
class Env;
}

namespace dynmesh {

struct RocksDbOptions {
  std::string directory;
  rocksdb::Env* env = nullptr;  ///< for tests: where files are; nullptr is the system's. Outlives the engine
};

/// An Engine in a directory of its own, made when it is not there:
///
///     dynmesh.lock     which process has it
///     dynmesh.synced   how many writes are on disk (SyncedMark)
///     rocksdb/         a RocksDB database
///
/// Errors: FAILED_PRECONDITION STORE_IN_USE; DATA_LOSS STORE_DAMAGED, also when the log holds fewer writes
/// than were synced: who accepts that loss deletes dynmesh.synced; UNAVAILABLE STORE_FAILED;
/// RESOURCE_EXHAUSTED STORE_FULL.
absl::StatusOr<std::unique_ptr<Engine>> OpenRocksDb(const RocksDbOptions& options);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_STORE_ROCKSDB_ENGINE_H_
