#include "server/rpc/status.h"

#include <algorithm>
#include <string>

#include "absl/strings/string_view.h"
#include "dynmesh/v1/error_details.pb.h"
#include "spdlog/spdlog.h"

namespace dynmesh {
namespace {

constexpr char kErrorDomain[] = "dynmesh";
constexpr char kErrorInfoUrl[] = "type.googleapis.com/google.rpc.ErrorInfo";
// A peer drops trailers of more than 8 KiB, and the message goes into them twice.
constexpr size_t kMaxMessageBytes = 1000;
constexpr size_t kMaxValueBytes = 500;

/// Printable ASCII of at most `max_bytes`: whatever a caller's text was cut to, it is valid in a proto
/// string.
std::string Printable(absl::string_view text, size_t max_bytes) {
  std::string out(text.substr(0, max_bytes));
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return c < 0x20 || c > 0x7e; }, '?');
  return out;
}

const char* FallbackReason(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kFailedPrecondition:
      return reason::kBadArgument;
    case absl::StatusCode::kCancelled:
    case absl::StatusCode::kDeadlineExceeded:
      return "CANCELLED";
    default:
      return reason::kInternal;
  }
}

spdlog::level::level_enum LevelOf(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kInternal:
    case absl::StatusCode::kUnknown:
    case absl::StatusCode::kDataLoss:
      return spdlog::level::err;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kResourceExhausted:
      return spdlog::level::warn;
    default:
      return spdlog::level::debug;
  }
}

}  // namespace

ErrorDetail DetailOf(const absl::Status& status) {
  absl::optional<ErrorDetail> detail = GetErrorDetail(status);
  return detail ? *std::move(detail) : ErrorDetail{FallbackReason(status.code()), {}};
}

grpc::Status ToGrpcStatus(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const ErrorDetail detail = DetailOf(status);
  v1::ErrorInfo info;
  info.set_reason(detail.reason);
  info.set_domain(kErrorDomain);
  for (const auto& [key, value] : detail.metadata) {
    (*info.mutable_metadata())[Printable(key, kMaxValueBytes)] = Printable(value, kMaxValueBytes);
  }
  v1::StatusDetails details;
  details.set_code(static_cast<int>(status.code()));
  details.set_message(Printable(status.message(), kMaxMessageBytes));
  google::protobuf::Any* any = details.add_details();
  any->set_type_url(kErrorInfoUrl);
  any->set_value(info.SerializeAsString());
  return grpc::Status(static_cast<grpc::StatusCode>(status.code()), details.message(),
                      details.SerializeAsString());
}

grpc::Status LoggedStatus(const char* rpc, const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const grpc::Status converted = ToGrpcStatus(status);
  spdlog::log(LevelOf(status.code()), "refused rpc={} code={} reason={} message=\"{}\"", rpc,
              absl::StatusCodeToString(status.code()), DetailOf(status).reason, converted.error_message());
  return converted;
}

}  // namespace dynmesh
