#include "server/rpc/convert.h"

#include <algorithm>
#include <bit>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"
#include "server/session/session_errors.h"

namespace dynmesh {

static_assert(std::endian::native == std::endian::little, "arrays travel as they lie in memory");

namespace {

v1::Warning FromFailedCheck(const MeshWarning& warning) {
  const CheckTraits& traits = TraitsOf(warning.check);
  const absl::string_view side = traits.bad == BadSide::kBelow ? "below " : "above ";
  v1::Warning message;
  message.set_reason(reason::kCheckFailed);
  message.set_message(absl::StrCat(traits.name, " is ", side, warning.threshold));
  message.set_kind(FromEntityKind(warning.kind));
  message.set_ids(FromArray(warning.ids));
  message.set_count(warning.count);
  message.set_check(static_cast<v1::CheckKind>(warning.check));
  message.set_threshold(warning.threshold);
  message.set_values(FromArray(warning.values));
  return message;
}

}  // namespace

absl::Status BadArrayLength(absl::string_view field, size_t bytes, size_t record_bytes) {
  return InvalidArgument(
      reason::kBadArrayLength,
      absl::StrCat(field, " has ", bytes, " bytes, which is no multiple of ", record_bytes),
      {{"field", std::string(field)}, {"index", absl::StrCat(bytes / record_bytes)}});
}

absl::StatusOr<EntityKind> ToEntityKind(int kind, absl::string_view field) {
  if (kind >= v1::ENTITY_KIND_VERTEX && kind <= v1::ENTITY_KIND_CELL) {
    return static_cast<EntityKind>(kind - v1::ENTITY_KIND_VERTEX);
  }
  return InvalidArgument(reason::kBadEntityKind, absl::StrCat(field, " is no entity kind: ", kind),
                         {{"field", std::string(field)}});
}

v1::EntityKind FromEntityKind(EntityKind kind) {
  return static_cast<v1::EntityKind>(Dimension(kind) + v1::ENTITY_KIND_VERTEX);
}

absl::StatusOr<ElementType> ToElementType(int type) {
  if (IsElementType(type)) return static_cast<ElementType>(type);
  return InvalidArgument(reason::kBadElementType, absl::StrCat("there is no element type ", type),
                         {{"field", "type"}});
}

v1::ElementType FromElementType(ElementType type) { return static_cast<v1::ElementType>(type); }

absl::StatusOr<AttributeSpec> ToAttributeSpec(const v1::AttributeSpec& message) {
  AttributeSpec spec;
  spec.name = message.name();
  DYNMESH_ASSIGN_OR_RETURN(spec.kind, ToEntityKind(message.kind(), "kind"));
  // What does not fit the fields becomes what CheckAttributeSpec refuses.
  const int type = message.type(), policy = message.policy();
  spec.type = IsAttributeType(type) ? static_cast<AttributeType>(type) : AttributeType::kUnspecified;
  spec.policy = static_cast<AttributePolicy>(IsAttributePolicy(policy) ? policy : UINT8_MAX);
  const uint32_t components = message.components() == 0 ? 1 : message.components();
  spec.components = std::min<uint32_t>(components, kMaxAttributeComponents + 1);
  spec.default_row.assign(message.default_row().begin(), message.default_row().end());
  DYNMESH_RETURN_IF_ERROR(CheckAttributeSpec(spec));
  return spec;
}

v1::AttributeSpec FromAttributeSpec(const AttributeSpec& spec) {
  v1::AttributeSpec message;
  message.set_name(spec.name);
  message.set_kind(FromEntityKind(spec.kind));
  message.set_type(static_cast<v1::AttributeType>(spec.type));
  message.set_components(spec.components);
  message.set_policy(static_cast<v1::AttributePolicy>(spec.effective_policy()));
  if (!spec.has_zero_default()) message.set_default_row(FromArray(spec.default_row));
  return message;
}

absl::StatusOr<int> ToPageSize(int requested) {
  constexpr int kDefaultPageSize = 100;
  constexpr int kMaxPageSize = 1000;
  if (requested < 0) return BadField("page_size", "page_size is negative");
  return requested == 0 ? kDefaultPageSize : std::min(requested, kMaxPageSize);
}

google::protobuf::Timestamp FromTime(absl::Time time) {
  google::protobuf::Timestamp message;
  const int64_t seconds = absl::ToUnixSeconds(time);  // rounds down, so nanos are not negative
  message.set_seconds(seconds);
  message.set_nanos(static_cast<int32_t>((time - absl::FromUnixSeconds(seconds)) / absl::Nanoseconds(1)));
  return message;
}

RevisionNote ToNote(const v1::RevisionNote& message) { return {message.author(), message.message()}; }

v1::RevisionNote FromNote(const RevisionNote& note) {
  v1::RevisionNote message;
  message.set_author(note.author);
  message.set_message(note.message);
  return message;
}

KindCounts ToKindCounts(const std::array<uint32_t, kNumEntityKinds>& live) {
  KindCounts counts;
  std::copy(live.begin(), live.end(), counts.begin());
  return counts;
}

v1::Checksum FromChecksum(const Checksum& checksum) {
  v1::Checksum message;
  message.set_topology(checksum.topology);
  message.set_geometry(checksum.geometry);
  return message;
}

v1::EntityCounts FromCounts(const KindCounts& counts) {
  v1::EntityCounts message;
  message.set_vertices(counts[0]);
  message.set_edges(counts[1]);
  message.set_faces(counts[2]);
  message.set_cells(counts[3]);
  return message;
}

v1::Warning FromWarning(const MeshWarning& warning) {
  if (warning.warning == WarningKind::kCheckFailed) return FromFailedCheck(warning);
  const bool degenerate = warning.warning == WarningKind::kDegenerateElement;
  v1::Warning message;
  message.set_reason(degenerate ? "DEGENERATE_ELEMENT" : reason::kDuplicateElement);
  message.set_message(absl::StrCat(warning.count, " of the elements ",
                                   degenerate ? "name a vertex twice" : "equal one that was there"));
  message.set_kind(FromEntityKind(warning.kind));
  message.set_ids(FromArray(warning.ids));
  message.set_count(warning.count);
  return message;
}

}  // namespace dynmesh
