#include "core/codec/attribute_codec.h"

#include <string>
#include <utility>

#include "core/codec/bytes.h"
#include "core/codec/planes.h"
#include "core/codec/symbols.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

using section::ColumnPart;

Packed PackSpec(const AttributeSpec& spec) {
  ByteWriter out;
  out.Fixed<EntityKind>(spec.kind);
  out.Fixed<AttributeType>(spec.type);
  out.Fixed<uint8_t>(spec.components);
  out.Bytes(spec.name);
  const uint64_t count = out.size();
  return {Packing::kRaw, count, std::move(out).Take()};
}

absl::StatusOr<AttributeSpec> UnpackSpec(const Section& section) {
  if (section.packing != Packing::kRaw || section.count != section.bytes.size()) {
    return CorruptPayload("an attribute's description is not of its length");
  }
  ByteReader in(section.bytes);
  AttributeSpec spec;
  spec.kind = in.Fixed<EntityKind>();
  spec.type = in.Fixed<AttributeType>();
  spec.components = in.Fixed<uint8_t>();
  spec.name = std::string(in.Bytes(in.remaining()));
  if (!in.ok() || !CheckAttributeSpec(spec).ok()) {
    return CorruptPayload("an attribute's description is not valid");
  }
  return spec;
}

absl::StatusOr<AttributeChanges> DecodeColumn(uint32_t column, SectionReader& sections) {
  AttributeChanges changes;
  const auto take = [&](ColumnPart part) { return sections.Take(section::Of(column, part)); };
  DYNMESH_ASSIGN_OR_RETURN(changes.spec, UnpackSpec(take(ColumnPart::kSpec)));
  DYNMESH_ASSIGN_OR_RETURN(changes.slots, UnpackSlots(take(ColumnPart::kRowSlots)));
  const Section rows = take(ColumnPart::kRows);
  const RowShape shape{changes.spec.type, changes.spec.components};
  if (rows.count != changes.slots.size() * shape.row_bytes()) {
    return CorruptPayload("an attribute's rows are not one for each slot");
  }
  DYNMESH_ASSIGN_OR_RETURN(changes.rows, UnpackRows(rows, shape));
  return changes;
}

}  // namespace

void EncodeAttributes(const std::vector<AttributeChanges>& columns, Codec codec, MessageWriter& writer) {
  for (uint32_t column = 0; column < columns.size(); ++column) {
    const AttributeChanges& changes = columns[column];
    const RowShape shape{changes.spec.type, changes.spec.components};
    writer.Add(section::Of(column, ColumnPart::kSpec), PackSpec(changes.spec));
    writer.Add(section::Of(column, ColumnPart::kRowSlots), PackSlots(changes.slots, codec));
    writer.Add(section::Of(column, ColumnPart::kRows), PackRows(changes.rows, shape, codec));
  }
}

absl::StatusOr<std::vector<AttributeChanges>> DecodeAttributes(SectionReader& sections) {
  std::vector<AttributeChanges> columns;
  while (sections.NextIs(section::Of(columns.size(), ColumnPart::kSpec))) {
    DYNMESH_ASSIGN_OR_RETURN(AttributeChanges changes, DecodeColumn(columns.size(), sections));
    columns.push_back(std::move(changes));
  }
  return columns;
}

}  // namespace dynmesh
