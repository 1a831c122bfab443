// What a session's settings are, and how they are changed.

#include "core/mesh/error.h"
#include "server/session/session.h"
#include "spdlog/spdlog.h"

namespace dynmesh {

SessionSettings Session::Settings() const {
  SessionSettings settings = options_.settings;
  settings.checks = checks();
  settings.retention = retention();
  ReaderMutexLock lock(&mu_);
  settings.stored_relations = StoredRelationsOf(mesh_);
  return settings;
}

absl::Status Session::Update(const SettingsUpdate& update, absl::string_view etag, const StopSignal& stop) {
  if (log_ == nullptr) return ChangeSettings(update, etag, stop);
  MutexLock lock(&identity_mu_);
  const SessionSettings before = Settings();
  DYNMESH_RETURN_IF_ERROR(ChangeSettings(update, etag, stop));
  const absl::Status stored = StoreIdentity();
  if (stored.ok()) return stored;
  SettingsUpdate back{.checks = before.checks, .retention = before.retention};
  if (update.stored_relations.has_value()) back.stored_relations = before.stored_relations;
  const absl::Status taken_back = ChangeSettings(back, "", StopSignal::Never());
  if (!taken_back.ok())
    spdlog::warn("settings_not_taken_back name={} error=\"{}\"", name(), taken_back.ToString());
  return stored;
}

absl::Status Session::ChangeSettings(const SettingsUpdate& update, absl::string_view etag,
                                     const StopSignal& stop) {
  WriterMutexLock lock(&mu_);
  DYNMESH_RETURN_IF_ERROR(CheckEditable());
  DYNMESH_RETURN_IF_ERROR(CheckEtag(etag));
  if (update.stored_relations.has_value()) {
    DYNMESH_RETURN_IF_ERROR(StoreJust(mesh_, *update.stored_relations, limits().max_session_bytes, stop));
    MakeRoom(mesh_.memory_bytes());
  }
  MutexLock settings_lock(&settings_mu_);
  if (update.checks.has_value()) checks_ = *update.checks;
  if (update.retention.has_value()) retention_ = *update.retention;
  if (log_ != nullptr) log_->SetRetention(retention_);
  ++num_updates_;
  return absl::OkStatus();
}

}  // namespace dynmesh
