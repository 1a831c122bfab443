// How long an append waits for its acknowledgement, in a quiet store and while checkpoints are written in it.
//
// usage: store_latency_bench DIRECTORY [SECONDS]
//
// DIRECTORY is on the disk that is measured; everything is written into a new folder in it, and removed. One
// editor appends 2 KiB records at 1000 a second, whether the ones before are acknowledged or not, to one
// session; all the pages of another one, 300 MiB, are written again and again. Prints a table.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_format.h"
#include "server/session/mutex.h"
#include "server/store/local_store.h"
#include "server/store/rocksdb_engine.h"
#include "tests/bench/fixture.h"

namespace dynmesh::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr size_t kRecordBytes = 2048;
constexpr std::chrono::milliseconds kPeriod{1};  // between two appends
constexpr size_t kPageBytes = size_t{32} << 10;
constexpr size_t kNumPages = (size_t{300} << 20) / kPageBytes;

/// Waits of appends, in milliseconds.
class Waits {
 public:
  void Add(Clock::duration wait) {
    MutexLock lock(&mu_);
    waits_.push_back(std::chrono::duration<double, std::milli>(wait).count());
    changed_.NotifyAll();
  }
  /// Of so many, sorted.
  std::vector<double> Await(size_t count) {
    MutexLock lock(&mu_);
    while (waits_.size() < count) changed_.Wait(&mu_);
    std::sort(waits_.begin(), waits_.end());
    return waits_;
  }

 private:
  Mutex mu_;
  CondVar changed_;
  std::vector<double> waits_;
};

std::vector<double> AppendAtAPace(SessionStore& session, Durability durability, int seconds) {
  Waits waits;
  const int count = seconds * 1000;
  Clock::time_point next = Clock::now();
  for (int i = 0; i < count; ++i, next += kPeriod) {
    std::this_thread::sleep_until(next);
    session.Append({session.last_revision() + 1, std::string(kRecordBytes, 'r')}, durability,
                   [&waits, began = Clock::now()](const absl::Status& status) {
                     Must(status);
                     waits.Add(Clock::now() - began);
                   });
  }
  return waits.Await(count);
}

/// Writes checkpoints until it ends. Half of a page compresses.
class Checkpoints {
 public:
  explicit Checkpoints(SessionStore* session) : session_(session), thread_([this] { Run(); }) {}
  ~Checkpoints() {
    stop_ = true;
    thread_.join();
  }
  size_t num_pages() const { return num_pages_; }

 private:
  void Run() {
    std::mt19937_64 random(1);
    std::string page(kPageBytes, 'p');
    for (size_t i = 0; i < kPageBytes / 2; ++i) page[i] = static_cast<char>(random());
    for (int64_t revision = 1; !stop_; ++revision) {
      const auto writer = Must(session_->BeginCheckpoint(revision));
      for (PageKey key = 0; key < kNumPages && !stop_; ++key, ++num_pages_)
        Must(writer->WritePage(key, page));
      if (!stop_) Must(writer->Commit("m"));
    }
  }

  SessionStore* const session_;
  std::atomic<bool> stop_{false};
  std::atomic<size_t> num_pages_{0};
  std::thread thread_;
};

void Print(const char* durability, const char* beside, const std::vector<double>& waits) {
  const auto quantile = [&](double part) { return waits[static_cast<size_t>(part * (waits.size() - 1))]; };
  std::cout << absl::StrFormat("| %s | %s | %.3f | %.3f | %.3f | %.3f |\n", durability, beside, quantile(0.5),
                               quantile(0.99), quantile(0.999), waits.back());
}

void Measure(Store& store, Durability durability, int seconds) {
  const char* const name = durability == Durability::kAsync ? "async" : "sync";
  for (const std::string session : {"edited", "stored"}) Must(store.CreateSession(session + name));
  const auto edited = Must(store.OpenSession(absl::StrCat("edited", name)));
  const auto stored = Must(store.OpenSession(absl::StrCat("stored", name)));
  Print(name, "nothing", AppendAtAPace(*edited, durability, seconds));
  const Checkpoints checkpoints(stored.get());
  const std::vector<double> waits = AppendAtAPace(*edited, durability, seconds);
  Print(name,
        absl::StrFormat("pages, %.0f MiB/s", 1.0 * checkpoints.num_pages() * kPageBytes / seconds / (1 << 20))
            .c_str(),
        waits);
}

}  // namespace
}  // namespace dynmesh::bench

int main(int argc, char** argv) {
  using namespace dynmesh::bench;  // NOLINT: this is the program
  using dynmesh::Durability;
  int seconds = 10;
  if (argc < 2 || !std::filesystem::is_directory(argv[1]) ||
      (argc > 2 && !absl::SimpleAtoi(argv[2], &seconds)) || seconds < 1) {
    std::cerr << "usage: " << argv[0] << " DIRECTORY [SECONDS]\n";
    return 2;
  }
  const std::string folder = std::string(argv[1]) + "/store_latency_bench";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directory(folder);
  {
    const auto store = Must(dynmesh::LocalStore::Open(Must(dynmesh::OpenRocksDb({folder}))));
    std::cout << "| appends of 2 KiB, 1000 a second | beside | p50 ms | p99 | p99.9 | max "
                 "|\n|---|---|---|---|---|---|\n";
    for (const Durability durability : {Durability::kAsync, Durability::kSync})
      Measure(*store, durability, seconds);
  }
  std::filesystem::remove_all(folder);
  return 0;
}
