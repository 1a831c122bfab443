#ifndef DYNMESH_CORE_ARCHIVE_ZIGZAG_H_
#define DYNMESH_CORE_ARCHIVE_ZIGZAG_H_

#include <cstdint>

#include "core/codec/bytes.h"

/// Differences of slots and stamps, which go both ways.
namespace dynmesh {

/// Appends value - before, small for what lies near on either side.
inline void WriteDifference(uint32_t value, uint32_t before, ByteWriter& out) {
  const uint32_t difference = value - before;
  out.Varint((difference << 1) ^ (0 - (difference >> 31)));
}

/// Reads `value` against the same `before`; false if that is no difference of 32 bits.
inline bool ReadDifference(ByteReader& in, uint32_t before, uint32_t& value) {
  const uint64_t code = in.Varint();
  const uint32_t low = static_cast<uint32_t>(code);
  value = before + ((low >> 1) ^ (0 - (low & 1)));
  return code <= 0xffffffffu;
}

}  // namespace dynmesh

#endif  // DYNMESH_CORE_ARCHIVE_ZIGZAG_H_
