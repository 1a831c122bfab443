#include "server/session/durability/log_record.h"

#include "core/codec/bytes.h"
#include "core/mesh/error.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

constexpr uint64_t kFormat = 1;

void WriteText(absl::string_view text, ByteWriter& out) {
  out.Varint(text.size());
  out.Bytes(text);
}

std::string ReadText(ByteReader& in) {
  const uint64_t size = in.Varint();
  return std::string(in.Bytes(size));
}

bool IsLoggedCall(uint8_t call) {
  return call >= static_cast<uint8_t>(LoggedCall::kEdit) &&
         call <= static_cast<uint8_t>(LoggedCall::kAdaptation);
}

}  // namespace

std::string EncodeLogRecord(const LogRecord& record) {
  ByteWriter out;
  out.Reserve(64 + record.request.answer.size() + record.batch.size());
  out.Varint(kFormat);
  out.Fixed(absl::ToUnixMicros(record.commit_time));
  out.Fixed(static_cast<uint8_t>(record.request.call));
  WriteText(record.request.request_id, out);
  out.Fixed(record.request.fingerprint);
  WriteText(record.request.answer, out);
  out.Bytes(record.batch);
  return std::move(out).Take();
}

absl::StatusOr<LogRecord> DecodeLogRecord(absl::string_view bytes) {
  ByteReader in(bytes);
  LogRecord record;
  const uint64_t format = in.Varint();
  if (in.ok() && format > kFormat) return StoreFormatNewer(format, kFormat);
  record.commit_time = absl::FromUnixMicros(in.Fixed<int64_t>());
  const auto call = in.Fixed<uint8_t>();
  record.request.call = static_cast<LoggedCall>(call);
  record.request.request_id = ReadText(in);
  record.request.fingerprint = in.Fixed<uint64_t>();
  record.request.answer = ReadText(in);
  record.batch = in.Bytes(in.remaining());
  if (!in.ok() || format == 0 || !IsLoggedCall(call)) return StoreDamaged("a record of a session is none");
  return record;
}

}  // namespace dynmesh
