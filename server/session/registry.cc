#include "server/session/registry.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "server/session/catch_exceptions.h"
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
  fingerprint.AddNumber(settings.retention.max_revisions);
  fingerprint.AddNumber(absl::ToInt64Microseconds(settings.retention.max_age));
  fingerprint.AddNumber(settings.retention.max_bytes);
  return fingerprint.value();
}

// std::map finds by any type that compares with its keys, which absl's and std's string_view do not.
std::string Key(absl::string_view name) { return std::string(name); }

SessionIdentity IdentityOf(const Session::Options& options) {
  return {options.uid,
          options.create_time,
          options.settings,
          options.create_request_id,
          options.create_fingerprint,
          options.create_revision};
}

}  // namespace

// ---- Creating ----

absl::StatusOr<SessionInfo> SessionRegistry::Create(const std::string& name, const SessionSettings& settings,
                                                    const std::string& request_id) {
  const absl::Time now = NowToTheMicrosecond();
  return CreateFrom({.name = name,
                     .settings = settings,
                     .mesh = Mesh(MeshOptions{settings.duplicates, ToMeshLimits(limits_)}),
                     .commit_time = now,
                     .create_time = now,
                     .request_id = request_id,
                     .fingerprint = FingerprintOf(name, settings)});
}

absl::StatusOr<SessionInfo> SessionRegistry::CreateFrom(SessionSeed seed) {
  DYNMESH_RETURN_IF_ERROR(CheckSessionName(seed.name));
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(seed.request_id));
  DYNMESH_RETURN_IF_ERROR(Prepare(seed));
  if (seed.validate_only) return DescribeSeed(seed);
  DYNMESH_ASSIGN_OR_RETURN(const auto remembered, BeginCreation(seed));
  if (remembered != nullptr) return *remembered;
  const absl::StatusOr<NewSession> made = CatchExceptions([&] { return MakeSession(seed); });
  EndCreation(seed, made);
  if (!made.ok()) return made.status();
  return made->info;
}

absl::StatusOr<std::shared_ptr<const SessionInfo>> SessionRegistry::BeginCreation(const SessionSeed& seed) {
  MutexLock lock(&create_mu_);
  while (creating_.contains(seed.name)) created_one_.Wait(&create_mu_);
  std::shared_ptr<const SessionInfo> remembered;
  if (!seed.request_id.empty()) {
    DYNMESH_ASSIGN_OR_RETURN(remembered, created_.Find(seed.request_id, seed.fingerprint));
  }
  if (remembered != nullptr) return remembered;
  DYNMESH_RETURN_IF_ERROR(CheckRoom(seed.name, creating_.size()));
  creating_.insert(seed.name);
  return remembered;
}

void SessionRegistry::EndCreation(const SessionSeed& seed, const absl::StatusOr<NewSession>& made) {
  MutexLock lock(&create_mu_);
  creating_.erase(seed.name);
  created_one_.NotifyAll();
  if (!made.ok()) return;
  if (!seed.request_id.empty()) {
    created_.Remember(seed.request_id, seed.fingerprint, std::make_shared<const SessionInfo>(made->info),
                      sizeof(made->info));
  }
  MutexLock sessions_lock(&mu_);
  sessions_[seed.name] = {made->session};
  spdlog::info("session_created name={} revision={} sessions={}", seed.name, made->info.revision,
               sessions_.size());
}

/// Makes the mesh one of this daemon.
absl::Status SessionRegistry::Prepare(SessionSeed& seed) const {
  for (EntityKind kind : kEntityKinds) {
    const uint32_t max_slots = limits_.max_slots(kind), slots = seed.mesh.slots(kind).limit();
    if (slots > max_slots) return LimitExceeded(kSlotLimitNames[Dimension(kind)], max_slots, slots);
  }
  seed.mesh.SetLimits(ToMeshLimits(limits_));
  DYNMESH_RETURN_IF_ERROR(StoreJust(seed.mesh, seed.settings.stored_relations, limits_.max_session_bytes));
  const uint64_t bytes = seed.mesh.memory_bytes();
  if (bytes > limits_.max_session_bytes) {
    return LimitExceeded("max_session_bytes", limits_.max_session_bytes, bytes);
  }
  seed.settings.duplicates = seed.mesh.options().duplicates;
  if (seed.settings.durability == SessionDurability::kDefault) {
    seed.settings.durability = store_ == nullptr ? SessionDurability::kNone : SessionDurability::kSync;
  }
  return absl::OkStatus();
}

absl::StatusOr<SessionInfo> SessionRegistry::DescribeSeed(SessionSeed& seed) const {
  DYNMESH_RETURN_IF_ERROR(CheckCreation(seed.name));
  if (seed.settings.durability != SessionDurability::kNone && store_ == nullptr) return NoStore();
  Session::Options options{seed.name, seed.settings, limits_, workers_};
  options.create_time = seed.create_time;
  const auto session = std::make_shared<Session>(options);
  session->BeginWith(std::move(seed.mesh), seed.commit_time);
  DYNMESH_ASSIGN_OR_RETURN(SessionInfo info, session->Info());
  info.uid.clear();
  info.etag.clear();
  return info;
}

absl::StatusOr<std::shared_ptr<const SessionInfo>> SessionRegistry::FindCreated(const std::string& name,
                                                                                const std::string& request_id,
                                                                                uint64_t fingerprint) {
  if (request_id.empty()) return std::shared_ptr<const SessionInfo>();
  MutexLock lock(&create_mu_);
  while (creating_.contains(name)) created_one_.Wait(&create_mu_);
  return created_.Find(request_id, fingerprint);
}

absl::Status SessionRegistry::CheckRoom(const std::string& name, size_t num_creating) const {
  MutexLock lock(&mu_);
  if (draining_) return ShuttingDown();
  if (sessions_.count(name) > 0) {
    return MakeError(absl::StatusCode::kAlreadyExists, reason::kSessionExists,
                     absl::StrCat("there is a session ", name, " already"), {{"session", name}});
  }
  const size_t wanted = sessions_.size() + num_creating + 1;
  if (wanted <= limits_.max_sessions) return absl::OkStatus();
  return LimitExceeded("max_sessions", limits_.max_sessions, wanted);
}

absl::StatusOr<SessionRegistry::NewSession> SessionRegistry::MakeSession(SessionSeed& seed) {
  Session::Options options{seed.name, seed.settings, limits_, workers_};
  options.uid = Session::NewUid();
  options.create_time = seed.create_time;
  options.create_request_id = seed.request_id;
  options.create_fingerprint = seed.fingerprint;
  options.create_revision = seed.mesh.revision();
  if (seed.settings.durability == SessionDurability::kNone) return BeginSession(seed, options, nullptr);
  if (store_ == nullptr) return NoStore();
  DYNMESH_RETURN_IF_ERROR(store_->CreateSession(seed.name));
  auto made = CatchExceptions([&]() -> absl::StatusOr<NewSession> {
    DYNMESH_ASSIGN_OR_RETURN(std::unique_ptr<SessionLog> log, StoreSeed(seed, IdentityOf(options)));
    return BeginSession(seed, options, std::move(log));
  });
  if (!made.ok()) store_->DeleteSession(seed.name).IgnoreError();
  return made;
}

absl::StatusOr<SessionRegistry::NewSession> SessionRegistry::BeginSession(SessionSeed& seed,
                                                                          const Session::Options& options,
                                                                          std::unique_ptr<SessionLog> log) {
  auto session = std::make_shared<Session>(options, std::move(log));
  session->BeginWith(std::move(seed.mesh), seed.commit_time);
  DYNMESH_ASSIGN_OR_RETURN(SessionInfo info, session->Info());
  return NewSession{std::move(session), std::move(info)};
}

/// The identity comes last: a session without one was never created.
absl::StatusOr<std::unique_ptr<SessionLog>> SessionRegistry::StoreSeed(const SessionSeed& seed,
                                                                       const SessionIdentity& identity) {
  DYNMESH_ASSIGN_OR_RETURN(std::unique_ptr<SessionStore> store, store_->OpenSession(seed.name));
  std::unique_ptr<SessionLog> log = LogFor(std::move(store), identity.settings);
  DYNMESH_RETURN_IF_ERROR(
      log->StoreAll(seed.mesh, seed.commit_time, {LoggedCall::kCreation, {}, 0, {}, seed.note}));
  DYNMESH_RETURN_IF_ERROR(log->store().PutValue(kIdentityName, EncodeIdentity(identity)));
  return log;
}

std::unique_ptr<SessionLog> SessionRegistry::LogFor(std::unique_ptr<SessionStore> store,
                                                    const SessionSettings& settings) const {
  SessionLogOptions options = log_options_;
  options.durability =
      settings.durability == SessionDurability::kAsync ? Durability::kAsync : Durability::kSync;
  auto log = std::make_unique<SessionLog>(std::move(store), options, workers_.quick);
  log->SetRetention(settings.retention);
  return log;
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
  options.create_revision = identity.create_revision;
  SessionPtr session = std::make_shared<Session>(options, LogFor(std::move(store), identity.settings),
                                                 Session::Content::kStored);
  if (!identity.request_id.empty()) {
    SessionInfo created = session->Outline();
    // What it began with is not known any more, unless that was nothing.
    if (identity.create_revision == 0) created.state = SessionState::kLoaded;
    created.etag.clear();
    created.revision = created.durable_revision = identity.create_revision;
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
