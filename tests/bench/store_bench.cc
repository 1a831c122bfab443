// What an append costs beside a bare RocksDB on the same disk, and what editors gain from one sync for all.
//
// usage: store_bench DIRECTORY [--benchmark_...]
//
// DIRECTORY is on the disk that is measured; everything is written into new folders in it, and removed.
// limit: a RocksDB that is written to directly, one record at a time. Times are of the wall.

#include <benchmark/benchmark.h>
#include <rocksdb/db.h>
#include <rocksdb/options.h>

#include <filesystem>
#include <future>
#include <iostream>
#include <semaphore>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/store/local_store.h"
#include "server/store/memory_engine.h"
#include "server/store/rocksdb_engine.h"
#include "tests/bench/arguments.h"
#include "tests/bench/fixture.h"

namespace dynmesh::bench {
namespace {

constexpr size_t kRecordBytes = 2048;
constexpr int kAppendsAtOnce = 256;  // of an editor that does not wait for each
constexpr int kRoundsOfMany = 64;    // appends of each editor in an iteration

/// A new folder, removed at the end.
class Folder {
 public:
  explicit Folder(const std::string& parent) {
    static int number = 0;
    path_ = absl::StrCat(parent, "/store_bench.", ++number);
    std::filesystem::remove_all(path_);
    std::filesystem::create_directory(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

void WriteToRocksDb(benchmark::State& state, const std::string& parent, Durability durability) {
  const Folder folder(parent);
  rocksdb::Options options;
  options.create_if_missing = true;
  rocksdb::DB* opened = nullptr;
  if (!rocksdb::DB::Open(options, folder.path(), &opened).ok()) return state.SkipWithError("cannot open");
  const std::unique_ptr<rocksdb::DB> db(opened);
  rocksdb::WriteOptions write;
  write.sync = durability == Durability::kSync;
  const std::string record(kRecordBytes, 'r');
  int64_t revision = 0;
  for (auto _ : state) {
    if (!db->Put(write, absl::StrCat(++revision), record).ok()) return state.SkipWithError("cannot write");
  }
  state.SetItemsProcessed(state.iterations());
}

struct OpenStore {
  std::unique_ptr<Store> store;
  std::vector<std::unique_ptr<SessionStore>> sessions;  // destroyed before the store
};

OpenStore Open(std::unique_ptr<Engine> engine, int num_sessions) {
  OpenStore open{Must(LocalStore::Open(std::move(engine))), {}};
  for (int i = 0; i < num_sessions; ++i) {
    const std::string name = absl::StrCat("session", i);
    Must(open.store->CreateSession(name));
    open.sessions.push_back(Must(open.store->OpenSession(name)));
  }
  return open;
}

void AppendAndWait(SessionStore& session) {
  std::promise<absl::Status> promise;
  std::future<absl::Status> result = promise.get_future();
  session.Append(
      {session.last_revision() + 1, std::string(kRecordBytes, 'r')}, Durability::kSync,
      [promise = std::move(promise)](const absl::Status& status) mutable { promise.set_value(status); });
  Must(result.get());
}

void OneEditor(benchmark::State& state, const std::string& parent) {
  const Folder folder(parent);
  const OpenStore open = Open(Must(OpenRocksDb({folder.path()})), 1);
  for (auto _ : state) AppendAndWait(*open.sessions[0]);
  state.SetItemsProcessed(state.iterations());
}

void ManyEditors(benchmark::State& state, const std::string& parent) {
  const Folder folder(parent);
  const int num_editors = static_cast<int>(state.range(0));
  const OpenStore open = Open(Must(OpenRocksDb({folder.path()})), num_editors);
  for (auto _ : state) {
    std::vector<std::thread> editors;
    for (const auto& session : open.sessions) {
      editors.emplace_back([&session] {
        for (int i = 0; i < kRoundsOfMany; ++i) AppendAndWait(*session);
      });
    }
    for (std::thread& editor : editors) editor.join();
  }
  state.SetItemsProcessed(state.iterations() * num_editors * kRoundsOfMany);
}

// An editor with so many appends on their way.
void Pipelined(benchmark::State& state, std::unique_ptr<Engine> engine) {
  std::counting_semaphore<kAppendsAtOnce> room(kAppendsAtOnce);
  const OpenStore open = Open(std::move(engine), 1);
  int64_t revision = 0;
  for (auto _ : state) {
    room.acquire();
    open.sessions[0]->Append({++revision, std::string(kRecordBytes, 'r')}, Durability::kAsync,
                             [&room](const absl::Status& status) {
                               Must(status);
                               room.release();
                             });
  }
  for (int i = 0; i < kAppendsAtOnce; ++i) room.acquire();
  state.SetItemsProcessed(state.iterations());
}

void Async(benchmark::State& state, const std::string& parent) {
  const Folder folder(parent);
  Pipelined(state, Must(OpenRocksDb({folder.path()})));
}

void Memory(benchmark::State& state) { Pipelined(state, std::make_unique<MemoryEngine>()); }

void Register(const std::string& parent) {
  const auto add = [](const char* name, auto fn) {
    return benchmark::RegisterBenchmark(name, fn)->UseRealTime()->Unit(benchmark::kMicrosecond);
  };
  add("store/sync/limit", [=](benchmark::State& state) { WriteToRocksDb(state, parent, Durability::kSync); });
  add("store/sync/one_editor", [=](benchmark::State& state) { OneEditor(state, parent); });
  add("store/sync/editors", [=](benchmark::State& state) { ManyEditors(state, parent); })->Arg(64);
  add("store/async/limit",
      [=](benchmark::State& state) { WriteToRocksDb(state, parent, Durability::kAsync); });
  add("store/async/one_editor", [=](benchmark::State& state) { Async(state, parent); });
  add("store/async/memory", [](benchmark::State& state) { Memory(state); });
}

}  // namespace
}  // namespace dynmesh::bench

int main(int argc, char** argv) {
  using namespace dynmesh::bench;  // NOLINT: this is the program
  if (argc < 2 || !std::filesystem::is_directory(argv[1])) {
    std::cerr << "usage: " << argv[0] << " DIRECTORY [--benchmark_...]\n";
    return 2;
  }
  const std::string parent = argv[1];
  argv[1] = argv[0];
  for (const char* key : {"type", "order"}) benchmark::AddCustomContext(key, "none");
  for (const char* key : {"elements", "vertices"}) benchmark::AddCustomContext(key, "0");
  Register(parent);
  return RunBenchmarks(argc - 1, argv + 1);
}
