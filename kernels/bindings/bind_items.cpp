#include <pybind11/pybind11.h>

#include "arrays.hpp"
#include "pbrdf/items.hpp"

namespace {

using namespace pbrdf;

void gather(const py::array_t<float, 0>& matrices, Array<float>& out) {
  if (matrices.ndim() != 6 || matrices.shape(4) != 4 || matrices.shape(5) != 4 || matrices.strides(5) != 4 ||
      matrices.strides(4) != 16)
    throw std::invalid_argument("matrices are not (*, *, *, *, 4, 4) with each matrix in one piece");
  check_shape("out", out, {matrices.shape(0), matrices.shape(1), matrices.shape(2), matrices.shape(3), 4, 4});
  ItemView view{reinterpret_cast<const unsigned char*>(matrices.data()), {}, {}};
  for (int axis = 0; axis < 4; ++axis) {
    view.shape[axis] = matrices.shape(axis);
    view.strides[axis] = matrices.strides(axis);
  }
  unsigned char* to = reinterpret_cast<unsigned char*>(out.mutable_data());
  py::gil_scoped_release release;
  gather_items(view, to);
}

}  // namespace

void register_items(py::module_& parent) {
  py::module_ m = parent.def_submodule("items", "Matrices of a table in another order of its axes.");
  m.def("gather", &gather, py::arg("matrices").noconvert(), py::arg("out").noconvert(),
        "Copy a view (*, *, *, *, 4, 4) float32 of any strides, each matrix in one piece, to `out` in C order.");
}
