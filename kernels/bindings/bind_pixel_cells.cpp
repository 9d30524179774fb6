#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>

#include "arrays.hpp"
#include "pbrdf/pixel_cells.hpp"

namespace {

using namespace pbrdf;

Lens make_lens(const std::array<double, 2>& focal, const std::array<double, 2>& principal,
               const std::array<double, 5>& distortion) {
  Lens lens;
  std::copy(focal.begin(), focal.end(), lens.focal);
  std::copy(principal.begin(), principal.end(), lens.principal);
  std::copy(distortion.begin(), distortion.end(), lens.distortion);
  return lens;
}

LitSphere make_scene(const std::array<double, 3>& centre, double radius, const std::array<double, 3>& light) {
  LitSphere scene;
  std::copy(centre.begin(), centre.end(), scene.centre);
  std::copy(light.begin(), light.end(), scene.light);
  scene.radius = radius;
  return scene;
}

void locate(const Lens& lens, const LitSphere& scene, const std::array<std::int64_t, 2>& first, double least_cosine,
            const std::array<std::int32_t, 2>& grid, Array<std::int32_t>& cell, Array<float>& theta_h,
            Array<float>& phi_d, Array<float>& gain) {
  check_shape("cell", cell, {any_length, any_length});
  const py::ssize_t rows = cell.shape(0), columns = cell.shape(1);
  check_shape("theta_h", theta_h, {rows, columns});
  check_shape("phi_d", phi_d, {rows, columns});
  check_shape("gain", gain, {rows, columns});
  if (grid[0] < 2 || grid[1] < 1) throw std::invalid_argument("a grid has 2 cells of theta_h and 1 of phi_d at least");
  const PixelCells out{cell.mutable_data(), theta_h.mutable_data(), phi_d.mutable_data(), gain.mutable_data()};
  py::gil_scoped_release release;
  locate_pixels(lens, scene, {first[0], first[1], rows, columns}, least_cosine, {grid[0], grid[1]}, out);
}

}  // namespace

void register_pixel_cells(py::module_& parent) {
  py::module_ m = parent.def_submodule("pixel_cells", "Which cell of the table's grid each pixel shows.");
  m.attr("NO_CELL") = no_cell;
  py::class_<Lens>(m, "Lens", "Focal lengths and principal point (columns, rows), px; Brown's k1 k2 p1 p2 k3.")
      .def(py::init(&make_lens), py::arg("focal"), py::arg("principal"), py::arg("distortion"));
  py::class_<LitSphere>(m, "LitSphere", "A sphere and a point light; mm, camera frame.")
      .def(py::init(&make_scene), py::arg("centre"), py::arg("radius"), py::arg("light"));
  m.def("locate", &locate, py::arg("lens"), py::arg("scene"), py::arg("first"), py::arg("least_cosine"),
        py::arg("grid"), py::arg("cell").noconvert(), py::arg("theta_h").noconvert(), py::arg("phi_d").noconvert(),
        py::arg("gain").noconvert(),
        "Cells of a grid (theta_h, phi_d) that the pixels of a window show, whose corner is `first` (row, column); "
        "all outputs are (rows, columns): cell int32, NO_CELL where there is none; place within the cell and "
        "d^2 / cos(theta_i), m^2, float32.");
}
