#include "tests/store/store_rig.h"

#include "tests/support/await.h"

namespace dynmesh::testing {

void FaultSwitch::Set(Fault fault) {
  MutexLock lock(&mu_);
  fault_ = fault;
}

Fault FaultSwitch::fault() const {
  MutexLock lock(&mu_);
  return fault_;
}

void FaultSwitch::Hold() {
  MutexLock lock(&mu_);
  hold_ = true;
}

void FaultSwitch::Release() {
  MutexLock lock(&mu_);
  hold_ = false;
  changed_.NotifyAll();
}

bool FaultSwitch::AwaitHeldSync() {
  MutexLock lock(&mu_);
  return AwaitThat(&mu_, changed_, [this] { return blocked_; });
}

void FaultSwitch::OnSync() {
  MutexLock lock(&mu_);
  ++num_syncs_;
  blocked_ = hold_;
  changed_.NotifyAll();
  while (hold_) changed_.Wait(&mu_);
  blocked_ = false;
}

int FaultSwitch::num_syncs() const {
  MutexLock lock(&mu_);
  return num_syncs_;
}

}  // namespace dynmesh::testing
