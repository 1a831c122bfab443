// What a session does to be unloaded. Nobody else has a reference to it meanwhile, so no lock here is waited
// for; they are taken all the same, because they bring what other threads have done before they gave theirs
// up.

#include <map>
#include <utility>

#include "server/session/importer/importer.h"
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
  AnswerMemory<ImportOutcome> imports = CopyImports();
  auto stored = std::make_shared<Session>(options, log_, Content::kStored);
  stored->KeepImports(std::move(imports));
  stored->deltas_.KeepGrids(std::move(grids));
  // Until it is loaded it says how much work a query may be.
  for (size_t i = 0; i < num_live_.size(); ++i) stored->num_live_[i] = num_live_[i].load();
  log_->Rest();
  return stored;
}

// No record tells of imports, and there are few: they stay in memory.
AnswerMemory<ImportOutcome> Session::CopyImports() const {
  MutexLock lock(&imports_mu_);
  return imports_;
}

void Session::KeepImports(AnswerMemory<ImportOutcome> imports) {
  MutexLock lock(&imports_mu_);
  imports_ = std::move(imports);
}

}  // namespace dynmesh
