#ifndef DYNMESH_SERVER_SERVER_H_
#define DYNMESH_SERVER_SERVER_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/session/durability/retention.h"
#include "server/session/limits.h"
#include "server/session/registry.h"

namespace dynmesh {

struct ServerOptions {
  /// "host:port"; port 0 lets the system choose.
  std::vector<std::string> listen = {"127.0.0.1:7447"};
  /// Path of a unix socket to listen on too; empty: none. The file is readable by the user only.
  std::string unix_socket;
  /// Needed for any address that others than this machine can reach: nothing is encrypted or authenticated.
  bool allow_insecure = false;
  /// Where sessions are kept; empty: they end with the process. Made if it is not there.
  std::string data_dir;
  /// What a loss of power may take of sessions with DURABILITY_ASYNC; at most 10 s.
  absl::Duration async_delay = absl::Milliseconds(50);
  /// Records of a session of so many bytes make a checkpoint due, which keeps its loading short.
  uint64_t checkpoint_bytes = uint64_t{64} << 20;
  /// Sessions in data_dir that nobody has used for so long are unloaded; zero: never.
  absl::Duration idle_timeout = absl::Minutes(30);
  /// When those that are loaded hold more, the least recently used ones are unloaded; 0: however much.
  uint64_t max_loaded_bytes = 0;
  /// Earlier revisions of sessions in data_dir that are kept; a session can say otherwise.
  Retention retention = {kDefaultRetainedRevisions, absl::ZeroDuration(), kDefaultRetainedBytes};
  Limits limits;
  int quick_threads = 0;  ///< 0: four for each processor, at least 8
  int heavy_threads = 0;  ///< 0: four more than max_concurrent_imports
};

/// INVALID_ARGUMENT unless `address` is "host:port" of the loopback interface.
absl::Status CheckLoopback(absl::string_view address);

/// A running daemon: the sessions, their threads, and gRPC in front of them with health and reflection.
///
///     auto server = Server::Start(options);
///     ... (*server)->addresses() ...
///     (*server)->Drain(absl::Seconds(10));
///
/// Thread safety: Drain() may be called from any thread but one of the server's own; the rest is const.
class Server {
 public:
  /// Errors: INVALID_ARGUMENT for an address that is malformed or not loopback without allow_insecure;
  /// UNAVAILABLE when an address is taken; those of OpenRocksDb and LocalStore::Open.
  static absl::StatusOr<std::unique_ptr<Server>> Start(const ServerOptions& options);
  ~Server();

  /// What the server really listens on, as gRPC targets: "127.0.0.1:41873", "unix:/run/dynmesh.sock".
  const std::vector<std::string>& addresses() const;

  /// Stops: health says NOT_SERVING, subscriptions and edit streams end with UNAVAILABLE SHUTTING_DOWN, new
  /// calls are refused, calls under way get up to `timeout`, and what is left then is cancelled. Returns when
  /// all is over; a second call returns when the first does.
  void Drain(absl::Duration timeout);

  SessionRegistry& registry();

 private:
  class Impl;
  explicit Server(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SERVER_H_
