#include "server/session/delta_source.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/time/time.h"
#include "core/mesh/error.h"
#include "server/session/catch_exceptions.h"
#include "server/session/session.h"

namespace dynmesh {
namespace {

// No message may exceed 4 MiB, however wide the rows of the session's attributes are.
constexpr size_t kPartBytes = size_t{3} << 20;
constexpr double kLargestCoordinate = std::numeric_limits<double>::max() / 8;
// Callbacks that are called one after the other, before another thread takes the next ones.
constexpr size_t kDeliveryBatch = 64;

size_t PartItems(const Mesh& mesh) {
  size_t widest_row = 0;
  for (const AttributeColumn& column : mesh.attributes()) {
    widest_row = std::max<size_t>(widest_row, column.spec().row_bytes() + sizeof(Slot));
  }
  return widest_row == 0 ? DeltaSource::kPartItems
                         : std::min(DeltaSource::kPartItems, kPartBytes / widest_row);
}

/// `box` widened by an eighth of its longest side, and cut to where sizes of boxes are finite.
Box Widen(Box box) {
  double longest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = std::max(box.low[axis], -kLargestCoordinate);
    box.high[axis] = std::min(box.high[axis], kLargestCoordinate);
    longest = std::max(longest, box.high[axis] - box.low[axis]);
  }
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] -= longest / 8;
    box.high[axis] += longest / 8;
  }
  return box;
}

}  // namespace

void DeltaSource::Get(const DeltaKey& key, Callback done) {
  PayloadPtr kept;
  {
    MutexLock lock(&mu_);
    kept = FindKept(key);
    if (kept == nullptr) {
      for (Pending& pending : pending_) {
        if (pending.key == key) {
          pending.waiting.push_back(std::move(done));
          return;
        }
      }
      Pending& pending = pending_.emplace_back(Pending{key, {}});
      pending.waiting.push_back(std::move(done));
    }
  }
  if (kept != nullptr) return done(kept);
  session_.access().Post(AccessMode::kRead, *session_.workers().quick,
                         [session = session_.shared_from_this(), key](AccessGrant grant) {
                           session->deltas().MakePending(key, std::move(grant));
                         });
}

void DeltaSource::MakePending(const DeltaKey& key, AccessGrant grant) {
  const absl::StatusOr<PayloadPtr> made = CatchExceptions([&] { return Make(key, grant); });
  grant.Release();
  if (!made.ok()) return Deliver(Publish(key, made), made);
  // What is told must not be taken back.
  session_.AwaitDurable((*made)->revision, [session = session_.shared_from_this(), key,
                                            payload = *made](const absl::Status& durable) {
    DeltaSource& self = session->deltas();
    const absl::StatusOr<PayloadPtr> told =
        durable.ok() ? absl::StatusOr<PayloadPtr>(payload) : absl::StatusOr<PayloadPtr>(durable);
    self.Deliver(self.Publish(key, told), told);
  });
}

PayloadPtr DeltaSource::FindKept(const DeltaKey& key) const {
  for (const Kept& kept : kept_) {
    if (kept.key == key) return kept.payload;
  }
  return nullptr;
}

std::vector<DeltaSource::Callback> DeltaSource::Publish(const DeltaKey& key,
                                                        const absl::StatusOr<PayloadPtr>& payload) {
  MutexLock lock(&mu_);
  const auto pending =
      std::find_if(pending_.begin(), pending_.end(), [&](const Pending& entry) { return entry.key == key; });
  std::vector<Callback> waiting = std::move(pending->waiting);
  pending_.erase(pending);
  if (payload.ok()) Keep(key, *payload);
  return waiting;
}

void DeltaSource::Keep(const DeltaKey& key, PayloadPtr payload) {
  // Whoever asks now asks for the present revision: payloads made for earlier ones are of no use any more.
  std::erase_if(kept_, [&](const Kept& kept) { return kept.key.at_least < key.at_least; });
  kept_.push_back({key, std::move(payload)});
  size_t bytes = 0;
  for (const Kept& kept : kept_) bytes += kept.payload->delta.size();
  while (kept_.size() > kKeptPayloads || bytes > kKeptBytes) {
    bytes -= kept_.front().payload->delta.size();
    kept_.pop_front();
  }
}

void DeltaSource::Forget() {
  MutexLock lock(&mu_);
  kept_.clear();
}

void DeltaSource::Deliver(std::vector<Callback> waiting, const absl::StatusOr<PayloadPtr>& payload) {
  for (size_t begin = kDeliveryBatch; begin < waiting.size(); begin += kDeliveryBatch) {
    const size_t end = std::min(waiting.size(), begin + kDeliveryBatch);
    std::vector<Callback> batch(std::make_move_iterator(waiting.begin() + begin),
                                std::make_move_iterator(waiting.begin() + end));
    session_.workers().quick->Post([batch = std::move(batch), payload]() mutable {
      for (Callback& callback : batch) callback(payload);
    });
  }
  for (size_t i = 0; i < std::min(waiting.size(), kDeliveryBatch); ++i) waiting[i](payload);
}

absl::StatusOr<PayloadPtr> DeltaSource::Make(const DeltaKey& key, AccessGrant& grant) {
  Delta delta;
  EncodeOptions options;
  options.codec = key.codec;
  auto payload = std::make_shared<Payload>();
  payload->session_uid = session_.uid();
  payload->next = key.cursor;
  DYNMESH_RETURN_IF_ERROR(session_.Read([&](const SessionView& view) {
    const Mesh& mesh = view.mesh;
    delta = DiffPart(mesh, key.from_revision, PartItems(mesh), payload->next);
    // With no edit since its first part, the answer is exact when it is complete.
    const bool unchanged = key.walk_start < 0 || key.walk_start == mesh.revision();
    delta.consistent = payload->next.done() && unchanged;
    delta.from_revision = key.base_revision;
    payload->commit_time_us = absl::ToUnixMicros(view.commit_time);
    if (key.position_bits > 0 && !delta.positions.empty()) options.grid = GridFor(key.position_bits, view);
    return absl::OkStatus();
  }));
  grant.Release();
  payload->from_revision = delta.from_revision;
  payload->revision = delta.to_revision;
  payload->consistent = delta.consistent;
  DYNMESH_ASSIGN_OR_RETURN(payload->delta, EncodeDelta(delta, options, &payload->stats));
  num_encodings_.fetch_add(1);
  return PayloadPtr(std::move(payload));
}

std::map<int, QuantizationGrid> DeltaSource::grids() const {
  MutexLock lock(&grids_mu_);
  return grids_;
}

void DeltaSource::KeepGrids(std::map<int, QuantizationGrid> grids) {
  MutexLock lock(&grids_mu_);
  grids_ = std::move(grids);
}

QuantizationGrid DeltaSource::GridFor(int bits, const SessionView& view) {
  MutexLock lock(&grids_mu_);
  const auto found = grids_.find(bits);
  if (found != grids_.end()) return found->second;
  const Box box = Widen(*BoundsOf(view.mesh));
  return grids_[bits] = MakeGrid(box.low, box.high, bits);
}

}  // namespace dynmesh
