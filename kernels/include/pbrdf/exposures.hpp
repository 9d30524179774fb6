// States photographed at several exposure times, merged into one rate each.
#pragma once

#include <cstdint>

namespace pbrdf {

// Noise of a raw value z (in DN): variance = read_noise^2 + max(z - dark, 0) * dn_per_electron.
struct NoiseModel {
  double dn_per_electron;
  double read_noise_dn;
};

struct Exposures {
  const double* seconds;  // ascending
  int count;
  NoiseModel noise;
};

// What the exposure of so many seconds adds to the inverse variance of a rate in DN/s.
template <typename T>
[[gnu::always_inline]] inline T certainty(T rate, T seconds, T read_variance, T dn_per_electron) {
  const T signal = (rate > T(0) ? rate : T(0)) * seconds;
  return seconds * seconds / (read_variance + signal * dn_per_electron);
}

// Inverse-variance mean of the exposures of each of some states.
// frames: states x exposures x pixels; dark: exposures x pixels (mean dark frame), in DN; usable: pixels, how many of
// the shortest exposures may be used at all. An exposure counts up to the first whose raw value reaches `saturation`.
// All weights of a pixel follow from one rate, signal over time: weights that follow each value's own noise would
// prefer those that came out low. rate: states x pixels, DN/s, NaN where no exposure counts; used: states x pixels, how
// many do; unknown: states, the number of pixels without any.
template <typename Raw>
void merge_exposures(const Raw* frames, const float* dark, const std::uint8_t* usable, const Exposures& exposures,
                     int states, std::int64_t pixels, double saturation, float* rate, std::uint8_t* used,
                     std::int64_t* unknown);

}  // namespace pbrdf
