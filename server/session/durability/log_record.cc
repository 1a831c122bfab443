#include "server/session/durability/log_record.h"

#include <utility>

#include "core/codec/bytes.h"
#include "core/mesh/error.h"
#include "server/store/store_errors.h"

namespace dynmesh {
namespace {

constexpr uint64_t kRecordFormat = 1;

bool IsLoggedCall(uint8_t call) {
  return call >= static_cast<uint8_t>(LoggedCall::kEdit) &&
         call <= static_cast<uint8_t>(LoggedCall::kCreation);
}

}  // namespace

std::string EncodeLogRecord(const LogRecord& record) {
  ByteWriter out;
  out.Reserve(64 + record.request.answer.size() + record.batch.size());
  out.Varint(kRecordFormat);
  out.Fixed(absl::ToUnixMicros(record.commit_time));
  out.Fixed(static_cast<uint8_t>(record.request.call));
  out.Text(record.request.request_id);
  out.Fixed(record.request.fingerprint);
  out.Text(record.request.answer);
  out.Text(record.request.note.author);
  out.Text(record.request.note.message);
  out.Bytes(record.batch);
  return std::move(out).Take();
}

absl::StatusOr<LogRecord> DecodeLogRecord(absl::string_view bytes) {
  ByteReader in(bytes);
  LogRecord record;
  const uint64_t format = in.Varint();
  if (in.ok() && format > kRecordFormat) return StoreFormatNewer(format, kRecordFormat);
  record.commit_time = absl::FromUnixMicros(in.Fixed<int64_t>());
  const auto call = in.Fixed<uint8_t>();
  record.request.call = static_cast<LoggedCall>(call);
  record.request.request_id = in.Text();
  record.request.fingerprint = in.Fixed<uint64_t>();
  record.request.answer = in.Text();
  record.request.note.author = in.Text();
  record.request.note.message = in.Text();
  record.batch = in.Bytes(in.remaining());
  if (!in.ok() || format == 0 || !IsLoggedCall(call)) return StoreDamaged("a record of a session is none");
  return record;
}

std::string EncodeOrigin(const Origin& origin) {
  ByteWriter out;
  out.Fixed(origin.revision);
  out.Fixed(origin.bytes);
  out.Bytes(EncodeLogRecord({origin.commit_time, origin.request, {}}));
  return std::move(out).Take();
}

absl::StatusOr<Origin> DecodeOrigin(absl::string_view bytes) {
  ByteReader in(bytes);
  Origin origin;
  origin.revision = in.Fixed<int64_t>();
  origin.bytes = in.Fixed<uint64_t>();
  DYNMESH_ASSIGN_OR_RETURN(LogRecord record, DecodeLogRecord(in.Bytes(in.remaining())));
  if (!in.ok() || origin.revision <= 0 || !record.batch.empty()) {
    return StoreDamaged("the origin of a session is none");
  }
  origin.commit_time = record.commit_time;
  origin.request = std::move(record.request);
  return origin;
}

}  // namespace dynmesh
