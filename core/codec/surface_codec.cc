#include "core/codec/surface_codec.h"

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <new>

#include "absl/strings/str_cat.h"
#include "core/codec/bytes.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

using draco::AttributeValueIndex;
using draco::FaceIndex;
using draco::PointIndex;
using Triangle = std::array<uint32_t, 3>;

constexpr int kSurfaceSpeed = 5;
constexpr int kMaxPositionBits = 30;
constexpr int kFloatBits = 24;  // what float32 holds; Draco's time and memory double with each bit
// Draco takes memory and time in proportion to the largest difference of an integer attribute, so slots
// from here on travel as two components, the low and the high 16 bits.
constexpr Slot kFirstWideSlot = 1u << 20;
constexpr int kLowSlotBits = 16;
constexpr uint32_t kLowSlotMask = (1u << kLowSlotBits) - 1;

absl::Status DracoError(const draco::Status& status) {
  return MakeError(absl::StatusCode::kInternal, reason::kInternal, status.error_msg_string());
}

absl::Status OutOfMemory() {
  return MakeError(absl::StatusCode::kResourceExhausted, reason::kLimitExceeded,
                   "memory ran out in the surface codec", {{"limit", "memory"}});
}

// float32 is what a .drc file holds; Draco also subtracts and doubles, and overflows into wild writes.
bool FitsFloat(const Point& p) {
  constexpr double kLargest = std::numeric_limits<float>::max() / 4;
  return std::all_of(p.begin(), p.end(), [](double x) { return std::abs(x) <= kLargest; });
}

absl::Status CheckSurface(const TriangleSurface& surface, int position_bits) {
  if (position_bits < 1 || position_bits > kMaxPositionBits) {
    return InvalidArgument(reason::kBadArgument, "positions are quantised to 1-30 bits");
  }
  if (surface.positions.size() != surface.vertex_slots.size()) {
    return InvalidArgument(reason::kBadArrayLength, "positions are not one for each vertex");
  }
  if (!std::all_of(surface.positions.begin(), surface.positions.end(), FitsFloat)) {
    return InvalidArgument(reason::kNonFinite, "a position is too large for float32");
  }
  for (size_t i = 0; i < surface.triangles.size(); ++i) {
    const Triangle& t = surface.triangles[i];
    if (*std::max_element(t.begin(), t.end()) < surface.positions.size()) continue;
    return InvalidArgument(reason::kUnknownEntity, absl::StrCat("triangle ", i, " has a vertex out of range"),
                           {{"index", absl::StrCat(i)}});
  }
  return absl::OkStatus();
}

bool IsDegenerate(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

// For each vertex its row in the table of those that a triangle uses; kUnused for the others.
constexpr uint32_t kUnused = UINT32_MAX;
std::vector<uint32_t> NumberUsed(const std::vector<Triangle>& triangles, size_t num_vertices) {
  std::vector<uint32_t> rows(num_vertices, kUnused);
  for (const Triangle& t : triangles) {
    for (uint32_t v : t) rows[v] = 0;
  }
  uint32_t next = 0;
  for (uint32_t& row : rows) {
    if (row != kUnused) row = next++;
  }
  return rows;
}

// Without degenerate triangles and without the vertices that no other triangle uses.
TriangleSurface Tidy(const TriangleSurface& surface) {
  TriangleSurface tidy;
  std::remove_copy_if(surface.triangles.begin(), surface.triangles.end(), std::back_inserter(tidy.triangles),
                      IsDegenerate);
  const std::vector<uint32_t> rows = NumberUsed(tidy.triangles, surface.positions.size());
  for (size_t v = 0; v < rows.size(); ++v) {
    if (rows[v] == kUnused) continue;
    tidy.positions.push_back(surface.positions[v]);
    tidy.vertex_slots.push_back(surface.vertex_slots[v]);
  }
  for (Triangle& t : tidy.triangles) t = {rows[t[0]], rows[t[1]], rows[t[2]]};
  return tidy;
}

int AddPositions(const std::vector<Point>& positions, draco::Mesh& mesh) {
  draco::GeometryAttribute attribute;
  attribute.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 3 * sizeof(float),
                 0);
  const int id = mesh.AddAttribute(attribute, true, positions.size());
  for (uint32_t v = 0; v < positions.size(); ++v) {
    const Point& p = positions[v];
    const float xyz[] = {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
    mesh.attribute(id)->SetAttributeValue(AttributeValueIndex(v), xyz);
  }
  return id;
}

void AddSlots(const std::vector<VertexId>& slots, draco::Mesh& mesh) {
  const bool wide =
      std::any_of(slots.begin(), slots.end(), [](VertexId v) { return v.slot() >= kFirstWideSlot; });
  const int components = wide ? 2 : 1;
  draco::GeometryAttribute attribute;
  attribute.Init(draco::GeometryAttribute::GENERIC, nullptr, components, draco::DT_UINT32, false,
                 components * sizeof(uint32_t), 0);
  const int id = mesh.AddAttribute(attribute, true, slots.size());
  for (uint32_t v = 0; v < slots.size(); ++v) {
    const Slot slot = slots[v].slot();
    const uint32_t value[] = {wide ? slot & kLowSlotMask : slot, slot >> kLowSlotBits};
    mesh.attribute(id)->SetAttributeValue(AttributeValueIndex(v), value);
  }
}

void AddTriangles(const std::vector<Triangle>& triangles, draco::Mesh& mesh) {
  mesh.SetNumFaces(triangles.size());
  for (uint32_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    mesh.SetFace(FaceIndex(i), {PointIndex(t[0]), PointIndex(t[1]), PointIndex(t[2])});
  }
}

absl::StatusOr<std::string> EncodeMesh(const TriangleSurface& surface, int position_bits) {
  draco::Mesh mesh;
  mesh.set_num_points(surface.positions.size());
  const int positions = AddPositions(surface.positions, mesh);
  AddSlots(surface.vertex_slots, mesh);
  AddTriangles(surface.triangles, mesh);
  draco::ExpertEncoder encoder(mesh);
  encoder.SetSpeedOptions(kSurfaceSpeed, kSurfaceSpeed);
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  encoder.SetAttributeQuantization(positions, std::min(position_bits, kFloatBits));
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) return DracoError(status);
  return std::string(buffer.data(), buffer.size());
}

Slot ReadSlot(const draco::PointAttribute& attribute, PointIndex point) {
  uint32_t value[2] = {0, 0};
  attribute.GetMappedValue(point, value);
  return attribute.num_components() == 1 ? value[0] : value[1] << kLowSlotBits | (value[0] & kLowSlotMask);
}

bool IsSlotAttribute(const draco::PointAttribute* attribute) {
  return attribute != nullptr && attribute->data_type() == draco::DT_UINT32 &&
         (attribute->num_components() == 1 || attribute->num_components() == 2);
}

bool IsPositionAttribute(const draco::PointAttribute* attribute) {
  return attribute != nullptr && attribute->data_type() == draco::DT_FLOAT32 &&
         attribute->num_components() == 3;
}

// Draco's points, several of which may share a slot, as rows of a table with one row for each slot.
std::vector<uint32_t> MergeBySlot(const draco::Mesh& mesh, const draco::PointAttribute& attribute,
                                  TriangleSurface& surface) {
  std::vector<VertexId>& table = surface.vertex_slots;
  std::vector<VertexId> slots;
  for (PointIndex p(0); p < mesh.num_points(); ++p) slots.emplace_back(ReadSlot(attribute, p));
  table = slots;
  std::sort(table.begin(), table.end());
  table.erase(std::unique(table.begin(), table.end()), table.end());
  std::vector<uint32_t> rows;
  for (VertexId slot : slots) {
    rows.push_back(std::lower_bound(table.begin(), table.end(), slot) - table.begin());
  }
  return rows;
}

// REQUIRES: attributes that IsPositionAttribute and IsSlotAttribute.
TriangleSurface ToSurface(const draco::Mesh& mesh, const draco::PointAttribute& positions,
                          const draco::PointAttribute& slots) {
  TriangleSurface surface;
  const std::vector<uint32_t> rows = MergeBySlot(mesh, slots, surface);
  surface.positions.resize(surface.vertex_slots.size());
  for (PointIndex p(0); p < mesh.num_points(); ++p) {
    float xyz[3];
    positions.GetMappedValue(p, xyz);
    surface.positions[rows[p.value()]] = {xyz[0], xyz[1], xyz[2]};
  }
  for (FaceIndex f(0); f < mesh.num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh.face(f);
    surface.triangles.push_back({rows[face[0].value()], rows[face[1].value()], rows[face[2].value()]});
  }
  return surface;
}

absl::StatusOr<TriangleSurface> DecodeMesh(const std::string& bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Mesh mesh;
  draco::Decoder decoder;
  if (!decoder.DecodeBufferToGeometry(&buffer, &mesh).ok()) {
    return CorruptPayload("the surface cannot be decoded");
  }
  const draco::PointAttribute* positions = mesh.GetNamedAttribute(draco::GeometryAttribute::POSITION);
  const draco::PointAttribute* slots = mesh.GetNamedAttribute(draco::GeometryAttribute::GENERIC);
  if (!IsPositionAttribute(positions) || !IsSlotAttribute(slots)) {
    return CorruptPayload("the surface has no positions or no vertex slots");
  }
  return ToSurface(mesh, *positions, *slots);
}

}  // namespace

absl::StatusOr<std::string> EncodeSurface(const TriangleSurface& surface, int position_bits) try {
  DYNMESH_RETURN_IF_ERROR(CheckSurface(surface, position_bits));
  const TriangleSurface tidy = Tidy(surface);
  if (tidy.triangles.empty()) {
    return FailedPrecondition(reason::kBadArgument,
                              "the surface has no triangle with three distinct vertices");
  }
  return EncodeMesh(tidy, position_bits);
} catch (const std::bad_alloc&) {
  return OutOfMemory();
} catch (...) {
  return MakeError(absl::StatusCode::kInternal, reason::kInternal, "Draco threw an exception while encoding");
}

absl::StatusOr<TriangleSurface> DecodeSurface(const std::string& bytes) try {
  return DecodeMesh(bytes);
} catch (const std::bad_alloc&) {
  return OutOfMemory();
} catch (...) {
  return CorruptPayload("Draco threw an exception while decoding");
}

}  // namespace dynmesh
