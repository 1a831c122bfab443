#ifndef DYNMESH_TESTS_SUPPORT_ROWS_H_
#define DYNMESH_TESTS_SUPPORT_ROWS_H_

#include <gtest/gtest.h>

#include <algorithm>
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

/// Expects that the columns of a copy are those of a mesh, row by row.
inline void ExpectSameRows(const std::vector<AttributeColumn>& copies, const Mesh& mesh) {
  ASSERT_EQ(copies.size(), mesh.attributes().size());
  for (const AttributeColumn& column : mesh.attributes()) {
    const auto copy = std::find_if(copies.begin(), copies.end(),
                                   [&](const AttributeColumn& c) { return c.spec() == column.spec(); });
    ASSERT_NE(copy, copies.end()) << column.spec().name;
    const Slot limit = mesh.slots(column.spec().kind).limit();
    for (Slot slot = 0; slot <= limit; ++slot) ASSERT_EQ(copy->Row(slot), column.Row(slot)) << slot;
  }
}

}  // namespace dynmesh::testing

#endif  // DYNMESH_TESTS_SUPPORT_ROWS_H_
