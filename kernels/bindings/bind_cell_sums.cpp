#include <pybind11/pybind11.h>

#include <cstring>

#include "arrays.hpp"
#include "pbrdf/cell_sums.hpp"

namespace {

using namespace pbrdf;

void sum(const Array<float>& mueller, const Array<float>& variance, Array<std::int32_t>& cell, Array<float>& theta_h,
         Array<float>& phi_d, Array<float>& gain, Array<float>& out) {
  check_shape("cell", cell, {any_length, any_length});
  const py::ssize_t rows = cell.shape(0), columns = cell.shape(1);
  check_shape("mueller", mueller, {16, rows, columns});
  check_shape("variance", variance, {16, rows, columns});
  check_shape("theta_h", theta_h, {rows, columns});
  check_shape("phi_d", phi_d, {rows, columns});
  check_shape("gain", gain, {rows, columns});
  check_shape("out", out, {any_length, sums_per_cell});
  const float *matrices = mueller.data(), *spread = variance.data();
  const PixelCells cells{cell.mutable_data(), theta_h.mutable_data(), phi_d.mutable_data(), gain.mutable_data()};
  const std::int64_t count = out.shape(0);
  for (py::ssize_t p = 0; p < rows * columns; ++p)
    if (cells.cell[p] < no_cell || cells.cell[p] >= count)
      throw std::invalid_argument("cell names one beyond the rows of out");
  float* sums = out.mutable_data();
  py::gil_scoped_release release;
  sum_cells(matrices, spread, cells, rows, columns, count, sums);
}

}  // namespace

void register_cell_sums(py::module_& parent) {
  py::module_ m = parent.def_submodule("cell_sums", "Sums over the pixels of each cell of the table's grid.");
  m.attr("MOMENTS_AT") = moments_at;
  m.attr("SUMS_PER_CELL") = sums_per_cell;
  m.def("sum", &sum, py::arg("mueller").noconvert(), py::arg("variance").noconvert(), py::arg("cell").noconvert(),
        py::arg("theta_h").noconvert(), py::arg("phi_d").noconvert(), py::arg("gain").noconvert(),
        py::arg("out").noconvert(),
        "Sums over the pixels (16, rows, columns) of each cell into `out` (cells, 40) float32: gain M, gain^2 "
        "variance, then 1, x, y, x x, x y, y y of their places. A pixel with NaN for M00 is left out.");
}
