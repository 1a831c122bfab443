#include "tests/store/contents.h"

#include <gtest/gtest.h>

#include <memory>

#include "core/mesh/error.h"
#include "tests/store/acknowledgements.h"

namespace dynmesh::testing {

void PrintTo(const SessionContents& contents, std::ostream* out) {
  *out << "checkpoint " << contents.checkpoint << " '" << contents.manifest << "', " << contents.pages.size()
       << " pages:";
  for (const auto& [page, bytes] : contents.pages) *out << ' ' << page << '(' << bytes.size() << ')';
  *out << ", records:";
  for (const auto& [revision, bytes] : contents.records)
    *out << ' ' << revision << '(' << bytes.size() << ')';
  for (const CheckpointContents& former : contents.former) {
    *out << ", former checkpoint " << former.revision << " with " << former.pages.size() << " pages";
  }
}

absl::StatusOr<CheckpointContents> ReadOne(SessionStore& session, uint64_t number) {
  CheckpointContents contents;
  const auto on_page = [&](PageKey page, absl::string_view bytes) {
    EXPECT_TRUE(contents.pages.emplace(page, bytes).second) << page;
    return absl::OkStatus();
  };
  DYNMESH_ASSIGN_OR_RETURN(const Checkpoint checkpoint, session.ReadCheckpoint(number, on_page));
  contents.revision = checkpoint.revision;
  contents.manifest = checkpoint.manifest;
  return contents;
}

absl::StatusOr<SessionContents> ReadSession(SessionStore& session) {
  SessionContents contents;
  DYNMESH_ASSIGN_OR_RETURN(const std::vector<Checkpoint> checkpoints, session.ListCheckpoints());
  for (const Checkpoint& checkpoint : checkpoints) {
    DYNMESH_ASSIGN_OR_RETURN(contents.former.emplace_back(), ReadOne(session, checkpoint.number));
  }
  if (!contents.former.empty()) {
    CheckpointContents last = std::move(contents.former.back());
    contents.former.pop_back();
    contents.checkpoint = last.revision;
    contents.manifest = std::move(last.manifest);
    contents.pages = std::move(last.pages);
  }
  const auto on_record = [&](int64_t revision, absl::string_view bytes) {
    contents.records.emplace_back(revision, bytes);
    return absl::OkStatus();
  };
  DYNMESH_RETURN_IF_ERROR(session.ReadRecords(contents.checkpoint, on_record));
  return contents;
}

absl::StatusOr<StoreContents> ReadStore(StoreRig& rig) {
  DYNMESH_ASSIGN_OR_RETURN(const std::unique_ptr<Store> store, rig.Open());
  StoreContents contents;
  for (const std::string& name : store->ListSessions()) {
    DYNMESH_ASSIGN_OR_RETURN(const std::unique_ptr<SessionStore> session, store->OpenSession(name));
    DYNMESH_ASSIGN_OR_RETURN(contents[name], ReadSession(*session));
  }
  return contents;
}

Records RecordsAfter(SessionStore& session, int64_t after) {
  Records records;
  EXPECT_EQ(session.ReadRecords(after,
                                [&](int64_t revision, absl::string_view bytes) {
                                  records.emplace_back(revision, bytes);
                                  return absl::OkStatus();
                                }),
            absl::OkStatus());
  return records;
}

SessionContents ContentsOf(SessionStore& session) {
  absl::StatusOr<SessionContents> contents = ReadSession(session);
  EXPECT_EQ(contents.status(), absl::OkStatus());
  return contents.ok() ? *std::move(contents) : SessionContents();
}

void RandomAuthor::Write(int num_steps) {
  absl::StatusOr<std::unique_ptr<Store>> store = rig_->Open();
  ASSERT_EQ(store.status(), absl::OkStatus());
  std::map<std::string, std::unique_ptr<SessionStore>> sessions;
  for (const std::string name : {"left", "right"}) {
    if (written_.count(name) == 0) {
      EXPECT_EQ((*store)->CreateSession(name), absl::OkStatus());
    }
    absl::StatusOr<std::unique_ptr<SessionStore>> session = (*store)->OpenSession(name);
    ASSERT_EQ(session.status(), absl::OkStatus());
    sessions[name] = *std::move(session);
    written_[name];
  }
  for (int i = 0; i < num_steps; ++i) {
    const std::string name = Below(2) == 0 ? "left" : "right";
    Step(*sessions[name], written_[name]);
  }
}

void RandomAuthor::Step(SessionStore& session, SessionContents& contents) {
  switch (Below(7)) {
    case 0:
      return MakeCheckpoint(session, contents);
    case 1:
      return DropCheckpoint(session, contents);
    case 2:
      EXPECT_EQ(session.TrimRecords(contents.checkpoint - Below(2)), absl::OkStatus());
      return;
    default:
      return Append(session, contents);
  }
}

void RandomAuthor::Append(SessionStore& session, SessionContents& contents) {
  const int64_t revision = session.last_revision() + 1 + Below(3);
  std::string bytes = AnyBytes();
  contents.records.emplace_back(revision, bytes);
  const Durability durability = Below(4) == 0 ? Durability::kSync : Durability::kAsync;
  EXPECT_EQ(AppendNow(session, revision, std::move(bytes), durability), absl::OkStatus());
}

void RandomAuthor::MakeCheckpoint(SessionStore& session, SessionContents& contents) {
  const int64_t revision = session.last_revision() + (Below(5) == 0 ? 1 : 0);
  const auto writer = session.BeginCheckpoint(revision);
  ASSERT_EQ(writer.status(), absl::OkStatus());
  std::map<PageKey, std::string> pages = contents.pages;
  ChangePages(**writer, pages);
  if (Below(4) == 0) return;  // abandoned
  std::string manifest = AnyBytes();
  std::vector<CheckpointContents> former = std::move(contents.former);
  const bool keeps = Below(2) == 0 && !(*session.ListCheckpoints()).empty();
  if (keeps) former.push_back({contents.checkpoint, contents.manifest, contents.pages});
  contents = {revision, manifest, std::move(pages), {}, std::move(former)};
  EXPECT_EQ((*writer)->Commit(std::move(manifest), keeps ? FormerCheckpoint::kKeep : FormerCheckpoint::kDrop),
            absl::OkStatus());
}

void RandomAuthor::DropCheckpoint(SessionStore& session, SessionContents& contents) {
  if (contents.former.empty()) return;
  const size_t index = Below(static_cast<uint32_t>(contents.former.size()));
  EXPECT_EQ(session.DropCheckpoint((*session.ListCheckpoints())[index].number), absl::OkStatus());
  contents.former.erase(contents.former.begin() + index);
}

void RandomAuthor::ChangePages(CheckpointWriter& writer, std::map<PageKey, std::string>& pages) {
  for (uint32_t i = Below(6); i > 0; --i) {
    const PageKey page = Below(8);
    if (Below(3) == 0) {
      pages.erase(page);
      EXPECT_EQ(writer.DropPage(page), absl::OkStatus());
    } else {
      pages[page] = AnyBytes();
      EXPECT_EQ(writer.WritePage(page, pages[page]), absl::OkStatus());
    }
  }
}

}  // namespace dynmesh::testing
