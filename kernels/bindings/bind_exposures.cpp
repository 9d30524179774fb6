#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <vector>

#include "arrays.hpp"
#include "pbrdf/exposures.hpp"

namespace {

using namespace pbrdf;

template <typename Raw>
std::vector<std::int64_t> merge(const Array<Raw>& frames, const Array<float>& dark, const Array<std::uint8_t>& usable,
                                const Array<double>& exposures_s, double saturation, double dn_per_electron,
                                double read_noise_dn, Array<float>& rate, Array<std::uint8_t>& used) {
  check_shape("frames", frames, {any_length, any_length, any_length});
  const py::ssize_t states = frames.shape(0), count = frames.shape(1), pixels = frames.shape(2);
  check_shape("dark", dark, {count, pixels});
  check_shape("usable", usable, {pixels});
  check_shape("exposures_s", exposures_s, {count});
  check_shape("rate", rate, {states, pixels});
  check_shape("used", used, {states, pixels});
  if (count > 255) throw std::invalid_argument("there are " + std::to_string(count) + " exposures, at most 255 fit");
  const Raw* raw = frames.data();
  const float* offset = dark.data();
  const std::uint8_t* limit = usable.data();
  const Exposures exposures{exposures_s.data(), static_cast<int>(count), {dn_per_electron, read_noise_dn}};
  float* out_rate = rate.mutable_data();
  std::uint8_t* out_used = used.mutable_data();
  std::vector<std::int64_t> unknown(states);
  py::gil_scoped_release release;
  merge_exposures(raw, offset, limit, exposures, static_cast<int>(states), pixels, saturation, out_rate, out_used,
                  unknown.data());
  return unknown;
}

template <typename Raw>
void define_merge(py::module_& m) {
  m.def("merge", &merge<Raw>, py::arg("frames").noconvert(), py::arg("dark").noconvert(), py::arg("usable").noconvert(),
        py::arg("exposures_s").noconvert(), py::arg("saturation"), py::arg("dn_per_electron"), py::arg("read_noise_dn"),
        py::arg("rate").noconvert(), py::arg("used").noconvert(),
        "Inverse-variance merge of the exposures, ascending, of frames (states, exposures, pixels) into `rate` (DN/s) "
        "(states, pixels) float32 and `used` (states, pixels) uint8, how many count: those before the first saturated "
        "one, at most `usable`. NaN where none does; returns the number of such pixels of each state.");
}

}  // namespace

void register_exposures(py::module_& parent) {
  py::module_ m = parent.def_submodule("exposures", "Several exposure times of one state.");
  define_merge<std::uint8_t>(m);
  define_merge<std::uint16_t>(m);
  define_merge<float>(m);
}
