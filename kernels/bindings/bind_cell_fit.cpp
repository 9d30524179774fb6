#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>

#include "arrays.hpp"
#include "pbrdf/cell_fit.hpp"

namespace {

using namespace pbrdf;

void fit(const Array<float>& sums, const std::array<std::int32_t, 2>& grid, const std::array<std::int32_t, 2>& stride,
         Array<float>& mueller, Array<float>& variance, Array<std::uint16_t>& count) {
  const CellGrid cells{grid[0], grid[1]}, step{stride[0], stride[1]};
  if (cells.theta_h < 2 || cells.phi_d < 3 || step.theta_h < 1 || step.phi_d < 1 ||
      (cells.theta_h - 1) % step.theta_h || cells.phi_d % step.phi_d)
    throw std::invalid_argument("the stride does not divide the grid");
  check_shape("sums", sums, {cells.count(), sums_per_cell});
  const py::ssize_t rows = (cells.theta_h - 1) / step.theta_h + 1, columns = cells.phi_d / step.phi_d;
  check_shape("mueller", mueller, {rows, columns, 16});
  check_shape("variance", variance, {rows, columns, 16});
  check_shape("count", count, {rows, columns});
  const float* of = sums.data();
  const NodeValues out{mueller.mutable_data(), variance.mutable_data(), count.mutable_data()};
  py::gil_scoped_release release;
  fit_cells(of, cells, step, out);
}

}  // namespace

void register_cell_fit(py::module_& parent) {
  py::module_ m = parent.def_submodule("cell_fit", "Values at nodes from means over cells.");
  m.def("fit", &fit, py::arg("sums").noconvert(), py::arg("grid"), py::arg("stride"), py::arg("mueller").noconvert(),
        py::arg("variance").noconvert(), py::arg("count").noconvert(),
        "Quadratics fitted to the sums (cells, 40) over the 3 x 3 cells around every so manieth cell of `grid` as "
        "`stride` tells (both theta_h, phi_d): mueller, variance (nodes of theta_h, of phi_d, 16) float32 and count "
        "uint16, the pixels "
        "behind each. Where the cells do not tell a node: NaN, 0.");
}
