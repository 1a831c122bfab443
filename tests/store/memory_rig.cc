#include <deque>
#include <utility>
#include <vector>

#include "server/store/local_store.h"
#include "server/store/memory_engine.h"
#include "server/store/store_errors.h"
#include "tests/store/store_rig.h"

namespace dynmesh::testing {
namespace {

constexpr char kFirstKey[] = "";
constexpr char kAfterLastKey[] = "\xff";

/// What a process sees of a medium, and what of that has been synced.
struct Medium {
  void ForgetNotSynced() {
    MutexLock lock(&mu);
    not_synced.clear();
  }

  std::unique_ptr<MemoryEngine> seen = std::make_unique<MemoryEngine>();
  MemoryEngine synced;
  Mutex mu;
  std::deque<EngineBatch> not_synced ABSL_GUARDED_BY(mu);
};

/// An engine on a Medium that outlives it.
class FaultyEngine final : public Engine {
 public:
  FaultyEngine(Medium* medium, FaultSwitch* faults) : medium_(medium), faults_(faults) {}

  absl::Status Write(const EngineBatch& batch) override {
    const Fault fault = faults_->fault();
    if (fault == Fault::kFullDisk) return StoreFull("injected");
    if (fault == Fault::kFailedWrite || fault == Fault::kTornWrite) return StoreFailed("injected");
    MutexLock lock(&medium_->mu);
    medium_->not_synced.push_back(batch);
    return medium_->seen->Write(batch);
  }

  absl::Status Sync() override {
    const size_t num_writes = NumNotSynced();  // what is written from here on is not on disk
    faults_->OnSync();
    if (faults_->fault() == Fault::kFailedSync) return StoreFailed("injected");
    MutexLock lock(&medium_->mu);
    for (size_t i = 0; i < num_writes; ++i) {
      (void)medium_->synced.Write(medium_->not_synced.front());
      medium_->not_synced.pop_front();
    }
    return absl::OkStatus();
  }

  absl::StatusOr<absl::optional<std::string>> Get(absl::string_view key) const override {
    return medium_->seen->Get(key);
  }
  absl::Status Scan(absl::string_view from, absl::string_view to, Visitor visit) const override {
    return medium_->seen->Scan(from, to, visit);
  }
  absl::StatusOr<absl::optional<std::string>> LastKey(absl::string_view from,
                                                      absl::string_view to) const override {
    return medium_->seen->LastKey(from, to);
  }

 private:
  size_t NumNotSynced() const {
    MutexLock lock(&medium_->mu);
    return medium_->not_synced.size();
  }

  Medium* const medium_;
  FaultSwitch* const faults_;
};

class MemoryRig final : public StoreRig {
 public:
  absl::StatusOr<std::unique_ptr<Store>> Open(const CommitterOptions& options) override {
    return LocalStore::Open(std::make_unique<FaultyEngine>(&medium_, &faults()), options);
  }

  void LosePower() override {
    medium_.seen = std::make_unique<MemoryEngine>();
    medium_.ForgetNotSynced();
    EngineBatch all;
    (void)medium_.synced.Scan(kFirstKey, kAfterLastKey, [&](absl::string_view key, absl::string_view value) {
      all.Put(std::string(key), std::string(value));
      return absl::OkStatus();
    });
    (void)medium_.seen->Write(all);
  }

  void FlipBit(std::mt19937& random) override {
    std::vector<std::pair<std::string, std::string>> all;
    (void)medium_.seen->Scan(kFirstKey, kAfterLastKey, [&](absl::string_view key, absl::string_view value) {
      all.emplace_back(key, value);
      return absl::OkStatus();
    });
    auto& [key, value] = all[random() % all.size()];
    value[random() % value.size()] ^= 1 << random() % 8;
    EngineBatch flipped;
    flipped.Put(std::move(key), std::move(value));
    (void)medium_.seen->Write(flipped);
  }

 private:
  Medium medium_;
};

}  // namespace

std::unique_ptr<StoreRig> MakeMemoryRig() { return std::make_unique<MemoryRig>(); }

}  // namespace dynmesh::testing
