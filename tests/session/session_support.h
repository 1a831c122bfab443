#ifndef DYNMESH_TESTS_SESSION_SESSION_SUPPORT_H_
#define DYNMESH_TESTS_SESSION_SESSION_SUPPORT_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/time/clock.h"
#include "core/delta/mirror.h"
#include "core/edit/transaction.h"
#include "server/session/follower.h"
#include "server/session/importer/importer.h"
#include "server/session/mutex.h"
#include "server/session/registry.h"
#include "server/session/session.h"
#include "tests/support/await.h"

/// What the tests of the session layer share.
namespace dynmesh::testing {

/// Threads, and sessions on them. Sessions may be used after Stop(), but nothing follows any more.
class Daemon {
 public:
  /// With a store, what that has is there.
  explicit Daemon(const Limits& limits = {}, std::unique_ptr<Store> store = nullptr,
                  const SessionLogOptions& log_options = {});
  ~Daemon();

  SessionRegistry& registry() { return registry_; }
  const Workers& workers() const { return workers_; }
  /// Creates a session; fails the test when refused.
  SessionPtr NewSession(const std::string& name = "mesh", const SessionSettings& settings = {});

 private:
  Timer timer_;
  Executor quick_;
  Executor heavy_;
  Workers workers_;
  SessionRegistry registry_;
};

/// A mesh of the same vertices and elements, added by ascending dimension: what an import makes of them.
Mesh ByDimension(const Mesh& mesh);

/// Edits that put the vertices and elements of `mesh` into an empty session, by ascending dimension. Ids become those
/// of ByDimension(mesh).
std::vector<Edit> EditsOf(const Mesh& mesh);

/// Fails the test when refused.
std::shared_ptr<const BatchResult> MustApply(Session& session, const std::vector<Edit>& edits,
                                             const ApplyOptions& options = {});

Checksum ChecksumOf(const Session& session);

/// Adds `n` vertices.
Edit AddSomeVertices(int n);
/// A batch of four vertices and the tetrahedron over them.
std::vector<Edit> AddTet();

/// A status for matchers: code and reason.
struct Refusal {
  absl::StatusCode code;
  std::string reason;
  friend bool operator==(const Refusal&, const Refusal&) = default;
  friend void PrintTo(const Refusal& r, std::ostream* out) {
    *out << absl::StatusCodeToString(r.code) << " " << r.reason;
  }
};
Refusal RefusalOf(const absl::Status& status);
template <typename T>
Refusal RefusalOf(const absl::StatusOr<T>& result) {
  return RefusalOf(result.status());
}
/// Value of a metadata key, empty when absent.
std::string MetadataOf(const absl::Status& status, absl::string_view key);

/// Random batches of all kinds of edits for one session, from what its answers said. With other editors
/// about, some batches are refused, which it learns by Forget().
class RandomBatches {
 public:
  explicit RandomBatches(uint32_t seed) : rng_(seed) {}

  std::vector<Edit> Next();
  /// Takes over what the batch that Next() gave has made and removed.
  void Applied(const BatchResult& result);
  /// The batch was refused.
  void Refused() { batch_.clear(); }

 private:
  int Uniform(int below) { return std::uniform_int_distribution<int>(0, below - 1)(rng_); }
  Slot AnyVertex();
  Point AnyPoint();
  Edit AnyEdit();
  Edit AddElements();
  Edit RemoveElement(EntityKind kind);
  Edit AttributeEdit();

  std::mt19937 rng_;
  std::array<std::vector<Slot>, kNumEntityKinds> live_;  ///< vertices; elements of each kind
  std::vector<Edit> batch_;
  int new_vertices_ = 0;
  bool has_attribute_ = false;
};

/// A follower's other end: decodes into a mirror, and acknowledges by itself or when told to.
class RecordingSink : public DeltaSink {
 public:
  enum class Acknowledge { kAtOnce, kByHand };

  /// REQUIRES: the daemon outlives this.
  RecordingSink(const Workers& workers, Acknowledge acknowledge,
                Mirror::Geometry geometry = Mirror::Geometry::kExact)
      : workers_(workers), acknowledge_(acknowledge), mirror_(geometry) {}

  /// Ends the follower.
  ~RecordingSink() override;

  /// Makes the follower and begins.
  absl::Status Follow(const SessionPtr& session, const FollowOptions& options);
  Follower& follower() { return *follower_; }

  void Send(PayloadPtr payload) override;
  void End(const absl::Status& status) override;

  /// By hand: waits for a payload that is not acknowledged and acknowledges it.
  PayloadPtr TakeOne();
  /// Waits until a payload is there to be acknowledged.
  void AwaitUnacknowledged();

  /// Wait until the mirror has a consistent copy of `revision` or later, or fail the test.
  void AwaitRevision(int64_t revision);
  absl::Status AwaitEnd();

  Checksum mirror_checksum();
  int64_t mirror_revision();
  std::vector<PayloadPtr> payloads();
  /// The first error of decoding or applying.
  absl::Status error();
  /// Calls fn(mirror) without other threads.
  template <typename Fn>
  void WithMirror(Fn fn) {
    MutexLock lock(&mu_);
    fn(mirror_);
  }

 private:
  void Absorb(const Payload& payload) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mu_);

  const Workers workers_;
  const Acknowledge acknowledge_;
  std::shared_ptr<Follower> follower_;
  bool begun_ = false;
  Mutex mu_;
  CondVar changed_;
  Mirror mirror_ ABSL_GUARDED_BY(mu_);
  std::vector<PayloadPtr> payloads_ ABSL_GUARDED_BY(mu_);
  PayloadPtr unacknowledged_ ABSL_GUARDED_BY(mu_);
  absl::Status error_ ABSL_GUARDED_BY(mu_);
  bool ended_ ABSL_GUARDED_BY(mu_) = false;
  absl::Status end_ ABSL_GUARDED_BY(mu_);
};

/// An ImportMonitor that can cancel at the n-th report.
class TestMonitor : public ImportMonitor {
 public:
  void OnProgress(uint64_t done, uint64_t total) override;
  bool cancelled() override { return cancelled_; }
  void Cancel() { cancelled_ = true; }
  void CancelAtReport(int report) { cancel_at_ = report; }
  int reports() const { return reports_; }

 private:
  bool cancelled_ = false;
  int cancel_at_ = -1;
  int reports_ = 0;
  uint64_t last_done_ = 0;
};

/// Bytes of an array as they travel.
template <typename T>
std::string BytesOf(const std::vector<T>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

/// Hands the vertices and elements of `mesh` to `staged`, cut into random pieces.
void StageMesh(const Mesh& mesh, StagedMesh& staged, std::mt19937& rng);

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SESSION_SESSION_SUPPORT_H_
