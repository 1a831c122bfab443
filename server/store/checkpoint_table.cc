#include "server/store/checkpoint_table.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/store/store_errors.h"

namespace dynmesh {

/// Takes the keys of a session's checkpoints in order: first the manifests, then the pages.
class CheckpointTable::Reader {
 public:
  Reader(uint64_t number, SessionStore::PageFn fn) : number_(number), fn_(fn) {}

  absl::Status Visit(absl::string_view key, absl::string_view value) {
    return layout::IsManifestKey(key) ? VisitManifest(key, value) : VisitPage(key, value);
  }

  absl::StatusOr<CheckpointTable> Finish(absl::optional<Checkpoint>& found) && {
    FindWanted();
    if (wanted_ != nullptr && next_ < wanted_->pages.size()) return Missing();
    found = std::move(found_);
    return std::move(table_);
  }

 private:
  absl::Status VisitManifest(absl::string_view key, absl::string_view value) {
    DYNMESH_ASSIGN_OR_RETURN(const uint64_t number, layout::CheckpointOfKey(key));
    DYNMESH_ASSIGN_OR_RETURN(const absl::string_view payload, layout::Unseal(key, value));
    DYNMESH_ASSIGN_OR_RETURN(layout::StoredManifest manifest, layout::ReadManifest(payload));
    if (number_ == 0 || number_ == number) {
      found_ = Checkpoint{manifest.revision, std::string(manifest.bytes), number};
    }
    table_.Add(number, {manifest.revision, std::move(manifest.pages)});
    return absl::OkStatus();
  }

  absl::Status VisitPage(absl::string_view key, absl::string_view value) {
    FindWanted();
    DYNMESH_ASSIGN_OR_RETURN(const layout::PageVersion version, layout::VersionOfKey(key));
    if (wanted_ != nullptr && next_ < wanted_->pages.size()) {
      const layout::PageVersion& next = wanted_->pages[next_];
      if (next == version) return VisitWanted(key, value);
      if (IsBefore(next, version)) return Missing();
    }
    if (!table_.num_uses_.contains(version)) NoteLeftover(version);
    return absl::OkStatus();
  }

  absl::Status VisitWanted(absl::string_view key, absl::string_view value) {
    DYNMESH_ASSIGN_OR_RETURN(const absl::string_view payload, layout::Unseal(key, value));
    return fn_(wanted_->pages[next_++].page, payload);
  }

  void NoteLeftover(const layout::PageVersion& version) {
    table_.last_number_ = std::max(table_.last_number_, version.checkpoint);
    table_.leftovers_.push_back(version);
  }

  void FindWanted() {
    if (wanted_ == nullptr && found_.has_value()) wanted_ = &table_.kept_.at(found_->number);
  }

  static bool IsBefore(const layout::PageVersion& a, const layout::PageVersion& b) {
    return a.page != b.page ? a.page < b.page : a.checkpoint < b.checkpoint;
  }

  absl::Status Missing() const {
    return StoreDamaged(
        absl::StrCat("page ", wanted_->pages[next_].page, " of checkpoint ", found_->number, " is missing"));
  }

  const uint64_t number_;
  const SessionStore::PageFn fn_;
  CheckpointTable table_;
  absl::optional<Checkpoint> found_;
  const Kept* wanted_ = nullptr;
  size_t next_ = 0;  ///< of the wanted pages
};

absl::StatusOr<CheckpointTable> CheckpointTable::Read(const Engine& engine, layout::SessionId id,
                                                      uint64_t number, absl::optional<Checkpoint>& found,
                                                      SessionStore::PageFn fn) {
  Reader reader(number, fn);
  const layout::KeyRange range = layout::CheckpointsOf(id);
  DYNMESH_RETURN_IF_ERROR(
      engine.Scan(range.from, range.to,
                  [&](absl::string_view key, absl::string_view value) { return reader.Visit(key, value); }));
  return std::move(reader).Finish(found);
}

const std::vector<layout::PageVersion>& CheckpointTable::last_pages() const {
  static const auto* const none = new std::vector<layout::PageVersion>();
  return kept_.empty() ? *none : kept_.rbegin()->second.pages;
}

void CheckpointTable::Add(uint64_t number, Kept checkpoint) {
  last_number_ = std::max(last_number_, number);
  for (const layout::PageVersion& version : checkpoint.pages) ++num_uses_[version];
  kept_[number] = std::move(checkpoint);
}

std::vector<layout::PageVersion> CheckpointTable::Remove(uint64_t number) {
  std::vector<layout::PageVersion> unused;
  const auto removed = kept_.find(number);
  for (const layout::PageVersion& version : removed->second.pages) {
    const auto uses = num_uses_.find(version);
    if (--uses->second > 0) continue;
    num_uses_.erase(uses);
    unused.push_back(version);
  }
  kept_.erase(removed);
  return unused;
}

}  // namespace dynmesh
