#include <pybind11/pybind11.h>

#include "arrays.hpp"
#include "pbrdf/decomposition.hpp"

namespace {

using namespace pbrdf;

template <typename T>
void decompose(const Array<T>& mueller, Array<T>& depolariser, Array<T>& retarder, Array<T>& diattenuator,
               Array<std::uint8_t>& guard) {
  check_shape("mueller", mueller, {any_length, 4, 4});
  const py::ssize_t pixels = mueller.shape(0);
  check_shape("depolariser", depolariser, {pixels, 4, 4});
  check_shape("retarder", retarder, {pixels, 4, 4});
  check_shape("diattenuator", diattenuator, {pixels, 4, 4});
  check_shape("guard", guard, {pixels});
  const T* m = mueller.data();
  const LuChipmanFactors<T> factors{depolariser.mutable_data(), retarder.mutable_data(), diattenuator.mutable_data(),
                                    reinterpret_cast<Guard*>(guard.mutable_data())};
  py::gil_scoped_release release;
  lu_chipman(m, pixels, factors);
}

template <typename T>
void define(py::module_& m) {
  m.def("lu_chipman", &decompose<T>, py::arg("mueller").noconvert(), py::arg("depolariser").noconvert(),
        py::arg("retarder").noconvert(), py::arg("diattenuator").noconvert(), py::arg("guard").noconvert(),
        "Factors of `mueller` (n, 4, 4) into three arrays of its shape, all float32 or float64, and what stood in the "
        "way into `guard` (n,) uint8: 0 nothing, 1 singular, 2 rank one, 3 polariser, 4 undefined (NaN).");
}

}  // namespace

void register_decomposition(py::module_& parent) {
  py::module_ m = parent.def_submodule("decomposition", "Lu and Chipman's polar decomposition of Mueller matrices.");
  define<float>(m);
  define<double>(m);
}
