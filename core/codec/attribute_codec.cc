#include "core/codec/attribute_codec.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/codec/bytes.h"
#include "core/codec/planes.h"
#include "core/codec/symbols.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

using section::ColumnPart;

/// Whether version 1 has words for a column.
bool IsPlain(const AttributeSpec& spec) {
  const bool known = spec.type == AttributeType::kFloat64 || spec.type == AttributeType::kInt32;
  return known && spec.effective_policy() == DefaultPolicy(spec.type) && spec.has_zero_default();
}

Packed PackSpec(int version, const AttributeSpec& spec) {
  ByteWriter out;
  out.Fixed<EntityKind>(spec.kind);
  out.Fixed<AttributeType>(spec.type);
  out.Fixed<uint8_t>(spec.components);
  if (version > kFirstVersion) {
    out.Fixed<AttributePolicy>(spec.effective_policy());
    out.Fixed<uint8_t>(spec.name.size());
  }
  out.Bytes(spec.name);
  if (!spec.has_zero_default()) {
    out.Bytes(
        absl::string_view(reinterpret_cast<const char*>(spec.default_row.data()), spec.default_row.size()));
  }
  const uint64_t count = out.size();
  return {Packing::kRaw, count, std::move(out).Take()};
}

absl::StatusOr<AttributeSpec> UnpackSpec(int version, const Section& section) {
  if (section.packing != Packing::kRaw || section.count != section.bytes.size()) {
    return CorruptPayload("an attribute's description is not of its length");
  }
  ByteReader in(section.bytes);
  AttributeSpec spec;
  spec.kind = in.Fixed<EntityKind>();
  spec.type = in.Fixed<AttributeType>();
  spec.components = in.Fixed<uint8_t>();
  if (version > kFirstVersion) spec.policy = in.Fixed<AttributePolicy>();
  const uint64_t name_bytes = version > kFirstVersion ? in.Fixed<uint8_t>() : in.remaining();
  spec.name = std::string(in.Bytes(name_bytes));
  const absl::string_view defaults = in.Bytes(in.remaining());
  spec.default_row.assign(defaults.begin(), defaults.end());
  const bool stated = version == kFirstVersion ? IsPlain(spec) : spec.policy != AttributePolicy::kUnspecified;
  if (!in.ok() || !stated || !CheckAttributeSpec(spec).ok()) {
    return CorruptPayload("an attribute's description is not valid");
  }
  return spec;
}

absl::StatusOr<AttributeChanges> DecodeColumn(int version, uint32_t column, SectionReader& sections) {
  AttributeChanges changes;
  const auto take = [&](ColumnPart part) { return sections.Take(section::Of(column, part)); };
  DYNMESH_ASSIGN_OR_RETURN(changes.spec, UnpackSpec(version, take(ColumnPart::kSpec)));
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

int VersionFor(const std::vector<AttributeChanges>& columns) {
  const bool plain = std::all_of(columns.begin(), columns.end(),
                                 [](const AttributeChanges& changes) { return IsPlain(changes.spec); });
  return plain ? kFirstVersion : kLatestVersion;
}

void EncodeAttributes(const std::vector<AttributeChanges>& columns, Codec codec, MessageWriter& writer) {
  const int version = VersionFor(columns);
  for (uint32_t column = 0; column < columns.size(); ++column) {
    const AttributeChanges& changes = columns[column];
    const RowShape shape{changes.spec.type, changes.spec.components};
    writer.Add(section::Of(column, ColumnPart::kSpec), PackSpec(version, changes.spec));
    writer.Add(section::Of(column, ColumnPart::kRowSlots), PackSlots(changes.slots, codec));
    writer.Add(section::Of(column, ColumnPart::kRows), PackRows(changes.rows, shape, codec));
  }
}

absl::StatusOr<std::vector<AttributeChanges>> DecodeAttributes(int version, SectionReader& sections) {
  std::vector<AttributeChanges> columns;
  while (sections.NextIs(section::Of(columns.size(), ColumnPart::kSpec))) {
    DYNMESH_ASSIGN_OR_RETURN(AttributeChanges changes, DecodeColumn(version, columns.size(), sections));
    columns.push_back(std::move(changes));
  }
  return columns;
}

}  // namespace dynmesh
