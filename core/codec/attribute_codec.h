#ifndef DYNMESH_CORE_CODEC_ATTRIBUTE_CODEC_H_
#define DYNMESH_CORE_CODEC_ATTRIBUTE_CODEC_H_

#include <vector>

#include "absl/status/statusor.h"
#include "core/codec/codec.h"
#include "core/codec/envelope.h"
#include "core/delta/delta.h"

/// Attribute columns: a description, slots as gaps, rows to the bit.
namespace dynmesh {

/// The lowest version of the format that can describe these columns.
int VersionFor(const std::vector<AttributeChanges>& columns);

/// Adds three sections for each column, fewer for a column without rows, in words of VersionFor(columns).
/// Throws std::bad_alloc when memory runs out.
void EncodeAttributes(const std::vector<AttributeChanges>& columns, Codec codec, MessageWriter& writer);

/// Takes the sections of all columns of a message of `version`. Errors: DATA_LOSS CORRUPT_PAYLOAD.
absl::StatusOr<std::vector<AttributeChanges>> DecodeAttributes(int version, SectionReader& sections);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_ATTRIBUTE_CODEC_H_
