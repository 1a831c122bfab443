#include "core/edit/convert_rows.h"

#include <cstring>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/mesh/error.h"

namespace dynmesh {
namespace {

/// Holds every value of every type exactly.
using Wide = long double;
static_assert(std::numeric_limits<Wide>::digits >= 64);

/// False if `to` cannot hold the value.
template <typename From, typename To>
bool Convert(From from, To& to) {
  const Wide exact = static_cast<Wide>(from);
  const bool inside = exact >= std::numeric_limits<To>::lowest() && exact <= std::numeric_limits<To>::max();
  if (!inside) return false;
  to = static_cast<To>(exact);
  return static_cast<Wide>(to) == exact;
}

/// Converts up to the first value that does not fit; returns how many did.
template <typename From, typename To>
size_t ConvertAll(absl::Span<const uint8_t> from, std::vector<uint8_t>& to) {
  const size_t count = from.size() / sizeof(From);
  to.resize(count * sizeof(To));
  for (size_t i = 0; i < count; ++i) {
    From value;
    std::memcpy(&value, from.data() + i * sizeof(value), sizeof(value));
    To converted;
    if (!Convert(value, converted)) return i;
    std::memcpy(to.data() + i * sizeof(converted), &converted, sizeof(converted));
  }
  return count;
}

}  // namespace

absl::StatusOr<std::vector<uint8_t>> ConvertRows(absl::Span<const uint8_t> rows, AttributeType from,
                                                 const AttributeSpec& to) {
  std::vector<uint8_t> converted;
  const size_t count = WithScalar(from, [&](auto source) {
    return WithScalar(to.type, [&](auto target) {
      return ConvertAll<decltype(source), decltype(target)>(rows, converted);
    });
  });
  if (count == rows.size() / ScalarBytes(from)) return converted;
  const std::string row = absl::StrCat(count / to.components);
  return InvalidArgument(reason::kInexactValue,
                         absl::StrCat("row ", row, " for attribute '", to.name, "' has a value that ",
                                      AttributeTypeName(to.type), " cannot hold"),
                         {{"attribute", to.name}, {"index", row}});
}

}  // namespace dynmesh
