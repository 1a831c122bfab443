#include "core/mesh/error.h"

#include <algorithm>

#include "absl/strings/cord.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace dynmesh {
namespace {

constexpr char kPayloadUrl[] = "dynmesh.error";
constexpr size_t kMaxJoinedSlots = 16;

// The payload is a row of netstrings ("5:hello,"): the reason, then key, value, key, value, ...
void AppendNetstring(absl::string_view text, std::string* out) {
  absl::StrAppend(out, text.size(), ":", text, ",");
}

bool TakeNetstring(absl::string_view* in, std::string* text) {
  const size_t colon = in->find(':');
  size_t size = 0;
  if (colon == in->npos || !absl::SimpleAtoi(in->substr(0, colon), &size)) return false;
  const size_t available = in->size() - colon - 1;
  if (size >= available || (*in)[colon + 1 + size] != ',') return false;
  *text = std::string(in->substr(colon + 1, size));
  in->remove_prefix(colon + size + 2);
  return true;
}

std::string Serialize(const ErrorDetail& detail) {
  std::string out;
  AppendNetstring(detail.reason, &out);
  for (const auto& [key, value] : detail.metadata) {
    AppendNetstring(key, &out);
    AppendNetstring(value, &out);
  }
  return out;
}

absl::optional<ErrorDetail> Parse(absl::string_view text) {
  ErrorDetail detail;
  if (!TakeNetstring(&text, &detail.reason)) return absl::nullopt;
  while (!text.empty()) {
    std::pair<std::string, std::string> entry;
    if (!TakeNetstring(&text, &entry.first) || !TakeNetstring(&text, &entry.second)) return absl::nullopt;
    detail.metadata.push_back(std::move(entry));
  }
  return detail;
}

auto FindKey(const ErrorMetadata& metadata, absl::string_view key) {
  return std::find_if(metadata.begin(), metadata.end(),
                      [key](const auto& entry) { return entry.first == key; });
}

}  // namespace

absl::string_view ErrorDetail::Find(absl::string_view key) const {
  const auto found = FindKey(metadata, key);
  return found == metadata.end() ? absl::string_view() : absl::string_view(found->second);
}

absl::Status MakeError(absl::StatusCode code, absl::string_view reason, absl::string_view message,
                       ErrorMetadata metadata) {
  absl::Status status(code, message);
  status.SetPayload(kPayloadUrl, absl::Cord(Serialize({std::string(reason), std::move(metadata)})));
  return status;
}

absl::Status InvalidArgument(absl::string_view reason, absl::string_view message, ErrorMetadata metadata) {
  return MakeError(absl::StatusCode::kInvalidArgument, reason, message, std::move(metadata));
}

absl::Status FailedPrecondition(absl::string_view reason, absl::string_view message, ErrorMetadata metadata) {
  return MakeError(absl::StatusCode::kFailedPrecondition, reason, message, std::move(metadata));
}

absl::Status EntityNotFound(absl::string_view reason, EntityId id) {
  const absl::string_view what =
      reason == reason::kEntityRemoved ? " has been removed" : " has never existed";
  const absl::string_view kind = EntityKindName(id.kind);
  return MakeError(absl::StatusCode::kNotFound, reason, absl::StrCat(kind, " ", id.slot, what),
                   {{"kind", std::string(kind)}, {"ids", absl::StrCat(id.slot)}});
}

absl::Status LimitExceeded(absl::string_view limit, uint64_t value, uint64_t requested) {
  return MakeError(absl::StatusCode::kResourceExhausted, reason::kLimitExceeded,
                   absl::StrCat(limit, " is limited to ", value, ", and ", requested, " was asked for"),
                   {{"limit", std::string(limit)},
                    {"value", absl::StrCat(value)},
                    {"requested", absl::StrCat(requested)}});
}

absl::Status WithMetadata(const absl::Status& status, absl::string_view key, absl::string_view value) {
  absl::optional<ErrorDetail> detail = GetErrorDetail(status);
  if (!detail || FindKey(detail->metadata, key) != detail->metadata.end()) return status;
  detail->metadata.emplace_back(std::string(key), std::string(value));
  absl::Status extended = status;
  extended.SetPayload(kPayloadUrl, absl::Cord(Serialize(*detail)));
  return extended;
}

absl::optional<ErrorDetail> GetErrorDetail(const absl::Status& status) {
  const absl::optional<absl::Cord> payload = status.GetPayload(kPayloadUrl);
  if (!payload) return absl::nullopt;
  return Parse(std::string(*payload));
}

std::string ErrorReason(const absl::Status& status) {
  absl::optional<ErrorDetail> detail = GetErrorDetail(status);
  return detail ? std::move(detail->reason) : std::string();
}

std::string JoinSlots(absl::Span<const Slot> slots) {
  std::string out;
  for (size_t i = 0; i < std::min(slots.size(), kMaxJoinedSlots); ++i) {
    absl::StrAppend(&out, i == 0 ? "" : ",", slots[i]);
  }
  if (slots.size() > kMaxJoinedSlots) out += ",...";
  return out;
}

}  // namespace dynmesh
