// What slots hold, into the arrays of a mesh. Links between them are made in the end (rebuild_links.cc).

#include "core/archive/rebuilder.h"

#include <algorithm>
#include <new>
#include <stdexcept>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "core/archive/part.h"

namespace dynmesh {
namespace {

/// About what a slot of each kind takes, with its share of the lists.
constexpr std::array<uint64_t, kNumEntityKinds> kSlotBytes = {96, 56, 64, 64};

/// Rows for what is added later, before arrays move: 1 in so many.
constexpr uint64_t kHeadroom = 16;

absl::Status WithinMemory(absl::FunctionRef<absl::Status()> fn) try {
  return fn();
} catch (const std::bad_alloc&) {
  return MakeError(absl::StatusCode::kResourceExhausted, reason::kLimitExceeded, "memory ran out",
                   {{"limit", "memory"}});
} catch (const std::length_error&) {
  return MakeError(absl::StatusCode::kResourceExhausted, reason::kLimitExceeded,
                   "a mesh would not fit into memory", {{"limit", "memory"}});
}

absl::Status PageDamaged(PageId page) {
  const std::string kind(EntityKindName(page.kind));
  return ArchiveDamaged(absl::StrCat("page ", page.index, " of kind ", kind, " is no page of a mesh"),
                        {{"kind", kind}, {"page", absl::StrCat(page.index)}});
}

absl::Status RecordDamaged(int64_t revision) {
  return ArchiveDamaged(absl::StrCat("the record of revision ", revision, " is none of a batch on this mesh"),
                        {{"revision", absl::StrCat(revision)}});
}

}  // namespace

Rebuilder::Rebuilder(ArchiveHead head, const RebuildOptions& options)
    : head_(std::move(head)), options_(options), mesh_(head_.options), fit_(head_.fit) {}

absl::StatusOr<Rebuilder> Rebuilder::Start(absl::string_view head, const RebuildOptions& options) {
  DYNMESH_ASSIGN_OR_RETURN(ArchiveHead decoded, DecodeHead(head));
  Rebuilder rebuilder(std::move(decoded), options);
  DYNMESH_RETURN_IF_ERROR(WithinMemory([&] { return rebuilder.Begin(); }));
  return rebuilder;
}

absl::Status Rebuilder::Begin() {
  std::array<uint64_t, kNumEntityKinds> rows;
  for (int kind = 0; kind < kNumEntityKinds; ++kind) {
    rows[kind] = head_.slot_limits[kind];
    DYNMESH_RETURN_IF_ERROR(Charge(rows[kind] * kSlotBytes[kind]));
    rows[kind] += rows[kind] / kHeadroom;
  }
  charged_slots_ = head_.slot_limits;
  mesh_.revision_ = head_.revision;
  Widen(head_.widths);
  mesh_.Reserve(rows);
  return AddColumns(head_.columns);
}

// ---- Pages ----

absl::Status Rebuilder::AddPage(absl::string_view page) {
  return WithinMemory([&] { return ReadPage(page); });
}

absl::Status Rebuilder::ReadPage(absl::string_view bytes) {
  DYNMESH_ASSIGN_OR_RETURN(const absl::string_view body, OpenPart(ArchivePart::kPage, bytes));
  ByteReader in(body);
  const EntityKind kind = in.Fixed<EntityKind>();
  const uint64_t index = in.Varint(), revision = in.Varint(), count = in.Varint();
  if (!in.ok() || !IsEntityKind(kind)) return ArchiveDamaged("a page of an archive does not say which it is");
  if (index >= head_.num_pages(kind)) return absl::OkStatus();
  const PageId page{kind, static_cast<uint32_t>(index)};
  const uint64_t begin = index * kPageSlots, max_slots = head_.options.limits.max_slots[Dimension(kind)];
  if (count < 1 || count > kPageSlots || begin + count > max_slots || revision > kMaxStamp) {
    return PageDamaged(page);
  }
  const Range range = {static_cast<Slot>(begin), static_cast<Slot>(begin + count),
                       static_cast<int64_t>(revision)};
  newest_page_ = std::max(newest_page_, range.revision);
  return ReadPageRows(page, range, in);
}

absl::Status Rebuilder::ReadPageRows(PageId page, const Range& range, ByteReader& in) {
  DYNMESH_RETURN_IF_ERROR(EnsureRows(page.kind, range.end));
  SlotRowReader rows(page.kind, head_.options.limits, RowContext::At(range.revision), in);
  SlotRow row;
  for (Slot slot = range.begin; slot < range.end; ++slot) {
    if (!rows.Read(row)) return PageDamaged(page);
    Put({page.kind, slot}, row);
  }
  const bool sound = ReadPageColumns(page.kind, range, in) && in.done();
  DYNMESH_RETURN_IF_ERROR(out_of_memory_);
  return sound ? absl::OkStatus() : PageDamaged(page);
}

// Columns that the head does not name were added since: records bring all their rows.
bool Rebuilder::ReadPageColumns(EntityKind kind, const Range& range, ByteReader& in) {
  uint64_t next_column = 0;
  for (uint64_t left = in.Varint(); left > 0; --left) {
    ColumnSection section;
    if (!ReadColumnSection(in, section) || section.column < next_column) return false;
    next_column = section.column + 1;
    if (section.column >= mesh_.attributes_.size()) continue;
    if (mesh_.attributes_[section.column].spec().kind != kind || !ReadColumn(section, range, nullptr))
      return false;
  }
  return true;
}

// ---- Records ----

absl::Status Rebuilder::AddRecord(absl::string_view record) {
  DYNMESH_ASSIGN_OR_RETURN(const RecordView view, ReadRecord(record));
  return AddRecord(view);
}

absl::Status Rebuilder::AddRecord(const RecordView& record) {
  if (record.revision <= head_.revision) return absl::OkStatus();
  return WithinMemory([&] { return ReadNextRecord(record); });
}

absl::Status Rebuilder::ReadNextRecord(const RecordView& record) {
  if (record.revision != revision() + 1) {
    return ArchiveDamaged(
        absl::StrCat("the record of revision ", record.revision, " cannot follow upon revision ", revision()),
        {{"revision", absl::StrCat(record.revision)}});
  }
  DYNMESH_RETURN_IF_ERROR(AddColumns(record.new_columns));
  Widen(record.widths);
  ByteReader in(record.body);
  for (EntityKind kind : kEntityKinds) DYNMESH_RETURN_IF_ERROR(ReadRuns(kind, record.revision, in));
  const bool sound = ReadRecordColumns(record.revision, in) && in.done();
  DYNMESH_RETURN_IF_ERROR(out_of_memory_);
  if (!sound) return RecordDamaged(record.revision);
  mesh_.revision_ = record.revision;
  fit_ = record.fit;
  return absl::OkStatus();
}

// A batch takes new slots in order: a run that leaves a gap would have memory taken for nothing.
absl::Status Rebuilder::ReadRuns(EntityKind kind, int64_t revision, ByteReader& in) {
  const uint32_t max_slots = head_.options.limits.max_slots[Dimension(kind)];
  SlotRowReader rows(kind, head_.options.limits, RowContext::At(revision), in);
  SlotRow row;
  uint64_t slot = 0;
  for (uint64_t left = in.Varint(); left > 0; --left) {
    const uint64_t gap = in.Varint(), count = in.Varint();
    if (gap > Limit(kind) || slot + gap > Limit(kind)) return RecordDamaged(revision);
    slot += gap;
    if (count < 1 || count > in.remaining() || slot + count > max_slots) return RecordDamaged(revision);
    DYNMESH_RETURN_IF_ERROR(EnsureRows(kind, static_cast<Slot>(slot + count)));
    changed_pages_.Add(kind, static_cast<Slot>(slot), static_cast<Slot>(slot + count));
    for (const uint64_t end = slot + count; slot < end; ++slot) {
      if (!rows.Read(row)) return RecordDamaged(revision);
      Put({kind, static_cast<Slot>(slot)}, row);
    }
  }
  return in.ok() ? absl::OkStatus() : RecordDamaged(revision);
}

bool Rebuilder::ReadRecordColumns(int64_t revision, ByteReader& in) {
  uint64_t next_column = 0;
  for (uint64_t left = in.Varint(); left > 0; --left) {
    ColumnSection section;
    if (!ReadColumnSection(in, section) || section.column < next_column) return false;
    next_column = section.column + 1;
    if (section.column >= mesh_.attributes_.size()) return false;
    const EntityKind kind = mesh_.attributes_[section.column].spec().kind;
    if (!ReadColumn(section, {0, Limit(kind), revision}, &changed_pages_)) return false;
  }
  return true;
}

// ---- Columns ----

absl::Status Rebuilder::AddColumns(absl::Span<const ColumnHead> columns) {
  for (const ColumnHead& column : columns) {
    if (mesh_.attributes_.size() >= kMaxAttributeColumns ||
        mesh_.FindAttribute(column.spec.name, column.spec.kind) >= 0) {
      return ArchiveDamaged(absl::StrCat("an archive names the column '", column.spec.name, "' in vain"),
                            {{"attribute", column.spec.name}});
    }
    mesh_.attributes_.emplace_back(column.spec, column.born);
  }
  return absl::OkStatus();
}

bool Rebuilder::ReadColumn(const ColumnSection& section, const Range& range, DirtyPages* changed) {
  AttributeColumn& column = mesh_.attributes_[section.column];
  ColumnRowReader rows(column, range.begin, range.revision, section.bytes);
  ColumnRow row;
  Slot charged_page = kNoSlot;
  for (uint64_t left = section.num_rows; left > 0; --left) {
    if (!rows.Read(range.end, row)) return false;
    if (row.slot / kPageSlots != std::exchange(charged_page, row.slot / kPageSlots)) {
      out_of_memory_ = Charge(column.BytesToSet({&row.slot, 1}));
      if (!out_of_memory_.ok()) return false;
      if (changed != nullptr) changed->Add(column.spec().kind, row.slot, row.slot + 1);
    }
    column.SetRow(row.slot, row.row, row.stamp);
  }
  return rows.done();
}

// ---- Slots ----

absl::Status Rebuilder::Charge(uint64_t bytes) {
  memory_bytes_ += bytes;
  if (memory_bytes_ > options_.max_memory_bytes) {
    return LimitExceeded("max_memory_bytes", options_.max_memory_bytes, memory_bytes_);
  }
  return options_.charge ? options_.charge(bytes) : absl::OkStatus();
}

absl::Status Rebuilder::EnsureRows(EntityKind kind, Slot end) {
  Slot& charged = charged_slots_[Dimension(kind)];
  if (end > charged) {
    DYNMESH_RETURN_IF_ERROR(Charge((end - charged) * kSlotBytes[Dimension(kind)]));
    charged = end;
  }
  mesh_.EnsureRow(kind, end - 1);
  return absl::OkStatus();
}

void Rebuilder::Widen(const RowWidths& widths) {
  mesh_.WidenFaces(widths.face);
  mesh_.WidenCells(widths.cell_vertices, widths.cell_faces);
}

void Rebuilder::Put(EntityId id, const SlotRow& row) {
  Slots& slots = mesh_.mutable_slots(id.kind);
  StampColumn& changed = mesh_.changed_[Dimension(id.kind)];
  row.live ? slots.PutLive(id.slot, row.born) : slots.PutDead(id.slot, row.born);
  if (row.changed != 0 || id.slot < changed.size()) changed.Touch(id.slot, row.changed);
  row.live ? PutContent(id, row) : PutNothing(id);
}

void Rebuilder::PutContent(EntityId id, const SlotRow& row) {
  if (id.kind == EntityKind::kVertex) {
    mesh_.positions_[id.slot] = row.position;
    return;
  }
  if (id.kind == EntityKind::kEdge) {
    mesh_.edge_vertices_[id.slot] = {VertexId(row.vertices[0]), VertexId(row.vertices[1])};
  } else if (id.kind == EntityKind::kFace) {
    mesh_.WidenFaces(row.num_vertices());
    const size_t at = size_t{id.slot} * mesh_.face_stride_;
    for (int k = 0; k < row.num_vertices(); ++k) {
      mesh_.face_vertices_[at + k] = VertexId(row.vertices[k]);
      mesh_.face_edges_[at + k] = EdgeId(row.parts[k]);
    }
  } else {
    const int num_faces = NumParts(row.type);
    mesh_.WidenCells(row.num_vertices(), num_faces);
    VertexId* vertices = &mesh_.cell_vertices_[size_t{id.slot} * mesh_.cell_vertex_stride_];
    OrientedFace* faces = &mesh_.cell_faces_[size_t{id.slot} * mesh_.cell_face_stride_];
    for (int k = 0; k < row.num_vertices(); ++k) vertices[k] = VertexId(row.vertices[k]);
    for (int k = 0; k < num_faces; ++k) faces[k] = OrientedFace(FaceId(row.parts[k]), FaceCode());
  }
  mesh_.flags(id) = static_cast<uint8_t>(row.type) | (row.element ? Mesh::kElementFlag : 0) |
                    (row.duplicate ? Mesh::kDuplicateFlag : 0);
}

// Dead edges and faces have no vertices, so that whoever refers to one is found out by these.
void Rebuilder::PutNothing(EntityId id) {
  if (id.kind == EntityKind::kVertex) {
    mesh_.positions_[id.slot] = {};
    return;
  }
  mesh_.flags(id) = 0;
  if (id.kind == EntityKind::kEdge) mesh_.edge_vertices_[id.slot].fill(VertexId());
  if (id.kind != EntityKind::kFace) return;
  std::fill_n(&mesh_.face_vertices_[size_t{id.slot} * mesh_.face_stride_], mesh_.face_stride_, VertexId());
}

}  // namespace dynmesh
