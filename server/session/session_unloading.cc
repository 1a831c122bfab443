// What a session does to be unloaded. Nobody else has a reference to it meanwhile, so no lock here is waited
// for; they are taken all the same, because they bring what other threads have done before they gave theirs
// up.

#include <map>
#include <utility>

#include "server/session/session.h"

namespace dynmesh {

bool Session::CanUnload() const {
  if (log_ == nullptr || state() != SessionState::kLoaded || writes_checkpoint_) return false;
  if (revision() == 0 || log_->durable_revision() != revision()) return false;
  ReaderMutexLock lock(&mu_);
  return gone_.ok() && !stores_import_;
}

bool Session::BeginLastCheckpoint() {
  if (!log_->IsLongSinceCheckpoint() || last_checkpoint_tried_.exchange(revision()) == revision())
    return false;
  if (!writes_checkpoint_.exchange(true)) StartCheckpoint();
  return true;
}

void Session::MeasureMemory() {
  ReaderMutexLock lock(&mu_);
  MutexLock repairs_lock(&repairs_mu_);
  measured_bytes_ = mesh_.memory_bytes() + answers_.bytes() + history_answers_.bytes() + repairs_.bytes();
}

// Whatever may fail comes first: until the other session exists this one must stay as it is.
std::shared_ptr<Session> Session::Unload() {
  Options options = options_;
  options.uid = uid_;
  options.settings = Settings();
  options.num_updates = num_updates_;
  std::map<int, QuantizationGrid> grids = deltas_.grids();
  WriterMutexLock lock(&mu_);
  options.update_time = commit_time_;
  auto stored = std::make_shared<Session>(options, log_, Content::kStored);
  stored->deltas_.KeepGrids(std::move(grids));
  // Until it is loaded it says how much work a query may be.
  for (size_t i = 0; i < num_live_.size(); ++i) stored->num_live_[i] = num_live_[i].load();
  log_->Rest();
  return stored;
}

}  // namespace dynmesh
