// dynmesh._native: decoding of deltas and surfaces, and partial checksums, for numpy.
//
// Arrays given out are views into the decoded value, which lives as long as any of them; nothing is copied.
// Failures leave as DecodeError(code, message, reason, metadata), which dynmesh.delta turns into its own types.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/codec/codec.h"
#include "core/codec/surface_codec.h"
#include "core/mesh/checksum.h"
#include "core/mesh/error.h"

namespace py = pybind11;

namespace dynmesh {
namespace {

static_assert(sizeof(VertexId) == sizeof(uint32_t) && sizeof(ElementType) == 1 && sizeof(Point) == 24,
              "the arrays of a Delta are handed to numpy as they are");

/// `data` as a read-only array whose base keeps `owner` alive.
template <typename Scalar>
py::array View(const void* data, std::vector<py::ssize_t> shape, const py::object& owner) {
  py::array_t<Scalar> array(std::move(shape), static_cast<const Scalar*>(data), owner);
  array.attr("flags").attr("writeable") = false;
  return array;
}

template <typename Scalar, typename T>
py::array View(const std::vector<T>& values, const py::object& owner) {
  return View<Scalar>(values.data(), {static_cast<py::ssize_t>(values.size())}, owner);
}

py::array PointsView(const std::vector<Point>& points, const py::object& owner) {
  return View<double>(points.data(), {static_cast<py::ssize_t>(points.size()), 3}, owner);
}

/// Moves `value` to where Python owns it; returns it with its owner.
template <typename T>
std::pair<const T&, py::capsule> GiveToPython(T value) {
  auto owned = std::make_unique<T>(std::move(value));
  const T& kept = *owned;
  py::capsule owner(owned.get(), [](void* p) { delete static_cast<T*>(p); });
  owned.release();  // NOLINT: the capsule deletes it
  return {kept, std::move(owner)};
}

[[noreturn]] void Throw(const absl::Status& status) {
  const ErrorDetail detail = GetErrorDetail(status).value_or(ErrorDetail());
  const py::object type = py::module_::import("dynmesh._native").attr("DecodeError");
  const std::string message(status.message().data(), status.message().size());
  const py::tuple args = py::make_tuple(static_cast<int>(status.code()), message, detail.reason, detail.metadata);
  PyErr_SetObject(type.ptr(), args.ptr());
  throw py::error_already_set();
}

py::tuple ElementLists(const ElementChanges& changes, const py::object& owner) {
  return py::make_tuple(View<uint32_t>(changes.removed, owner), View<uint32_t>(changes.slots, owner),
                        View<uint8_t>(changes.types, owner), View<uint32_t>(changes.vertices, owner));
}

py::array Values(const AttributeChanges& changes, const py::object& owner) {
  const std::vector<py::ssize_t> shape = {static_cast<py::ssize_t>(changes.slots.size()),
                                          changes.spec.components};
  return WithScalar(changes.spec.type, [&](auto scalar) -> py::array {
    return View<decltype(scalar)>(changes.rows.data(), shape, owner);
  });
}

/// A copy: [components].
py::array DefaultRow(const AttributeSpec& spec) {
  const AttributeColumn column(spec);
  return WithScalar(spec.type, [&](auto scalar) -> py::array {
    return py::array_t<decltype(scalar)>(
        spec.components, reinterpret_cast<const decltype(scalar)*>(column.default_row().data()));
  });
}

py::list AttributeLists(const Delta& delta, const py::object& owner) {
  py::list lists;
  for (const AttributeChanges& changes : delta.attributes) {
    lists.append(py::make_tuple(changes.spec.name, Dimension(changes.spec.kind),
                                View<uint32_t>(changes.slots, owner), Values(changes, owner),
                                DefaultRow(changes.spec), static_cast<int>(changes.spec.effective_policy())));
  }
  return lists;
}

py::list ElementListsByKind(const Delta& delta, const py::object& owner) {
  py::list lists;
  for (const ElementChanges& changes : delta.elements) lists.append(ElementLists(changes, owner));
  return lists;
}

py::dict ToPython(Delta decoded, int position_bits) {
  const auto [delta, owner] = GiveToPython(std::move(decoded));
  py::dict parts;
  parts["from_revision"] = delta.from_revision;
  parts["to_revision"] = delta.to_revision;
  parts["consistent"] = delta.consistent;
  parts["removed_vertices"] = View<uint32_t>(delta.removed_vertices, owner);
  parts["vertex_slots"] = View<uint32_t>(delta.vertex_slots, owner);
  parts["positions"] = PointsView(delta.positions, owner);
  parts["elements"] = ElementListsByKind(delta, owner);
  parts["attributes"] = AttributeLists(delta, owner);
  parts["checksum"] = py::make_tuple(delta.checksum.topology, delta.checksum.geometry);
  parts["position_bits"] = position_bits;
  return parts;
}

absl::StatusOr<std::pair<Delta, int>> DecodeWithHeader(absl::string_view bytes) {
  DYNMESH_ASSIGN_OR_RETURN(const DeltaHeader header, PeekDelta(bytes));
  DYNMESH_ASSIGN_OR_RETURN(Delta delta, DecodeDelta(bytes));
  return std::pair(std::move(delta), header.position_bits);
}

absl::string_view BytesOf(const py::bytes& payload) {
  return absl::string_view(PyBytes_AS_STRING(payload.ptr()), PyBytes_GET_SIZE(payload.ptr()));
}

py::dict Decode(const py::bytes& payload) {
  absl::StatusOr<std::pair<Delta, int>> decoded = absl::UnknownError("not decoded");
  {
    py::gil_scoped_release release;
    decoded = DecodeWithHeader(BytesOf(payload));
  }
  if (!decoded.ok()) Throw(decoded.status());
  return ToPython(std::move(decoded->first), decoded->second);
}

py::tuple DecodeSurfaceFile(const std::string& drc) {
  absl::StatusOr<TriangleSurface> decoded = absl::UnknownError("not decoded");
  {
    py::gil_scoped_release release;
    decoded = DecodeSurface(drc);
  }
  if (!decoded.ok()) Throw(decoded.status());
  const auto [surface, owner] = GiveToPython(*std::move(decoded));
  const auto triangles = static_cast<py::ssize_t>(surface.triangles.size());
  return py::make_tuple(View<uint32_t>(surface.vertex_slots, owner), PointsView(surface.positions, owner),
                        View<uint32_t>(surface.triangles.data(), {triangles, 3}, owner));
}

template <typename T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

void Require(bool condition, const char* message) {
  if (!condition) throw py::value_error(message);
}

uint64_t PositionSum(const Array<uint32_t>& slots, const Array<double>& positions) {
  Require(slots.ndim() == 1 && positions.size() == 3 * slots.size(), "one position for each slot");
  const uint32_t* slot = slots.data();
  const double* xyz = positions.data();
  py::gil_scoped_release release;
  uint64_t sum = 0;
  for (py::ssize_t i = 0, n = slots.size(); i < n; ++i, xyz += 3) {
    sum += Checksum::PositionTerm(slot[i], {xyz[0], xyz[1], xyz[2]});
  }
  return sum;
}

uint64_t ElementSum(const Array<uint8_t>& types, const Array<uint32_t>& slots, const Array<uint32_t>& rows) {
  Require(types.ndim() == 1 && types.size() == slots.size() && rows.ndim() == 2 && rows.shape(0) == types.size(),
          "one type and one row for each slot");
  const py::ssize_t count = types.size(), width = rows.shape(1);
  const uint8_t* type = types.data();
  const bool fit = std::all_of(type, type + count, [width](uint8_t t) {
    return IsElementType(t) && NumVertices(static_cast<ElementType>(t)) <= width;
  });
  Require(fit, "types are 1-7 and no wider than a row");
  const uint32_t* slot = slots.data();
  const auto* row = reinterpret_cast<const VertexId*>(rows.data());
  py::gil_scoped_release release;
  uint64_t sum = 0;
  for (py::ssize_t i = 0; i < count; ++i, row += width) {
    const auto element_type = static_cast<ElementType>(type[i]);
    sum += Checksum::ElementTerm(element_type, slot[i], absl::MakeConstSpan(row, NumVertices(element_type)));
  }
  return sum;
}

PYBIND11_MODULE(_native, m) {
  m.doc() = "Decoding of deltas (core/codec/FORMAT.md) and partial checksums.";
  py::exception<absl::Status>(m, "DecodeError", PyExc_RuntimeError);
  m.def("decode", &Decode, py::arg("payload"),
        "A delta as a dict of scalars and read-only arrays. Raises DecodeError(code, message, reason, metadata).");
  m.def("decode_surface", &DecodeSurfaceFile, py::arg("drc"),
        "(vertex slots u32[n], positions f64[n, 3], triangles u32[m, 3]) of a .drc boundary surface.");
  m.def("position_sum", &PositionSum, py::arg("slots"), py::arg("positions"),
        "Sum modulo 2^64 of the geometry terms of vertices.");
  m.def("element_sum", &ElementSum, py::arg("types"), py::arg("slots"), py::arg("rows"),
        "Sum modulo 2^64 of the topology terms of elements; rows are padded to a common width.");
}

}  // namespace
}  // namespace dynmesh
