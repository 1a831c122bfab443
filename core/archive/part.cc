#include "core/archive/part.h"

#include <xxhash.h>

#include <utility>

#include "absl/strings/str_cat.h"

namespace dynmesh {
namespace {

constexpr absl::string_view kArchiveMagic("DYNA", 4);
constexpr size_t kBeginBytes = 6;
constexpr size_t kSealBytes = sizeof(uint64_t);

uint64_t SealOf(absl::string_view bytes) { return XXH64(bytes.data(), bytes.size(), 0); }

}  // namespace

void BeginPart(ArchivePart part, ByteWriter& out) {
  out.Bytes(kArchiveMagic);
  out.Fixed<ArchivePart>(part);
  out.Fixed<uint8_t>(kArchiveFormat);
}

std::string SealPart(ByteWriter out) {
  out.Fixed<uint64_t>(SealOf(out.bytes()));
  return std::move(out).Take();
}

absl::StatusOr<absl::string_view> OpenPart(ArchivePart part, absl::string_view bytes) {
  ByteReader begin(bytes);
  if (begin.Bytes(kArchiveMagic.size()) != kArchiveMagic || begin.Fixed<ArchivePart>() != part) {
    return ArchiveDamaged("the bytes are not that part of an archive");
  }
  const int format = begin.Fixed<uint8_t>();
  if (format > kArchiveFormat) {
    return FailedPrecondition(
        reason::kArchiveFormatNewer,
        absl::StrCat("the archive is of format ", format, ", and this build reads up to ", kArchiveFormat),
        {{"format", absl::StrCat(format)}});
  }
  if (format < 1 || begin.remaining() < kSealBytes)
    return ArchiveDamaged("a part of an archive is truncated");
  const absl::string_view sealed = bytes.substr(0, bytes.size() - kSealBytes);
  if (ByteReader(bytes.substr(sealed.size())).Fixed<uint64_t>() != SealOf(sealed)) {
    return ArchiveDamaged("the seal of a part of an archive does not match its bytes");
  }
  return sealed.substr(kBeginBytes);
}

absl::Status ArchiveDamaged(absl::string_view what, ErrorMetadata metadata) {
  return MakeError(absl::StatusCode::kDataLoss, reason::kArchiveDamaged, what, std::move(metadata));
}

absl::Status EntityDamaged(EntityId id, absl::string_view what) {
  return ArchiveDamaged(absl::StrCat(EntityKindName(id.kind), " ", id.slot, " ", what),
                        {{"kind", std::string(EntityKindName(id.kind))}, {"ids", absl::StrCat(id.slot)}});
}

}  // namespace dynmesh
