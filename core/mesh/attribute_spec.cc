#include "core/mesh/attribute_spec.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

bool IsNameByte(char c) { return absl::ascii_isalnum(c) || c == '_' || c == '.' || c == '-'; }

bool IsName(absl::string_view name) {
  return !name.empty() && name.size() <= kMaxAttributeNameBytes &&
         std::all_of(name.begin(), name.end(), IsNameByte);
}

bool AreZeros(absl::Span<const uint8_t> bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](uint8_t byte) { return byte == 0; });
}

/// Offset of the first scalar that is not finite; values.size() if all are.
template <typename Float>
size_t FindNonFinite(absl::Span<const uint8_t> values) {
  size_t offset = 0;
  for (; offset < values.size(); offset += sizeof(Float)) {
    Float value;
    std::memcpy(&value, values.data() + offset, sizeof(value));
    if (!std::isfinite(value)) break;
  }
  return offset;
}

absl::Status BadSpec(const AttributeSpec& spec, absl::string_view field, absl::string_view message) {
  return InvalidArgument(reason::kBadArgument, message,
                         {{"attribute", spec.name}, {"field", std::string(field)}});
}

absl::Status CheckDefaultRow(const AttributeSpec& spec) {
  const size_t size = spec.default_row.size();
  const ErrorMetadata metadata = {{"attribute", spec.name}, {"field", "default_row"}};
  if (size != 0 && size != static_cast<size_t>(spec.row_bytes())) {
    return InvalidArgument(reason::kBadArrayLength,
                           absl::StrCat("the default row of attribute '", spec.name, "' has ", size,
                                        " bytes, not ", spec.row_bytes()),
                           metadata);
  }
  if (CheckFinite(spec, spec.default_row).ok()) return absl::OkStatus();
  return InvalidArgument(reason::kNonFinite,
                         absl::StrCat("the default row of attribute '", spec.name, "' is not finite"),
                         metadata);
}

}  // namespace

absl::string_view AttributeTypeName(AttributeType type) {
  constexpr absl::string_view kNames[] = {"unspecified", "float64", "int32", "float32", "int64", "uint8"};
  return kNames[IsAttributeType(static_cast<int>(type)) ? static_cast<int>(type) : 0];
}

bool AttributeSpec::has_zero_default() const { return AreZeros(default_row); }

bool operator==(const AttributeSpec& a, const AttributeSpec& b) {
  return a.name == b.name && a.kind == b.kind && a.type == b.type && a.components == b.components &&
         a.effective_policy() == b.effective_policy() &&
         (a.default_row == b.default_row || (a.has_zero_default() && b.has_zero_default()));
}

absl::Status CheckAttributeSpec(const AttributeSpec& spec) {
  if (!IsName(spec.name)) {
    return InvalidArgument(reason::kBadArgument, "an attribute's name is 1-64 bytes of [A-Za-z0-9_.-]",
                           {{"field", "name"}});
  }
  if (static_cast<int>(spec.kind) >= kNumEntityKinds) {
    return BadSpec(spec, "kind", "an attribute is of an entity kind");
  }
  if (ScalarBytes(spec.type) == 0) {
    return BadSpec(spec, "type", "an attribute is of type float64, int32, float32, int64 or uint8");
  }
  if (spec.components < 1 || spec.components > kMaxAttributeComponents) {
    return BadSpec(spec, "components",
                   absl::StrCat("an attribute has 1-16 components, not ", spec.components));
  }
  if (!IsAttributePolicy(static_cast<int>(spec.policy))) {
    return BadSpec(spec, "policy", "an attribute's policy is interpolate, copy, max or drop");
  }
  return CheckDefaultRow(spec);
}

absl::Status CheckFinite(const AttributeSpec& spec, absl::Span<const uint8_t> values) {
  if (!IsFloatingPoint(spec.type)) return absl::OkStatus();
  assert(values.size() % spec.row_bytes() == 0);
  const size_t offset =
      spec.type == AttributeType::kFloat64 ? FindNonFinite<double>(values) : FindNonFinite<float>(values);
  if (offset == values.size()) return absl::OkStatus();
  const std::string row = absl::StrCat(offset / spec.row_bytes());
  return InvalidArgument(reason::kNonFinite,
                         absl::StrCat("row ", row, " of attribute ", spec.name, " is not finite"),
                         {{"attribute", spec.name}, {"index", row}});
}

}  // namespace dynmesh
