// Unloading of sessions that nobody uses.

#include <algorithm>
#include <utility>

#include "absl/time/time.h"
#include "server/session/heap.h"
#include "server/session/registry.h"
#include "spdlog/spdlog.h"

namespace dynmesh {
namespace {

/// Who calls again and again finds a session loaded, also where it holds more than all may.
constexpr absl::Duration kRest = absl::Seconds(1);

}  // namespace

size_t SessionRegistry::UnloadIdle(absl::Time now, const UnloadPolicy& policy) {
  std::vector<Unloaded> unloaded = TakeIdle(now, policy);
  for (Unloaded& taken : unloaded) {
    spdlog::info("session_unloaded name={} bytes={} idle={}", taken.session->name(), taken.bytes,
                 absl::FormatDuration(taken.idle));
    taken.session = nullptr;
  }
  if (!unloaded.empty()) TrimHeap();
  return unloaded.size();
}

// Whoever is not among the owners cannot become one while this has the lock: only Find() and ListAfter() hand
// sessions out, and no session hands itself out without an owner that asks.
std::vector<SessionRegistry::Unloaded> SessionRegistry::TakeIdle(absl::Time now, const UnloadPolicy& policy) {
  std::vector<Unloaded> taken;
  MutexLock lock(&mu_);
  if (draining_) return taken;  // sessions that come now would not know
  uint64_t loaded_bytes = 0;
  for (Entry* entry : FindIdle(now, loaded_bytes)) {
    const absl::Duration idle = now - entry->last_used;
    const bool too_much = loaded_bytes > policy.max_loaded_bytes && idle >= kRest;
    if (idle < policy.idle_timeout && !too_much) break;
    const uint64_t bytes = entry->session->loaded_bytes();
    loaded_bytes -= bytes;
    if (entry->session->BeginLastCheckpoint()) continue;
    SessionPtr stored = entry->session->Unload();
    taken.push_back({std::exchange(entry->session, std::move(stored)), bytes, idle});
  }
  return taken;
}

std::vector<SessionRegistry::Entry*> SessionRegistry::FindIdle(absl::Time now, uint64_t& loaded_bytes) {
  std::vector<Entry*> idle;
  for (auto& [name, entry] : sessions_) {
    Session& session = *entry.session;
    if (!session.is_stored() || session.state() != SessionState::kLoaded) continue;
    const bool in_use = entry.session.use_count() > 1;
    entry.last_used = in_use && !session.writes_checkpoint() ? now : std::min(entry.last_used, now);
    if (!in_use) session.MeasureMemory();
    loaded_bytes += session.loaded_bytes();
    if (!in_use && session.CanUnload()) idle.push_back(&entry);
  }
  std::stable_sort(idle.begin(), idle.end(),
                   [](const Entry* a, const Entry* b) { return a->last_used < b->last_used; });
  return idle;
}

}  // namespace dynmesh
