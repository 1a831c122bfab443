#ifndef DYNMESH_SERVER_SESSION_DELTA_SOURCE_H_
#define DYNMESH_SERVER_SESSION_DELTA_SOURCE_H_

#include <atomic>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "absl/types/optional.h"
#include "core/codec/codec.h"
#include "core/delta/diff.h"
#include "server/session/access_queue.h"
#include "server/session/mutex.h"

namespace dynmesh {

class Session;
struct SessionView;

/// An encoded delta and what a follower needs to know of it. Shared by all followers that ask for the same.
struct Payload {
  std::string session_uid;
  int64_t from_revision = 0;
  int64_t revision = 0;    ///< of the session when it was made
  bool consistent = true;  ///< false: one part of a longer answer
  DiffCursor next;         ///< where the following part begins
  int64_t commit_time_us = 0;
  std::string delta;  ///< core/codec/FORMAT.md
  EncodeStats stats;
};
using PayloadPtr = std::shared_ptr<const Payload>;

/// Which delta a follower asks for.
struct DeltaKey {
  int64_t from_revision = 0;
  int64_t base_revision = 0;  ///< what the client has for certain: a closing delta starts later than that
  int64_t at_least = 0;       ///< the payload's `revision` is this or later
  int64_t walk_start = -1;    ///< -1: a new answer; else the revision of its first part
  DiffCursor cursor;          ///< where in the walk
  Codec codec = Codec::kUnspecified;
  int position_bits = 0;

  auto AsTuple() const {
    return std::make_tuple(from_revision, base_revision, at_least, walk_start, cursor.stage, cursor.column,
                           cursor.next, static_cast<int>(codec), position_bits);
  }
  friend bool operator==(const DeltaKey& a, const DeltaKey& b) { return a.AsTuple() == b.AsTuple(); }
};

/// Makes the payloads that followers send, each once.
///
/// The first to ask for a key computes the difference under the session's reader lock and encodes it
/// without; whoever asks meanwhile gets the same payload when it is ready, and whoever asks soon after finds
/// it among the last few of that revision (kKeptPayloads, at most kKeptBytes). So a thousand followers at the
/// same revision cost one encoding. A delta of more than kPartItems slots comes in parts, between which the
/// lock is free. A payload is handed out when the revision that it tells of is durable.
///
/// Quantised positions lie on a grid for each number of bits, fixed when the first such delta with a vertex
/// is made: the vertices' bounding cube then, widened by an eighth on each side.
/// Thread safety: full.
class DeltaSource {
 public:
  using Callback = absl::AnyInvocable<void(const absl::StatusOr<PayloadPtr>&)>;

  static constexpr size_t kPartItems = 50'000;
  static constexpr size_t kKeptPayloads = 16;
  static constexpr size_t kKeptBytes = size_t{16} << 20;

  explicit DeltaSource(Session& session) : session_(session) {}

  /// Calls `done` with the payload: before returning if it is kept, else from a thread of the executor, when
  /// it is the session's turn to be read. To be called without locks. Never waits.
  /// Errors: those of Session::Read and EncodeDelta.
  void Get(const DeltaKey& key, Callback done);

  /// Drops the payloads that are kept, e.g. because nobody follows any more.
  void Forget();

  /// Grids that are fixed, by number of bits: for the session that takes the place of an unloaded one.
  std::map<int, QuantizationGrid> grids() const;
  void KeepGrids(std::map<int, QuantizationGrid> grids);

  /// How many deltas have been encoded: for tests and statistics.
  uint64_t num_encodings() const { return num_encodings_.load(); }

 private:
  struct Pending {
    DeltaKey key;
    std::vector<Callback> waiting;
  };
  struct Kept {
    DeltaKey key;
    PayloadPtr payload;
  };

  PayloadPtr FindKept(const DeltaKey& key) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  std::vector<Callback> Publish(const DeltaKey& key, const absl::StatusOr<PayloadPtr>& payload);
  void Keep(const DeltaKey& key, PayloadPtr payload) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);
  void Deliver(std::vector<Callback> waiting, const absl::StatusOr<PayloadPtr>& payload);
  /// Makes the payload that is pending, and delivers it.
  void MakePending(const DeltaKey& key, AccessGrant grant);
  /// Gives the grant back before it encodes.
  absl::StatusOr<PayloadPtr> Make(const DeltaKey& key, AccessGrant& grant);
  QuantizationGrid GridFor(int bits, const SessionView& view);

  Session& session_;
  Mutex mu_;
  std::vector<Pending> pending_ ABSL_GUARDED_BY(mu_);
  std::deque<Kept> kept_ ABSL_GUARDED_BY(mu_);
  mutable Mutex grids_mu_;
  std::map<int, QuantizationGrid> grids_ ABSL_GUARDED_BY(grids_mu_);
  std::atomic<uint64_t> num_encodings_{0};
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DELTA_SOURCE_H_
