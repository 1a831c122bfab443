// A process that is killed loses nothing that it was told is safe.
//
// The test starts itself again as the process that writes: crash_test --write DIRECTORY. It says on its
// standard output what was acknowledged, one line each, and goes on until it is killed.

#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <semaphore>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "server/store/local_store.h"
#include "server/store/rocksdb_engine.h"
#include "tests/store/contents.h"
#include "tests/store/temporary_directory.h"

namespace dynmesh::testing {
namespace {

constexpr std::array<const char*, 3> kNames = {"a", "b", "c"};
constexpr int64_t kCheckpointEvery = 16;
constexpr PageKey kNumPages = 5;
constexpr int kWindow = 8;  // appends of a session that wait at once

std::string RecordBytes(const std::string& name, int64_t revision) {
  return absl::StrCat(name, revision, std::string(revision * 37 % 3000, 'r'));
}

// Every checkpoint writes two of the pages.
bool Writes(int64_t checkpoint, PageKey page) {
  const int64_t number = checkpoint / kCheckpointEvery;
  return number % kNumPages == page || (number + 2) % kNumPages == page;
}

std::string PageBytes(int64_t checkpoint, PageKey page) {
  return absl::StrCat(page, "@", checkpoint, std::string(20000, 'p'));
}

std::map<PageKey, std::string> PagesOf(int64_t checkpoint) {
  std::map<PageKey, std::string> pages;
  for (int64_t at = kCheckpointEvery; at <= checkpoint; at += kCheckpointEvery) {
    for (PageKey page = 0; page < kNumPages; ++page) {
      if (Writes(at, page)) pages[page] = PageBytes(at, page);
    }
  }
  return pages;
}

absl::StatusOr<std::unique_ptr<Store>> OpenStore(const std::string& directory) {
  auto engine = OpenRocksDb({directory});
  if (!engine.ok()) return engine.status();
  return LocalStore::Open(*std::move(engine), {.async_delay = absl::Milliseconds(2)});
}

// ---- the process that writes

void Tell(const std::string& line) { (void)!write(STDOUT_FILENO, line.data(), line.size()); }

void Must(const absl::Status& status) {
  if (status.ok()) return;
  std::cerr << status << std::endl;
  _exit(1);
}

void MakeCheckpoint(SessionStore& session, const std::string& name, int64_t revision) {
  auto writer = session.BeginCheckpoint(revision);
  Must(writer.status());
  for (PageKey page = 0; page < kNumPages; ++page) {
    if (Writes(revision, page)) Must((*writer)->WritePage(page, PageBytes(revision, page)));
  }
  Must((*writer)->Commit("m"));
  Tell(absl::StrCat("c ", name, " ", revision, "\n"));
  Must(session.TrimRecords(revision));
}

void WriteSession(SessionStore& session, const std::string& name, Durability durability) {
  std::counting_semaphore<kWindow> room(kWindow);
  for (int64_t revision = session.last_revision() + 1;; ++revision) {
    room.acquire();
    session.Append({revision, RecordBytes(name, revision)}, durability,
                   [&, revision](const absl::Status& status) {
                     Must(status);
                     Tell(absl::StrCat("r ", name, " ", revision, "\n"));
                     room.release();
                   });
    if (revision % kCheckpointEvery == 0) MakeCheckpoint(session, name, revision);
  }
}

[[noreturn]] void WriteUntilKilled(const std::string& directory) {
  const auto store = OpenStore(directory);
  Must(store.status());
  std::vector<std::unique_ptr<SessionStore>> sessions;
  std::vector<std::thread> threads;
  for (const std::string name : kNames) {
    const auto names = (*store)->ListSessions();
    if (std::find(names.begin(), names.end(), name) == names.end()) Must((*store)->CreateSession(name));
    auto session = (*store)->OpenSession(name);
    Must(session.status());
    sessions.push_back(*std::move(session));
    const Durability durability = name == "b" ? Durability::kAsync : Durability::kSync;
    threads.emplace_back(
        [&session = *sessions.back(), name, durability] { WriteSession(session, name, durability); });
  }
  for (std::thread& thread : threads) thread.join();
  _exit(2);
}

// ---- the process that looks

/// What a writer acknowledged before it was killed: the last record and the last checkpoint of each session.
struct Told {
  std::map<std::string, int64_t> records;
  std::map<std::string, int64_t> checkpoints;

  void Hear(const std::string& line) {
    const std::vector<std::string> words = absl::StrSplit(line, ' ');
    int64_t revision = 0;
    ASSERT_TRUE(words.size() == 3 && absl::SimpleAtoi(words[2], &revision)) << line;
    (words[0] == "r" ? records : checkpoints)[words[1]] = revision;
  }
};

/// A writer whose output is read here.
class Writer {
 public:
  explicit Writer(const std::string& directory) {
    std::array<int, 2> ends;
    EXPECT_EQ(pipe(ends.data()), 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    std::string self = "/proc/self/exe", mode = "--write", where = directory;
    char* const arguments[] = {self.data(), mode.data(), where.data(), nullptr};
    EXPECT_EQ(posix_spawn(&pid_, self.c_str(), &actions, nullptr, arguments, environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    output_ = fdopen(ends[0], "r");
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() { fclose(output_); }

  /// Hears a line; false at the end.
  bool HearLine(Told& told) {
    char line[100];
    if (fgets(line, sizeof(line), output_) == nullptr) return false;
    line[strcspn(line, "\n")] = '\0';
    told.Hear(line);
    return true;
  }

  void Kill() {
    kill(pid_, SIGKILL);
    int status = 0;
    waitpid(pid_, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status)) << "it ended by itself with " << WEXITSTATUS(status);
  }

 private:
  pid_t pid_ = 0;
  FILE* output_ = nullptr;
};

Told WriteAndKill(const std::string& directory, int num_lines) {
  Told told;
  Writer writer(directory);
  for (int i = 0; i < num_lines && writer.HearLine(told); ++i) continue;
  writer.Kill();
  while (writer.HearLine(told)) continue;
  return told;
}

void CheckSession(const std::string& name, SessionStore& session, const Told& told) {
  const SessionContents contents = ContentsOf(session);
  const auto at_least = [&](const std::map<std::string, int64_t>& heard) {
    return heard.count(name) == 0 ? 0 : heard.at(name);
  };
  EXPECT_GE(contents.checkpoint, at_least(told.checkpoints));
  EXPECT_GE(session.last_revision(), at_least(told.records));
  EXPECT_EQ(contents.pages, PagesOf(contents.checkpoint));
  int64_t expected = contents.checkpoint;
  for (const auto& [revision, bytes] : contents.records) {
    EXPECT_EQ(revision, ++expected);
    EXPECT_EQ(bytes, RecordBytes(name, revision));
  }
  EXPECT_EQ(session.last_revision(), expected);
}

TEST(CrashTest, NothingThatWasAcknowledgedIsLostByKilling) {
  for (uint32_t seed = 0; seed < 8; ++seed) {
    std::mt19937 random(seed);
    const TemporaryDirectory directory;
    for (int life = 0; life < 3; ++life) {
      SCOPED_TRACE(absl::StrCat("seed ", seed, ", life ", life));
      const Told told = WriteAndKill(directory.path(), 1 + random() % 1500);
      const auto store = OpenStore(directory.path());
      ASSERT_EQ(store.status(), absl::OkStatus());
      for (const std::string& name : (*store)->ListSessions()) {
        const auto session = (*store)->OpenSession(name);
        ASSERT_EQ(session.status(), absl::OkStatus());
        CheckSession(name, **session, told);
      }
      for (const auto& [name, revision] : told.records) {
        EXPECT_TRUE((*store)->OpenSession(name).ok()) << name;
      }
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing

int main(int argc, char** argv) {
  if (argc == 3 && std::strcmp(argv[1], "--write") == 0) dynmesh::testing::WriteUntilKilled(argv[2]);
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
