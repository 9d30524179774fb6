#include <pybind11/pybind11.h>

#include "arrays.hpp"
#include "pbrdf/halves.hpp"

namespace {

using namespace pbrdf;

void convert(const Array<float>& values, float factor, Array<std::uint16_t>& halves) {
  check_shape("values", values, {any_length});
  check_shape("halves", halves, {values.shape(0)});
  const float* from = values.data();
  std::uint16_t* to = halves.mutable_data();
  const std::int64_t count = values.shape(0);
  py::gil_scoped_release release;
  to_halves(from, factor, count, to);
}

}  // namespace

void register_halves(py::module_& parent) {
  py::module_ m = parent.def_submodule("halves", "Numbers of 16 bits for the disk.");
  m.def("convert", &convert, py::arg("values").noconvert(), py::arg("factor"), py::arg("halves").noconvert(),
        "Values (n,) float32 times a factor as the bits of float16 into `halves` (n,) uint16.");
}
