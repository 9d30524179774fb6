#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <tuple>
#include <vector>

#include "arrays.hpp"
#include "pbrdf/merge.hpp"

namespace {

using namespace pbrdf;

using LightArrays = std::tuple<Array<float>, Array<float>, Array<std::uint16_t>, Array<double>>;

void interpolate(const std::vector<LightArrays>& lights, int low, const Array<double>& theta_d, double widest_gap,
                 Array<float>& mueller, Array<float>& variance, Array<std::uint16_t>& count) {
  check_shape("theta_d", theta_d, {any_length});
  check_shape("mueller", mueller, {any_length, theta_d.shape(0), any_length, 4, 4});
  const TableShape shape{mueller.shape(0), mueller.shape(1), mueller.shape(2)};
  check_shape("variance", variance, {shape.halves, shape.differences, shape.azimuths, 4, 4});
  check_shape("count", count, {shape.halves, shape.differences, shape.azimuths});
  const int number = static_cast<int>(lights.size());
  if (low < 0 || low > 1 || number < low + 2 || number > low + 3)
    throw std::invalid_argument("lights are the two that bracket, from `low` on, and at most one before and after");
  std::vector<LightSlice> slices;
  for (const auto& [matrices, spread, pixels, seen] : lights) {
    check_shape("mueller of a light", matrices, {shape.halves, shape.azimuths, 4, 4});
    check_shape("variance of a light", spread, {shape.halves, shape.azimuths, 4, 4});
    check_shape("count of a light", pixels, {shape.halves, shape.azimuths});
    check_shape("theta_d of a light", seen, {shape.halves, shape.azimuths});
    slices.push_back({matrices.data(), spread.data(), pixels.data(), seen.data()});
  }
  const TableBand table{mueller.mutable_data(), variance.mutable_data(), count.mutable_data()};
  const double* nodes = theta_d.data();
  py::gil_scoped_release release;
  interpolate_lights({slices.data(), number, low}, shape, nodes, widest_gap, table);
}

}  // namespace

void register_merge(py::module_& parent) {
  py::module_ m = parent.def_submodule("merge", "Nodes of the table between neighbouring lights.");
  m.def("interpolate", &interpolate, py::arg("lights"), py::arg("low"), py::arg("theta_d").noconvert(),
        py::arg("widest_gap"), py::arg("mueller").noconvert(), py::arg("variance").noconvert(),
        py::arg("count").noconvert(),
        "Write the nodes of a band, `mueller` and `variance` (H, D, P, 4, 4) and `count` (H, D, P), whose theta_d lies "
        "between those of lights[low] and lights[low + 1], each of mueller, variance, count and theta_d (H, P, ...); "
        "a light before and one after them help.");
}
