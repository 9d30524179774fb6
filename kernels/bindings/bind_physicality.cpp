#include <pybind11/pybind11.h>

#include "arrays.hpp"
#include "pbrdf/physicality.hpp"

namespace {

using namespace pbrdf;

template <typename T>
void eigenvalues(const Array<T>& mueller, Array<T>& out) {
  check_shape("mueller", mueller, {any_length, 4, 4});
  const py::ssize_t pixels = mueller.shape(0);
  check_shape("out", out, {pixels, 4});
  const T* m = mueller.data();
  T* values = out.mutable_data();
  py::gil_scoped_release release;
  coherency_eigenvalues(m, pixels, values);
}

template <typename T>
void mask(const Array<T>& mueller, T tolerance, Array<bool>& out) {
  check_shape("mueller", mueller, {any_length, 4, 4});
  const py::ssize_t pixels = mueller.shape(0);
  check_shape("out", out, {pixels});
  if (!(tolerance >= 0)) throw std::invalid_argument("tolerance is negative or not a number");
  const T* m = mueller.data();
  bool* physical = out.mutable_data();
  py::gil_scoped_release release;
  physicality_mask(m, pixels, tolerance, physical);
}

template <typename T>
void nearest(const Array<T>& mueller, Array<T>& out) {
  check_shape("mueller", mueller, {any_length, 4, 4});
  const py::ssize_t pixels = mueller.shape(0);
  check_shape("out", out, {pixels, 4, 4});
  const T* m = mueller.data();
  T* projected = out.mutable_data();
  py::gil_scoped_release release;
  nearest_physical(m, pixels, projected);
}

template <typename T>
void define(py::module_& m) {
  m.def("coherency_eigenvalues", &eigenvalues<T>, py::arg("mueller").noconvert(), py::arg("out").noconvert(),
        "Ascending eigenvalues of the coherency matrices of `mueller` (n, 4, 4) into `out` (n, 4), both float32 or "
        "float64; NaN where an element is not finite.");
  m.def("physicality_mask", &mask<T>, py::arg("mueller").noconvert(), py::arg("tolerance"), py::arg("out").noconvert(),
        "Whether the smallest eigenvalue is at least -tolerance M00, into `out` (n,) bool.");
  m.def("nearest_physical", &nearest<T>, py::arg("mueller").noconvert(), py::arg("out").noconvert(),
        "Nearest physical matrices in Frobenius norm into `out` (n, 4, 4), which may be `mueller`.");
}

}  // namespace

void register_physicality(py::module_& parent) {
  py::module_ m =
      parent.def_submodule("physicality", "Cloude's test of Mueller matrices, and the nearest that passes.");
  define<float>(m);
  define<double>(m);
}
