#include <pybind11/eigen.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "pbrdf/render.hpp"

namespace {

using namespace pbrdf;

Array<float> render(const Pinhole& camera, const SphereScene& scene, const std::array<double, 5>& material, int rows,
                    int columns, int samples) {
  if (rows < 1 || columns < 1 || samples < 1) throw std::invalid_argument("rows, columns and samples are at least 1");
  Array<float> out({rows, columns, 16});
  float* data = out.mutable_data();
  py::gil_scoped_release release;
  const auto [alpha, eta, kappa, specular, albedo] = material;
  render_mueller(camera, scene, FacetMaterial{alpha, eta, kappa, specular, albedo}, rows, columns, samples, data);
  return out;
}

void expose_frame(const Array<float>& mueller, const Array<double>& state, double electrons,
                  const Array<float>& dark_electrons, const Sensor& sensor, std::uint64_t key,
                  Array<std::uint16_t>& out) {
  check_shape("mueller", mueller, {any_length, any_length, 16});
  check_shape("state", state, {16});
  check_shape("dark_electrons", dark_electrons, {mueller.shape(0), mueller.shape(1)});
  check_shape("out", out, {mueller.shape(0), mueller.shape(1)});
  const float* matrices = mueller.data();
  const double* row = state.data();
  const float* dark = dark_electrons.data();
  std::uint16_t* frame = out.mutable_data();
  const std::int64_t pixels = mueller.shape(0) * mueller.shape(1);
  py::gil_scoped_release release;
  expose(matrices, row, pixels, electrons, dark, sensor, key, frame);
}

}  // namespace

void register_render(py::module_& parent) {
  py::module_ m = parent.def_submodule("render", "The virtual camera.");
  py::class_<Pinhole>(m, "Pinhole", "Focal lengths and principal point, pixels.")
      .def(py::init<double, double, double, double>(), py::arg("fx"), py::arg("fy"), py::arg("cx"), py::arg("cy"));
  py::class_<SphereScene>(m, "SphereScene", "A sphere, a point light and the modules' x axes; mm, camera frame.")
      .def(py::init<Vector3, double, Vector3, Vector3, Vector3>(), py::arg("centre"), py::arg("radius"),
           py::arg("light"), py::arg("generator_axis"), py::arg("analyser_axis"));
  py::class_<Sensor>(m, "Sensor", "Gain, noise and word of the sensor.")
      .def(py::init<double, double, double, int, int>(), py::arg("electrons_per_dn"), py::arg("read_noise_electrons"),
           py::arg("offset_dn"), py::arg("adc_bits"), py::arg("shift"));
  m.def("render_mueller", &render, py::arg("camera"), py::arg("scene"), py::arg("material"), py::arg("rows"),
        py::arg("columns"), py::arg("samples"),
        "material: (alpha, eta, kappa, specular, albedo). Mueller image of the light path in the modules' frames times "
        "cos(theta_i)/d^2, 1/(sr m^2): (rows, columns, 16) "
        "float32, zero where no lit surface is seen.");
  m.def("expose", &expose_frame, py::arg("mueller").noconvert(), py::arg("state").noconvert(), py::arg("electrons"),
        py::arg("dark_electrons").noconvert(), py::arg("sensor"), py::arg("key"), py::arg("out").noconvert(),
        "One raw frame of a Mueller image through a state (16,), into `out` (rows, columns) uint16. dark_electrons: "
        "(rows, columns) float32, the mean of each pixel without light.");
}
