#ifndef DYNMESH_CORE_EDIT_CONVERT_ROWS_H_
#define DYNMESH_CORE_EDIT_CONVERT_ROWS_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/mesh/attribute_spec.h"

namespace dynmesh {

/// `rows` of scalars of `from` as scalars of the column `to`, each of exactly the same value.
/// Errors: INVALID_ARGUMENT INEXACT_VALUE naming the attribute and the first row (index) with a value that
/// the column's type cannot hold: too large, not whole, with more digits, NaN. REQUIRES: whole rows of
/// to.components scalars.
absl::StatusOr<std::vector<uint8_t>> ConvertRows(absl::Span<const uint8_t> rows, AttributeType from,
                                                 const AttributeSpec& to);

}  // namespace dynmesh

#endif  // DYNMESH_CORE_EDIT_CONVERT_ROWS_H_
