#include "server/session/durability/revision_gate.h"

#include <utility>

#include "server/session/catch_exceptions.h"
#include "spdlog/spdlog.h"

namespace dynmesh {

void RevisionGate::Wait(int64_t revision, Done done) {
  absl::Status status;
  {
    MutexLock lock(&mu_);
    if (revision > reached_ && status_.ok()) {
      waiting_.emplace(revision, std::move(done));
      return;
    }
    if (revision > reached_) status = status_;
  }
  done(status);
}

absl::Status RevisionGate::Await(int64_t revision) {
  MutexLock lock(&mu_);
  while (revision > reached_ && status_.ok()) changed_.Wait(&mu_);
  return revision > reached_ ? status_ : absl::OkStatus();
}

void RevisionGate::Reach(int64_t revision) {
  Waiting due;
  {
    MutexLock lock(&mu_);
    if (revision <= reached_ || !status_.ok()) return;
    reached_ = revision;
    changed_.NotifyAll();
    const auto end = waiting_.upper_bound(revision);
    while (waiting_.begin() != end) due.insert(due.end(), waiting_.extract(waiting_.begin()));
  }
  Post(std::move(due), absl::OkStatus());
}

void RevisionGate::Fail(const absl::Status& status) {
  Waiting due;
  {
    MutexLock lock(&mu_);
    if (!status_.ok()) return;
    status_ = status;
    changed_.NotifyAll();
    due.swap(waiting_);
  }
  Post(std::move(due), status);
}

void RevisionGate::Post(Waiting due, const absl::Status& status) {
  if (due.empty()) return;
  executor_->Post([due = std::move(due), status]() mutable {
    for (auto& [revision, done] : due) {
      const absl::Status told = CatchExceptions([&done = done, &status] {
        done(status);
        return absl::OkStatus();
      });
      if (!told.ok()) spdlog::error("acknowledgement_failed error=\"{}\"", told.ToString());
    }
  });
}

int64_t RevisionGate::reached() const {
  MutexLock lock(&mu_);
  return reached_;
}

absl::Status RevisionGate::status() const {
  MutexLock lock(&mu_);
  return status_;
}

}  // namespace dynmesh
