#ifndef DYNMESH_CORE_MESH_ATTRIBUTE_SPEC_H_
#define DYNMESH_CORE_MESH_ATTRIBUTE_SPEC_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/mesh/ids.h"

namespace dynmesh {

/// Scalar type of an attribute column. The values travel on the wire: never renumber.
enum class AttributeType : uint8_t {
  kUnspecified = 0,
  kFloat64 = 1,
  kInt32 = 2,
  kFloat32 = 3,
  kInt64 = 4,
  kUint8 = 5,
};

/// Which row an entity takes that an operator makes of others, its parents (core/edit/OPERATORS.md). The
/// values travel on the wire: never renumber.
enum class AttributePolicy : uint8_t {
  kUnspecified = 0,  ///< kInterpolate for floating-point numbers, kCopy for integers
  kInterpolate = 1,  ///< vertices: weighed, integers to the nearest, a half upwards; others: kCopy
  kCopy = 2,         ///< that of the parent that weighs most
  kMax = 3,          ///< of each component the greatest of all parents
  kDrop = 4,         ///< the default row
};

/// Calls fn(Scalar()) with the C++ type of a scalar. REQUIRES: IsAttributeType(type).
template <typename Fn>
constexpr auto WithScalar(AttributeType type, Fn fn) {
  switch (type) {
    case AttributeType::kInt32:
      return fn(int32_t{});
    case AttributeType::kFloat32:
      return fn(float{});
    case AttributeType::kInt64:
      return fn(int64_t{});
    case AttributeType::kUint8:
      return fn(uint8_t{});
    default:
      return fn(double{});
  }
}

constexpr bool IsAttributeType(int type) { return type >= 1 && type <= 5; }
constexpr bool IsAttributePolicy(int policy) { return policy >= 0 && policy <= 4; }
constexpr bool IsFloatingPoint(AttributeType type) {
  return type == AttributeType::kFloat64 || type == AttributeType::kFloat32;
}

/// Bytes of one scalar: 8, 4 or 1; 0 for kUnspecified.
constexpr int ScalarBytes(AttributeType type) {
  if (!IsAttributeType(static_cast<int>(type))) return 0;
  return WithScalar(type, [](auto scalar) { return static_cast<int>(sizeof(scalar)); });
}

/// "float64" and so on.
absl::string_view AttributeTypeName(AttributeType type);

/// What kUnspecified means for a type.
constexpr AttributePolicy DefaultPolicy(AttributeType type) {
  return IsFloatingPoint(type) ? AttributePolicy::kInterpolate : AttributePolicy::kCopy;
}

inline constexpr int kMaxAttributeComponents = 16;
inline constexpr int kMaxAttributeNameBytes = 64;
inline constexpr int kMaxAttributeColumns = 64;

/// What a column is: fixed when it is added.
struct AttributeSpec {
  std::string name;  ///< 1-64 bytes of [A-Za-z0-9_.-]
  EntityKind kind = EntityKind::kVertex;
  AttributeType type = AttributeType::kFloat64;
  int components = 1;  ///< 1-16
  AttributePolicy policy = AttributePolicy::kUnspecified;
  std::vector<uint8_t> default_row = {};  ///< row_bytes() bytes, finite; or none: zeros

  int row_bytes() const { return ScalarBytes(type) * components; }
  /// The policy that kUnspecified stands for, or the policy.
  AttributePolicy effective_policy() const {
    return policy == AttributePolicy::kUnspecified ? DefaultPolicy(type) : policy;
  }
  /// Whether rows never set are zeros, however that is said.
  bool has_zero_default() const;

  /// Whether both say the same, in whatever words.
  friend bool operator==(const AttributeSpec& a, const AttributeSpec& b);
};

/// INVALID_ARGUMENT, with metadata attribute and field, if anything is outside what AttributeSpec says:
/// BAD_ARGUMENT; of the default row BAD_ARRAY_LENGTH, NON_FINITE_VALUE.
absl::Status CheckAttributeSpec(const AttributeSpec& spec);

/// INVALID_ARGUMENT NON_FINITE_VALUE naming the first row of `values` that holds NaN or an infinity.
/// REQUIRES: values.size() is a multiple of spec.row_bytes().
absl::Status CheckFinite(const AttributeSpec& spec, absl::Span<const uint8_t> values);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_MESH_ATTRIBUTE_SPEC_H_
