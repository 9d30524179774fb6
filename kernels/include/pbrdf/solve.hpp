// From raw frames to Mueller images: exposures merged, then the data reduction matrix applied to every pixel.
#pragma once

#include <cstdint>

namespace pbrdf {

// Noise of a raw value z (in DN): variance = read_noise^2 + max(z - dark, 0) / gain.
struct NoiseModel {
  double dn_per_electron;
  double read_noise_dn;
};

// Inverse-variance merge of the exposures of one state: rate in DN/s and its variance.
// frames: exposures x pixels; dark: exposures x pixels (mean dark frame), in DN. A value at or above `saturation` has
// no weight; a pixel without any weight becomes NaN, and the number of these is returned.
template <typename Raw>
std::int64_t merge_exposures(const Raw* frames, const float* dark, const double* exposures_s, int exposures,
                             std::int64_t pixels, double saturation, const NoiseModel& noise, float* rate,
                             float* variance);

// m = W+ i for every pixel, in float64, with the residual sum of squares.
// reduction: 16 x states (row-major), measurement: states x 16; rate: states x pixels; mueller: 16 x pixels, which may
// be the first 16 planes of rate itself; residual: pixels. NaN in any state makes the pixel NaN.
void apply_reduction(const double* reduction, const double* measurement, int states, std::int64_t pixels,
                     const float* rate, float* mueller, float* residual);

}  // namespace pbrdf
