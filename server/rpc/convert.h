#ifndef DYNMESH_SERVER_RPC_CONVERT_H_
#define DYNMESH_SERVER_RPC_CONVERT_H_

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "core/mesh/attributes.h"
#include "core/mesh/checksum.h"
#include "core/mesh/element_type.h"
#include "core/mesh/ids.h"
#include "dynmesh/v1/types.pb.h"
#include "google/protobuf/timestamp.pb.h"
#include "server/session/durability/revision_note.h"
#include "server/session/mesh_warnings.h"
#include "server/session/session_info.h"

/// Between messages and values of core: only convert*.{h,cc} see both. This one has the shared vocabulary.
///
/// To...() checks everything that can be judged without a session: INVALID_ARGUMENT with metadata "field".
/// From...() cannot fail.
namespace dynmesh {

static_assert(sizeof(VertexId) == sizeof(Slot), "arrays of ids travel as they lie in memory");

/// INVALID_ARGUMENT BAD_ARRAY_LENGTH for an array of `bytes` bytes whose records have `record_bytes`.
absl::Status BadArrayLength(absl::string_view field, size_t bytes, size_t record_bytes);

/// Little-endian numbers (or arrays of such) as they travel. Errors: BAD_ARRAY_LENGTH.
template <typename T>
absl::StatusOr<std::vector<T>> ToArray(const std::string& bytes, absl::string_view field) {
  if (bytes.size() % sizeof(T) != 0) return BadArrayLength(field, bytes.size(), sizeof(T));
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!bytes.empty()) std::memcpy(static_cast<void*>(values.data()), bytes.data(), bytes.size());
  return values;
}

template <typename T>
std::string FromArray(const std::vector<T>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

/// Errors: BAD_ENTITY_KIND.
absl::StatusOr<EntityKind> ToEntityKind(int kind, absl::string_view field);
v1::EntityKind FromEntityKind(EntityKind kind);

/// Errors: BAD_ELEMENT_TYPE.
absl::StatusOr<ElementType> ToElementType(int type);
v1::ElementType FromElementType(ElementType type);

/// Errors: BAD_ENTITY_KIND, BAD_ARGUMENT, BAD_ARRAY_LENGTH, NON_FINITE_VALUE.
absl::StatusOr<AttributeSpec> ToAttributeSpec(const v1::AttributeSpec& spec);
v1::AttributeSpec FromAttributeSpec(const AttributeSpec& spec);

/// So many items a page has. Errors: BAD_ARGUMENT for a negative number.
absl::StatusOr<int> ToPageSize(int requested);

google::protobuf::Timestamp FromTime(absl::Time time);
RevisionNote ToNote(const v1::RevisionNote& message);
v1::RevisionNote FromNote(const RevisionNote& note);
v1::Checksum FromChecksum(const Checksum& checksum);
KindCounts ToKindCounts(const std::array<uint32_t, kNumEntityKinds>& live);
v1::EntityCounts FromCounts(const KindCounts& counts);
v1::Warning FromWarning(const MeshWarning& warning);

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_RPC_CONVERT_H_
