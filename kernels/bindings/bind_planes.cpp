#include <pybind11/pybind11.h>

#include "arrays.hpp"
#include "pbrdf/planes.hpp"

namespace {

using namespace pbrdf;

template <typename Raw>
void combine(const Array<Raw>& planes, const Array<double>& matrix, Array<float>& out) {
  check_shape("planes", planes, {any_length, any_length});
  const py::ssize_t states = planes.shape(0), pixels = planes.shape(1);
  check_shape("matrix", matrix, {16, states});
  check_shape("out", out, {16, pixels});
  const Raw* raw = planes.data();
  const double* weights = matrix.data();
  float* result = out.mutable_data();
  py::gil_scoped_release release;
  combine_planes(raw, weights, static_cast<int>(states), pixels, result);
}

template <typename Raw>
void define_combine(py::module_& m) {
  m.def("combine", &combine<Raw>, py::arg("planes").noconvert(), py::arg("matrix").noconvert(),
        py::arg("out").noconvert(),
        "Weighted sums of planes (states, pixels) by `matrix` (16, states) into `out` (16, pixels) float32.");
}

}  // namespace

void register_planes(py::module_& parent) {
  py::module_ m = parent.def_submodule("planes", "Sixteen weighted sums of any number of planes.");
  define_combine<std::uint8_t>(m);
  define_combine<std::uint16_t>(m);
  define_combine<float>(m);
}
