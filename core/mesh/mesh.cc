#include "core/mesh/mesh.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/mesh/vector.h"

namespace dynmesh {
namespace {

/// Where a cell finds each of its edges: position `edge` of local face `face`. First come, so that the
/// six edges of a tetrahedron come from three faces.
struct EdgeSource {
  uint8_t face = 0;
  uint8_t edge = 0;
};
using EdgeSources = std::array<std::array<EdgeSource, kMaxElementEdges>, kNumElementTypes + 1>;

EdgeSources MakeEdgeSources() {
  EdgeSources sources{};
  for (ElementType type : kElementTypes) {
    const ElementTemplate& shape = TemplateOf(type);
    for (int face = shape.num_faces - 1; face >= 0; --face) {
      for (int k = 0; k < shape.faces[face].size; ++k) {
        sources[static_cast<int>(type)][shape.faces[face].edges[k]] = {static_cast<uint8_t>(face),
                                                                       static_cast<uint8_t>(k)};
      }
    }
  }
  return sources;
}

const EdgeSources kEdgeSources = MakeEdgeSources();

absl::Status BornLater(EntityId id, Stamp born) {
  return MakeError(absl::StatusCode::kNotFound, reason::kEntityRemoved,
                   absl::StrCat(EntityKindName(id.kind), " ", id.slot, " is one that revision ", born,
                                " made, after its id was read"),
                   {{"kind", std::string(EntityKindName(id.kind))}, {"ids", absl::StrCat(id.slot)}});
}

absl::Status NonFinitePosition() {
  return InvalidArgument(reason::kNonFinite, "a coordinate is NaN or infinite");
}

}  // namespace

Mesh::Mesh(const MeshOptions& options) : options_(options) {}

// ---- Liveness and reading ----

absl::Status Mesh::CheckLive(EntityId id, int64_t as_of_revision) const {
  const Slots& slots = this->slots(id.kind);
  if (slots.IsLive(id.slot) && slots.Born(id.slot) <= as_of_revision) return absl::OkStatus();
  if (slots.IsLive(id.slot)) return BornLater(id, slots.Born(id.slot));
  return EntityNotFound(slots.Born(id.slot) == 0 ? reason::kUnknownEntity : reason::kEntityRemoved, id);
}

absl::Span<const VertexId> Mesh::VerticesOf(EntityId id) const {
  switch (id.kind) {
    case EntityKind::kEdge:
      return Vertices(EdgeId(id.slot));
    case EntityKind::kFace:
      return Vertices(FaceId(id.slot));
    default:
      return Vertices(CellId(id.slot));
  }
}

EdgeId Mesh::Edge(CellId c, int local_edge) const {
  const EdgeSource source = kEdgeSources[static_cast<int>(Type(c))][local_edge];
  const OrientedFace oriented = Faces(c)[source.face];
  const auto edges = Edges(oriented.face());
  return edges[oriented.code().StoredEdge(source.edge, edges.size())];
}

// ---- Vertices ----

absl::StatusOr<VertexId> Mesh::AddVertex(const Point& position) {
  if (!IsFinite(position)) return NonFinitePosition();
  const uint32_t limit = options_.limits.max_slots[0];
  if (!slots(EntityKind::kVertex).CanAllocate(1, limit)) {
    return LimitExceeded("max_vertices", limit, uint64_t{limit} + 1);
  }
  JournalEntry entry;
  const VertexId v(NewSlot(EntityKind::kVertex, entry));
  FillVertex(v, position);
  Record(entry);
  return v;
}

absl::Status Mesh::RemoveVertex(VertexId v) {
  DYNMESH_RETURN_IF_ERROR(CheckLive(v));
  if (const auto edges = IncidentEdges(v); !edges.empty()) {
    return FailedPrecondition(
        reason::kVertexInUse,
        absl::StrCat("vertex ", v.slot(), " still has ", edges.size(), " incident edges"),
        {{"kind", "vertex"}, {"ids", absl::StrCat(v.slot())}});
  }
  DestroyVertex(v);
  return absl::OkStatus();
}

absl::Status Mesh::MoveVertex(VertexId v, const Point& position) {
  DYNMESH_RETURN_IF_ERROR(CheckLive(v));
  if (!IsFinite(position)) return NonFinitePosition();
  MoveTo(v, position);
  return absl::OkStatus();
}

void Mesh::MoveTo(VertexId v, const Point& position) {
  Record(
      {JournalOp::kMoveVertex, EntityKind::kVertex, v.slot(), 0, changed(EntityKind::kVertex).At(v.slot())});
  if (journaling()) journal_.positions.push_back(Position(v));
  checksum_.geometry -= Checksum::PositionTerm(v.slot(), Position(v));
  positions_[v.slot()] = position;
  checksum_.geometry += Checksum::PositionTerm(v.slot(), position);
  Touch(v);
}

// ---- Attributes ----

int Mesh::FindAttribute(absl::string_view name, EntityKind kind) const {
  for (size_t i = 0; i < attributes_.size(); ++i) {
    if (attributes_[i].spec().kind == kind && attributes_[i].spec().name == name) return i;
  }
  return -1;
}

absl::Status Mesh::AddAttribute(const AttributeSpec& spec) {
  DYNMESH_RETURN_IF_ERROR(CheckAttributeSpec(spec));
  if (FindAttribute(spec.name, spec.kind) >= 0) {
    return MakeError(absl::StatusCode::kAlreadyExists, reason::kAttributeExists,
                     absl::StrCat(EntityKindName(spec.kind), " attribute '", spec.name, "' exists already"),
                     {{"attribute", spec.name}});
  }
  if (attributes_.size() >= kMaxAttributeColumns) {
    return LimitExceeded("max_attributes", kMaxAttributeColumns, attributes_.size() + 1);
  }
  attributes_.emplace_back(spec, next_stamp());
  Record({JournalOp::kAddAttribute, spec.kind, 0, 0, 0});
  return absl::OkStatus();
}

absl::Status Mesh::SetAttribute(int column, Slot slot, absl::Span<const uint8_t> row) {
  const AttributeSpec& spec = attributes_[column].spec();
  DYNMESH_RETURN_IF_ERROR(CheckLive({spec.kind, slot}));
  if (row.size() != static_cast<size_t>(spec.row_bytes())) {
    return InvalidArgument(reason::kBadArrayLength,
                           absl::StrCat("a row of attribute '", spec.name, "' has ", spec.row_bytes(),
                                        " bytes, not ", row.size()),
                           {{"attribute", spec.name}});
  }
  if (!CheckFinite(spec, row).ok()) {
    return InvalidArgument(reason::kNonFinite,
                           absl::StrCat("a value of attribute '", spec.name, "' is NaN or infinite"),
                           {{"attribute", spec.name}});
  }
  WriteAttribute(column, slot, row);
  return absl::OkStatus();
}

void Mesh::WriteAttribute(int column, Slot slot, absl::Span<const uint8_t> row) {
  AttributeColumn& values = attributes_[column];
  if (journaling()) {
    Record({JournalOp::kSetAttribute, values.spec().kind, slot, static_cast<uint32_t>(column),
            values.stamps().At(slot)});
    const auto before = values.Row(slot);
    journal_.rows.insert(journal_.rows.end(), before.begin(), before.end());
  }
  values.SetRow(slot, row, next_stamp());
}

void Mesh::ResetAttributes(EntityId id) {
  for (size_t column = 0; column < attributes_.size(); ++column) {
    if (attributes_[column].spec().kind != id.kind) continue;
    const auto row = attributes_[column].default_row();
    if (attributes_[column].Row(id.slot) != row) WriteAttribute(column, id.slot, row);
  }
}

// ---- Stored relations ----

absl::Status Mesh::StoreRelation(Relation relation, bool on, WorkMeter& meter) {
  if (StorableIndex(relation) == kNumStorableRelations) {
    return InvalidArgument(reason::kBadArgument,
                           absl::StrCat("the relation ", EntityKindName(relation.from), " -> ",
                                        EntityKindName(relation.to), " cannot be switched"));
  }
  if (stored_.Has(relation) == on) return absl::OkStatus();
  if (on) return stored_.Build(*this, relation, meter);
  stored_.Drop(relation);
  return absl::OkStatus();
}

Mesh::FixedRows Mesh::FixedRowsOf(Relation relation) const {
  const auto rows = [](const auto* ids, size_t stride) {
    static_assert(sizeof(*ids) % sizeof(Slot) == 0);
    return FixedRows{reinterpret_cast<const Slot*>(ids), stride};
  };
  if (relation == Relation{EntityKind::kEdge, EntityKind::kVertex}) return rows(edge_vertices_.data(), 2);
  if (relation.from == EntityKind::kFace && face_stride_ == 3) {
    if (relation.to == EntityKind::kVertex) return rows(face_vertices_.data(), 3);
    if (relation.to == EntityKind::kEdge) return rows(face_edges_.data(), 3);
  }
  if (relation == Relation{EntityKind::kCell, EntityKind::kVertex} && IsTetrahedral()) {
    return rows(cell_vertices_.data(), 4);
  }
  const CellEdgeRows* edges = stored_.cell_edges();
  if (relation == kStorableRelations[0] && edges != nullptr && edges->stride() != 0) {
    return rows(edges->data(), edges->stride());
  }
  return {};
}

// ---- Batches ----

void Mesh::BeginBatch() {
  journal_.Clear();
  batch_open_ = true;
}

absl::Status Mesh::Commit() {
  if (revision_ + 1 >= kMaxStamp) return LimitExceeded("max_revision", kMaxStamp - 1, revision_ + 1);
  ++revision_;
  for (Slots& slots : slots_) slots.EndQuarantine();
  journal_.Clear();
  batch_open_ = false;
  return absl::OkStatus();
}

}  // namespace dynmesh
