// dynmeshd: flags and signals. Everything else is in server.h.

#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "absl/flags/flag.h"
#include "absl/flags/parse.h"
#include "absl/flags/reflection.h"
#include "absl/flags/usage.h"
#include "absl/flags/usage_config.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/health_probe.h"
#include "server/server.h"
#include "server/session/heap.h"
#include "spdlog/sinks/stdout_sinks.h"
#include "spdlog/spdlog.h"

ABSL_FLAG(std::vector<std::string>, listen, {"127.0.0.1:7447"},
          "Addresses host:port, separated by commas; port 0 lets the system choose. Empty: none");
ABSL_FLAG(std::string, unix_socket, "", "Path of a unix socket to listen on too");
ABSL_FLAG(bool, allow_insecure, false,
          "Allow addresses that other machines can reach, although nothing is encrypted or authenticated");
ABSL_FLAG(std::string, data_dir, "",
          "Directory to keep sessions in, made if it is not there; empty: sessions end with the daemon");
ABSL_FLAG(absl::Duration, async_delay, dynmesh::ServerOptions().async_delay,
          "What a loss of power may take of sessions that are kept with DURABILITY_ASYNC");
ABSL_FLAG(uint64_t, checkpoint_bytes, dynmesh::ServerOptions().checkpoint_bytes,
          "Log of a session before another checkpoint is written, which keeps loading it quick");
ABSL_FLAG(absl::Duration, idle_timeout, dynmesh::ServerOptions().idle_timeout,
          "Sessions in data_dir that nobody has used or followed for so long are unloaded, until somebody "
          "uses them; what undoes batches is lost. 0: never");
ABSL_FLAG(uint64_t, max_loaded_bytes, dynmesh::ServerOptions().max_loaded_bytes,
          "Memory of the sessions in data_dir that are loaded: beyond it the least recently used ones that "
          "nobody uses are unloaded. 0: however much");
ABSL_FLAG(
    uint32_t, retain_revisions, dynmesh::ServerOptions().retention.max_revisions,
    "Last revisions of a session in data_dir that can be gone back to; 0: all. A session can ask for fewer");
ABSL_FLAG(absl::Duration, retain_age, dynmesh::ServerOptions().retention.max_age,
          "The same by their age; 0: of any age");
ABSL_FLAG(uint64_t, retain_bytes, dynmesh::ServerOptions().retention.max_bytes,
          "The same by the disk that their records take; 0: however much");
ABSL_FLAG(std::string, ready_file, "",
          "File that is written, one address a line, when the server is serving; removed at the end");
ABSL_FLAG(std::string, log_level, "info", "trace, debug, info, warn, error or off");
ABSL_FLAG(absl::Duration, drain_timeout, absl::Seconds(10),
          "How long calls under way may go on after SIGTERM or SIGINT; the daemon ends at most 5 s later");
ABSL_FLAG(bool, exit_with_parent, false, "Drain and exit when the process that started this one ends");
ABSL_FLAG(
    std::string, health_check, "",
    "Do not serve: ask the server at this gRPC target for its health, and exit with 0 or 1. \"self\": where "
    "one with the other flags and the same environment serves");
ABSL_FLAG(int32_t, quick_threads, 0,
          "Threads for edits and small queries; 0: four for each processor, at least 8");
ABSL_FLAG(
    int32_t, heavy_threads, 0,
    "Threads for imports, exports, validation and large queries; 0: four more than max_concurrent_imports");

ABSL_FLAG(uint32_t, max_sessions, dynmesh::Limits().max_sessions, "Sessions");
ABSL_FLAG(uint32_t, max_vertices, dynmesh::Limits().max_vertices, "Vertices of a session");
ABSL_FLAG(uint32_t, max_edges, dynmesh::Limits().max_edges, "Edges of a session, derived ones included");
ABSL_FLAG(uint32_t, max_faces, dynmesh::Limits().max_faces, "Faces of a session, derived ones included");
ABSL_FLAG(uint32_t, max_cells, dynmesh::Limits().max_cells, "Cells of a session");
ABSL_FLAG(uint64_t, max_session_bytes, dynmesh::Limits().max_session_bytes,
          "Memory of a session's mesh; by default the smaller of 64 GiB and 3/4 of the machine's memory");
ABSL_FLAG(uint64_t, max_batch_edits, dynmesh::Limits().max_batch_edits, "Edits in a batch");
ABSL_FLAG(uint64_t, max_batch_items, dynmesh::Limits().max_batch_items,
          "Vertices, elements and rows that the edits of a batch name, and elements that its operators make");
ABSL_FLAG(uint32_t, max_undo_batches, dynmesh::Limits().max_undo_batches,
          "Batches of a session that can be undone or redone; 0: none");
ABSL_FLAG(uint64_t, max_undo_bytes, dynmesh::Limits().max_undo_bytes,
          "Memory for what undoes and redoes the batches of a session");
ABSL_FLAG(uint64_t, max_message_bytes, dynmesh::Limits().max_message_bytes, "One request message");
ABSL_FLAG(uint64_t, max_query_bytes, dynmesh::Limits().max_query_bytes, "One answer of a query or export");
ABSL_FLAG(uint64_t, max_query_steps, dynmesh::Limits().max_query_steps,
          "Entities and incidences that one query or export may look at, about ten nanoseconds each");
ABSL_FLAG(uint64_t, max_answer_bytes, dynmesh::Limits().max_answer_bytes,
          "All answers of queries and exports that wait to be read");
ABSL_FLAG(uint32_t, max_followers, dynmesh::Limits().max_followers, "Subscriptions of a session");
ABSL_FLAG(uint32_t, max_concurrent_imports, dynmesh::Limits().max_concurrent_imports,
          "Imports and restores at once");
ABSL_FLAG(uint32_t, max_concurrent_adaptations, dynmesh::Limits().max_concurrent_adaptations,
          "AdaptSession calls at once");
ABSL_FLAG(uint64_t, max_staged_bytes, dynmesh::Limits().max_staged_bytes,
          "What imports and restores have received and not finished yet, all together");
ABSL_FLAG(uint64_t, max_backup_bytes, dynmesh::Limits().max_backup_bytes,
          "Copies of sessions that backups are written of, all together");
ABSL_FLAG(absl::Duration, import_idle_timeout, dynmesh::Limits().import_idle_timeout,
          "How long an import or restore may send nothing, or an import or backup not read what it is told");
ABSL_FLAG(uint32_t, max_queued_tasks, dynmesh::Limits().max_queued_tasks,
          "Calls that wait for a thread or for their session, for each of the two pools of threads");
ABSL_FLAG(uint64_t, max_queued_bytes, dynmesh::Limits().max_queued_bytes, "Requests of the calls that wait");

namespace dynmesh {
namespace {

constexpr char kUsage[] =
    "dynmeshd holds named mesh sessions and serves them by gRPC.\n"
    "Each flag that is not given is taken from the environment variable DYNMESHD_<FLAG>, if that is set,\n"
    "e.g. DYNMESHD_LISTEN=127.0.0.1:0.";
constexpr char kEnvironmentPrefix[] = "DYNMESHD_";
constexpr absl::Duration kHealthTimeout = absl::Seconds(5);
// After drain_timeout calls are cancelled; what computes notices within a second, unless it is our fault.
constexpr absl::Duration kDrainGrace = absl::Seconds(5);

bool IsOwnFlag(const absl::CommandLineFlag& flag) {
  return absl::string_view(flag.Filename()).find("server/main.cc") != absl::string_view::npos;
}

/// Before the command line is parsed, which thereby has the last word.
bool SetFlagsFromEnvironment() {
  for (const auto& [name, flag] : absl::GetAllFlags()) {
    if (!IsOwnFlag(*flag)) continue;
    const std::string variable = absl::StrCat(kEnvironmentPrefix, absl::AsciiStrToUpper(name));
    const char* value = getenv(variable.c_str());
    std::string error;
    if (value == nullptr || flag->ParseFrom(value, &error)) continue;
    std::cerr << "dynmeshd: " << variable << "='" << value << "': " << error << "\n";
    return false;
  }
  return true;
}

bool SetUpLogging() {
  auto logger = spdlog::stderr_logger_mt("dynmeshd");
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z level=%l %v");
  const std::string name = absl::GetFlag(FLAGS_log_level);
  const auto level = spdlog::level::from_str(name);
  logger->set_level(level);
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(logger);
  return level != spdlog::level::off || name == "off";
}

Limits LimitsFromFlags() {
  Limits limits;
  limits.max_sessions = absl::GetFlag(FLAGS_max_sessions);
  limits.max_vertices = absl::GetFlag(FLAGS_max_vertices);
  limits.max_edges = absl::GetFlag(FLAGS_max_edges);
  limits.max_faces = absl::GetFlag(FLAGS_max_faces);
  limits.max_cells = absl::GetFlag(FLAGS_max_cells);
  limits.max_session_bytes = absl::GetFlag(FLAGS_max_session_bytes);
  limits.max_batch_edits = absl::GetFlag(FLAGS_max_batch_edits);
  limits.max_batch_items = absl::GetFlag(FLAGS_max_batch_items);
  limits.max_undo_batches = absl::GetFlag(FLAGS_max_undo_batches);
  limits.max_undo_bytes = absl::GetFlag(FLAGS_max_undo_bytes);
  limits.max_message_bytes = absl::GetFlag(FLAGS_max_message_bytes);
  limits.max_query_bytes = absl::GetFlag(FLAGS_max_query_bytes);
  limits.max_query_steps = absl::GetFlag(FLAGS_max_query_steps);
  limits.max_answer_bytes = absl::GetFlag(FLAGS_max_answer_bytes);
  limits.max_followers = absl::GetFlag(FLAGS_max_followers);
  limits.max_concurrent_adaptations = absl::GetFlag(FLAGS_max_concurrent_adaptations);
  limits.max_concurrent_imports = absl::GetFlag(FLAGS_max_concurrent_imports);
  limits.max_staged_bytes = absl::GetFlag(FLAGS_max_staged_bytes);
  limits.max_backup_bytes = absl::GetFlag(FLAGS_max_backup_bytes);
  limits.import_idle_timeout = absl::GetFlag(FLAGS_import_idle_timeout);
  limits.max_queued_tasks = absl::GetFlag(FLAGS_max_queued_tasks);
  limits.max_queued_bytes = absl::GetFlag(FLAGS_max_queued_bytes);
  return limits;
}

ServerOptions OptionsFromFlags() {
  ServerOptions options;
  options.listen.clear();
  for (const std::string& address : absl::GetFlag(FLAGS_listen)) {
    if (!address.empty()) options.listen.push_back(address);
  }
  options.unix_socket = absl::GetFlag(FLAGS_unix_socket);
  options.allow_insecure = absl::GetFlag(FLAGS_allow_insecure);
  options.data_dir = absl::GetFlag(FLAGS_data_dir);
  options.async_delay = absl::GetFlag(FLAGS_async_delay);
  options.checkpoint_bytes = absl::GetFlag(FLAGS_checkpoint_bytes);
  options.retention = {absl::GetFlag(FLAGS_retain_revisions), absl::GetFlag(FLAGS_retain_age),
                       absl::GetFlag(FLAGS_retain_bytes)};
  options.idle_timeout = absl::GetFlag(FLAGS_idle_timeout);
  options.max_loaded_bytes = absl::GetFlag(FLAGS_max_loaded_bytes);
  options.limits = LimitsFromFlags();
  options.quick_threads = absl::GetFlag(FLAGS_quick_threads);
  options.heavy_threads = absl::GetFlag(FLAGS_heavy_threads);
  return options;
}

/// Written beside and renamed, so that whoever sees the file sees all of it.
bool WriteReadyFile(const std::string& path, const std::vector<std::string>& addresses) {
  const std::string temporary = absl::StrCat(path, ".", getpid());
  {
    std::ofstream file(temporary);
    for (const std::string& address : addresses) file << address << "\n";
    if (!file.flush()) return false;
  }
  return std::rename(temporary.c_str(), path.c_str()) == 0;
}

/// The signals that end the daemon, blocked in all threads and waited for in main.
sigset_t BlockSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

/// From here on the end of the thread that started this process sends SIGTERM. False when it is gone already.
bool TieToParent() {
  const pid_t parent = getppid();
  return prctl(PR_SET_PDEATHSIG, SIGTERM) == 0 && getppid() == parent;
}

int CheckHealth(std::string target) {
  if (target == "self") target = ProbeTarget(absl::GetFlag(FLAGS_listen), absl::GetFlag(FLAGS_unix_socket));
  if (target.empty()) {
    std::cerr << "dynmeshd: --health_check=self needs an address with a port, or a unix socket\n";
    return EXIT_FAILURE;
  }
  const absl::Status status = ProbeHealth(target, kHealthTimeout);
  if (!status.ok()) std::cerr << "dynmeshd: " << status.message() << "\n";
  return status.ok() ? EXIT_SUCCESS : EXIT_FAILURE;
}

/// Ends the process when the drain does not: whoever waits for us must not have to kill us.
void ExitAt(absl::Time deadline) {
  std::thread([deadline] {
    absl::SleepFor(deadline - absl::Now());
    spdlog::critical("drain_overrun");
    _exit(EXIT_FAILURE);
  }).detach();
}

int Serve() {
  ReturnLargeBlocks();
  const sigset_t signals = BlockSignals();
  if (absl::GetFlag(FLAGS_exit_with_parent) && !TieToParent()) return EXIT_FAILURE;
  absl::StatusOr<std::unique_ptr<Server>> server = Server::Start(OptionsFromFlags());
  if (!server.ok()) {
    std::cerr << "dynmeshd: " << server.status().message() << "\n";
    return EXIT_FAILURE;
  }
  spdlog::info("serving addresses={} pid={}", absl::StrJoin((*server)->addresses(), ","), getpid());
  const std::string ready_file = absl::GetFlag(FLAGS_ready_file);
  if (!ready_file.empty() && !WriteReadyFile(ready_file, (*server)->addresses())) {
    std::cerr << "dynmeshd: cannot write " << ready_file << "\n";
    return EXIT_FAILURE;
  }
  int signal_number = 0;
  sigwait(&signals, &signal_number);
  spdlog::info("signal number={}", signal_number);
  if (!ready_file.empty()) std::remove(ready_file.c_str());
  const absl::Duration timeout = absl::GetFlag(FLAGS_drain_timeout);
  ExitAt(absl::Now() + timeout + kDrainGrace);
  (*server)->Drain(timeout);
  *server = nullptr;
  return EXIT_SUCCESS;
}

int Main(int argc, char** argv) {
  absl::SetProgramUsageMessage(kUsage);
  absl::FlagsUsageConfig config;
  config.normalize_filename = [](absl::string_view file) {
    return std::string(
        file.substr(std::min(file.size(), file.rfind("server/"))));  // no path of a build machine
  };
  config.contains_helpshort_flags = [](absl::string_view file) { return file.find("main.cc") != file.npos; };
  config.contains_help_flags = config.contains_helpshort_flags;
  config.version_string = [] { return std::string("dynmeshd " DYNMESH_VERSION "\n"); };
  absl::SetFlagsUsageConfig(config);
  if (!SetFlagsFromEnvironment()) return EXIT_FAILURE;
  const std::vector<char*> rest = absl::ParseCommandLine(argc, argv);
  if (rest.size() > 1) {
    std::cerr << "dynmeshd: unexpected argument '" << rest[1] << "'\n";
    return EXIT_FAILURE;
  }
  if (!SetUpLogging()) {
    std::cerr << "dynmeshd: unknown --log_level\n";
    return EXIT_FAILURE;
  }
  const std::string target = absl::GetFlag(FLAGS_health_check);
  return target.empty() ? Serve() : CheckHealth(target);
}

}  // namespace
}  // namespace dynmesh

int main(int argc, char** argv) { return dynmesh::Main(argc, argv); }
