#include "server/store/layout.h"

#include <xxhash.h>

#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/codec/bytes.h"
#include "server/store/store_errors.h"

namespace dynmesh::layout {
namespace {

// The first byte of every key, and for keys of sessions the one after the id.
constexpr char kFormatTag = 'f';
constexpr char kNameTag = 'n';
constexpr char kSessionTag = 's';
constexpr char kManifestTag = 'c';
constexpr char kPageTag = 'd';  // right after the manifest
constexpr char kRecordTag = 'r';
constexpr char kTrimmedTag = 't';
constexpr char kValueTag = 'v';
constexpr size_t kSealBytes = sizeof(uint64_t);
constexpr size_t kVersionBytes = 2 * sizeof(uint64_t);
constexpr size_t kTagAt = 1 + sizeof(uint64_t);
constexpr size_t kSuffixAt = kTagAt + 1;

std::string Tag(char tag) { return std::string(1, tag); }
std::string AfterTag(char tag) { return Tag(static_cast<char>(tag + 1)); }

// Big-endian, so that keys sort as numbers do.
void AppendOrdered(uint64_t number, std::string& key) {
  for (int shift = 56; shift >= 0; shift -= 8) key.push_back(static_cast<char>(number >> shift));
}

uint64_t ReadOrdered(absl::string_view bytes) {
  uint64_t number = 0;
  for (size_t i = 0; i < sizeof(number); ++i) number = number << 8 | static_cast<uint8_t>(bytes[i]);
  return number;
}

std::string SessionKey(SessionId id, char tag) {
  std::string key = Tag(kSessionTag);
  AppendOrdered(id, key);
  key.push_back(tag);
  return key;
}

// No record has the revision after INT64_MAX, but its key sorts after all others, since they are not
// negative.
std::string KeyAfterRecord(SessionId id, int64_t revision) {
  std::string key = SessionKey(id, kRecordTag);
  AppendOrdered(static_cast<uint64_t>(revision) + 1, key);
  return key;
}

absl::Status BadKey(absl::string_view key) {
  return StoreDamaged(absl::StrCat("the key ", absl::BytesToHexString(key), " is none that it writes"));
}

absl::Status BadManifest() { return StoreDamaged("a checkpoint's manifest is not valid"); }

uint64_t SealOf(absl::string_view key, absl::string_view payload) {
  return XXH3_64bits_withSeed(payload.data(), payload.size(), XXH3_64bits(key.data(), key.size()));
}

}  // namespace

std::string FormatKey() { return Tag(kFormatTag); }
std::string NameKey(absl::string_view name) { return absl::StrCat(Tag(kNameTag), name); }
KeyRange Names() { return {Tag(kNameTag), AfterTag(kNameTag)}; }
absl::string_view NameOfKey(absl::string_view key) { return key.substr(1); }

KeyRange DataOf(SessionId id) {
  KeyRange range{Tag(kSessionTag), Tag(kSessionTag)};
  AppendOrdered(id, range.from);
  AppendOrdered(id + 1, range.to);
  return range;
}

KeyRange DataOfAll() { return {Tag(kSessionTag), AfterTag(kSessionTag)}; }

std::string ManifestKey(SessionId id, uint64_t checkpoint) {
  std::string key = SessionKey(id, kManifestTag);
  AppendOrdered(checkpoint, key);
  return key;
}

std::string PageKeyOf(SessionId id, PageKey page, uint64_t checkpoint) {
  std::string key = SessionKey(id, kPageTag);
  AppendOrdered(page, key);
  AppendOrdered(checkpoint, key);
  return key;
}

std::string RecordKey(SessionId id, int64_t revision) {
  std::string key = SessionKey(id, kRecordTag);
  AppendOrdered(static_cast<uint64_t>(revision), key);
  return key;
}

std::string TrimmedKey(SessionId id) { return SessionKey(id, kTrimmedTag); }

std::string ValueKey(SessionId id, absl::string_view name) {
  return absl::StrCat(SessionKey(id, kValueTag), name);
}

KeyRange ManifestsOf(SessionId id) { return {SessionKey(id, kManifestTag), SessionKey(id, kPageTag)}; }

KeyRange CheckpointsOf(SessionId id) {
  return {SessionKey(id, kManifestTag), SessionKey(id, static_cast<char>(kPageTag + 1))};
}

bool IsManifestKey(absl::string_view key) { return key.size() > kTagAt && key[kTagAt] == kManifestTag; }

KeyRange RecordsOf(SessionId id, int64_t after, int64_t last) {
  return {KeyAfterRecord(id, after), KeyAfterRecord(id, last)};
}

absl::StatusOr<SessionId> SessionOfKey(absl::string_view key) {
  if (key.size() <= kTagAt) return BadKey(key);
  const SessionId id = ReadOrdered(key.substr(1));
  if (id == 0 || id > kMaxNumber) return BadKey(key);
  return id;
}

absl::StatusOr<int64_t> RevisionOfKey(absl::string_view record_key) {
  if (record_key.size() != kSuffixAt + sizeof(int64_t)) return BadKey(record_key);
  const uint64_t revision = ReadOrdered(record_key.substr(kSuffixAt));
  if (revision == 0 || revision > kMaxNumber) return BadKey(record_key);
  return static_cast<int64_t>(revision);
}

absl::StatusOr<uint64_t> CheckpointOfKey(absl::string_view manifest_key) {
  if (manifest_key.size() != kSuffixAt + sizeof(uint64_t)) return BadKey(manifest_key);
  const uint64_t checkpoint = ReadOrdered(manifest_key.substr(kSuffixAt));
  if (checkpoint == 0 || checkpoint > kMaxNumber) return BadKey(manifest_key);
  return checkpoint;
}

absl::StatusOr<PageVersion> VersionOfKey(absl::string_view page_key) {
  if (page_key.size() != kSuffixAt + 2 * sizeof(uint64_t)) return BadKey(page_key);
  const PageVersion version{ReadOrdered(page_key.substr(kSuffixAt)),
                            ReadOrdered(page_key.substr(kSuffixAt + sizeof(uint64_t)))};
  if (version.checkpoint == 0 || version.checkpoint > kMaxNumber) return BadKey(page_key);
  return version;
}

std::string Seal(absl::string_view key, std::string payload) {
  const uint64_t seal = SealOf(key, payload);
  payload.append(reinterpret_cast<const char*>(&seal), kSealBytes);  // little-endian: core/codec/bytes.h
  return payload;
}

absl::StatusOr<absl::string_view> Unseal(absl::string_view key, absl::string_view value) {
  if (value.size() >= kSealBytes) {
    const absl::string_view payload = value.substr(0, value.size() - kSealBytes);
    ByteReader seal(value.substr(payload.size()));
    if (seal.Fixed<uint64_t>() == SealOf(key, payload)) return payload;
  }
  return StoreDamaged(
      absl::StrCat("the value of key ", absl::BytesToHexString(key), " is not what was written"));
}

std::string WriteNumber(uint64_t number) {
  ByteWriter out;
  out.Fixed<uint64_t>(number);
  return std::move(out).Take();
}

absl::StatusOr<uint64_t> ReadNumber(absl::string_view payload) {
  ByteReader in(payload);
  const uint64_t number = in.Fixed<uint64_t>();
  if (!in.done() || number > kMaxNumber) return StoreDamaged("a number is none that it writes");
  return number;
}

std::string WriteRecord(const StoredRecord& record) {
  ByteWriter out;
  out.Reserve(sizeof(int64_t) + record.bytes.size() + kSealBytes);
  out.Fixed<int64_t>(record.previous);
  out.Bytes(record.bytes);
  return std::move(out).Take();
}

absl::StatusOr<StoredRecord> ReadRecord(absl::string_view payload) {
  ByteReader in(payload);
  StoredRecord record;
  record.previous = in.Fixed<int64_t>();
  record.bytes = in.Bytes(in.remaining());
  if (!in.ok() || record.previous < 0) return StoreDamaged("a record's head is not valid");
  return record;
}

std::string WriteManifest(const StoredManifest& manifest) {
  ByteWriter out;
  out.Reserve(2 * sizeof(uint64_t) + manifest.pages.size() * kVersionBytes + manifest.bytes.size() +
              kSealBytes);
  out.Fixed<int64_t>(manifest.revision);
  out.Fixed<uint64_t>(manifest.pages.size());
  for (const PageVersion& version : manifest.pages) {
    out.Fixed<uint64_t>(version.page);
    out.Fixed<uint64_t>(version.checkpoint);
  }
  out.Bytes(manifest.bytes);
  return std::move(out).Take();
}

absl::StatusOr<StoredManifest> ReadManifest(absl::string_view payload) {
  ByteReader in(payload);
  StoredManifest manifest;
  manifest.revision = in.Fixed<int64_t>();
  const auto num_pages = in.Fixed<uint64_t>();
  if (!in.ok() || manifest.revision < 0 || num_pages > in.remaining() / kVersionBytes) return BadManifest();
  manifest.pages.reserve(num_pages);
  for (uint64_t i = 0; i < num_pages; ++i) {
    const auto page = in.Fixed<uint64_t>();
    const auto checkpoint = in.Fixed<uint64_t>();
    const bool ascends = i == 0 || page > manifest.pages.back().page;
    if (!ascends || checkpoint == 0 || checkpoint > kMaxNumber) return BadManifest();
    manifest.pages.push_back({page, checkpoint});
  }
  manifest.bytes = in.Bytes(in.remaining());
  return manifest;
}

}  // namespace dynmesh::layout
