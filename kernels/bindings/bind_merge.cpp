#include <pybind11/pybind11.h>

#include "arrays.hpp"
#include "pbrdf/merge.hpp"

namespace {

using namespace pbrdf;

LightSlice slice(const Array<float>& mueller, const Array<float>& variance, const Array<std::uint16_t>& count,
                 const Array<double>& theta_d, py::ssize_t halves, py::ssize_t azimuths) {
  check_shape("mueller of a light", mueller, {halves, azimuths, 4, 4});
  check_shape("variance of a light", variance, {halves, azimuths, 4, 4});
  check_shape("count of a light", count, {halves, azimuths});
  check_shape("theta_d of a light", theta_d, {halves, azimuths});
  return {mueller.data(), variance.data(), count.data(), theta_d.data()};
}

void interpolate(const Array<float>& low_mueller, const Array<float>& low_variance,
                 const Array<std::uint16_t>& low_count, const Array<double>& low_theta_d,
                 const Array<float>& high_mueller, const Array<float>& high_variance,
                 const Array<std::uint16_t>& high_count, const Array<double>& high_theta_d,
                 const Array<double>& theta_d, double widest_gap, Array<float>& mueller, Array<float>& variance,
                 Array<std::uint16_t>& count) {
  check_shape("theta_d", theta_d, {any_length});
  check_shape("mueller", mueller, {any_length, theta_d.shape(0), any_length, 4, 4});
  const TableShape shape{mueller.shape(0), mueller.shape(1), mueller.shape(2)};
  check_shape("variance", variance, {shape.halves, shape.differences, shape.azimuths, 4, 4});
  check_shape("count", count, {shape.halves, shape.differences, shape.azimuths});
  const LightSlice low = slice(low_mueller, low_variance, low_count, low_theta_d, shape.halves, shape.azimuths);
  const LightSlice high = slice(high_mueller, high_variance, high_count, high_theta_d, shape.halves, shape.azimuths);
  const TableBand table{mueller.mutable_data(), variance.mutable_data(), count.mutable_data()};
  const double* nodes = theta_d.data();
  py::gil_scoped_release release;
  interpolate_lights(low, high, shape, nodes, widest_gap, table);
}

}  // namespace

void register_merge(py::module_& parent) {
  py::module_ m = parent.def_submodule("merge", "Nodes of the table between two neighbouring lights.");
  m.def("interpolate", &interpolate, py::arg("low_mueller").noconvert(), py::arg("low_variance").noconvert(),
        py::arg("low_count").noconvert(), py::arg("low_theta_d").noconvert(), py::arg("high_mueller").noconvert(),
        py::arg("high_variance").noconvert(), py::arg("high_count").noconvert(), py::arg("high_theta_d").noconvert(),
        py::arg("theta_d").noconvert(), py::arg("widest_gap"), py::arg("mueller").noconvert(),
        py::arg("variance").noconvert(), py::arg("count").noconvert(),
        "Write the nodes of a band, `mueller` and `variance` (H, D, P, 4, 4) and `count` (H, D, P), whose theta_d lies "
        "between those of two lights (H, P).");
}
