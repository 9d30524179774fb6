// The rates of all states of a pixel solved for its Mueller matrix, with its variance and how well it fits.
#pragma once

#include <cstdint>

#include "pbrdf/exposures.hpp"

namespace pbrdf {

struct MeasurementMatrix {
  const double* measurement;  // W: states x 16
  const double* reduction;    // its pseudo-inverse: 16 x states
  int states;
};

// What is known of a pixel's states, and what becomes of it. All but `used` are float32 planes.
struct SolvedPlanes {
  const float* rate;          // states x pixels, DN/s
  const std::uint8_t* used;   // states x pixels: exposures behind each rate
  const float* inverse_flat;  // pixels: result per measured value, or null for one
  float* mueller;             // 16 x pixels, DN/s; all results may be planes of `rate`
  float* variance;            // 16 x pixels
  float* residual;            // pixels: sum over states of (i - W m)^2
  float* expected;            // pixels: what the noise model expects of that sum
};

// m = W+ i where all states have the same exposures, else m = (W' S W)^-1 W' S i with S the inverse variances.
// Variances follow from the noise model at the fitted intensities W m, not at the measured ones, and hold the noise of
// the mean dark frame, which all states share: a pixel's variance in one dark frame of `exposures` is `dark_variance`.
// NaN in any state makes the pixel NaN.
void solve_states(const MeasurementMatrix& matrix, const Exposures& exposures, double dark_variance,
                  std::int64_t pixels, const SolvedPlanes& planes);

}  // namespace pbrdf
