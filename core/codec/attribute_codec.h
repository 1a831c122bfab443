#ifndef DYNMESH_CORE_CODEC_ATTRIBUTE_CODEC_H_
#define DYNMESH_CORE_CODEC_ATTRIBUTE_CODEC_H_

#include <vector>

#include "absl/status/statusor.h"
#include "core/codec/codec.h"
#include "core/codec/envelope.h"
#include "core/delta/delta.h"

/// Attribute columns: a description, slots as gaps, rows to the bit.
namespace dynmesh {

/// Adds three sections for each column, fewer for a column without rows.
/// Throws std::bad_alloc when memory runs out.
void EncodeAttributes(const std::vector<AttributeChanges>& columns, Codec codec, MessageWriter& writer);

/// Takes the sections of all columns. Errors: DATA_LOSS CORRUPT_PAYLOAD.
absl::StatusOr<std::vector<AttributeChanges>> DecodeAttributes(SectionReader& sections);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_ATTRIBUTE_CODEC_H_
