#include <pybind11/pybind11.h>

#include "arrays.hpp"
#include "pbrdf/gaps.hpp"

namespace {

using namespace pbrdf;

Grid grid_of(const Array<float>& mueller, const Array<double>& theta_h, const Array<double>& theta_d) {
  check_shape("mueller", mueller, {any_length, any_length, any_length, 4, 4});
  const TableShape shape{mueller.shape(0), mueller.shape(1), mueller.shape(2)};
  if (shape.azimuths < 2) throw std::invalid_argument("mueller has fewer than two azimuths");
  check_shape("theta_h", theta_h, {shape.halves});
  check_shape("theta_d", theta_d, {shape.differences});
  return {shape, theta_h.data(), theta_d.data()};
}

Gaps gaps_of(const TableShape& shape, Array<float>& mueller, const Array<std::uint8_t>& known,
             const Array<std::uint8_t>& target, Array<std::uint8_t>& done) {
  const std::initializer_list<py::ssize_t> nodes{shape.halves, shape.differences, shape.azimuths};
  check_shape("known", known, nodes);
  check_shape("target", target, nodes);
  check_shape("done", done, nodes);
  return {mueller.mutable_data(), known.data(), target.data(), done.mutable_data()};
}

Widths widths_of(double narrowest, double azimuth) {
  if (!(narrowest > 0 && azimuth > 0)) throw std::invalid_argument("a width is not positive");
  return {narrowest, azimuth};
}

void between(const Array<double>& theta_h, const Array<double>& theta_d, double narrowest, double azimuth,
             double farthest, Array<float>& mueller, const Array<std::uint8_t>& known,
             const Array<std::uint8_t>& target, Array<std::uint8_t>& done) {
  const Grid grid = grid_of(mueller, theta_h, theta_d);
  const Gaps gaps = gaps_of(grid.shape, mueller, known, target, done);
  const Widths widths = widths_of(narrowest, azimuth);
  py::gil_scoped_release release;
  fill_between(grid, widths, farthest, gaps);
}

void beyond(const Array<double>& theta_h, const Array<double>& theta_d, double narrowest, double azimuth,
            Array<float>& mueller, const Array<std::uint8_t>& known, const Array<std::uint8_t>& target,
            Array<std::uint8_t>& done) {
  const Grid grid = grid_of(mueller, theta_h, theta_d);
  const Gaps gaps = gaps_of(grid.shape, mueller, known, target, done);
  const Widths widths = widths_of(narrowest, azimuth);
  py::gil_scoped_release release;
  fill_beyond(grid, widths, gaps);
}

}  // namespace

void register_gaps(py::module_& parent) {
  py::module_ m = parent.def_submodule("gaps", "Nodes that were never measured, from those around them.");
  m.def("between", &between, py::arg("theta_h").noconvert(), py::arg("theta_d").noconvert(), py::arg("narrowest"),
        py::arg("azimuth"), py::arg("farthest"), py::arg("mueller").noconvert(), py::arg("known").noconvert(),
        py::arg("target").noconvert(), py::arg("done").noconvert(),
        "Fill targets of a band (H, D, P, 4, 4) between known nodes of their line, by a local cubic.");
  m.def("beyond", &beyond, py::arg("theta_h").noconvert(), py::arg("theta_d").noconvert(), py::arg("narrowest"),
        py::arg("azimuth"), py::arg("mueller").noconvert(), py::arg("known").noconvert(), py::arg("target").noconvert(),
        py::arg("done").noconvert(),
        "Fill targets that share two angles with a known node, linearly in the logarithm of M00.");
}
