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

absl::StatusOr<SessionInfo> SessionRegistry::Create(const std::string& name, const SessionSettings& settings,
                                                    const std::string& request_id) {
  DYNMESH_RETURN_IF_ERROR(CheckSessionName(name));
  DYNMESH_RETURN_IF_ERROR(CheckRequestId(request_id));
  const uint64_t fingerprint = FingerprintOf(name, settings);
  MutexLock lock(&mu_);
  if (!request_id.empty()) {
    DYNMESH_ASSIGN_OR_RETURN(const auto remembered, created_.Find(request_id, fingerprint));
    if (remembered != nullptr) return *remembered;
  }
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, Insert(name, settings));
  DYNMESH_ASSIGN_OR_RETURN(SessionInfo info, session->Info());
  if (!request_id.empty()) {
    created_.Remember(request_id, fingerprint, std::make_shared<const SessionInfo>(info), sizeof(info));
  }
  spdlog::info("session_created name={} sessions={}", name, sessions_.size());
  return info;
}

absl::StatusOr<SessionPtr> SessionRegistry::Insert(const std::string& name, const SessionSettings& settings) {
  if (draining_) return ShuttingDown();
  if (sessions_.count(name) > 0) {
    return MakeError(absl::StatusCode::kAlreadyExists, reason::kSessionExists,
                     absl::StrCat("there is a session ", name, " already"), {{"session", name}});
  }
  if (sessions_.size() >= limits_.max_sessions) {
    return LimitExceeded("max_sessions", limits_.max_sessions, sessions_.size() + 1);
  }
  return sessions_[name] = std::make_shared<Session>(Session::Options{name, settings, limits_, workers_});
}

absl::StatusOr<SessionPtr> SessionRegistry::Find(absl::string_view name) const {
  DYNMESH_RETURN_IF_ERROR(CheckSessionName(name));
  MutexLock lock(&mu_);
  const auto found = sessions_.find(Key(name));
  if (found == sessions_.end()) return SessionNotFound(name);
  return found->second;
}

std::vector<SessionPtr> SessionRegistry::ListAfter(absl::string_view after, size_t max_sessions) const {
  std::vector<SessionPtr> page;
  MutexLock lock(&mu_);
  for (auto it = sessions_.upper_bound(Key(after)); it != sessions_.end() && page.size() < max_sessions;
       ++it) {
    page.push_back(it->second);
  }
  return page;
}

absl::StatusOr<int64_t> SessionRegistry::Delete(absl::string_view name, absl::string_view etag) {
  DYNMESH_ASSIGN_OR_RETURN(const SessionPtr session, Find(name));
  return Delete(session, etag);
}

absl::StatusOr<int64_t> SessionRegistry::Delete(const SessionPtr& session, absl::string_view etag) {
  DYNMESH_ASSIGN_OR_RETURN(const int64_t revision, session->Delete(etag));
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
    for (const auto& [name, session] : sessions_) sessions.push_back(session);
  }
  for (const SessionPtr& session : sessions) session->followers().Close(ShuttingDown());
}

}  // namespace dynmesh
