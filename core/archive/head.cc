#include "core/archive/head.h"

#include <utility>

#include "core/archive/page.h"
#include "core/archive/part.h"

namespace dynmesh {
namespace {

void WriteSpec(const AttributeColumn& column, ByteWriter& out) {
  const AttributeSpec& spec = column.spec();
  out.Varint(column.born());
  out.Fixed<uint8_t>(spec.name.size());
  out.Bytes(spec.name);
  out.Fixed<EntityKind>(spec.kind);
  out.Fixed<AttributeType>(spec.type);
  out.Fixed<uint8_t>(spec.components);
  out.Fixed<AttributePolicy>(spec.policy);
  out.Varint(spec.default_row.size());
  for (uint8_t byte : spec.default_row) out.Fixed<uint8_t>(byte);
}

bool ReadSpec(ByteReader& in, ColumnHead& column) {
  const uint64_t born = in.Varint();
  AttributeSpec& spec = column.spec;
  const absl::string_view name = in.Bytes(in.Fixed<uint8_t>());
  spec.name.assign(name.data(), name.size());
  spec.kind = in.Fixed<EntityKind>();
  spec.type = in.Fixed<AttributeType>();
  spec.components = in.Fixed<uint8_t>();
  spec.policy = in.Fixed<AttributePolicy>();
  const absl::string_view row = in.Bytes(in.Varint());
  spec.default_row.assign(row.begin(), row.end());
  column.born = static_cast<Stamp>(born);
  return in.ok() && born <= kMaxStamp && CheckAttributeSpec(spec).ok();
}

void WriteOptions(const MeshOptions& options, ByteWriter& out) {
  out.Fixed<uint8_t>(options.duplicates == DuplicatePolicy::kRefuse);
  for (uint32_t max_slots : options.limits.max_slots) out.Varint(max_slots);
}

bool ReadOptions(ByteReader& in, MeshOptions& options) {
  const uint8_t duplicates = in.Fixed<uint8_t>();
  options.duplicates = duplicates == 0 ? DuplicatePolicy::kKeep : DuplicatePolicy::kRefuse;
  bool sound = duplicates <= 1;
  for (uint32_t& max_slots : options.limits.max_slots) {
    const uint64_t value = in.Varint();
    sound &= value <= max_slots;  // the most that ids have room for
    max_slots = static_cast<uint32_t>(value);
  }
  return sound;
}

bool ReadSlotLimits(ByteReader& in, ArchiveHead& head) {
  bool sound = true;
  for (int kind = 0; kind < kNumEntityKinds; ++kind) {
    const uint64_t limit = in.Varint();
    sound &= limit <= head.options.limits.max_slots[kind];
    head.slot_limits[kind] = static_cast<Slot>(limit);
  }
  return sound;
}

bool ReadHead(ByteReader& in, ArchiveHead& head) {
  const uint64_t revision = in.Varint();
  head.revision = static_cast<int64_t>(revision);
  return revision < kMaxStamp && ReadOptions(in, head.options) && ReadWidths(in, head.widths) &&
         ReadSlotLimits(in, head) && ReadFit(in, head.fit) && ReadColumnHeads(in, head.columns) && in.done();
}

}  // namespace

uint32_t ArchiveHead::num_pages(EntityKind kind) const { return NumPages(slot_limits[Dimension(kind)]); }

std::string EncodeHead(const Mesh& mesh) {
  ByteWriter out;
  BeginPart(ArchivePart::kHead, out);
  out.Varint(mesh.revision());
  WriteOptions(mesh.options(), out);
  WriteWidths(RowWidths::Of(mesh), out);
  for (EntityKind kind : kEntityKinds) out.Varint(mesh.slots(kind).limit());
  WriteFit(mesh.FitNow(), out);
  WriteColumnHeads(mesh, 0, out);
  return SealPart(std::move(out));
}

absl::StatusOr<ArchiveHead> DecodeHead(absl::string_view bytes) {
  DYNMESH_ASSIGN_OR_RETURN(const absl::string_view body, OpenPart(ArchivePart::kHead, bytes));
  ByteReader in(body);
  ArchiveHead head;
  if (!ReadHead(in, head)) return ArchiveDamaged("the head of an archive does not say what a mesh is");
  return head;
}

void WriteFit(const BatchImage::Fit& fit, ByteWriter& out) {
  out.Fixed<uint64_t>(fit.checksum.topology);
  out.Fixed<uint64_t>(fit.checksum.geometry);
  for (uint32_t num_live : fit.num_live) out.Varint(num_live);
}

bool ReadFit(ByteReader& in, BatchImage::Fit& fit) {
  fit.checksum.topology = in.Fixed<uint64_t>();
  fit.checksum.geometry = in.Fixed<uint64_t>();
  bool sound = true;
  for (uint32_t& num_live : fit.num_live) {
    const uint64_t count = in.Varint();
    sound &= count < kNoSlot;
    num_live = static_cast<uint32_t>(count);
  }
  return sound && in.ok();
}

void WriteWidths(const RowWidths& widths, ByteWriter& out) {
  out.Fixed<uint8_t>(widths.face);
  out.Fixed<uint8_t>(widths.cell_vertices);
  out.Fixed<uint8_t>(widths.cell_faces);
}

bool ReadWidths(ByteReader& in, RowWidths& widths) {
  widths.face = in.Fixed<uint8_t>();
  widths.cell_vertices = in.Fixed<uint8_t>();
  widths.cell_faces = in.Fixed<uint8_t>();
  return widths.face >= 3 && widths.face <= kMaxFaceVertices && widths.cell_vertices >= 4 &&
         widths.cell_vertices <= kMaxElementVertices && widths.cell_faces >= 4 &&
         widths.cell_faces <= kMaxElementFaces;
}

void WriteColumnHeads(const Mesh& mesh, size_t first, ByteWriter& out) {
  out.Varint(mesh.attributes().size() - first);
  for (size_t i = first; i < mesh.attributes().size(); ++i) WriteSpec(mesh.attributes()[i], out);
}

bool ReadColumnHeads(ByteReader& in, std::vector<ColumnHead>& columns) {
  const uint64_t count = in.Varint();
  if (count > kMaxAttributeColumns) return false;
  columns.resize(count);
  for (ColumnHead& column : columns) {
    if (!ReadSpec(in, column)) return false;
  }
  return in.ok();
}

}  // namespace dynmesh
