#ifndef DYNMESH_CORE_EDIT_MIX_ROWS_H_
#define DYNMESH_CORE_EDIT_MIX_ROWS_H_

#include <cstdint>
#include <vector>

#include "absl/types/span.h"
#include "core/mesh/attributes.h"

namespace dynmesh {

/// A row that another one is made of, and its weight.
struct RowShare {
  absl::Span<const uint8_t> row;
  double weight = 1;
};

/// The row that a column's policy makes of its parents:
///
///     kInterpolate  their sum, weighed; integers to the nearest, a half upwards
///     kCopy         that of the first that weighs most
///     kMax          of each component the greatest, whatever they weigh
///     kDrop         the default row
///
/// No component leaves the range of its parents, so equal ones stay equal and finite ones finite. int64 are
/// weighed as exactly as float64 holds their differences. A parent of weight 1 is taken to the bit.
/// REQUIRES: there is a parent; weights are not negative and add up to 1.
std::vector<uint8_t> MixRows(const AttributeColumn& column, absl::Span<const RowShare> parents);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_MIX_ROWS_H_
