#include "server/health_probe.h"

#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/security/credentials.h"

namespace dynmesh {
namespace {

constexpr char kMethod[] = "/grpc.health.v1.Health/Check";
// HealthCheckResponse with its only field, status = 1, set to SERVING = 1. The proto is in no Debian package,
// and for one number none is needed.
constexpr char kServing[] = "\x08\x01";

std::string ToString(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  if (!buffer.Valid() || !buffer.Dump(&slices).ok()) return "";
  std::string bytes;
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes;
}

}  // namespace

std::string ProbeTarget(const std::vector<std::string>& listen, const std::string& unix_socket) {
  for (const std::string& address : listen) {
    const size_t colon = address.rfind(':');
    if (colon == std::string::npos) continue;
    const std::string host = address.substr(0, colon);
    const std::string port = address.substr(colon);
    if (port == ":0" || port == ":") continue;
    if (host == "0.0.0.0") return absl::StrCat("127.0.0.1", port);
    if (host == "[::]") return absl::StrCat("[::1]", port);
    return address;
  }
  return unix_socket.empty() ? "" : absl::StrCat("unix:", unix_socket);
}

absl::Status ProbeHealth(const std::string& target, absl::Duration timeout) {
  grpc::GenericStub stub(grpc::CreateChannel(target, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(absl::ToChronoTime(absl::Now() + timeout));
  const grpc::Slice empty;
  const grpc::ByteBuffer request(&empty, 1);
  grpc::ByteBuffer response;
  grpc::Status status;
  absl::Notification done;
  stub.UnaryCall(&context, kMethod, grpc::StubOptions(), &request, &response, [&](grpc::Status result) {
    status = std::move(result);
    done.Notify();
  });
  done.WaitForNotification();
  if (!status.ok()) return absl::UnavailableError(absl::StrCat(target, ": ", status.error_message()));
  if (ToString(response) == kServing) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat(target, " is not serving"));
}

}  // namespace dynmesh
