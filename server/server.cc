#include "server/server.h"

#include <arpa/inet.h>
#include <grpc/support/log.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "grpcpp/ext/proto_server_reflection_plugin.h"
#include "grpcpp/health_check_service_interface.h"
#include "grpcpp/impl/service_type.h"
#include "grpcpp/server.h"
#include "grpcpp/server_builder.h"
#include "server/rpc/adapt_service.h"
#include "server/rpc/backups_service.h"
#include "server/rpc/checks_service.h"
#include "server/rpc/edits_service.h"
#include "server/rpc/history_service.h"
#include "server/rpc/open_streams.h"
#include "server/rpc/queries_service.h"
#include "server/rpc/repairs_service.h"
#include "server/rpc/sessions_service.h"
#include "server/rpc/subscriptions_service.h"
#include "server/session/catch_exceptions.h"
#include "server/session/session_errors.h"
#include "server/store/local_store.h"
#include "server/store/rocksdb_engine.h"
#include "spdlog/spdlog.h"

namespace dynmesh {
namespace {

constexpr const char* kServiceNames[] = {"dynmesh.v1.SessionService", "dynmesh.v1.EditService",
                                         "dynmesh.v1.QueryService",   "dynmesh.v1.CheckService",
                                         "dynmesh.v1.RepairService",  "dynmesh.v1.AdaptService",
                                         "dynmesh.v1.HistoryService", "dynmesh.v1.BackupService",
                                         "dynmesh.v1.SubscriptionService"};
// gRPC refuses larger messages before we see them; up to there our own refusal names the limit.
constexpr uint64_t kHardMessageFactor = 4;
// Followers, and a daemon that drains, wait for as long.
constexpr absl::Duration kMaxAsyncDelay = absl::Seconds(10);
// How often sessions are looked at that may be unloaded: an eighth of idle_timeout, within these bounds.
constexpr absl::Duration kMinSweepPeriod = absl::Milliseconds(250);
constexpr absl::Duration kMaxSweepPeriod = absl::Minutes(1);
constexpr int kKeepaliveTimeMs = 30'000;
constexpr int kKeepaliveTimeoutMs = 10'000;
constexpr int kMinPingIntervalMs = 5'000;

absl::Status BadAddress(absl::string_view address, absl::string_view message) {
  return InvalidArgument(reason::kBadArgument, absl::StrCat("address '", address, "' ", message),
                         {{"field", "listen"}, {"address", std::string(address)}});
}

struct HostAndPort {
  std::string host;
  int port = 0;
};

absl::StatusOr<HostAndPort> SplitAddress(absl::string_view address) {
  const size_t colon = address.rfind(':');
  HostAndPort parts;
  if (colon == address.npos || colon == 0 || !absl::SimpleAtoi(address.substr(colon + 1), &parts.port) ||
      parts.port < 0 || parts.port > 65535) {
    return BadAddress(address, "is not of the form host:port");
  }
  parts.host = std::string(address.substr(0, colon));
  return parts;
}

bool IsLoopbackHost(std::string host) {
  if (absl::StartsWith(host, "[") && absl::EndsWith(host, "]")) host = host.substr(1, host.size() - 2);
  if (host == "localhost") return true;
  in_addr v4;
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  in6_addr v6;
  return inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

/// gRPC's own log lines go where ours go.
void LogForGrpc(gpr_log_func_args* args) {
  const auto level = args->severity == GPR_LOG_SEVERITY_ERROR  ? spdlog::level::warn
                     : args->severity == GPR_LOG_SEVERITY_INFO ? spdlog::level::debug
                                                               : spdlog::level::trace;
  spdlog::log(level, "grpc message=\"{}\"", args->message);
}

/// Whether somebody accepts connections at the unix socket `path`: gRPC would take its place without a word.
bool IsServed(const std::string& path) {
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) return false;
  std::copy(path.begin(), path.end(), address.sun_path);
  const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool served = fd >= 0 && connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  if (fd >= 0) close(fd);
  return served;
}

absl::Status CannotListen(absl::string_view address) {
  return absl::UnavailableError(absl::StrCat("cannot listen on ", address));
}

Executor::Options ExecutorOptions(const char* name, int threads, const Limits& limits) {
  return {name, threads, limits.max_queued_tasks, limits.max_queued_bytes};
}

/// More than processors: one that waits for memory or for a lock for a moment costs nothing.
int QuickThreads(const ServerOptions& options) {
  if (options.quick_threads > 0) return options.quick_threads;
  return std::max<int>(8, 4 * std::thread::hardware_concurrency());
}

/// More than imports may take.
int HeavyThreads(const ServerOptions& options) {
  if (options.heavy_threads > 0) return options.heavy_threads;
  return static_cast<int>(std::min(options.limits.max_concurrent_imports, 16u)) + 4;
}

UnloadPolicy PolicyOf(const ServerOptions& options) {
  UnloadPolicy policy;
  if (options.idle_timeout > absl::ZeroDuration()) policy.idle_timeout = options.idle_timeout;
  if (options.max_loaded_bytes > 0) policy.max_loaded_bytes = options.max_loaded_bytes;
  return policy;
}

/// Never where nothing is to be unloaded.
absl::Duration SweepPeriod(const ServerOptions& options) {
  if (options.data_dir.empty()) return absl::InfiniteDuration();
  if (options.max_loaded_bytes > 0) return kMinSweepPeriod;
  const absl::Duration idle = PolicyOf(options).idle_timeout;
  if (idle == absl::InfiniteDuration()) return idle;
  return std::clamp(idle / 8, kMinSweepPeriod, kMaxSweepPeriod);
}

/// Null without a directory.
absl::StatusOr<std::unique_ptr<Store>> OpenStore(const ServerOptions& options) {
  if (options.data_dir.empty()) return std::unique_ptr<Store>();
  if (options.async_delay < absl::ZeroDuration() || options.async_delay > kMaxAsyncDelay) {
    return InvalidArgument(reason::kBadArgument, "async_delay is outside 0 to 10 s",
                           {{"field", "async_delay"}});
  }
  if (options.retention.max_age < absl::ZeroDuration()) {
    return InvalidArgument(reason::kBadArgument, "retain_age is negative", {{"field", "retain_age"}});
  }
  DYNMESH_ASSIGN_OR_RETURN(std::unique_ptr<Engine> engine, OpenRocksDb({options.data_dir}));
  return LocalStore::Open(std::move(engine), {.async_delay = options.async_delay});
}

}  // namespace

absl::Status CheckLoopback(absl::string_view address) {
  DYNMESH_ASSIGN_OR_RETURN(const HostAndPort parts, SplitAddress(address));
  if (IsLoopbackHost(parts.host)) return absl::OkStatus();
  return BadAddress(address,
                    "can be reached from other machines, and nothing would be encrypted or authenticated: "
                    "allow that with --allow_insecure");
}

/// Members are destroyed from the last to the first: gRPC, then the threads, then the sessions.
class Server::Impl {
 public:
  Impl(const ServerOptions& options, std::unique_ptr<Store> store)
      : quick_(ExecutorOptions("quick", QuickThreads(options), options.limits)),
        heavy_(ExecutorOptions("heavy", HeavyThreads(options), options.limits)),
        registry_(options.limits, Workers{&quick_, &heavy_, &timer_}, std::move(store),
                  {.checkpoint_bytes = options.checkpoint_bytes, .retention = options.retention}),
        unload_policy_(PolicyOf(options)),
        sweep_period_(SweepPeriod(options)) {
    const ServiceContext context{registry_, streams_};
    services_.push_back(MakeSessionsService(context));
    services_.push_back(MakeEditsService(context));
    services_.push_back(MakeQueriesService(context));
    services_.push_back(MakeRepairsService(context));
    services_.push_back(MakeHistoryService(context));
    services_.push_back(MakeChecksService(context));
    services_.push_back(MakeSubscriptionsService(context));
    services_.push_back(MakeAdaptService(context));
    services_.push_back(MakeBackupsService(context));
  }

  ~Impl() {
    Drain(absl::ZeroDuration());
    timer_.Stop();
    quick_.Stop();
    heavy_.Stop();
  }

  absl::Status Listen(const ServerOptions& options);
  void Drain(absl::Duration timeout);
  /// From now on sessions are unloaded, as long as the timer runs.
  void SweepLater();
  const std::vector<std::string>& addresses() const { return addresses_; }
  SessionRegistry& registry() { return registry_; }

 private:
  void Configure(const Limits& limits, grpc::ServerBuilder& builder);

  Timer timer_;
  Executor quick_;
  Executor heavy_;
  OpenStreams streams_;
  SessionRegistry registry_;
  const UnloadPolicy unload_policy_;
  const absl::Duration sweep_period_;
  std::vector<std::unique_ptr<grpc::Service>> services_;
  Mutex drain_mu_;
  bool drained_ ABSL_GUARDED_BY(drain_mu_) = false;
  std::vector<std::string> addresses_;
  std::unique_ptr<grpc::Server> grpc_;
};

void Server::Impl::Configure(const Limits& limits, grpc::ServerBuilder& builder) {
  for (const auto& service : services_) builder.RegisterService(service.get());
  builder.SetMaxReceiveMessageSize(
      static_cast<int>(std::min<uint64_t>(limits.max_message_bytes * kHardMessageFactor, INT32_MAX)));
  builder.SetMaxSendMessageSize(-1);
  // A second daemon on the same port must fail, not share the port.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveTimeMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kMinPingIntervalMs);
}

absl::Status Server::Impl::Listen(const ServerOptions& options) {
  grpc::ServerBuilder builder;
  Configure(options.limits, builder);
  std::vector<std::string> targets = options.listen;
  if (!options.unix_socket.empty()) {
    if (IsServed(options.unix_socket)) return CannotListen(options.unix_socket);
    targets.push_back(absl::StrCat("unix:", options.unix_socket));
  }
  std::vector<int> ports(targets.size(), 0);
  for (size_t i = 0; i < targets.size(); ++i) {
    builder.AddListeningPort(targets[i], grpc::InsecureServerCredentials(), &ports[i]);
  }
  const mode_t mask = umask(0077);  // so that the socket's file is the user's own from the beginning
  grpc_ = builder.BuildAndStart();
  umask(mask);
  for (size_t i = 0; i < targets.size(); ++i) {
    if (grpc_ == nullptr || ports[i] <= 0) return CannotListen(targets[i]);
    const bool has_port = i < options.listen.size();
    addresses_.push_back(has_port ? absl::StrCat(targets[i].substr(0, targets[i].rfind(':')), ":", ports[i])
                                  : targets[i]);
  }
  for (const char* name : kServiceNames) grpc_->GetHealthCheckService()->SetServingStatus(name, true);
  return absl::OkStatus();
}

// One at a time: the next is due after the last.
void Server::Impl::SweepLater() {
  if (sweep_period_ == absl::InfiniteDuration()) return;
  timer_.RunAt(absl::Now() + sweep_period_, [this] {
    heavy_.Post([this] {
      const absl::Status swept = CatchExceptions([this] {
        registry_.UnloadIdle(absl::Now(), unload_policy_);
        return absl::OkStatus();
      });
      if (!swept.ok()) spdlog::error("unloading_failed error=\"{}\"", swept.ToString());
      SweepLater();
    });
  });
}

void Server::Impl::Drain(absl::Duration timeout) {
  MutexLock lock(&drain_mu_);
  if (drained_ || grpc_ == nullptr) return;
  drained_ = true;
  spdlog::info("draining timeout_ms={}", absl::ToInt64Milliseconds(timeout));
  grpc_->GetHealthCheckService()->SetServingStatus(false);
  registry_.Drain();
  streams_.Drain();
  grpc_->Shutdown(absl::ToChronoTime(absl::Now() + timeout));
  grpc_->Wait();
  spdlog::info("drained");
}

absl::StatusOr<std::unique_ptr<Server>> Server::Start(const ServerOptions& options) {
  if (options.listen.empty() && options.unix_socket.empty()) {
    return BadAddress("", "is missing: there is nothing to listen on");
  }
  for (const std::string& address : options.listen) {
    DYNMESH_RETURN_IF_ERROR(SplitAddress(address).status());
    if (!options.allow_insecure) DYNMESH_RETURN_IF_ERROR(CheckLoopback(address));
  }
  if (options.idle_timeout < absl::ZeroDuration()) {
    return InvalidArgument(reason::kBadArgument, "idle_timeout is negative", {{"field", "idle_timeout"}});
  }
  gpr_set_log_function(LogForGrpc);
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  DYNMESH_ASSIGN_OR_RETURN(std::unique_ptr<Store> store, OpenStore(options));
  auto impl = std::make_unique<Impl>(options, std::move(store));
  DYNMESH_RETURN_IF_ERROR(impl->registry().AddStored());
  DYNMESH_RETURN_IF_ERROR(impl->Listen(options));
  impl->SweepLater();
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::~Server() = default;

const std::vector<std::string>& Server::addresses() const { return impl_->addresses(); }

void Server::Drain(absl::Duration timeout) { impl_->Drain(timeout); }

SessionRegistry& Server::registry() { return impl_->registry(); }

}  // namespace dynmesh
