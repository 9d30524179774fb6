#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "pbrdf/symmetry.hpp"

namespace {

using namespace pbrdf;

TableShape shape_of(const Array<std::uint8_t>& origin) {
  check_shape("origin", origin, {any_length, any_length, any_length});
  if (origin.shape(2) < 2) throw std::invalid_argument("origin has fewer than two azimuths");
  return {origin.shape(0), origin.shape(1), origin.shape(2)};
}

void check_matrices(const char* name, const py::array& matrices, const TableShape& shape) {
  check_shape(name, matrices, {shape.halves, shape.differences, shape.azimuths, 4, 4});
}

SymmetricBand band_of(const TableShape& shape, Array<float>& mueller, Array<float>& variance,
                      Array<std::uint16_t>& count, Array<std::uint8_t>& origin) {
  check_matrices("mueller", mueller, shape);
  check_matrices("variance", variance, shape);
  check_shape("count", count, {shape.halves, shape.differences, shape.azimuths});
  return {mueller.mutable_data(), variance.mutable_data(), count.mutable_data(), origin.mutable_data(), nullptr};
}

void pool(Array<float>& mueller, Array<float>& variance, Array<std::uint16_t>& count, Array<std::uint8_t>& origin,
          const Array<double>& weight) {
  const TableShape shape = shape_of(origin);
  SymmetricBand band = band_of(shape, mueller, variance, count, origin);
  check_shape("weight", weight, {shape.halves, shape.differences, shape.azimuths});
  band.weight = weight.data();
  py::gil_scoped_release release;
  pool_partners(shape, band);
}

void copy(Array<float>& mueller, Array<float>& variance, Array<std::uint16_t>& count, Array<std::uint8_t>& origin) {
  const TableShape shape = shape_of(origin);
  const SymmetricBand band = band_of(shape, mueller, variance, count, origin);
  py::gil_scoped_release release;
  copy_partners(shape, band);
}

void compare(const Array<float>& mueller, const std::optional<Array<float>>& variance,
             const Array<std::uint8_t>& origin, Array<double>& out) {
  const TableShape shape = shape_of(origin);
  check_matrices("mueller", mueller, shape);
  if (variance) check_matrices("variance", *variance, shape);
  static_assert(sizeof(Disagreement) == 50 * sizeof(double));
  check_shape("out", out, {shape.halves, shape.differences, 2, 50});
  const float* matrices = mueller.data();
  const float* spread = variance ? variance->data() : nullptr;
  const std::uint8_t* origins = origin.data();
  Disagreement* sums = reinterpret_cast<Disagreement*>(out.mutable_data());
  py::gil_scoped_release release;
  compare_partners(shape, matrices, spread, origins, sums);
}

}  // namespace

void register_symmetry(py::module_& parent) {
  py::module_ m = parent.def_submodule("symmetry", "What mirror images and exchanged directions say of a node.");
  m.def("pool", &pool, py::arg("mueller").noconvert(), py::arg("variance").noconvert(), py::arg("count").noconvert(),
        py::arg("origin").noconvert(), py::arg("weight").noconvert(),
        "Give all nodes of a band (H, D, P) that hold one matrix the weighted mean of their measurements.");
  m.def("copy", &copy, py::arg("mueller").noconvert(), py::arg("variance").noconvert(), py::arg("count").noconvert(),
        py::arg("origin").noconvert(), "Give unseen nodes of a band a measured partner's matrix.");
  m.def("compare", &compare, py::arg("mueller").noconvert(), py::arg("variance").noconvert().none(true),
        py::arg("origin").noconvert(), py::arg("out").noconvert(),
        "Sums over pairs of partners into `out` (H, D, 2, 50) float64: pairs, M00, then 16 each of |difference|, pairs "
        "with a variance, difference^2 / variance; for the mirror, then the exchange.");
}
