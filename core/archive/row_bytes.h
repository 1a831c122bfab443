#ifndef DYNMESH_CORE_ARCHIVE_ROW_BYTES_H_
#define DYNMESH_CORE_ARCHIVE_ROW_BYTES_H_

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "absl/strings/string_view.h"
#include "core/codec/bytes.h"

/// Bytes of rows: differences of slots and stamps, which go both ways.
namespace dynmesh {

/// Bytes of one row, of at most kMaxBytes: appended to the others at once, which is faster than one by one.
class RowBuffer {
 public:
  static constexpr size_t kMaxBytes = 128;

  template <typename T>
  void Fixed(const T& value) {
    std::memcpy(bytes_ + size_, &value, sizeof(value));
    size_ += sizeof(value);
  }

  void Varint(uint32_t value) {
    for (; value >= 0x80; value >>= 7) bytes_[size_++] = static_cast<char>(value | 0x80);
    bytes_[size_++] = static_cast<char>(value);
  }

  /// Appends them to `out` and forgets them.
  void MoveTo(ByteWriter& out) {
    out.Bytes(absl::string_view(bytes_, size_));
    size_ = 0;
  }

 private:
  char bytes_[kMaxBytes];
  size_t size_ = 0;
};

/// Appends value - before, small for what lies near on either side.
template <typename Out>
void WriteDifference(uint32_t value, uint32_t before, Out& out) {
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

#endif  // DYNMESH_CORE_ARCHIVE_ROW_BYTES_H_
