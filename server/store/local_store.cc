#include "server/store/local_store.h"

#include <algorithm>
#include <utility>

#include "core/mesh/error.h"
#include "server/store/local_session.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

constexpr layout::SessionId kNoSession = 0;

absl::Status CheckSessionName(absl::string_view name) {
  if (!name.empty() && name.size() <= kMaxNameBytes) return absl::OkStatus();
  return InvalidArgument(reason::kBadSessionName, "a session's name is empty or too long",
                         {{"session", std::string(name.substr(0, kMaxNameBytes))}});
}

absl::StatusOr<uint64_t> ReadSealedNumber(absl::string_view key, absl::string_view value) {
  DYNMESH_ASSIGN_OR_RETURN(const absl::string_view payload, layout::Unseal(key, value));
  return layout::ReadNumber(payload);
}

}  // namespace

absl::StatusOr<std::unique_ptr<Store>> LocalStore::Open(std::unique_ptr<Engine> engine,
                                                        const CommitterOptions& options) {
  std::unique_ptr<LocalStore> store(new LocalStore(std::move(engine), options));
  DYNMESH_RETURN_IF_ERROR(store->Load());
  return std::unique_ptr<Store>(std::move(store));
}

absl::Status LocalStore::Load() {
  DYNMESH_RETURN_IF_ERROR(LoadFormat());
  return LoadCatalogue();
}

absl::Status LocalStore::LoadFormat() {
  const std::string key = layout::FormatKey();
  DYNMESH_ASSIGN_OR_RETURN(const absl::optional<std::string> value, engine_->Get(key));
  if (value.has_value()) {
    DYNMESH_ASSIGN_OR_RETURN(const uint64_t format, ReadSealedNumber(key, *value));
    if (format < layout::kFormat) return StoreFormatOlder(format, layout::kFormat);
    return format == layout::kFormat ? absl::OkStatus() : StoreFormatNewer(format, layout::kFormat);
  }
  DYNMESH_ASSIGN_OR_RETURN(const auto any, engine_->LastKey(layout::Names().from, layout::DataOfAll().to));
  if (any.has_value()) return StoreDamaged("it does not say its format");
  EngineBatch batch;
  batch.Put(key, layout::Seal(key, layout::WriteNumber(layout::kFormat)));
  return Write(std::move(batch));
}

absl::Status LocalStore::LoadCatalogue() {
  Catalogue catalogue;
  const layout::KeyRange names = layout::Names();
  const auto visit = [&](absl::string_view key, absl::string_view value) {
    AddEntry(key, value, catalogue);
    return absl::OkStatus();
  };
  DYNMESH_RETURN_IF_ERROR(engine_->Scan(names.from, names.to, visit));
  const layout::KeyRange data = layout::DataOfAll();
  DYNMESH_ASSIGN_OR_RETURN(const auto last, engine_->LastKey(data.from, data.to));
  layout::SessionId last_id = kNoSession;
  if (last.has_value()) {  // also of sessions whose entry is damaged
    DYNMESH_ASSIGN_OR_RETURN(last_id, layout::SessionOfKey(*last));
  }
  for (const auto& [name, entry] : catalogue) last_id = std::max(last_id, entry.ownership->id());
  MutexLock lock(&mu_);
  catalogue_ = std::move(catalogue);
  last_id_ = last_id;
  return absl::OkStatus();
}

void LocalStore::AddEntry(absl::string_view key, absl::string_view value, Catalogue& catalogue) {
  const std::string name(layout::NameOfKey(key));
  const absl::StatusOr<uint64_t> id = ReadSealedNumber(key, value);
  catalogue[name] = {std::make_shared<Ownership>(id.ok() ? *id : kNoSession, name),
                     InSession(id.status(), name)};
}

std::vector<std::string> LocalStore::ListSessions() const {
  MutexLock lock(&mu_);
  std::vector<std::string> names;
  for (const auto& [name, entry] : catalogue_) {
    if (!entry.ownership->deleted()) names.push_back(name);
  }
  return names;
}

absl::Status LocalStore::CreateSession(absl::string_view name) {
  DYNMESH_RETURN_IF_ERROR(CheckSessionName(name));
  AwaitedWrite write({});
  {
    MutexLock lock(&mu_);
    if (catalogue_.contains(name)) return StoredSessionExists(name);
    if (last_id_ >= layout::kMaxNumber) return StoreDamaged("no number is left for a session");
    const layout::SessionId id = ++last_id_;
    catalogue_[std::string(name)] = {std::make_shared<Ownership>(id, std::string(name)), {}};
    const std::string key = layout::NameKey(name);
    write.write.batch.Put(key, layout::Seal(key, layout::WriteNumber(id)));
    committer_.Enqueue(std::move(write.write));  // before anything that whoever sees the entry writes
  }
  const absl::Status status = write.Wait();
  if (!status.ok()) Forget(name);
  return status;
}

absl::StatusOr<std::unique_ptr<SessionStore>> LocalStore::OpenSession(absl::string_view name) {
  std::shared_ptr<Ownership> ownership;
  {
    MutexLock lock(&mu_);
    const auto found = catalogue_.find(name);
    if (found == catalogue_.end()) return StoredSessionNotFound(name);
    DYNMESH_RETURN_IF_ERROR(found->second.damage);
    ownership = found->second.ownership;
  }
  DYNMESH_ASSIGN_OR_RETURN(const uint64_t token, ownership->TakeOver());
  committer_.Drain();  // to disk what the former owner wrote
  return LocalSession::Open(OwnedSession(std::move(ownership), token, engine_.get(), &committer_));
}

absl::Status LocalStore::DeleteSession(absl::string_view name) {
  DYNMESH_ASSIGN_OR_RETURN(const std::shared_ptr<Ownership> ownership, MarkDeleted(name));
  committer_.Drain();  // of what its owner wrote
  EngineBatch batch;
  batch.Delete(layout::NameKey(name));
  if (ownership->id() != kNoSession) {
    layout::KeyRange data = layout::DataOf(ownership->id());
    batch.DeleteRange(std::move(data.from), std::move(data.to));
  }
  DYNMESH_RETURN_IF_ERROR(Write(std::move(batch)));
  Forget(name);
  return absl::OkStatus();
}

// The entry stays until the deletion is on disk, so nobody makes another session of that name meanwhile.
absl::StatusOr<std::shared_ptr<Ownership>> LocalStore::MarkDeleted(absl::string_view name) {
  MutexLock lock(&mu_);
  const auto found = catalogue_.find(name);
  if (found == catalogue_.end()) return StoredSessionNotFound(name);
  DYNMESH_RETURN_IF_ERROR(found->second.ownership->Delete());
  return found->second.ownership;
}

absl::Status LocalStore::Write(EngineBatch batch) {
  AwaitedWrite write(std::move(batch));
  committer_.Enqueue(std::move(write.write));
  return write.Wait();
}

void LocalStore::Forget(absl::string_view name) {
  MutexLock lock(&mu_);
  const auto found = catalogue_.find(name);
  if (found != catalogue_.end()) catalogue_.erase(found);
}

}  // namespace dynmesh
