#include "tests/session/session_support.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "core/codec/codec.h"
#include "core/mesh/error.h"
#include "tests/support/meshes.h"

#if defined(__SANITIZE_THREAD__)
// A status that threads share is counted by code inside the distribution's Abseil, which ThreadSanitizer does
// not see: it takes the last owner's delete for a race with the other owners.
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() { return "race:absl::*::Status::Unref\n"; }
#endif

namespace dynmesh::testing {
namespace {

const AttributeSpec kQuality{"quality", EntityKind::kVertex,   AttributeType::kFloat64,
                             2,         AttributePolicy::kMax, std::vector<uint8_t>(16, 1)};

template <typename Fn>
void ForEachElement(const Mesh& mesh, Fn fn) {
  for (EntityKind kind : {EntityKind::kEdge, EntityKind::kFace, EntityKind::kCell}) {
    mesh.slots(kind).live().ForEach([&](Slot slot) {
      if (mesh.IsElement({kind, slot})) fn(EntityId(kind, slot));
    });
  }
}

std::vector<Slot> SlotsOf(absl::Span<const VertexId> vertices) {
  std::vector<Slot> slots;
  for (VertexId v : vertices) slots.push_back(v.slot());
  return slots;
}

}  // namespace

Daemon::Daemon(const Limits& limits, std::unique_ptr<Store> store, const SessionLogOptions& log_options)
    : quick_({"quick", 3, limits.max_queued_tasks}),
      heavy_({"heavy", 2, limits.max_queued_tasks}),
      workers_{&quick_, &heavy_, &timer_},
      registry_(limits, workers_, std::move(store), log_options) {
  const absl::Status added = registry_.AddStored();
  EXPECT_TRUE(added.ok()) << added;
}

Daemon::~Daemon() {
  registry_.Drain();
  timer_.Stop();
  quick_.Stop();
  heavy_.Stop();
}

SessionPtr Daemon::NewSession(const std::string& name, const SessionSettings& settings) {
  const auto info = registry_.Create(name, settings, "");
  EXPECT_TRUE(info.ok()) << info.status();
  return *registry_.Find(name);
}

Mesh ByDimension(const Mesh& mesh) {
  Mesh copy;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    EXPECT_TRUE(copy.AddVertex(mesh.Position(VertexId(slot))).ok());
  });
  ForEachElement(mesh,
                 [&](EntityId id) { EXPECT_TRUE(copy.AddElement(mesh.Type(id), mesh.VerticesOf(id)).ok()); });
  Commit(copy);
  return copy;
}

std::vector<Edit> EditsOf(const Mesh& mesh) {
  constexpr size_t kFew = 16;  // vertices of one edit, so that they keep their order
  std::vector<Edit> edits;
  AddVerticesEdit vertices;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    vertices.positions.push_back(mesh.Position(VertexId(slot)));
    if (vertices.positions.size() == kFew) edits.push_back(std::exchange(vertices, {}));
  });
  edits.push_back(vertices);
  ForEachElement(mesh, [&](EntityId id) {
    AddElementsEdit edit{mesh.Type(id), SlotsOf(mesh.VerticesOf(id))};
    for (Slot& slot : edit.vertices) slot |= kNewVertex;
    edits.push_back(edit);
  });
  return edits;
}

std::shared_ptr<const BatchResult> MustApply(Session& session, const std::vector<Edit>& edits,
                                             const ApplyOptions& options) {
  const auto result = session.Apply(edits, options);
  EXPECT_TRUE(result.ok()) << result.status();
  return result.ok() ? *result : std::make_shared<const BatchResult>();
}

Checksum ChecksumOf(const Session& session) {
  Checksum checksum;
  const absl::Status read = session.Read([&](const SessionView& view) {
    checksum = view.mesh.checksum();
    return absl::OkStatus();
  });
  EXPECT_TRUE(read.ok()) << read;
  return checksum;
}

Edit AddSomeVertices(int n) {
  AddVerticesEdit edit;
  for (int i = 0; i < n; ++i) edit.positions.push_back({1.0 * i, 0.5 * i * i, 1.0 / (i + 1)});
  return edit;
}

std::vector<Edit> AddTet() {
  const auto vertex = [](Slot k) { return kNewVertex | k; };
  return {AddSomeVertices(4),
          AddElementsEdit{ElementType::kTetrahedron, {vertex(0), vertex(1), vertex(2), vertex(3)}}};
}

Refusal RefusalOf(const absl::Status& status) { return {status.code(), ErrorReason(status)}; }

std::string MetadataOf(const absl::Status& status, absl::string_view key) {
  const auto detail = GetErrorDetail(status);
  return detail ? std::string(detail->Find(key)) : "";
}

std::vector<Edit> RandomBatches::Next() {
  batch_.clear();
  new_vertices_ = 0;
  const int size = 1 + Uniform(4);
  for (int i = 0; i < size; ++i) batch_.push_back(AnyEdit());
  return batch_;
}

Edit RandomBatches::AnyEdit() {
  const int choice = Uniform(10);
  if (live_[0].size() < 8 || choice == 0) {
    const int n = 4 + Uniform(5);
    new_vertices_ += n;
    AddVerticesEdit edit;
    for (int i = 0; i < n; ++i) edit.positions.push_back(AnyPoint());
    return edit;
  }
  if (choice == 1) return MoveVerticesEdit{{live_[0][Uniform(live_[0].size())]}, {AnyPoint()}};
  if (choice == 2) return AttributeEdit();
  if (choice == 9) return RemoveVerticesEdit{{live_[0][Uniform(live_[0].size())]}};
  if (choice <= 4) {
    const EntityKind kind = kEntityKinds[1 + Uniform(3)];
    if (live_[Dimension(kind)].size() > batch_.size()) return RemoveElement(kind);
  }
  return AddElements();
}

Slot RandomBatches::AnyVertex() {
  if (new_vertices_ > 0 && Uniform(3) == 0) return kNewVertex | Uniform(new_vertices_);
  return live_[0][Uniform(live_[0].size())];
}

Point RandomBatches::AnyPoint() {
  std::uniform_real_distribution<double> coordinate(-1, 1);
  return {coordinate(rng_), coordinate(rng_), coordinate(rng_)};
}

Edit RandomBatches::AddElements() {
  AddElementsEdit edit{kElementTypes[Uniform(kNumElementTypes)], {}};
  const int n = 1 + Uniform(3);
  for (int i = 0; i < n * NumVertices(edit.type); ++i) edit.vertices.push_back(AnyVertex());
  return edit;
}

Edit RandomBatches::RemoveElement(EntityKind kind) {
  // From the end of the list, one place further for each edit before: so no batch removes one twice.
  const auto& live = live_[Dimension(kind)];
  return RemoveElementsEdit{kind, {live[live.size() - 1 - batch_.size()]}};
}

Edit RandomBatches::AttributeEdit() {
  if (!has_attribute_) {
    has_attribute_ = true;
    return AddAttributeEdit{kQuality};
  }
  SetAttributeEdit edit{kQuality, {live_[0][Uniform(live_[0].size())]}, std::vector<uint8_t>(16)};
  edit.rows[0] = Uniform(256);
  return edit;
}

void RandomBatches::Applied(const BatchResult& result) {
  for (size_t i = 0; i < batch_.size(); ++i) {
    if (const auto* removed = std::get_if<RemoveElementsEdit>(&batch_[i])) {
      auto& live = live_[Dimension(removed->kind)];
      live.erase(std::find(live.begin(), live.end(), removed->elements[0]));
    }
    if (const auto* removed = std::get_if<RemoveVerticesEdit>(&batch_[i]))
      std::erase(live_[0], removed->vertices[0]);
    const auto* added = std::get_if<AddElementsEdit>(&batch_[i]);
    const int kind = added == nullptr ? 0 : Dimension(KindOf(added->type));
    const auto& slots = result.results[i].new_slots;
    live_[kind].insert(live_[kind].begin(), slots.begin(), slots.end());
  }
}

RecordingSink::~RecordingSink() {
  if (!begun_) return;
  follower_->End(absl::CancelledError("the test is over"));
  bool by_hand;
  {
    MutexLock lock(&mu_);
    AwaitThat(&mu_, changed_, [this] { return ended_ || unacknowledged_ != nullptr; });
    by_hand = !ended_ && acknowledge_ == Acknowledge::kByHand;
  }
  if (by_hand) follower_->OnSent(false);
  EXPECT_FALSE(AwaitEnd().ok());
}

absl::Status RecordingSink::Follow(const SessionPtr& session, const FollowOptions& options) {
  follower_ = std::make_shared<Follower>(session, options, this);
  const absl::Status begun = follower_->Begin();
  begun_ = begun.ok();
  return begun;
}

void RecordingSink::Send(PayloadPtr payload) {
  MutexLock lock(&mu_);
  EXPECT_EQ(unacknowledged_, nullptr) << "a second payload in flight";
  EXPECT_FALSE(ended_) << "a payload after the end";
  unacknowledged_ = payload;
  changed_.NotifyAll();
  if (acknowledge_ == Acknowledge::kAtOnce) {
    workers_.quick->Post([this] { TakeOne(); });
  }
}

void RecordingSink::End(const absl::Status& status) {
  MutexLock lock(&mu_);
  EXPECT_FALSE(ended_) << "a second end";
  ended_ = true;
  end_ = status;
  changed_.NotifyAll();
}

PayloadPtr RecordingSink::TakeOne() {
  PayloadPtr taken;
  {
    MutexLock lock(&mu_);
    if (!AwaitThat(&mu_, changed_, [this] { return unacknowledged_ != nullptr; })) {
      ADD_FAILURE() << "no payload came";
      return nullptr;
    }
    taken = std::move(unacknowledged_);
    unacknowledged_ = nullptr;
    Absorb(*taken);
  }
  follower_->OnSent(true);
  return taken;
}

void RecordingSink::Absorb(const Payload& payload) {
  payloads_.push_back(std::make_shared<Payload>(payload));
  auto delta = DecodeDelta(payload.delta);
  if (delta.ok()) {
    EXPECT_EQ(delta->from_revision, payload.from_revision);
    EXPECT_EQ(delta->to_revision, payload.revision);
    EXPECT_EQ(delta->consistent, payload.consistent);
  }
  const absl::Status applied = delta.ok() ? mirror_.Apply(*delta) : delta.status();
  if (error_.ok()) error_ = applied;
  changed_.NotifyAll();
}

void RecordingSink::AwaitUnacknowledged() {
  MutexLock lock(&mu_);
  EXPECT_TRUE(AwaitThat(&mu_, changed_, [this] { return unacknowledged_ != nullptr; })) << "no payload came";
}

void RecordingSink::AwaitRevision(int64_t revision) {
  MutexLock lock(&mu_);
  const auto reached = [&] { return mirror_.revision() >= revision && !payloads_.empty(); };
  EXPECT_TRUE(AwaitThat(&mu_, changed_, reached))
      << "stuck at revision " << mirror_.revision() << ", waiting for " << revision << ", error " << error_;
}

absl::Status RecordingSink::AwaitEnd() {
  MutexLock lock(&mu_);
  EXPECT_TRUE(AwaitThat(&mu_, changed_, [this] { return ended_; })) << "no end came";
  return end_;
}

Checksum RecordingSink::mirror_checksum() {
  MutexLock lock(&mu_);
  return mirror_.checksum();
}

int64_t RecordingSink::mirror_revision() {
  MutexLock lock(&mu_);
  return mirror_.revision();
}

std::vector<PayloadPtr> RecordingSink::payloads() {
  MutexLock lock(&mu_);
  return payloads_;
}

absl::Status RecordingSink::error() {
  MutexLock lock(&mu_);
  return error_;
}

void TestMonitor::OnProgress(uint64_t done, uint64_t total) {
  EXPECT_GT(done, last_done_);
  EXPECT_LE(done, total);
  last_done_ = done;
  if (++reports_ == cancel_at_) cancelled_ = true;
}

void StageMesh(const Mesh& mesh, StagedMesh& staged, std::mt19937& rng) {
  const auto cut = [&](std::string bytes, size_t record, auto add) {
    while (!bytes.empty()) {
      const size_t records = 1 + rng() % (bytes.size() / record);
      EXPECT_TRUE(add(bytes.substr(0, records * record)).ok());
      bytes.erase(0, records * record);
    }
  };
  std::vector<Point> positions;
  mesh.slots(EntityKind::kVertex).live().ForEach([&](Slot slot) {
    positions.push_back(mesh.Position(VertexId(slot)));
  });
  std::string positions_bytes = BytesOf(positions);
  const bool vertices_last = rng() % 2 == 0;
  const auto add_positions = [&](std::string piece) { return staged.AddPositions(std::move(piece)); };
  if (!vertices_last) cut(positions_bytes, sizeof(Point), add_positions);
  std::vector<std::pair<ElementType, std::string>> runs;
  ForEachElement(mesh, [&](EntityId id) {
    if (runs.empty() || runs.back().first != mesh.Type(id)) runs.push_back({mesh.Type(id), ""});
    runs.back().second += BytesOf(SlotsOf(mesh.VerticesOf(id)));
  });
  for (auto& [type, bytes] : runs) {
    cut(bytes, NumVertices(type) * sizeof(Slot),
        [&staged, type = type](std::string piece) { return staged.AddElements(type, std::move(piece)); });
  }
  if (vertices_last) cut(positions_bytes, sizeof(Point), add_positions);
}

}  // namespace dynmesh::testing
