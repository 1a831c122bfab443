// What is found out about a store that is not as it was written, or not ours to open.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "core/mesh/error.h"
#include "server/store/layout.h"
#include "server/store/local_store.h"
#include "server/store/rocksdb_engine.h"
#include "server/store/store_errors.h"
#include "server/store/synced_mark.h"
#include "tests/store/acknowledgements.h"
#include "tests/store/contents.h"
#include "tests/store/temporary_directory.h"

namespace dynmesh::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::Pair;

class DamageTest : public ::testing::Test {
 protected:
  absl::StatusOr<std::unique_ptr<Store>> Open() {
    auto engine = OpenRocksDb({directory_.path()});
    if (!engine.ok()) return engine.status();
    return LocalStore::Open(*std::move(engine));
  }

  // Sessions 1 "left" and 2 "right": checkpoint 1 at revision 2 with pages 1 and 2, and records 1 to 4.
  void Fill() {
    const auto store = Open();
    ASSERT_EQ(store.status(), absl::OkStatus());
    for (const std::string name : {"left", "right"}) {
      ASSERT_EQ((*store)->CreateSession(name), absl::OkStatus());
      const auto session = (*store)->OpenSession(name);
      for (int i = 1; i <= 4; ++i) EXPECT_TRUE(AppendNow(**session, i, absl::StrCat(name, i)).ok());
      const auto writer = (*session)->BeginCheckpoint(2);
      for (PageKey page : {1, 2}) EXPECT_TRUE((*writer)->WritePage(page, name).ok());
      EXPECT_TRUE((*writer)->Commit("m").ok());
    }
  }

  // Changes what is stored, below the store.
  void Tamper(EngineBatch batch) {
    const auto engine = OpenRocksDb({directory_.path()});
    ASSERT_EQ(engine.status(), absl::OkStatus());
    EXPECT_EQ((*engine)->Write(batch), absl::OkStatus());
    EXPECT_EQ((*engine)->Sync(), absl::OkStatus());
  }
  std::string Stored(const std::string& key) {
    const auto engine = OpenRocksDb({directory_.path()});
    return (*engine)->Get(key)->value();
  }

  // "left" cannot be read and says so, and "right" is as it was.
  void ExpectOnlyLeftIsDamaged() {
    const auto store = Open();
    ASSERT_EQ(store.status(), absl::OkStatus());
    EXPECT_THAT((*store)->ListSessions(), ElementsAre("left", "right"));
    const auto left = (*store)->OpenSession("left");
    const absl::Status status = left.ok() ? ReadSession(**left).status() : left.status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    EXPECT_EQ(ErrorReason(status), reason::kStoreDamaged);
    if (!status.ok()) {
      EXPECT_EQ(GetErrorDetail(status)->Find("session"), "left");
    }
    EXPECT_EQ(ContentsOf(**(*store)->OpenSession("right")),
              (SessionContents{2, "m", {{1, "right"}, {2, "right"}}, {{3, "right3"}, {4, "right4"}}}));
    EXPECT_EQ((*store)->DeleteSession("left"), absl::OkStatus()) << "a damaged session can be deleted";
    EXPECT_THAT((*store)->ListSessions(), ElementsAre("right"));
  }

  fs::path TheLog() const {
    fs::path log;
    for (const auto& entry : fs::directory_iterator(directory_.path() + "/rocksdb")) {
      if (entry.path().extension() == ".log") log = entry.path();
    }
    return log;
  }

  const TemporaryDirectory directory_;
};

EngineBatch Deletion(std::string key) {
  EngineBatch batch;
  batch.Delete(std::move(key));
  return batch;
}

EngineBatch Replacement(std::string key, std::string value) {
  EngineBatch batch;
  batch.Put(std::move(key), std::move(value));
  return batch;
}

TEST_F(DamageTest, AMissingRecordIsFound) {
  Fill();
  Tamper(Deletion(layout::RecordKey(1, 3)));
  ExpectOnlyLeftIsDamaged();
}

TEST_F(DamageTest, AMissingPageIsFound) {
  Fill();
  Tamper(Deletion(layout::PageKeyOf(1, 2, 1)));
  ExpectOnlyLeftIsDamaged();
}

TEST_F(DamageTest, AMissingManifestIsFound) {
  Fill();
  {
    const auto store = Open();
    const auto session = (*store)->OpenSession("left");
    EXPECT_TRUE((*session)->TrimRecords(2).ok());
  }
  Tamper(Deletion(layout::ManifestKey(1, 1)));
  ExpectOnlyLeftIsDamaged();
}

TEST_F(DamageTest, AValueInTheWrongPlaceIsFound) {
  Fill();
  Tamper(Replacement(layout::RecordKey(1, 3), Stored(layout::RecordKey(2, 3))));
  ExpectOnlyLeftIsDamaged();
}

TEST_F(DamageTest, ASealedValueThatMakesNoSenseIsFound) {
  Fill();
  for (const std::string& key : {layout::ManifestKey(1, 1), layout::TrimmedKey(1), layout::RecordKey(1, 3)}) {
    const std::string before = Stored(layout::ManifestKey(1, 1));
    Tamper(Replacement(key, layout::Seal(key, "short")));
    const auto store = Open();
    const auto left = (*store)->OpenSession("left");
    const absl::Status status = left.ok() ? ReadSession(**left).status() : left.status();
    EXPECT_EQ(ErrorReason(status), reason::kStoreDamaged);
  }
  ExpectOnlyLeftIsDamaged();
}

TEST_F(DamageTest, AKeyThatMakesNoSenseIsFound) {
  Fill();
  Tamper(Replacement(layout::RecordKey(1, 3) + "x", "y"));
  ExpectOnlyLeftIsDamaged();
}

TEST_F(DamageTest, ADamagedEntryOfTheCatalogueCostsItsSessionOnly) {
  Fill();
  Tamper(Replacement(layout::NameKey("left"), Stored(layout::NameKey("right"))));
  ExpectOnlyLeftIsDamaged();
}

TEST_F(DamageTest, ANewSessionTakesNothingOverFromOneWhoseEntryIsDamaged) {
  Fill();
  Tamper(Deletion(layout::NameKey("right")));
  const auto store = Open();
  EXPECT_TRUE((*store)->CreateSession("new").ok());
  EXPECT_EQ(ContentsOf(**(*store)->OpenSession("new")), SessionContents());
}

TEST_F(DamageTest, ANewerFormatIsRefused) {
  Fill();
  const std::string key = layout::FormatKey();
  Tamper(Replacement(key, layout::Seal(key, layout::WriteNumber(layout::kFormat + 1))));
  const absl::Status status = Open().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ErrorReason(status), reason::kStoreFormatNewer);
  EXPECT_EQ(GetErrorDetail(status)->Find("found"), absl::StrCat(layout::kFormat + 1));
  EXPECT_EQ(GetErrorDetail(status)->Find("supported"), absl::StrCat(layout::kFormat));
}

TEST_F(DamageTest, AStoreThatDoesNotSayItsFormatIsDamaged) {
  Fill();
  Tamper(Deletion(layout::FormatKey()));
  EXPECT_EQ(ErrorReason(Open().status()), reason::kStoreDamaged);
}

TEST_F(DamageTest, ADirectoryIsForOneStoreAtATime) {
  const auto store = Open();
  ASSERT_EQ(store.status(), absl::OkStatus());
  const absl::Status status = Open().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ErrorReason(status), reason::kStoreInUse);
  EXPECT_EQ(GetErrorDetail(status)->Find("pid"), absl::StrCat(getpid()));
}

TEST_F(DamageTest, ADirectoryThatCannotBeMadeIsAnError) {
  EXPECT_EQ(ErrorReason(OpenRocksDb({directory_.path() + "/none/store"}).status()), reason::kStoreFailed);
}

TEST_F(DamageTest, ALogThatLostSyncedWritesIsDamagedUntilSomebodyAcceptsIt) {
  Fill();
  fs::resize_file(TheLog(), fs::file_size(TheLog()) - 1);
  for (int attempt = 0; attempt < 2; ++attempt) {
    EXPECT_EQ(ErrorReason(Open().status()), reason::kStoreDamaged) << "opening it once does not heal it";
  }
  fs::remove(directory_.path() + "/dynmesh.synced");
  const auto store = Open();
  ASSERT_EQ(store.status(), absl::OkStatus());
  EXPECT_THAT(ContentsOf(**(*store)->OpenSession("left")).records,
              ElementsAre(Pair(3, "left3"), Pair(4, "left4")));
}

TEST_F(DamageTest, AMissingDatabaseIsNoNewStore) {
  Fill();
  fs::remove_all(directory_.path() + "/rocksdb");
  EXPECT_EQ(ErrorReason(Open().status()), reason::kStoreDamaged);
}

TEST(SyncedMarkTest, KeepsItsNumber) {
  const TemporaryDirectory directory;
  const std::string path = directory.path() + "/mark";
  EXPECT_EQ((*SyncedMark::Open(path))->number(), 0u);
  EXPECT_TRUE((*SyncedMark::Open(path))->Set(300).ok());
  EXPECT_EQ((*SyncedMark::Open(path))->number(), 300u);
}

TEST(SyncedMarkTest, IsDamagedWhenItIsOfAnotherSize) {
  const TemporaryDirectory directory;
  const std::string path = directory.path() + "/mark";
  for (const int size : {15, 17, 40}) {
    fs::remove(path);
    EXPECT_TRUE((*SyncedMark::Open(path))->Set(300).ok());
    fs::resize_file(path, size);
    EXPECT_EQ(ErrorReason(SyncedMark::Open(path).status()), reason::kStoreDamaged) << size;
  }
}

}  // namespace
}  // namespace dynmesh::testing
