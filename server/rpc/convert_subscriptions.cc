#include "server/rpc/convert_subscriptions.h"

#include "core/mesh/error.h"
#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/io/zero_copy_stream_impl_lite.h"
#include "google/protobuf/wire_format_lite.h"
#include "server/session/session_errors.h"

namespace dynmesh {
namespace {

/// Tag and length of a field of bytes.
void AppendLengthPrefix(int field_number, uint32_t length, std::string* out) {
  using google::protobuf::internal::WireFormatLite;
  google::protobuf::io::StringOutputStream stream(out);
  google::protobuf::io::CodedOutputStream coded(&stream);
  coded.WriteTag(WireFormatLite::MakeTag(field_number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED));
  coded.WriteVarint32(length);
}

}  // namespace

absl::StatusOr<FollowOptions> ToFollowOptions(const v1::SubscribeRequest& request) {
  FollowOptions options;
  options.from_revision = request.from_revision();
  options.session_uid = request.session_uid();
  if (request.codec() < v1::DELTA_CODEC_UNSPECIFIED || request.codec() > v1::DELTA_CODEC_DRACO) {
    return BadField("codec", "there is no such codec");
  }
  options.codec = static_cast<Codec>(request.codec());
  options.position_bits = request.position_bits();
  options.min_interval = absl::Milliseconds(request.min_interval_ms());
  return options;
}

std::string FromPayloadHead(const Payload& payload) {
  v1::SubscribeResponse response;
  response.set_revision(payload.revision);
  response.set_session_uid(payload.session_uid);
  response.set_from_revision(payload.from_revision);
  response.set_consistent(payload.consistent);
  response.set_commit_time_us(payload.commit_time_us);
  response.set_raw_topology_bytes(payload.stats.raw_topology_bytes);
  response.set_raw_geometry_bytes(payload.stats.raw_geometry_bytes);
  response.set_topology_bytes(payload.stats.topology_bytes);
  response.set_geometry_bytes(payload.stats.geometry_bytes);
  std::string head = response.SerializeAsString();
  AppendLengthPrefix(v1::SubscribeResponse::kDeltaFieldNumber, payload.delta.size(), &head);
  return head;
}

}  // namespace dynmesh
