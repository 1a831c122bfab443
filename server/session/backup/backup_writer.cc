#include "server/session/backup/backup_writer.h"

#include <utility>

#include "core/archive/head.h"
#include "core/codec/zstd_frame.h"

namespace dynmesh {
namespace {

/// Less is not worth it.
constexpr size_t kMinPackedBytes = 512;

}  // namespace

BackupWriter::BackupWriter(BackupIdentity identity, Mesh mesh)
    : identity_(std::move(identity)), mesh_(std::move(mesh)) {
  for (EntityKind kind : kEntityKinds) num_pages_ += NumPages(mesh_.slots(kind).limit());
}

std::string BackupWriter::Next() {
  std::string out;
  if (!std::exchange(begun_, true)) {
    Begin(out);
  } else if (pages_done_ < num_pages_) {
    WritePages(out);
  } else {
    End(out);
  }
  return out;
}

void BackupWriter::Begin(std::string& out) {
  Append(kBackupMagic, out);
  Append(absl::string_view(reinterpret_cast<const char*>(&kBackupFormat), 1), out);
  Write(BackupPart::kIdentity, EncodeBackupIdentity(identity_), out);
  Write(BackupPart::kHead, EncodeHead(mesh_), out);
}

void BackupWriter::WritePages(std::string& out) { Write(BackupPart::kPages, TakePages(), out); }

std::string BackupWriter::TakePages() {
  ByteWriter pages;
  while (pages.size() < kBackupPagesBytes && FindPage()) {
    pages.Text(EncodePage(mesh_, next_));
    ++next_.index;
    ++pages_done_;
  }
  return std::move(pages).Take();
}

bool BackupWriter::FindPage() {
  while (next_.index == NumPages(mesh_.slots(next_.kind).limit())) {
    if (next_.kind == EntityKind::kCell) return false;
    next_ = {kEntityKinds[Dimension(next_.kind) + 1], 0};
  }
  return true;
}

void BackupWriter::End(std::string& out) {
  ByteWriter end;
  end.Varint(parts_done_);
  end.Varint(pages_done_);
  end.Varint(bytes_done_);
  Write(BackupPart::kEnd, end.bytes(), out);
  done_ = true;
}

void BackupWriter::Write(BackupPart part, absl::string_view content, std::string& out) {
  const std::string frame = content.size() < kMinPackedBytes ? std::string(content) : CompressFrame(content);
  const bool packed = frame.size() < content.size();
  const absl::string_view bytes = packed ? absl::string_view(frame) : content;
  ByteWriter begin;
  begin.Fixed(part);
  begin.Fixed(packed ? BackupPacking::kZstd : BackupPacking::kPlain);
  begin.Varint(bytes.size());
  Append(begin.bytes(), out);
  Append(bytes, out);
  ByteWriter seal;
  seal.Fixed<uint64_t>(hash_.value());
  Append(seal.bytes(), out);
  ++parts_done_;
}

void BackupWriter::Append(absl::string_view bytes, std::string& out) {
  hash_.Add(bytes);
  bytes_done_ += bytes.size();
  out.append(bytes.data(), bytes.size());
}

}  // namespace dynmesh
