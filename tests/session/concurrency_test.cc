// Editors, readers and followers at once. Meant for ThreadSanitizer, and true without it.

#include <atomic>
#include <thread>

#include "core/mesh/validate.h"
#include "server/session/export.h"
#include "server/session/queries.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"
#include "tests/support/oracle.h"

namespace dynmesh::testing {
namespace {

constexpr int kBatchesEach = 150;

/// Adds one tetrahedron by reading the revision and insisting on it, as often as it takes.
void AddTetInsisting(Session& session) {
  while (true) {
    ApplyOptions options;
    options.if_revision = session.revision();
    const auto result = session.Apply(AddTet(), options);
    if (result.ok()) return;
    ASSERT_EQ(RefusalOf(result), (Refusal{absl::StatusCode::kAborted, reason::kRevisionMismatch}));
  }
}

TEST(ConcurrencyTest, EditorsThatInsistOnTheRevisionLoseNothing) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  std::vector<std::thread> editors;
  for (int i = 0; i < 4; ++i) {
    editors.emplace_back([&] {
      for (int batch = 0; batch < kBatchesEach; ++batch) AddTetInsisting(*session);
    });
  }
  for (std::thread& editor : editors) editor.join();
  EXPECT_EQ(session->revision(), 4 * kBatchesEach);
  EXPECT_EQ(session->Info()->counts[3], 4u * kBatchesEach);
}

TEST(ConcurrencyTest, RetriesAtTheSameTimeApplyOnce) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  std::vector<std::thread> callers;
  std::atomic<int> first_answers{0};
  for (int i = 0; i < 4; ++i) {
    callers.emplace_back([&] {
      for (int batch = 0; batch < kBatchesEach; ++batch) {
        const auto result = session->Apply(AddTet(), {.request_id = "batch " + std::to_string(batch)});
        ASSERT_TRUE(result.ok()) << result.status();
        first_answers += (*result)->revision == batch + 1;
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(session->revision(), kBatchesEach);
}

TEST(ConcurrencyTest, ReadersSeeWholeRevisionsAndFollowersStayEqual) {
  const uint32_t seed = 4711;
  SCOPED_TRACE(seed);
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  std::vector<std::unique_ptr<RecordingSink>> sinks;
  for (Codec codec : {Codec::kUnspecified, Codec::kRaw, Codec::kZstd, Codec::kUnspecified}) {
    sinks.push_back(std::make_unique<RecordingSink>(daemon.workers(), RecordingSink::Acknowledge::kAtOnce));
    ASSERT_TRUE(sinks.back()->Follow(session, {.codec = codec}).ok());
  }
  std::atomic<bool> stop{false};
  std::vector<std::thread> editors, readers;
  for (int i = 0; i < 3; ++i) {
    editors.emplace_back([&, i] {
      RandomBatches batches(seed + i);
      for (int batch = 0; batch < kBatchesEach; ++batch) {
        const auto result = session->Apply(batches.Next(), {});
        result.ok() ? batches.Applied(**result) : batches.Refused();
      }
    });
  }
  readers.emplace_back([&] {
    while (!stop) {
      const auto info = session->Info();
      ASSERT_TRUE(info.ok());
      const auto exported = ExportSession(*session);
      ASSERT_TRUE(exported.ok());
      ASSERT_GE(exported->revision, info->revision);
    }
  });
  readers.emplace_back([&] {
    while (!stop) {
      ASSERT_TRUE(QueryNeighbors(*session, Relation{EntityKind::kVertex, EntityKind::kCell}, {}).ok());
      ASSERT_TRUE(session
                      ->Read([](const SessionView& view) {
                        EXPECT_THAT(Validate(view.mesh), ::testing::IsEmpty());
                        return absl::OkStatus();
                      })
                      .ok());
    }
  });
  for (std::thread& editor : editors) editor.join();
  stop = true;
  for (std::thread& reader : readers) reader.join();
  for (auto& sink : sinks) {
    sink->AwaitRevision(session->revision());
    EXPECT_TRUE(sink->error().ok()) << sink->error();
    EXPECT_EQ(sink->mirror_checksum(), ChecksumOf(*session));
  }
}

TEST(ConcurrencyTest, FollowersComeAndGoWhileTheSessionIsEditedAndDeleted) {
  Daemon daemon;
  for (int round = 0; round < 5; ++round) {
    const SessionPtr session = daemon.NewSession("s" + std::to_string(round));
    std::vector<std::thread> threads;
    for (int i = 0; i < 3; ++i) {
      threads.emplace_back([&] {
        for (int n = 0; n < 10; ++n) {
          RecordingSink sink(daemon.workers(), RecordingSink::Acknowledge::kAtOnce);
          const absl::Status begun = sink.Follow(session, {});
          EXPECT_TRUE(begun.ok() || ErrorReason(begun) == reason::kSessionDeleted) << begun;
        }
      });
    }
    threads.emplace_back([&] {
      for (int batch = 0; batch < 30; ++batch) {
        const auto result = session->Apply(AddTet(), {});
        EXPECT_TRUE(result.ok()) << result.status();
      }
      EXPECT_TRUE(daemon.registry().Delete(session->name(), "").ok());
    });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(session->followers().size(), 0u);
  }
}

TEST(ConcurrencyTest, OneOfManyImportsWins) {
  Daemon daemon;
  const SessionPtr session = daemon.NewSession();
  ImportGate gate(Limits{.max_concurrent_imports = 8});
  std::atomic<int> won{0};
  std::vector<std::thread> importers;
  for (int i = 0; i < 4; ++i) {
    importers.emplace_back([&, i] {
      const Mesh mesh = TetGrid(4, 4, 4 + i);
      std::mt19937 rng(i);
      const auto importer = Importer::Start(session, gate, {});
      if (!importer.ok()) return;
      StageMesh(mesh, (*importer)->staged(), rng);
      TestMonitor monitor;
      const auto outcome = (*importer)->Finish(monitor);
      if (outcome.ok()) {
        ++won;
        EXPECT_EQ(outcome->outcome->info.counts[3], mesh.NumLive(EntityKind::kCell));
      } else {
        EXPECT_EQ(ErrorReason(outcome.status()), reason::kSessionNotEmpty);
      }
    });
  }
  for (std::thread& importer : importers) importer.join();
  EXPECT_EQ(won, 1);
  EXPECT_EQ(session->revision(), 1);
}

}  // namespace
}  // namespace dynmesh::testing
