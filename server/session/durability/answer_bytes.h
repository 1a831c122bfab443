#ifndef DYNMESH_SERVER_SESSION_DURABILITY_ANSWER_BYTES_H_
#define DYNMESH_SERVER_SESSION_DURABILITY_ANSWER_BYTES_H_

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/optional.h"
#include "core/codec/bytes.h"
#include "core/mesh/checksum.h"
#include "core/mesh/error.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// Writes what answers are made of.
class AnswerWriter {
 public:
  template <typename T>
  void Fixed(T value) {
    out_.Fixed(value);
  }
  void Count(uint64_t count) { out_.Varint(count); }

  void Text(absl::string_view text) { out_.Text(text); }

  template <typename T>
  void Array(const std::vector<T>& values) {
    Count(values.size());
    out_.Bytes({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)});
  }

  void Id(EntityId id) {
    Fixed(static_cast<uint8_t>(id.kind));
    Fixed(id.slot);
  }

  /// Calls write(item) for each.
  template <typename Items, typename Fn>
  void Each(const Items& items, Fn write) {
    Count(items.size());
    for (const auto& item : items) write(item);
  }

  void State(const Checksum& checksum, const std::array<uint32_t, kNumEntityKinds>& counts) {
    Fixed(checksum.topology);
    Fixed(checksum.geometry);
    for (uint32_t count : counts) Fixed(count);
  }

  void Error(const absl::Status& status) {
    Fixed(static_cast<uint8_t>(status.code()));
    Text({status.message().data(), status.message().size()});
    const absl::optional<ErrorDetail> detail = GetErrorDetail(status);
    Fixed(static_cast<uint8_t>(detail.has_value()));
    if (!detail.has_value()) return;
    Text(detail->reason);
    Each(detail->metadata, [this](const auto& pair) {
      Text(pair.first);
      Text(pair.second);
    });
  }

  std::string Take() && { return std::move(out_).Take(); }

 private:
  ByteWriter out_;
};

/// Reads what AnswerWriter wrote; failure is sticky, as of ByteReader.
class AnswerReader {
 public:
  explicit AnswerReader(absl::string_view bytes) : in_(bytes) {}

  template <typename T>
  T Fixed() {
    return in_.Fixed<T>();
  }

  std::string Text() { return in_.Text(); }

  template <typename T>
  std::vector<T> Array() {
    const uint64_t count = in_.Varint();
    if (count > in_.remaining() / sizeof(T)) return Fail<std::vector<T>>();
    const absl::string_view bytes = in_.Bytes(count * sizeof(T));
    std::vector<T> values(count);
    if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }

  EntityId Id() {
    const uint8_t kind = Fixed<uint8_t>();
    const Slot slot = Fixed<Slot>();
    if (kind >= kNumEntityKinds) return Fail<EntityId>();
    return {static_cast<EntityKind>(kind), slot};
  }

  /// Items that take a byte or more each.
  template <typename Item, typename Fn>
  std::vector<Item> Each(Fn read) {
    std::vector<Item> items;
    const uint64_t count = in_.Varint();
    if (count > in_.remaining()) return Fail<std::vector<Item>>();
    for (uint64_t i = 0; i < count && ok(); ++i) items.push_back(read());
    return items;
  }

  void State(Checksum& checksum, std::array<uint32_t, kNumEntityKinds>& counts) {
    checksum.topology = Fixed<uint64_t>();
    checksum.geometry = Fixed<uint64_t>();
    for (uint32_t& count : counts) count = Fixed<uint32_t>();
  }

  absl::Status Error() {
    const auto code = static_cast<absl::StatusCode>(Fixed<uint8_t>());
    const std::string message = Text();
    if (Fixed<uint8_t>() == 0) return absl::Status(code, message);
    const std::string reason = Text();
    ErrorMetadata metadata = Each<ErrorMetadata::value_type>([this] {
      std::string key = Text();
      return std::make_pair(std::move(key), Text());
    });
    return MakeError(code, reason, message, std::move(metadata));
  }

  bool ok() const { return ok_ && in_.ok(); }
  /// What was read makes no sense.
  void Spoil() { ok_ = false; }

  /// `answer` if all was read and nothing failed.
  template <typename Answer>
  absl::StatusOr<Answer> End(Answer answer) const {
    if (ok_ && in_.done()) return answer;
    return CorruptPayload("an answer that was stored is none");
  }

 private:
  template <typename T>
  T Fail() {
    ok_ = false;
    return {};
  }

  ByteReader in_;
  bool ok_ = true;
};

}  // namespace dynmesh

#endif  // DYNMESH_SERVER_SESSION_DURABILITY_ANSWER_BYTES_H_
