// Editors that read, think and write at the same time, each in a region of its own choice, with
// ConflictPolicy::kTouched. Meant for ThreadSanitizer, and true without it.
//
// DYNMESH_EDITOR_BATCHES: how many each editor makes (default 120).

#include <algorithm>
#include <barrier>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "absl/strings/str_split.h"
#include "core/mesh/validate.h"
#include "tests/session/session_support.h"
#include "tests/support/meshes.h"

namespace dynmesh::testing {
namespace {

constexpr int kMaxTries = 100'000;  ///< of one batch: far beyond what is fair
const AttributeSpec kCount = {"count", EntityKind::kVertex, AttributeType::kInt32, 1};

int NumBatches() {
  const char* batches = std::getenv("DYNMESH_EDITOR_BATCHES");
  return batches != nullptr ? std::atoi(batches) : 120;
}

int32_t CountAt(const Mesh& mesh, Slot vertex) {
  int32_t count;
  std::memcpy(&count, mesh.attributes()[0].Row(vertex).data(), sizeof(count));
  return count;
}

/// Adds one to the counters of some vertices near each other, moves one of these, and now and then puts a
/// cell there in place of itself. Waits for the others between reading and writing, when it first tries.
class CountingEditor {
 public:
  struct Region {
    Slot begin, end;  ///< vertices
  };

  CountingEditor(Session& session, Region region, std::barrier<>& all_have_read, uint32_t seed)
      : session_(session), region_(region), all_have_read_(all_have_read), rng_(seed) {}

  void Run() {
    const int batches = NumBatches();
    for (int batch = 0; batch < batches; ++batch) {
      tries_ = 0;
      while (!TryBatch()) {
        if (++tries_ < kMaxTries) continue;
        all_have_read_.arrive_and_drop();
        FAIL() << "this editor never gets through";
      }
    }
  }

  int64_t sum() const { return sum_; }
  int num_refusals() const { return num_refusals_; }

 private:
  int Uniform(int below) { return std::uniform_int_distribution<int>(0, below - 1)(rng_); }

  /// False when somebody was faster.
  bool TryBatch() {
    std::vector<Edit> edits;
    ApplyOptions options{.conflict_policy = ConflictPolicy::kTouched};
    const absl::Status read = session_.Read([&](const SessionView& view) {
      options.as_of_revision = view.mesh.revision();
      edits = Think(view.mesh);
      return absl::OkStatus();
    });
    EXPECT_TRUE(read.ok()) << read;
    if (tries_ == 0) all_have_read_.arrive_and_wait();
    const auto applied = session_.Apply(edits, options);
    if (applied.ok()) {
      sum_ += num_counted_;
      return true;
    }
    ++num_refusals_;
    ExpectRealConflict(applied.status(), options.as_of_revision);
    return false;
  }

  std::vector<Edit> Think(const Mesh& mesh) {
    SetAttributeEdit set{kCount, {}, {}};
    const Slot first = region_.begin + Uniform(region_.end - region_.begin);
    for (Slot v = first; v < std::min<Slot>(first + 1 + Uniform(4), region_.end); ++v) {
      const int32_t next = CountAt(mesh, v) + 1;
      set.slots.push_back(v);
      const auto* bytes = reinterpret_cast<const uint8_t*>(&next);
      set.rows.insert(set.rows.end(), bytes, bytes + sizeof(next));
    }
    num_counted_ = set.slots.size();
    Point place = mesh.Position(VertexId(first));
    place[0] += 1e-6;
    std::vector<Edit> edits = {set, MoveVerticesEdit{{first}, {place}}};
    if (Uniform(3) == 0) ReplaceCell(mesh, first, edits);
    return edits;
  }

  void ReplaceCell(const Mesh& mesh, Slot vertex, std::vector<Edit>& edits) {
    for (EdgeId e : mesh.IncidentEdges(VertexId(vertex))) {
      for (FaceId f : mesh.IncidentFaces(e)) {
        const CellId c = mesh.IncidentCells(f)[0];
        std::vector<Slot> corners;
        for (VertexId v : mesh.Vertices(c)) corners.push_back(v.slot());
        if (*std::min_element(corners.begin(), corners.end()) < region_.begin) continue;
        if (*std::max_element(corners.begin(), corners.end()) >= region_.end) continue;
        edits.push_back(RemoveElementsEdit{EntityKind::kCell, {c.slot()}});
        edits.push_back(AddElementsEdit{ElementType::kTetrahedron, corners});
        return;
      }
    }
  }

  /// ABORTED, and each entity that it names has changed since.
  void ExpectRealConflict(const absl::Status& status, int64_t as_of) {
    EXPECT_EQ(RefusalOf(status), (Refusal{absl::StatusCode::kAborted, reason::kConflict})) << status;
    const std::vector<std::string> ids = absl::StrSplit(MetadataOf(status, "ids"), ',', absl::SkipEmpty());
    EXPECT_FALSE(ids.empty());
    const bool are_cells = MetadataOf(status, "kind") == "cell";
    const absl::Status read = session_.Read([&](const SessionView& view) {
      for (const std::string& id : ids) {
        const Slot slot = std::stoul(id);
        const Stamp changed = view.mesh.changed(are_cells ? EntityKind::kCell : EntityKind::kVertex).At(slot);
        const Stamp counted = are_cells ? 0 : view.mesh.attributes()[0].stamps().At(slot);
        EXPECT_GT(std::max(changed, counted), as_of) << MetadataOf(status, "kind") << " " << slot;
      }
      return absl::OkStatus();
    });
    EXPECT_TRUE(read.ok()) << read;
  }

  Session& session_;
  const Region region_;
  std::barrier<>& all_have_read_;
  std::mt19937 rng_;
  int tries_ = 0;
  int64_t num_counted_ = 0;
  int64_t sum_ = 0;
  int num_refusals_ = 0;
};

class ConflictConcurrencyTest : public ::testing::TestWithParam<int> {
 protected:
  ConflictConcurrencyTest() {
    Mesh mesh = TetGrid(3, 1, 1);  // an import, so that it cannot be undone
    EXPECT_TRUE(session_->Adopt(mesh).ok());
    MustApply(*session_, {AddAttributeEdit{kCount}});
  }

  /// Lets editors run at once; returns how often they were refused. Fails the test unless every accepted
  /// batch counts, and the mesh is sound.
  int Run(const std::vector<CountingEditor::Region>& regions) {
    std::vector<std::unique_ptr<CountingEditor>> editors;
    std::vector<std::thread> threads;
    std::barrier all_have_read(static_cast<std::ptrdiff_t>(regions.size()));
    for (const auto& region : regions) {
      const uint32_t seed = 100 + editors.size();
      editors.push_back(std::make_unique<CountingEditor>(*session_, region, all_have_read, seed));
    }
    for (auto& editor : editors) threads.emplace_back([&editor] { editor->Run(); });
    for (std::thread& thread : threads) thread.join();
    int64_t expected = 0;
    int num_refusals = 0;
    for (const auto& editor : editors) {
      expected += editor->sum();
      num_refusals += editor->num_refusals();
    }
    const absl::Status read = session_->Read([&](const SessionView& view) {
      int64_t actual = 0;
      view.mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot v) { actual += CountAt(view.mesh, v); });
      EXPECT_EQ(actual, expected) << "an update was lost";
      EXPECT_THAT(Validate(view.mesh), ::testing::IsEmpty());
      EXPECT_EQ(view.mesh.NumLive(EntityKind::kCell), 18u);
      return absl::OkStatus();
    });
    EXPECT_TRUE(read.ok()) << read;
    return num_refusals;
  }

  Daemon daemon_;
  const SessionPtr session_ = daemon_.NewSession();
};

TEST_P(ConflictConcurrencyTest, InOverlappingRegionsNoUpdateIsLost) {
  const int num_refusals = Run(std::vector<CountingEditor::Region>(GetParam(), {0, 16}));
  EXPECT_GT(num_refusals, 0);
  EXPECT_EQ(session_->revision(), 2 + int64_t{GetParam()} * NumBatches())
      << "each accepted batch is one revision";
}

INSTANTIATE_TEST_SUITE_P(Editors, ConflictConcurrencyTest, ::testing::Values(2, 4));

TEST_F(ConflictConcurrencyTest, InDisjointRegionsNobodyIsRefused) { EXPECT_EQ(Run({{0, 8}, {8, 16}}), 0); }

TEST_F(ConflictConcurrencyTest, UndoingAndEditingAtOnceLeavesASoundMesh) {
  std::vector<std::thread> threads;
  std::barrier alone(1);
  CountingEditor editor(*session_, {0, 16}, alone, 7);
  threads.emplace_back([&] { editor.Run(); });
  threads.emplace_back([&] {
    for (int i = 0, batches = NumBatches(); i < batches; ++i) {
      const HistoryMove move = i % 3 == 2 ? HistoryMove::kRedo : HistoryMove::kUndo;
      const auto moved = session_->MoveInHistory(move, {.validate_only = i % 2 == 0});
      if (!moved.ok()) {
        EXPECT_EQ(moved.status().code(), absl::StatusCode::kFailedPrecondition) << moved.status();
      }
    }
  });
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(session_
                  ->Read([](const SessionView& view) {
                    EXPECT_THAT(Validate(view.mesh), ::testing::IsEmpty());
                    return absl::OkStatus();
                  })
                  .ok());
}

}  // namespace
}  // namespace dynmesh::testing
