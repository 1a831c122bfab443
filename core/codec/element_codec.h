#ifndef DYNMESH_CORE_CODEC_ELEMENT_CODEC_H_
#define DYNMESH_CORE_CODEC_ELEMENT_CODEC_H_

#include "absl/status/status.h"
#include "core/codec/codec.h"
#include "core/codec/envelope.h"
#include "core/delta/delta.h"

/// Elements of one kind as symbol streams, in slot order and to the corner.
///
/// Consecutive elements share vertices, so a corner is a hit in a move-to-front cache of the last 63
/// vertices (its position, 1 the most recent), or a miss (0). A miss adds the distance of the vertex, in
/// the sorted table of the vertices that occur, from the one missed before. See FORMAT.md, "Elements".
namespace dynmesh {

/// Adds the sections of `changes`. kUnspecified also tries the corners as a plain array through zstd, and so
/// never takes more than that. Throws std::bad_alloc when memory runs out.
/// Cost: O(corners * 63) at worst, O(misses * log(misses)).
void EncodeElements(EntityKind kind, const ElementChanges& changes, Codec codec, MessageWriter& writer);

/// Takes the sections of `kind`. `changes` obeys the invariants of Delta but for slots that are both removed
/// and upserted. Errors: DATA_LOSS CORRUPT_PAYLOAD.
absl::Status DecodeElements(EntityKind kind, SectionReader& sections, ElementChanges& changes);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_ELEMENT_CODEC_H_
