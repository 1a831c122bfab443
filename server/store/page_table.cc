#include "server/store/page_table.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/store/store_errors.h"

namespace dynmesh {

absl::StatusOr<PageTable> PageTable::Read(const Engine& engine, layout::SessionId id,
                                          absl::optional<Checkpoint>& checkpoint, SessionStore::PageFn fn) {
  PageTable table;
  layout::StoredManifest manifest;
  const std::string manifest_key = layout::ManifestKey(id);
  const layout::KeyRange range = layout::CheckpointOf(id);
  const auto visit = [&](absl::string_view key, absl::string_view value) -> absl::Status {
    if (key == manifest_key) {  // comes first
      DYNMESH_ASSIGN_OR_RETURN(const absl::string_view payload, layout::Unseal(key, value));
      DYNMESH_ASSIGN_OR_RETURN(manifest, layout::ReadManifest(payload));
      checkpoint = Checkpoint{manifest.revision, std::string(manifest.bytes)};
      table.last_checkpoint_ = manifest.checkpoint;
      return absl::OkStatus();
    }
    DYNMESH_ASSIGN_OR_RETURN(const layout::PageVersion version, layout::VersionOfKey(key));
    if (version.checkpoint > manifest.checkpoint) {
      table.last_checkpoint_ = std::max(table.last_checkpoint_, version.checkpoint);
      table.leftovers_.push_back(version);
      return absl::OkStatus();
    }
    DYNMESH_ASSIGN_OR_RETURN(const absl::string_view payload, layout::Unseal(key, value));
    DYNMESH_RETURN_IF_ERROR(table.Add(version));
    return fn(version.page, payload);
  };
  DYNMESH_RETURN_IF_ERROR(engine.Scan(range.from, range.to, visit));
  if (table.size() != manifest.num_pages || table.hash() != manifest.pages_hash) {
    return StoreDamaged(absl::StrCat("checkpoint ", manifest.checkpoint, " has ", manifest.num_pages,
                                     " pages, and these are not the ", table.size(), " that are there"));
  }
  return table;
}

absl::Status PageTable::Add(const layout::PageVersion& version) {
  if (Find(version.page) != 0) return StoreDamaged(absl::StrCat("page ", version.page, " is there twice"));
  Put(version);
  return absl::OkStatus();
}

uint64_t PageTable::Find(PageKey page) const {
  const auto found = versions_.find(page);
  return found == versions_.end() ? 0 : found->second;
}

void PageTable::Put(const layout::PageVersion& version) {
  Remove(version.page);
  versions_.emplace(version.page, version.checkpoint);
  hash_ ^= layout::PageHash(version);
}

void PageTable::Remove(PageKey page) {
  const auto found = versions_.find(page);
  if (found == versions_.end()) return;
  hash_ ^= layout::PageHash({page, found->second});
  versions_.erase(found);
}

}  // namespace dynmesh
