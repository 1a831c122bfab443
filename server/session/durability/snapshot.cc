#include "server/session/durability/snapshot.h"

#include <utility>

#include "core/codec/bytes.h"
#include "core/mesh/error.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

constexpr uint64_t kSnapshotsFormat = 1;

Snapshot ReadSnapshot(ByteReader& in) {
  Snapshot snapshot;
  snapshot.name = in.Text();
  snapshot.revision = in.Fixed<int64_t>();
  snapshot.checkpoint = in.Fixed<uint64_t>();
  snapshot.checkpoint_revision = in.Fixed<int64_t>();
  snapshot.create_time = absl::FromUnixMicros(in.Fixed<int64_t>());
  snapshot.note.author = in.Text();
  snapshot.note.message = in.Text();
  return snapshot;
}

}  // namespace

std::string EncodeSnapshots(const std::vector<Snapshot>& snapshots) {
  ByteWriter out;
  out.Varint(kSnapshotsFormat);
  out.Varint(snapshots.size());
  for (const Snapshot& snapshot : snapshots) {
    out.Text(snapshot.name);
    out.Fixed(snapshot.revision);
    out.Fixed(snapshot.checkpoint);
    out.Fixed(snapshot.checkpoint_revision);
    out.Fixed(absl::ToUnixMicros(snapshot.create_time));
    out.Text(snapshot.note.author);
    out.Text(snapshot.note.message);
  }
  return std::move(out).Take();
}

absl::StatusOr<std::vector<Snapshot>> DecodeSnapshots(absl::string_view bytes) {
  ByteReader in(bytes);
  const uint64_t format = in.Varint();
  if (in.ok() && format > kSnapshotsFormat) return StoreFormatNewer(format, kSnapshotsFormat);
  std::vector<Snapshot> snapshots;
  for (uint64_t count = in.Varint(); count > 0 && in.ok(); --count) snapshots.push_back(ReadSnapshot(in));
  if (!in.done() || format == 0) return StoreDamaged("the list of snapshots is none");
  return snapshots;
}

}  // namespace dynmesh
