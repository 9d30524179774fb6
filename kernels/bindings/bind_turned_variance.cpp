#include <pybind11/pybind11.h>

#include "arrays.hpp"
#include "pbrdf/turned_variance.hpp"

namespace {

using namespace pbrdf;

void turn(const Array<double>& mueller, const Array<double>& variance, const Array<double>& turns,
          const Array<double>& reduction, const Array<double>& measurement, const Array<double>& exposures_s,
          double saturation, double dn_per_electron, double read_noise_dn, double dark_variance, Array<double>& out) {
  check_shape("mueller", mueller, {any_length, 16});
  const py::ssize_t count = mueller.shape(0);
  check_shape("variance", variance, {count, 16});
  check_shape("turns", turns, {count, 4});
  check_shape("measurement", measurement, {any_length, 16});
  const py::ssize_t states = measurement.shape(0);
  check_shape("reduction", reduction, {16, states});
  check_shape("exposures_s", exposures_s, {any_length});
  check_shape("out", out, {count, 16});
  const Turning turning{mueller.data(), variance.data(), turns.data(), count};
  const MeasurementMatrix matrix{measurement.data(), reduction.data(), static_cast<int>(states)};
  const Exposures exposures{
      exposures_s.data(), static_cast<int>(exposures_s.shape(0)), {dn_per_electron, read_noise_dn}};
  double* turned = out.mutable_data();
  py::gil_scoped_release release;
  turn_variances(turning, matrix, {exposures, saturation, dark_variance}, turned);
}

}  // namespace

void register_turned_variance(py::module_& parent) {
  py::module_ m = parent.def_submodule("turned_variance", "Variances of Mueller matrices in turned frames.");
  m.def("turn", &turn, py::arg("mueller").noconvert(), py::arg("variance").noconvert(), py::arg("turns").noconvert(),
        py::arg("reduction").noconvert(), py::arg("measurement").noconvert(), py::arg("exposures_s").noconvert(),
        py::arg("saturation"), py::arg("dn_per_electron"), py::arg("read_noise_dn"), py::arg("dark_variance"),
        py::arg("out").noconvert(),
        "Variances (n, 16) of matrices (n, 16), DN/s, after their frames have been turned; turns: (n, 4), cosine and "
        "sine of twice the angle of the incident and of the outgoing frame. The noise of the elements hangs together "
        "as states, exposures and sensor make it.");
}
