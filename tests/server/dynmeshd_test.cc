// The binary itself: flags, environment, ready file, signals, exit codes.

#include <fcntl.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "server/health_probe.h"
#include "tests/server/server_support.h"
#include "tests/store/temporary_directory.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

std::string ReadFile(const std::string& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// A dynmeshd with its output in a file.
class Process {
 public:
  Process(const std::vector<std::string>& arguments, const std::vector<std::string>& environment)
      : output_path_(::testing::TempDir() + "dynmeshd-" + std::to_string(getpid()) + ".out") {
    std::vector<std::string> words = {DYNMESHD};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv, envp;
    for (std::string& word : words) argv.push_back(word.data());
    std::vector<std::string> variables = environment;
    for (std::string& variable : variables) envp.push_back(variable.data());
    argv.push_back(nullptr);
    envp.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 1, output_path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions, 1, 2);
    EXPECT_EQ(posix_spawn(&pid_, DYNMESHD, &actions, nullptr, argv.data(), envp.data()), 0);
    posix_spawn_file_actions_destroy(&actions);
  }
  ~Process() {
    if (running_) {
      Signal(SIGKILL);
      Wait();
    }
    std::filesystem::remove(output_path_);
  }

  void Signal(int number) { kill(pid_, number); }

  /// Exit code, or -signal.
  int Wait() {
    int status = 0;
    EXPECT_EQ(waitpid(pid_, &status, 0), pid_);
    running_ = false;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  /// Memory that it holds at the moment, in bytes.
  uint64_t resident_bytes() const {
    for (absl::string_view line :
         absl::StrSplit(ReadFile("/proc/" + std::to_string(pid_) + "/status"), '\n')) {
      uint64_t kib = 0;
      if (absl::ConsumePrefix(&line, "VmRSS:") && absl::ConsumeSuffix(&line, " kB") &&
          absl::SimpleAtoi(line, &kib)) {
        return kib << 10;
      }
    }
    ADD_FAILURE() << "no VmRSS";
    return 0;
  }

  std::string output() const { return ReadFile(output_path_); }

 private:
  const std::string output_path_;
  pid_t pid_ = 0;
  bool running_ = true;
};

class DynmeshdTest : public ::testing::Test {
 protected:
  std::string ready_file_ = ::testing::TempDir() + "dynmeshd-" + std::to_string(getpid()) + ".ready";

  std::vector<std::string> AwaitReady() {
    const absl::Time deadline = absl::Now() + kPatience;
    while (!std::filesystem::exists(ready_file_)) {
      if (absl::Now() > deadline) {
        ADD_FAILURE() << "not ready";
        return {};
      }
      std::this_thread::yield();
    }
    return absl::StrSplit(ReadFile(ready_file_), '\n', absl::SkipEmpty());
  }

  /// Runs to the end and expects `code`; returns the output.
  std::string Run(int code, const std::vector<std::string>& arguments,
                  const std::vector<std::string>& environment = {}) {
    Process process(arguments, environment);
    EXPECT_EQ(process.Wait(), code) << process.output();
    return process.output();
  }
};

TEST_F(DynmeshdTest, ServesUntilSigtermAndExitsWith0) {
  for (int number : {SIGTERM, SIGINT}) {
    Process process({"--listen=127.0.0.1:0", "--ready_file=" + ready_file_}, {});
    const auto addresses = AwaitReady();
    ASSERT_EQ(addresses.size(), 1u);
    EXPECT_TRUE(ProbeHealth(addresses[0], kPatience).ok());
    EXPECT_EQ(Run(0, {"--health_check=" + addresses[0]}), "");
    process.Signal(number);
    EXPECT_EQ(process.Wait(), 0);
    EXPECT_FALSE(std::filesystem::exists(ready_file_));
    EXPECT_TRUE(absl::StrContains(Run(1, {"--health_check=" + addresses[0]}), addresses[0]));
  }
}

/// A call that is under way when the daemon is told to end.
class CallUnderWay {
 public:
  template <typename Fn>
  explicit CallUnderWay(Fn fn) : thread_([this, fn] { fn(&context_); }) {}
  ~CallUnderWay() {
    context_.TryCancel();
    thread_.join();
  }

 private:
  PatientContext context_;
  std::thread thread_;
};

TEST_F(DynmeshdTest, EndsInTimeWhateverItDoes) {
  Process process({"--listen=127.0.0.1:0", "--ready_file=" + ready_file_, "--drain_timeout=1s",
                   "--max_query_steps=1000000000000000000"},
                  {});
  const auto addresses = AwaitReady();
  ASSERT_EQ(addresses.size(), 1u);
  const auto channel = grpc::CreateChannel(addresses[0], grpc::InsecureChannelCredentials());
  const auto sessions = v1::SessionService::NewStub(channel);
  const auto edits = v1::EditService::NewStub(channel);
  const auto queries = v1::QueryService::NewStub(channel);
  const auto subscriptions = v1::SubscriptionService::NewStub(channel);
  for (const char* name : {"book", "empty"}) {
    PatientContext context;
    v1::CreateSessionRequest request;
    request.set_name(name);
    v1::CreateSessionResponse response;
    ASSERT_TRUE(sessions->CreateSession(&context, request, &response).ok());
  }
  {
    PatientContext context;
    v1::ApplyEditsResponse response;
    ASSERT_TRUE(edits->ApplyEdits(&context, BookBatch("book", 50'000), &response).ok());
  }
  std::atomic<int> begun{0};
  const CallUnderWay query([&](grpc::ClientContext* context) {
    // All of its edges, of which the hub is one.
    v1::GetNeighborsRequest request = CellsOfEdges("book", 0, 0);
    std::vector<Slot> edges;
    for (int i = 0; i < 900'000; ++i) edges.push_back(i % 3);
    *request.mutable_selection() = SelectIds(edges);
    const auto stream = queries->GetNeighbors(context, request);
    ++begun;
    v1::GetNeighborsResponse response;
    while (stream->Read(&response)) {
    }
    EXPECT_FALSE(stream->Finish().ok());
  });
  const CallUnderWay validate([&](grpc::ClientContext*) {
    v1::ValidateSessionRequest request;
    request.set_session("book");
    v1::ValidateSessionResponse response;
    ++begun;
    for (bool serves = true; serves;) {  // one after the other, so that one is under way
      PatientContext context;
      serves = sessions->ValidateSession(&context, request, &response).ok();
    }
  });
  const CallUnderWay import([&](grpc::ClientContext* context) {
    const auto stream = sessions->ImportMesh(context);
    stream->Write(ImportHead("empty"));
    stream->Write(ImportPositions(SomePoints(1000)));
    ++begun;
    v1::ImportMeshResponse response;
    while (stream->Read(&response)) {
    }
    EXPECT_FALSE(stream->Finish().ok());
  });
  const CallUnderWay edit([&](grpc::ClientContext* context) {
    const auto stream = edits->StreamEdits(context);
    v1::StreamEditsRequest request;
    *request.mutable_batch() = TetBatch("book");  // waits for the query
    stream->Write(request);
    ++begun;
    v1::StreamEditsResponse response;
    while (stream->Read(&response)) {
    }
    EXPECT_FALSE(stream->Finish().ok());
  });
  const CallUnderWay follow([&](grpc::ClientContext* context) {
    v1::SubscribeRequest request;
    request.set_session("book");
    const auto stream = subscriptions->Subscribe(context, request);
    ++begun;
    v1::SubscribeResponse response;
    while (stream->Read(&response)) {
    }
    EXPECT_FALSE(stream->Finish().ok());
  });
  while (begun < 5) std::this_thread::yield();
  const absl::Time begin = absl::Now();
  process.Signal(SIGTERM);
  EXPECT_EQ(process.Wait(), 0) << process.output();
  EXPECT_LT(absl::Now() - begin, absl::Seconds(6));
}

v1::Session GetSession(v1::SessionService::Stub& sessions, const std::string& name) {
  PatientContext context;
  v1::GetSessionRequest request;
  request.set_name(name);
  v1::GetSessionResponse response;
  EXPECT_TRUE(sessions.GetSession(&context, request, &response).ok());
  return response.session();
}

/// Bytes that the process holds while somebody follows a session at revision 1, which keeps it loaded and is
/// sent nothing.
uint64_t ResidentWhileFollowed(const Process& process, v1::SubscriptionService::Stub& subscriptions,
                               const std::string& name) {
  PatientContext context;
  v1::SubscribeRequest request;
  request.set_session(name);
  request.set_from_revision(1);
  const auto stream = subscriptions.Subscribe(&context, request);
  v1::SubscribeResponse response;
  EXPECT_TRUE(stream->Read(&response));
  const uint64_t bytes = process.resident_bytes();
  context.TryCancel();
  EXPECT_FALSE(stream->Finish().ok());
  return bytes;
}

/// Waits until the process holds no more than `target` bytes, or for long; returns what it holds.
uint64_t AwaitResident(const Process& process, uint64_t target) {
  const absl::Time deadline = absl::Now() + kPatience;
  uint64_t bytes = process.resident_bytes();
  while (bytes > target && absl::Now() < deadline) {
    std::this_thread::yield();
    bytes = process.resident_bytes();
  }
  return bytes;
}

TEST_F(DynmeshdTest, MemoryOfUnloadedSessionsGoesBackToTheSystem) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "freed memory is kept in quarantine";
#endif
  const TemporaryDirectory directory;
  Process process({"--listen=127.0.0.1:0", "--ready_file=" + ready_file_, "--data_dir=" + directory.path(),
                   "--idle_timeout=100ms"},
                  {});
  const auto addresses = AwaitReady();
  ASSERT_EQ(addresses.size(), 1u);
  const auto channel = grpc::CreateChannel(addresses[0], grpc::InsecureChannelCredentials());
  const auto sessions = v1::SessionService::NewStub(channel);
  const auto subscriptions = v1::SubscriptionService::NewStub(channel);
  {
    PatientContext context;
    v1::CreateSessionRequest request;
    request.set_name("grid");
    v1::CreateSessionResponse response;
    ASSERT_TRUE(sessions->CreateSession(&context, request, &response).ok());
  }
  ASSERT_TRUE(SendImport(*sessions, ImportOf("grid", TetGrid(26, 26, 26), 50'000)).ok());
  const v1::Session before = GetSession(*sessions, "grid");
  ASSERT_GT(before.counts().cells(), 100'000u);
  uint64_t left_first = 0;
  for (int round = 0; round < 3; ++round) {
    const uint64_t loaded = ResidentWhileFollowed(process, *subscriptions, "grid");
    const uint64_t target = loaded - std::min(loaded, before.memory_bytes() / 5 * 4);
    const uint64_t left = AwaitResident(process, target);
    EXPECT_LE(left, target) << loaded << " bytes became " << left << ", the session holds "
                            << before.memory_bytes() << "\n"
                            << process.output();
    if (round == 0) left_first = left;
    EXPECT_LE(left, left_first + before.memory_bytes() / 2) << "more stays each time";
  }
  EXPECT_TRUE(absl::StrContains(process.output(), "session_unloaded name=grid bytes=")) << process.output();
  const v1::Session after = GetSession(*sessions, "grid");
  EXPECT_EQ(after.checksum().topology(), before.checksum().topology());
  EXPECT_EQ(after.checksum().geometry(), before.checksum().geometry());
  EXPECT_EQ(after.etag(), before.etag());
  process.Signal(SIGTERM);
  EXPECT_EQ(process.Wait(), 0);
}

TEST_F(DynmeshdTest, TheEnvironmentStandsInForFlags) {
  const std::string socket = ::testing::TempDir() + "dynmeshd-" + std::to_string(getpid()) + ".sock";
  Process process({"--ready_file=" + ready_file_, "--listen="},
                  {"DYNMESHD_LISTEN=127.0.0.1:0,localhost:0", "DYNMESHD_UNIX_SOCKET=" + socket});
  EXPECT_EQ(AwaitReady(), std::vector<std::string>{"unix:" + socket});  // the flag has the last word
  process.Signal(SIGTERM);
  EXPECT_EQ(process.Wait(), 0);
  Process other({"--ready_file=" + ready_file_}, {"DYNMESHD_LISTEN=127.0.0.1:0,localhost:0"});
  EXPECT_EQ(AwaitReady().size(), 2u);
  other.Signal(SIGTERM);
  EXPECT_EQ(other.Wait(), 0);
}

TEST_F(DynmeshdTest, TheHealthCheckFollowsTheFlagsAndTheEnvironment) {
  EXPECT_EQ(ProbeTarget({"0.0.0.0:7447"}, ""), "127.0.0.1:7447");
  EXPECT_EQ(ProbeTarget({"", "[::]:1", "127.0.0.1:2"}, "/s"), "[::1]:1");
  EXPECT_EQ(ProbeTarget({"10.1.2.3:4"}, "/s"), "10.1.2.3:4");
  EXPECT_EQ(ProbeTarget({"127.0.0.1:0"}, "/s"), "unix:/s");
  EXPECT_EQ(ProbeTarget({}, ""), "");
  const std::string socket = ::testing::TempDir() + "dynmeshd-" + std::to_string(getpid()) + ".sock";
  const std::vector<std::string> environment = {"DYNMESHD_LISTEN=127.0.0.1:0",
                                                "DYNMESHD_UNIX_SOCKET=" + socket};
  const std::vector<std::string> check = {"--health_check=self"};
  Process process({"--ready_file=" + ready_file_}, environment);
  const auto addresses = AwaitReady();
  ASSERT_EQ(addresses.size(), 2u);
  Run(0, check, environment);
  Run(0, check, {"DYNMESHD_LISTEN=" + addresses[0]});
  process.Signal(SIGTERM);
  EXPECT_EQ(process.Wait(), 0);
  Run(1, check, environment);
  Run(1, check, {"DYNMESHD_LISTEN="});
}

TEST_F(DynmeshdTest, WrongCallsSayWhatIsWrong) {
  const auto expect = [&](const std::string& said, const std::vector<std::string>& arguments,
                          const std::vector<std::string>& environment = {}) {
    const std::string output = Run(1, arguments, environment);
    EXPECT_TRUE(absl::StrContains(output, said)) << output;
  };
  expect("--allow_insecure", {"--listen=0.0.0.0:0"});
  expect("nonsense", {"--nonsense"});
  expect("unexpected argument 'serve'", {"serve"});
  expect("DYNMESHD_MAX_SESSIONS", {}, {"DYNMESHD_MAX_SESSIONS=many"});
  expect("host:port", {"--listen=7447"});
  expect("log_level", {"--log_level=loud"});
  expect("idle_timeout", {"--idle_timeout=-1s"});
  expect("nothing to listen on", {"--listen="});
}

TEST_F(DynmeshdTest, TellsItsVersion) { EXPECT_TRUE(absl::StartsWith(Run(0, {"--version"}), "dynmeshd ")); }

TEST_F(DynmeshdTest, EndsWithItsParent) {
  // A thread that starts it and ends is enough of a parent.
  std::unique_ptr<Process> process;
  std::thread parent([&] {
    process = std::make_unique<Process>(
        std::vector<std::string>{"--listen=127.0.0.1:0", "--exit_with_parent", "--ready_file=" + ready_file_},
        std::vector<std::string>{});
    AwaitReady();
  });
  parent.join();
  EXPECT_EQ(process->Wait(), 0);
}

}  // namespace
}  // namespace dynmesh::testing
