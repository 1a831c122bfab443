#ifndef DYNMESH_CORE_CODEC_BYTES_H_
#define DYNMESH_CORE_CODEC_BYTES_H_

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/mesh/error.h"

namespace dynmesh {

static_assert(std::endian::native == std::endian::little, "fields are copied as they lie in memory");

inline constexpr int kMaxVarintBytes = 10;

/// DATA_LOSS CORRUPT_PAYLOAD: `what` is a full sentence about the message.
inline absl::Status CorruptPayload(absl::string_view what) {
  return MakeError(absl::StatusCode::kDataLoss, reason::kCorruptPayload, what);
}

/// Appends little-endian fields and LEB128 varints to a string.
class ByteWriter {
 public:
  template <typename T>
  void Fixed(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }

  void Varint(uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<char>(value | 0x80));
    bytes_.push_back(static_cast<char>(value));
  }

  void Bytes(absl::string_view bytes) { bytes_.append(bytes.data(), bytes.size()); }
  /// Its length as a varint, then the bytes.
  void Text(absl::string_view text) {
    Varint(text.size());
    Bytes(text);
  }
  void Reserve(size_t size) { bytes_.reserve(size); }

  size_t size() const { return bytes_.size(); }
  const std::string& bytes() const { return bytes_; }
  std::string Take() && { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Reads what ByteWriter wrote. Failure is sticky: after the first read beyond the end, or of a varint that
/// does not fit, ok() is false and every read yields zero or nothing, so a caller checks once at the end.
class ByteReader {
 public:
  explicit ByteReader(absl::string_view bytes) : next_(bytes.data()), end_(bytes.data() + bytes.size()) {}

  template <typename T>
  T Fixed() {
    T value{};
    if (Require(sizeof(T))) {
      std::memcpy(&value, next_, sizeof(T));
      next_ += sizeof(T);
    }
    return value;
  }

  uint64_t Varint() {
    if (ok_ && next_ != end_ && static_cast<uint8_t>(*next_) < 0x80) return static_cast<uint8_t>(*next_++);
    uint64_t value = 0;
    for (int shift = 0; shift < 7 * kMaxVarintBytes && Require(1); shift += 7) {
      const uint64_t byte = static_cast<uint8_t>(*next_++);
      if (shift == 63 && byte > 1) break;
      value |= (byte & 0x7f) << shift;
      if (byte < 0x80) return value;
    }
    ok_ = false;
    return 0;
  }

  absl::string_view Bytes(uint64_t size) {
    if (!Require(size)) return {};
    return absl::string_view(std::exchange(next_, next_ + size), size);
  }

  std::string Text() {
    const uint64_t size = Varint();
    return std::string(Bytes(size));
  }

  bool ok() const { return ok_; }
  /// Whether every byte was read and nothing failed.
  bool done() const { return ok_ && next_ == end_; }
  uint64_t remaining() const { return end_ - next_; }

 private:
  bool Require(uint64_t size) {
    ok_ = ok_ && size <= remaining();
    return ok_;
  }

  const char* next_;
  const char* end_;
  bool ok_ = true;
};

}  // namespace dynmesh

#endif  // DYNMESH_CORE_CODEC_BYTES_H_
