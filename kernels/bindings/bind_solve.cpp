#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <optional>

#include "arrays.hpp"
#include "pbrdf/solve.hpp"

namespace {

using namespace pbrdf;

void solve(const Array<double>& reduction, const Array<double>& measurement, const Array<double>& exposures_s,
           double dn_per_electron, double read_noise_dn, double dark_variance, const Array<float>& rate,
           const Array<std::uint8_t>& used, const std::optional<Array<float>>& inverse_flat, Array<float>& mueller,
           Array<float>& variance, Array<float>& residual, Array<float>& expected) {
  check_shape("measurement", measurement, {any_length, 16});
  const py::ssize_t states = measurement.shape(0);
  check_shape("reduction", reduction, {16, states});
  check_shape("exposures_s", exposures_s, {any_length});
  check_shape("rate", rate, {states, any_length});
  const py::ssize_t pixels = rate.shape(1);
  check_shape("used", used, {states, pixels});
  if (inverse_flat) check_shape("inverse_flat", *inverse_flat, {pixels});
  check_shape("mueller", mueller, {16, pixels});
  check_shape("variance", variance, {16, pixels});
  check_shape("residual", residual, {pixels});
  check_shape("expected", expected, {pixels});
  const MeasurementMatrix matrix{measurement.data(), reduction.data(), static_cast<int>(states)};
  const Exposures exposures{
      exposures_s.data(), static_cast<int>(exposures_s.shape(0)), {dn_per_electron, read_noise_dn}};
  const SolvedPlanes planes{rate.data(),
                            used.data(),
                            inverse_flat ? inverse_flat->data() : nullptr,
                            mueller.mutable_data(),
                            variance.mutable_data(),
                            residual.mutable_data(),
                            expected.mutable_data()};
  py::gil_scoped_release release;
  solve_states(matrix, exposures, dark_variance, pixels, planes);
}

}  // namespace

void register_solve(py::module_& parent) {
  py::module_ m = parent.def_submodule("solve", "From the rates of all states to Mueller images.");
  m.def("solve", &solve, py::arg("reduction").noconvert(), py::arg("measurement").noconvert(),
        py::arg("exposures_s").noconvert(), py::arg("dn_per_electron"), py::arg("read_noise_dn"),
        py::arg("dark_variance"), py::arg("rate").noconvert(), py::arg("used").noconvert(),
        py::arg("inverse_flat").noconvert(), py::arg("mueller").noconvert(), py::arg("variance").noconvert(),
        py::arg("residual").noconvert(), py::arg("expected").noconvert(),
        "Rates (states, pixels) and exposures behind them into mueller (16, pixels), variance "
        "(16, pixels), and per pixel the residual sum of squares and what the noise makes of it. Weighted by inverse "
        "variances where the states of a pixel differ in exposures.");
}
