#ifndef DYNMESH_TESTS_SUPPORT_ROWS_H_
#define DYNMESH_TESTS_SUPPORT_ROWS_H_

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <vector>

#include "core/mesh/mesh.h"

/// Rows of attributes as numbers.
namespace dynmesh::testing {

template <typename Scalar>
std::vector<uint8_t> RowOf(const std::vector<Scalar>& values) {
  std::vector<uint8_t> row(values.size() * sizeof(Scalar));
  if (!row.empty()) std::memcpy(row.data(), values.data(), row.size());
  return row;
}
template <typename Scalar>
std::vector<uint8_t> RowOf(std::initializer_list<Scalar> values) {
  return RowOf(std::vector<Scalar>(values));
}

template <typename Scalar>
std::vector<Scalar> ValuesOf(absl::Span<const uint8_t> row) {
  std::vector<Scalar> values(row.size() / sizeof(Scalar));
  if (!row.empty()) std::memcpy(values.data(), row.data(), row.size());
  return values;
}
template <typename Scalar>
std::vector<Scalar> ValuesAt(const Mesh& mesh, int column, Slot slot) {
  return ValuesOf<Scalar>(mesh.attributes()[column].Row(slot));
}

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SUPPORT_ROWS_H_
