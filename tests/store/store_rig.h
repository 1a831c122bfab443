#ifndef DYNMESH_TESTS_STORE_STORE_RIG_H_
#define DYNMESH_TESTS_STORE_STORE_RIG_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <string>

#include "absl/status/statusor.h"
#include "server/session/mutex.h"
#include "server/store/committer.h"
#include "server/store/store.h"

namespace dynmesh::testing {

/// What goes wrong with every write from Inject() to Mend().
enum class Fault {
  kNone,
  kFailedWrite,  ///< nothing of it arrives
  kTornWrite,    ///< some of it arrives
  kFullDisk,
  kFailedSync,  ///< it is written, and the sync fails
};

/// What is wrong with a medium, and who waits for it. Rigs and what they put under stores share it.
/// Thread safety: full.
class FaultSwitch {
 public:
  void Set(Fault fault);
  Fault fault() const;

  /// Syncs block from Hold() to Release().
  void Hold();
  void Release();
  /// Waits until a sync blocks; false when that takes too long.
  bool AwaitHeldSync();
  /// Called by what syncs: blocks, and counts.
  void OnSync();
  int num_syncs() const;

 private:
  mutable Mutex mu_;
  CondVar changed_;
  Fault fault_ = Fault::kNone;
  bool hold_ = false;
  bool blocked_ = false;
  int num_syncs_ = 0;
};

/// A medium with a store on it, which can be opened again and again, and on which things go wrong.
class StoreRig {
 public:
  virtual ~StoreRig() = default;

  /// REQUIRES: the store opened before is gone. By default nothing syncs only because time passes.
  virtual absl::StatusOr<std::unique_ptr<Store>> Open(const CommitterOptions& options = {
                                                          .async_delay = absl::Hours(24)}) = 0;

  /// With no store open: what was not synced is gone. Stores sync when they are closed: inject
  /// kFailedSync before closing for there to be something.
  virtual void LosePower() = 0;
  /// With no store open: changes a bit of what is stored.
  virtual void FlipBit(std::mt19937& random) = 0;

  FaultSwitch& faults() { return faults_; }

 private:
  FaultSwitch faults_;
};

using RigMaker = std::function<std::unique_ptr<StoreRig>()>;

std::unique_ptr<StoreRig> MakeMemoryRig();
std::unique_ptr<StoreRig> MakeRocksDbRig();

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_STORE_STORE_RIG_H_
