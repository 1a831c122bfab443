#include "server/store/rocksdb_engine.h"

#include <rocksdb/db.h>
#include <rocksdb/options.h>
#include <rocksdb/write_batch.h>

#include <atomic>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/codec/bytes.h"
#include "core/mesh/error.h"
#include "server/store/directory_lock.h"
#include "server/store/store_errors.h"
#include "server/store/synced_mark.h"

namespace dynmesh {
namespace {

// Sorts before all keys of stores, which begin with letters. Its value: the number of writes so far.
constexpr char kWritesKey[] = "#";
constexpr size_t kMemtableBytes = size_t{32} << 20;
// As many may wait to be flushed before writes stop, and pages stop one before that.
constexpr int kMaxMemtables = 3;
constexpr size_t kKeptBatchBytes = size_t{1} << 20;
constexpr size_t kMaxInfoLogBytes = size_t{1} << 20;

rocksdb::Slice SliceOf(absl::string_view text) { return {text.data(), text.size()}; }
absl::string_view ViewOf(const rocksdb::Slice& slice) { return {slice.data(), slice.size()}; }

absl::Status StatusOf(const rocksdb::Status& status) {
  if (status.ok()) return absl::OkStatus();
  if (status.IsCorruption()) return StoreDamaged(status.ToString());
  if (status.IsNoSpace() || status.subcode() == rocksdb::Status::kSpaceLimit)
    return StoreFull(status.ToString());
  return StoreFailed(status.ToString());
}

rocksdb::Options DatabaseOptions(rocksdb::Env* env) {
  rocksdb::Options options;
  if (env != nullptr) options.env = env;
  options.create_if_missing = true;
  options.paranoid_checks = true;
  // A torn end of the log is what a crash leaves; whether more than that is gone, SyncedMark tells.
  options.wal_recovery_mode = rocksdb::WALRecoveryMode::kPointInTimeRecovery;
  // The log has everything: closing must not write, least of all after a write has failed.
  options.avoid_flush_during_shutdown = true;
  options.max_bgerror_resume_count = 0;  // after an error only opening again tells what is there
  options.write_buffer_size = kMemtableBytes;
  options.max_write_buffer_number = kMaxMemtables;
  options.compression = rocksdb::kLZ4Compression;
  options.info_log_level = rocksdb::WARN_LEVEL;
  options.max_log_file_size = kMaxInfoLogBytes;
  options.keep_log_file_num = 2;
  return options;
}

class RocksDbEngine final : public Engine {
 public:
  RocksDbEngine(std::unique_ptr<DirectoryLock> lock, std::unique_ptr<SyncedMark> mark,
                std::unique_ptr<rocksdb::DB> db)
      : lock_(std::move(lock)), mark_(std::move(mark)), db_(std::move(db)) {}

  /// Errors: DATA_LOSS STORE_DAMAGED.
  absl::Status CheckWrites();

  absl::Status Write(const EngineBatch& batch) override;
  absl::Status Sync() override;
  bool IsBehind() const override;
  absl::StatusOr<absl::optional<std::string>> Get(absl::string_view key) const override;
  absl::Status Scan(absl::string_view from, absl::string_view to, Visitor visit) const override;
  absl::StatusOr<absl::optional<std::string>> LastKey(absl::string_view from,
                                                      absl::string_view to) const override;

 private:
  uint64_t Property(const rocksdb::Slice& name) const;

  const std::unique_ptr<DirectoryLock> lock_;  // destroyed last
  const std::unique_ptr<SyncedMark> mark_;
  const std::unique_ptr<rocksdb::DB> db_;
  std::atomic<uint64_t> num_writes_{0};
  rocksdb::WriteBatch batch_;  ///< the writer's
};

absl::StatusOr<uint64_t> ReadWrites(absl::string_view value) {
  ByteReader in(value);
  const uint64_t writes = in.Fixed<uint64_t>();
  if (!in.done()) return StoreDamaged("the number of writes has another size");
  return writes;
}

absl::Status RocksDbEngine::CheckWrites() {
  const absl::StatusOr<absl::optional<std::string>> value = Get(kWritesKey);
  DYNMESH_RETURN_IF_ERROR(value.status());
  if (value->has_value()) {
    DYNMESH_ASSIGN_OR_RETURN(num_writes_, ReadWrites(**value));
  }
  if (num_writes_ >= mark_->number()) return absl::OkStatus();
  return StoreDamaged(absl::StrCat("the log ends with write ", num_writes_.load(), ", but ", mark_->number(),
                                   " were on disk; to go on with what is left, delete dynmesh.synced"));
}

void AddChange(const EngineBatch::Change& change, rocksdb::WriteBatch& batch) {
  switch (change.kind) {
    case EngineBatch::Kind::kPut:
      batch.Put(change.key, change.value);
      return;
    case EngineBatch::Kind::kDelete:
      batch.Delete(change.key);
      return;
    case EngineBatch::Kind::kDeleteRange:
      if (change.key < change.value) batch.DeleteRange(change.key, change.value);
      return;
  }
}

absl::Status RocksDbEngine::Write(const EngineBatch& batch) {
  if (batch_.GetDataSize() > kKeptBatchBytes) batch_ = rocksdb::WriteBatch();
  batch_.Clear();  // keeps its memory
  for (const EngineBatch::Change& change : batch.changes()) AddChange(change, batch_);
  ByteWriter number;
  number.Fixed<uint64_t>(num_writes_ + 1);
  batch_.Put(kWritesKey, number.bytes());
  DYNMESH_RETURN_IF_ERROR(StatusOf(db_->Write(rocksdb::WriteOptions(), &batch_)));
  ++num_writes_;
  return absl::OkStatus();
}

absl::Status RocksDbEngine::Sync() {
  const uint64_t written = num_writes_;  // before: what is written from here on may not be synced
  DYNMESH_RETURN_IF_ERROR(StatusOf(db_->SyncWAL()));
  return mark_->Set(written);
}

uint64_t RocksDbEngine::Property(const rocksdb::Slice& name) const {
  uint64_t value = 0;
  db_->GetIntProperty(name, &value);
  return value;
}

bool RocksDbEngine::IsBehind() const {
  if (Property(rocksdb::DB::Properties::kBackgroundErrors) > 0) return false;  // a write will tell
  return Property(rocksdb::DB::Properties::kNumImmutableMemTable) >= kMaxMemtables - 1 ||
         Property(rocksdb::DB::Properties::kActualDelayedWriteRate) > 0;
}

absl::StatusOr<absl::optional<std::string>> RocksDbEngine::Get(absl::string_view key) const {
  std::string value;
  const rocksdb::Status status = db_->Get(rocksdb::ReadOptions(), SliceOf(key), &value);
  if (status.IsNotFound()) return absl::optional<std::string>();
  DYNMESH_RETURN_IF_ERROR(StatusOf(status));
  return absl::optional<std::string>(std::move(value));
}

absl::Status RocksDbEngine::Scan(absl::string_view from, absl::string_view to, Visitor visit) const {
  const rocksdb::Slice end = SliceOf(to);
  rocksdb::ReadOptions options;
  options.iterate_upper_bound = &end;
  options.fill_cache = false;  // what is scanned is read once
  const std::unique_ptr<rocksdb::Iterator> it(db_->NewIterator(options));
  for (it->Seek(SliceOf(from)); it->Valid(); it->Next()) {
    DYNMESH_RETURN_IF_ERROR(visit(ViewOf(it->key()), ViewOf(it->value())));
  }
  return StatusOf(it->status());
}

absl::StatusOr<absl::optional<std::string>> RocksDbEngine::LastKey(absl::string_view from,
                                                                   absl::string_view to) const {
  const rocksdb::Slice end = SliceOf(to);
  const rocksdb::Slice begin = SliceOf(from);
  rocksdb::ReadOptions options;
  options.iterate_upper_bound = &end;
  options.iterate_lower_bound = &begin;
  const std::unique_ptr<rocksdb::Iterator> it(db_->NewIterator(options));
  it->SeekToLast();
  DYNMESH_RETURN_IF_ERROR(StatusOf(it->status()));
  if (!it->Valid()) return absl::optional<std::string>();
  return absl::optional<std::string>(it->key().ToString());
}

// RocksDB calls some kinds of damage by other names: where its files are missing or cannot be parsed.
absl::Status OpenError(const rocksdb::Status& status) {
  const bool damaged =
      status.IsInvalidArgument() || status.IsNotFound() || status.IsPathNotFound() || status.IsIncomplete();
  return damaged ? StoreDamaged(status.ToString()) : StatusOf(status);
}

}  // namespace

absl::StatusOr<std::unique_ptr<Engine>> OpenRocksDb(const RocksDbOptions& options) {
  DYNMESH_ASSIGN_OR_RETURN(std::unique_ptr<DirectoryLock> lock, DirectoryLock::Take(options.directory));
  DYNMESH_ASSIGN_OR_RETURN(std::unique_ptr<SyncedMark> mark,
                           SyncedMark::Open(options.directory + "/dynmesh.synced"));
  // Compaction gives way to whoever edits; a failure to ask for that costs nothing.
  rocksdb::Env* const env = options.env == nullptr ? rocksdb::Env::Default() : options.env;
  (void)env->LowerThreadPoolCPUPriority(rocksdb::Env::LOW, rocksdb::CpuPriority::kLow);
  rocksdb::DB* db = nullptr;
  const rocksdb::Status opened =
      rocksdb::DB::Open(DatabaseOptions(options.env), options.directory + "/rocksdb", &db);
  if (!opened.ok()) return OpenError(opened);
  auto engine =
      std::make_unique<RocksDbEngine>(std::move(lock), std::move(mark), std::unique_ptr<rocksdb::DB>(db));
  DYNMESH_RETURN_IF_ERROR(engine->CheckWrites());
  return std::unique_ptr<Engine>(std::move(engine));
}

}  // namespace dynmesh
