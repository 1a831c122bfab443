#include "core/codec/draco_gate.h"

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/point_cloud/point_cloud.h>

#include <new>

#include "core/codec/bytes.h"
#include "core/codec/symbols.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

constexpr int kSpeed = 5;
constexpr size_t kMaxPoints = size_t{1} << 28;  // Draco counts in int32, and in bytes of them

// Everything in a blob that comes before its entropy-coded symbols.
std::string BlobPrefix(uint32_t num_points) {
  ByteWriter out;
  out.Bytes("DRACO");
  out.Bytes(absl::string_view("\2\3", 2));  // bitstream version 2.3
  out.Bytes(absl::string_view("\0\0", 2));  // point cloud, sequential
  out.Fixed<uint16_t>(0);                   // flags: no metadata
  out.Fixed<uint32_t>(num_points);
  out.Bytes(absl::string_view("\1\1", 2));        // one decoder with one attribute
  out.Bytes(absl::string_view("\4\5\1\0\0", 5));  // GENERIC, int32, one component, not normalised, id 0
  out.Bytes(absl::string_view("\1", 1));          // coded as integers
  out.Bytes(absl::string_view("\xfe\1", 2));      // no prediction, entropy-coded
  return std::move(out).Take();
}

absl::Status DracoError(absl::string_view message) {
  return MakeError(absl::StatusCode::kInternal, reason::kInternal, message);
}

int AddSymbols(absl::Span<const uint32_t> symbols, draco::PointCloud& cloud) {
  cloud.set_num_points(symbols.size());
  draco::GeometryAttribute attribute;
  attribute.Init(draco::GeometryAttribute::GENERIC, nullptr, 1, draco::DT_INT32, false, sizeof(int32_t), 0);
  const int id = cloud.AddAttribute(attribute, true, symbols.size());
  std::vector<uint32_t> values(symbols.size());
  for (size_t i = 0; i < symbols.size(); ++i) values[i] = UnZigZag(symbols[i]);
  cloud.attribute(id)->buffer()->Write(0, values.data(), values.size() * sizeof(uint32_t));
  return id;
}

absl::StatusOr<std::string> EncodeCloud(absl::Span<const uint32_t> symbols) {
  draco::PointCloud cloud;
  const int attribute = AddSymbols(symbols, cloud);
  draco::ExpertEncoder encoder(cloud);
  encoder.SetSpeedOptions(kSpeed, kSpeed);
  encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
  if (!encoder.SetAttributePredictionScheme(attribute, draco::PREDICTION_NONE).ok()) {
    return DracoError("Draco refuses to code without prediction");
  }
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) return DracoError(status.error_msg_string());
  return std::string(buffer.data(), buffer.size());
}

// The header was checked, but what Draco made of the rest was not.
bool HoldsSymbols(const draco::PointCloud& cloud, size_t count) {
  if (cloud.num_attributes() != 1 || cloud.num_points() != count) return false;
  const draco::PointAttribute& attribute = *cloud.attribute(0);
  return attribute.size() == count && attribute.is_mapping_identity() &&
         attribute.buffer()->data_size() == count * sizeof(uint32_t);
}

void AppendSymbols(const draco::PointCloud& cloud, std::vector<uint32_t>& symbols) {
  const size_t begin = symbols.size();
  symbols.resize(begin + cloud.num_points());
  cloud.attribute(0)->buffer()->Read(0, symbols.data() + begin, cloud.num_points() * sizeof(uint32_t));
  for (size_t i = begin; i < symbols.size(); ++i) symbols[i] = ZigZag(symbols[i]);
}

absl::Status DecodeCloud(absl::string_view& bytes, size_t count, std::vector<uint32_t>& symbols) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::PointCloud cloud;
  draco::Decoder decoder;
  const bool decoded = decoder.DecodeBufferToGeometry(&buffer, &cloud).ok();
  if (!decoded || buffer.remaining_size() < 0) return CorruptPayload("a Draco blob cannot be decoded");
  if (!HoldsSymbols(cloud, count)) return CorruptPayload("a Draco blob holds other than its header says");
  AppendSymbols(cloud, symbols);
  bytes.remove_prefix(bytes.size() - buffer.remaining_size());
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::string> DracoEncode(absl::Span<const uint32_t> symbols) try {
  if (symbols.empty() || symbols.size() > kMaxPoints) {
    return DracoError("Draco cannot code that many symbols");
  }
  DYNMESH_ASSIGN_OR_RETURN(std::string blob, EncodeCloud(symbols));
  const std::string prefix = BlobPrefix(symbols.size());
  if (blob.compare(0, prefix.size(), prefix) != 0) return DracoError("Draco writes an unknown header");
  return blob;
} catch (...) {
  return DracoError("Draco threw an exception while encoding");
}

absl::Status DracoDecode(absl::string_view& bytes, size_t count, std::vector<uint32_t>& symbols) try {
  if (count == 0 || count > kMaxPoints) return CorruptPayload("a Draco blob cannot hold that many symbols");
  const std::string prefix = BlobPrefix(count);
  if (bytes.substr(0, prefix.size()) != prefix) {
    return CorruptPayload("a Draco blob's header is not as expected");
  }
  return DecodeCloud(bytes, count, symbols);
} catch (const std::bad_alloc&) {
  throw;
} catch (...) {
  return CorruptPayload("Draco threw an exception while decoding");
}

}  // namespace dynmesh
