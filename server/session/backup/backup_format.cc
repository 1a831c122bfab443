#include "server/session/backup/backup_format.h"

#include <algorithm>
#include <new>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/session/durability/manifest.h"
#include "server/session/session.h"
#include "xxhash.h"

namespace dynmesh {
namespace {

constexpr size_t kUidBytes = 16;
constexpr int64_t kMaxTimeUs = 253'402'300'799'999'999;  // the end of the year 9999

/// Clients are told both: what is no text or no time of protobuf must not come so far.
bool IsUid(absl::string_view uid) {
  return uid.size() == kUidBytes && std::all_of(uid.begin(), uid.end(), absl::ascii_isxdigit);
}

bool ReadTime(ByteReader& in, absl::Time& time) {
  const int64_t us = in.Fixed<int64_t>();
  time = absl::FromUnixMicros(us);
  return us >= 0 && us <= kMaxTimeUs;
}

void FreeHashState(XXH3_state_t* state) { XXH3_freeState(state); }

}  // namespace

std::string EncodeBackupIdentity(const BackupIdentity& identity) {
  ByteWriter out;
  out.Text(identity.name);
  out.Text(identity.uid);
  out.Fixed(absl::ToUnixMicros(identity.create_time));
  out.Fixed(absl::ToUnixMicros(identity.commit_time));
  WriteSettings(identity.settings, out);
  return std::move(out).Take();
}

bool DecodeBackupIdentity(absl::string_view bytes, BackupIdentity& identity) {
  ByteReader in(bytes);
  identity.name = in.Text();
  identity.uid = in.Text();
  const bool has_times = ReadTime(in, identity.create_time) && ReadTime(in, identity.commit_time);
  return has_times && ReadSettings(in, identity.settings) && in.done() &&
         CheckSessionName(identity.name).ok() && IsUid(identity.uid);
}

RunningHash::RunningHash() : state_(XXH3_createState(), &FreeHashState) {
  if (state_ == nullptr) throw std::bad_alloc();
  XXH3_64bits_reset(state_.get());
}

void RunningHash::Add(absl::string_view bytes) {
  XXH3_64bits_update(state_.get(), bytes.data(), bytes.size());
}

uint64_t RunningHash::value() const { return XXH3_64bits_digest(state_.get()); }

absl::Status BackupDamaged(const BackupPlace& place, absl::string_view what) {
  return MakeError(
      absl::StatusCode::kDataLoss, reason::kBackupDamaged,
      absl::StrCat("the backup is damaged: part ", place.part, ", from byte ", place.byte, " on, ", what),
      {{"part", absl::StrCat(place.part)}, {"byte", absl::StrCat(place.byte)}});
}

absl::Status BackupFormatNewer(uint64_t found) {
  return FailedPrecondition(reason::kBackupFormatNewer,
                            absl::StrCat("the backup is of format ", found, ", and this build reads up to ",
                                         kBackupFormat, ": use the build that wrote it, or a later one"),
                            {{"found", absl::StrCat(found)}, {"supported", absl::StrCat(kBackupFormat)}});
}

}  // namespace dynmesh
