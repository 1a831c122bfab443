#include "server/session/backup/backup_reader.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/archive/head.h"
#include "core/codec/zstd_frame.h"
#include "core/mesh/error.h"
#include "server/session/durability/recover.h"

namespace dynmesh {
namespace {

constexpr size_t kSealBytes = sizeof(uint64_t);
constexpr size_t kMaxPartBeginBytes = 2 + kMaxVarintBytes;

absl::Status CheckSlotLimits(const ArchiveHead& head, const Limits& limits) {
  for (EntityKind kind : kEntityKinds) {
    const uint32_t max_slots = limits.max_slots(kind), slots = head.slot_limits[Dimension(kind)];
    if (slots > max_slots) return LimitExceeded(kSlotLimitNames[Dimension(kind)], max_slots, slots);
  }
  return absl::OkStatus();
}

}  // namespace

// A piece that begins where a part does is read where it lies; only what is left of it is copied.
absl::Status BackupReader::Add(absl::string_view bytes) {
  if (waiting_.empty()) {
    DYNMESH_RETURN_IF_ERROR(Read(bytes));
    waiting_.assign(bytes.data(), bytes.size());
    return absl::OkStatus();
  }
  waiting_.append(bytes.data(), bytes.size());
  absl::string_view left = waiting_;
  DYNMESH_RETURN_IF_ERROR(Read(left));
  waiting_.erase(0, waiting_.size() - left.size());
  return absl::OkStatus();
}

/// Takes what is whole from the begin of `bytes`.
absl::Status BackupReader::Read(absl::string_view& bytes) {
  if (!begun_) {
    DYNMESH_RETURN_IF_ERROR(ReadBegin(bytes));
    if (!begun_) return absl::OkStatus();
    bytes.remove_prefix(kBackupBeginBytes);
  }
  while (!bytes.empty()) {
    if (done_) return Damaged("stands after the end");
    DYNMESH_ASSIGN_OR_RETURN(const absl::optional<Part> part, FindPart(bytes));
    if (!part.has_value()) return absl::OkStatus();
    DYNMESH_RETURN_IF_ERROR(CheckSeal(bytes.substr(0, part->size)));
    DYNMESH_RETURN_IF_ERROR(ReadPart(*part));
    bytes.remove_prefix(part->size);
    place_ = {place_.part + 1, place_.byte + part->size};
  }
  return absl::OkStatus();
}

absl::Status BackupReader::ReadBegin(absl::string_view bytes) {
  const absl::string_view magic = bytes.substr(0, kBackupMagic.size());
  if (magic != kBackupMagic.substr(0, magic.size())) return Damaged("is not the begin of a backup");
  if (bytes.size() < kBackupBeginBytes) return absl::OkStatus();
  const uint8_t format = static_cast<uint8_t>(bytes[kBackupMagic.size()]);
  if (format > kBackupFormat) return BackupFormatNewer(format);
  if (format == 0) return Damaged("is of no format");
  hash_.Add(bytes.substr(0, kBackupBeginBytes));
  place_.byte = kBackupBeginBytes;
  begun_ = true;
  return absl::OkStatus();
}

absl::StatusOr<absl::optional<BackupReader::Part>> BackupReader::FindPart(absl::string_view bytes) {
  ByteReader in(bytes);
  Part part;
  part.letter = in.Fixed<BackupPart>();
  part.packing = in.Fixed<BackupPacking>();
  if (!IsExpected(part.letter)) return Damaged("is not of the kind that comes next");
  if (part.packing > BackupPacking::kZstd) return Damaged("is packed in a way that there is not");
  const uint64_t size = in.Varint();
  if (in.ok() ? size > kMaxBackupPartBytes : bytes.size() >= kMaxPartBeginBytes) {
    return Damaged("says that it is larger than any");
  }
  part.bytes = in.Bytes(size);
  in.Bytes(kSealBytes);
  if (!in.ok()) return absl::optional<Part>();
  part.size = bytes.size() - in.remaining();
  return absl::make_optional(part);
}

bool BackupReader::IsExpected(BackupPart letter) const {
  if (!identity_.has_value()) return letter == BackupPart::kIdentity;
  if (!rebuilder_.has_value()) return letter == BackupPart::kHead;
  return letter == (pages_done_ < num_pages_ ? BackupPart::kPages : BackupPart::kEnd);
}

absl::Status BackupReader::CheckSeal(absl::string_view part) {
  const absl::string_view sealed = part.substr(0, part.size() - kSealBytes);
  hash_.Add(sealed);
  const absl::string_view seal = part.substr(sealed.size());
  if (ByteReader(seal).Fixed<uint64_t>() != hash_.value()) {
    return Damaged("has a seal that does not match the bytes before it");
  }
  hash_.Add(seal);
  return absl::OkStatus();
}

absl::Status BackupReader::ReadPart(const Part& part) {
  return part.packing == BackupPacking::kPlain ? ReadContent(part.letter, part.bytes) : ReadPacked(part);
}

absl::Status BackupReader::ReadPacked(const Part& part) {
  const uint64_t size = FrameContentBytes(part.bytes);
  if (size > kMaxBackupPartBytes) return Damaged("cannot be unpacked");
  DYNMESH_RETURN_IF_ERROR(lease_.Grow(size));
  const absl::StatusOr<std::string> content = DecompressFrame(part.bytes, 0, kMaxBackupPartBytes);
  if (!content.ok()) return Damaged("cannot be unpacked");
  DYNMESH_RETURN_IF_ERROR(ReadContent(part.letter, *content));
  lease_.Shrink(size);
  return absl::OkStatus();
}

absl::Status BackupReader::ReadContent(BackupPart letter, absl::string_view content) {
  switch (letter) {
    case BackupPart::kIdentity:
      return DecodeBackupIdentity(content, identity_.emplace()) ? absl::OkStatus()
                                                                : Damaged("is no identity of a session");
    case BackupPart::kHead:
      return ReadHead(content);
    case BackupPart::kPages:
      return ReadPages(content);
    case BackupPart::kEnd:
      return ReadEnd(content);
  }
  return Damaged("is of no kind");
}

absl::Status BackupReader::ReadHead(absl::string_view content) {
  const absl::StatusOr<ArchiveHead> head = DecodeHead(content);
  if (!head.ok()) return FromArchive(head.status());
  DYNMESH_RETURN_IF_ERROR(CheckSlotLimits(*head, limits_));
  for (EntityKind kind : kEntityKinds) num_pages_ += head->num_pages(kind);
  const RebuildOptions options = {.max_memory_bytes = MaxRebuildBytes(limits_),
                                  .charge = [this](uint64_t bytes) { return lease_.Grow(bytes); }};
  absl::StatusOr<Rebuilder> rebuilder = Rebuilder::Start(content, options);
  if (!rebuilder.ok()) return FromArchive(rebuilder.status());
  rebuilder_.emplace(*std::move(rebuilder));
  return absl::OkStatus();
}

absl::Status BackupReader::ReadPages(absl::string_view content) {
  if (content.empty()) return Damaged("has no pages");
  for (ByteReader in(content); !in.done(); ++pages_done_) {
    const absl::string_view page = in.Bytes(in.Varint());
    if (!in.ok() || pages_done_ == num_pages_) return Damaged("has not the pages that it should");
    const absl::Status added = rebuilder_->AddPage(page);
    if (!added.ok()) return FromArchive(added);
  }
  return absl::OkStatus();
}

absl::Status BackupReader::ReadEnd(absl::string_view content) {
  ByteReader in(content);
  const bool sound = in.Varint() == place_.part && in.Varint() == pages_done_ && in.Varint() == place_.byte;
  if (!sound || !in.done()) return Damaged("does not tell the counts of what came");
  done_ = true;
  return absl::OkStatus();
}

absl::Status BackupReader::FromArchive(const absl::Status& status) const {
  return absl::IsDataLoss(status) ? Damaged(absl::StrCat("says: ", status.message())) : status;
}

absl::StatusOr<Backup> BackupReader::Finish() && {
  if (!done_) return Damaged("is cut off");
  absl::StatusOr<Mesh> mesh = std::move(*rebuilder_).Finish();
  if (!mesh.ok()) return FromArchive(mesh.status());
  return Backup{*std::move(identity_), *std::move(mesh), hash_.value()};
}

}  // namespace dynmesh
