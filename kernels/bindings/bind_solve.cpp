#include <pybind11/pybind11.h>

#include "arrays.hpp"
#include "pbrdf/solve.hpp"

namespace {

using namespace pbrdf;

template <typename Raw>
std::int64_t merge(const Array<Raw>& frames, const Array<float>& dark, const Array<double>& exposures_s,
                   double saturation, double dn_per_electron, double read_noise_dn, Array<float>& rate,
                   Array<float>& variance) {
  check_shape("frames", frames, {any_length, any_length});
  const py::ssize_t exposures = frames.shape(0), pixels = frames.shape(1);
  check_shape("dark", dark, {exposures, pixels});
  check_shape("exposures_s", exposures_s, {exposures});
  check_shape("rate", rate, {pixels});
  check_shape("variance", variance, {pixels});
  const Raw* raw = frames.data();
  const float* offset = dark.data();
  const double* seconds = exposures_s.data();
  float* out_rate = rate.mutable_data();
  float* out_variance = variance.mutable_data();
  py::gil_scoped_release release;
  return merge_exposures(raw, offset, seconds, static_cast<int>(exposures), pixels, saturation,
                         NoiseModel{dn_per_electron, read_noise_dn}, out_rate, out_variance);
}

template <typename Raw>
void define_merge(py::module_& m) {
  m.def("merge_exposures", &merge<Raw>, py::arg("frames").noconvert(), py::arg("dark").noconvert(),
        py::arg("exposures_s").noconvert(), py::arg("saturation"), py::arg("dn_per_electron"), py::arg("read_noise_dn"),
        py::arg("rate").noconvert(), py::arg("variance").noconvert(),
        "Inverse-variance merge of the exposures (exposures, pixels) of one state into `rate` (DN/s) and `variance`, "
        "both (pixels,) float32; NaN where every exposure is saturated. Returns the number of such pixels.");
}

void apply(const Array<double>& reduction, const Array<double>& measurement, const Array<float>& rate,
           Array<float>& mueller, Array<float>& residual) {
  check_shape("measurement", measurement, {any_length, 16});
  const py::ssize_t states = measurement.shape(0);
  check_shape("reduction", reduction, {16, states});
  check_shape("rate", rate, {states, any_length});
  const py::ssize_t pixels = rate.shape(1);
  check_shape("mueller", mueller, {16, pixels});
  check_shape("residual", residual, {pixels});
  const double* w_plus = reduction.data();
  const double* w = measurement.data();
  const float* i = rate.data();
  float* m = mueller.mutable_data();
  float* squares = residual.mutable_data();
  py::gil_scoped_release release;
  apply_reduction(w_plus, w, static_cast<int>(states), pixels, i, m, squares);
}

}  // namespace

void register_solve(py::module_& parent) {
  py::module_ m = parent.def_submodule("solve", "From raw frames to Mueller images.");
  define_merge<std::uint8_t>(m);
  define_merge<std::uint16_t>(m);
  define_merge<float>(m);
  m.def("apply_reduction", &apply, py::arg("reduction").noconvert(), py::arg("measurement").noconvert(),
        py::arg("rate").noconvert(), py::arg("mueller").noconvert(), py::arg("residual").noconvert(),
        "m = W+ i for every pixel: rate (states, pixels) into mueller (16, pixels), which may be rate[:16], and the "
        "residual sum of squares (pixels,), all float32.");
}
