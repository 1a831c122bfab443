#include "server/session/registry.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "server/session/fingerprint.h"
#include "server/session/session_errors.h"
#include "spdlog/spdlog.h"

namespace dynmesh {
namespace {

uint64_t FingerprintOf(const std::string& name, const SessionSettings& settings) {
  Fingerprint fingerprint;
  fingerprint.AddString(name);
  fingerprint.AddNumber(static_cast<uint64_t>(settings.durability));
  fingerprint.AddNumber(static_cast<uint64_t>(settings.duplicates));
  for (Relation relation : settings.stored_relations) fingerprint.AddNumber(StorableIndex(relation));
  for (CheckKind check : AllChecks()) {
    const CheckSetting& setting = settings.checks[check];
    fingerprint.AddNumber(static_cast<uint64_t>(setting.severity));
    fingerprint.AddBytes(&setting.threshold, sizeof(setting.threshold));
  }
  return fingerprint.value();
}

// std::map finds by any type that compares with its keys, which absl's and std's string_view do not.
std::string Key(absl::string_view name) { return std::string(name); }

}  // namespace

/// What somebody wants to create.
struct SessionRegistry::Creation {
  std::string name;
  SessionSettings settings;
  std::string request_id;
  uint64_t fingerprint;
};

// ---- Creating ----

absl::StatusOr<SessionInfo> SessionRegistry::Create(const std::string& name, const SessionSettings& settings,
                                                    const std::string& request_id) {
  DYNMESH_RETURN_IF_ERROR(CheckSessionName(name));
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(request_id));
  Creation creation{name, settings, request_id, FingerprintOf(name, settings)};
  if (settings.durability == SessionDurability::kDefault) {
    creation.settings.durability = store_ == nullptr ? SessionDurability::kNone : SessionDurability::kSync;
  }
  MutexLock lock(&create_mu_);
  return CreateOnce(creation);
}

absl::StatusOr<SessionInfo> SessionRegistry::CreateOnce(const Creation& creation) {
  if (!creation.request_id.empty()) {
    DYNMESH_ASSIGN_OR_RETURN(const auto remembered, created_.Find(creation.request_id, creation.fingerprint));
    if (remembered != nullptr) return *remembered;
  }
  DYNMESH_RETURN_IF_ERROR(CheckCreation(creation.name));
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, MakeSession(creation));
  DYNMESH_ASSIGN_OR_RETURN(SessionInfo info, session->Info());
  if (!creation.request_id.empty()) {
    created_.Remember(creation.request_id, creation.fingerprint, std::make_shared<const SessionInfo>(info),
                      sizeof(info));
  }
  MutexLock lock(&mu_);
  sessions_[creation.name] = {session};
  spdlog::info("session_created name={} sessions={}", creation.name, sessions_.size());
  return info;
}

absl::Status SessionRegistry::CheckCreation(const std::string& name) const {
  MutexLock lock(&mu_);
  if (draining_) return ShuttingDown();
  if (sessions_.count(name) > 0) {
    return MakeError(absl::StatusCode::kAlreadyExists, reason::kSessionExists,
                     absl::StrCat("there is a session ", name, " already"), {{"session", name}});
  }
  if (sessions_.size() < limits_.max_sessions) return absl::OkStatus();
  return LimitExceeded("max_sessions", limits_.max_sessions, sessions_.size() + 1);
}

absl::StatusOr<SessionPtr> SessionRegistry::MakeSession(const Creation& creation) {
  const Session::Options options{creation.name, creation.settings, limits_, workers_};
  if (creation.settings.durability == SessionDurability::kNone) return std::make_shared<Session>(options);
  if (store_ == nullptr) return NoStore();
  SessionIdentity identity{Session::NewUid(), absl::Now(), creation.settings, creation.request_id,
                           creation.fingerprint};
  absl::StatusOr<std::unique_ptr<SessionLog>> log = MakeLog(creation.name, identity);
  if (!log.ok()) {
    if (!absl::IsAlreadyExists(log.status())) store_->DeleteSession(creation.name).IgnoreError();
    return log.status();
  }
  Session::Options kept = options;
  kept.uid = identity.uid;
  kept.create_time = identity.create_time;
  kept.create_request_id = creation.request_id;
  kept.create_fingerprint = creation.fingerprint;
  return std::make_shared<Session>(kept, *std::move(log));
}

/// The identity comes last: a session without one was never created.
absl::StatusOr<std::unique_ptr<SessionLog>> SessionRegistry::MakeLog(const std::string& name,
                                                                     const SessionIdentity& identity) {
  DYNMESH_RETURN_IF_ERROR(store_->CreateSession(name));
  DYNMESH_ASSIGN_OR_RETURN(std::unique_ptr<SessionStore> store, store_->OpenSession(name));
  std::unique_ptr<SessionLog> log = LogFor(std::move(store), identity.settings.durability);
  const Mesh empty(MeshOptions{identity.settings.duplicates, ToMeshLimits(limits_)});
  DYNMESH_RETURN_IF_ERROR(log->StoreAll(empty, identity.create_time));
  DYNMESH_RETURN_IF_ERROR(log->store().PutValue(kIdentityName, EncodeIdentity(identity)));
  return log;
}

std::unique_ptr<SessionLog> SessionRegistry::LogFor(std::unique_ptr<SessionStore> store,
                                                    SessionDurability durability) const {
  SessionLogOptions options = log_options_;
  options.durability = durability == SessionDurability::kAsync ? Durability::kAsync : Durability::kSync;
  return std::make_unique<SessionLog>(std::move(store), options, workers_.quick);
}

// ---- What the store has ----

absl::Status SessionRegistry::AddStored() {
  if (store_ == nullptr) return absl::OkStatus();
  MutexLock create_lock(&create_mu_);
  for (const std::string& name : store_->ListSessions()) {
    absl::StatusOr<SessionPtr> session = OpenStored(name);
    if (!session.ok()) {
      spdlog::error("session_damaged name={} error=\"{}\"", name, session.status().ToString());
      Session::Options options{name, {}, limits_, workers_};
      options.damage = session.status();
      session = std::make_shared<Session>(options);
    }
    if (*session == nullptr) {
      spdlog::warn("session_forgotten name={} reason=\"its creation was not finished\"", name);
      DYNMESH_RETURN_IF_ERROR(store_->DeleteSession(name));
      continue;
    }
    MutexLock lock(&mu_);
    sessions_[name] = {*session};
  }
  return absl::OkStatus();
}

/// Null where it was never created as a whole.
absl::StatusOr<SessionPtr> SessionRegistry::OpenStored(const std::string& name) {
  DYNMESH_ASSIGN_OR_RETURN(std::unique_ptr<SessionStore> store, store_->OpenSession(name));
  DYNMESH_ASSIGN_OR_RETURN(const auto bytes, store->GetValue(kIdentityName));
  if (!bytes.has_value()) return SessionPtr();
  DYNMESH_ASSIGN_OR_RETURN(const SessionIdentity identity, DecodeIdentity(*bytes));
  Session::Options options{name, identity.settings, limits_, workers_};
  options.uid = identity.uid;
  options.create_time = identity.create_time;
  options.create_request_id = identity.request_id;
  options.create_fingerprint = identity.fingerprint;
  SessionPtr session = std::make_shared<Session>(
      options, LogFor(std::move(store), identity.settings.durability), Session::Content::kStored);
  if (!identity.request_id.empty()) {
    SessionInfo created = session->Outline();
    created.state = SessionState::kLoaded;
    created.revision = created.durable_revision = 0;
    created_.Remember(identity.request_id, identity.fingerprint,
                      std::make_shared<const SessionInfo>(std::move(created)), sizeof(created));
  }
  return session;
}

// ---- Finding and deleting ----

absl::StatusOr<SessionPtr> SessionRegistry::Find(absl::string_view name) {
  DYNMESH_RETURN_IF_ERROR(CheckSessionName(name));
  MutexLock lock(&mu_);
  const auto found = sessions_.find(Key(name));
  if (found == sessions_.end()) return SessionNotFound(name);
  Entry& entry = found->second;
  entry.last_used = absl::Now();
  entry.session->EnsureLoaded();
  return entry.session;
}

std::vector<SessionPtr> SessionRegistry::ListAfter(absl::string_view after, size_t max_sessions) const {
  std::vector<SessionPtr> page;
  MutexLock lock(&mu_);
  for (auto it = sessions_.upper_bound(Key(after)); it != sessions_.end() && page.size() < max_sessions;
       ++it) {
    page.push_back(it->second.session);
  }
  return page;
}

absl::StatusOr<int64_t> SessionRegistry::Delete(absl::string_view name, absl::string_view etag) {
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, Find(name));
  return Delete(session, etag);
}

absl::StatusOr<int64_t> SessionRegistry::Delete(const SessionPtr& session, absl::string_view etag) {
  DYNMESH_ASSIGN_OR_RETURN(const int64_t revision, session->Delete(etag));
  if (session->is_stored()) DYNMESH_RETURN_IF_ERROR(store_->DeleteSession(session->name()));
  MutexLock lock(&mu_);
  sessions_.erase(session->name());
  spdlog::info("session_deleted name={} revision={} sessions={}", session->name(), revision,
               sessions_.size());
  return revision;
}

void SessionRegistry::Drain() {
  std::vector<SessionPtr> sessions;
  {
    MutexLock lock(&mu_);
    draining_ = true;
    for (const auto& [name, entry] : sessions_) sessions.push_back(entry.session);
  }
  for (const SessionPtr& session : sessions) session->followers().Close(ShuttingDown());
}

}  // namespace dynmesh
