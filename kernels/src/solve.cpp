#include "pbrdf/solve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace pbrdf {
namespace {

constexpr std::int64_t block_pixels = 256;

constexpr float missing = std::numeric_limits<float>::quiet_NaN();

}  // namespace

template <typename Raw>
void merge_exposures(const Raw* frames, const float* dark, const double* exposures_s, int exposures,
                     std::int64_t pixels, double saturation, const NoiseModel& noise, float* rate, float* variance) {
  const double read_variance = noise.read_noise_dn * noise.read_noise_dn;
#pragma omp parallel for schedule(static)
  for (std::int64_t pixel = 0; pixel < pixels; ++pixel) {
    double weights = 0.0, weighted = 0.0;
    for (int e = 0; e < exposures; ++e) {
      const double raw = static_cast<double>(frames[e * pixels + pixel]);
      if (!(raw < saturation)) continue;
      const double seconds = exposures_s[e];
      const double signal = raw - dark[e * pixels + pixel];
      const double weight = seconds * seconds / (read_variance + std::max(signal, 0.0) * noise.dn_per_electron);
      weights += weight;
      weighted += weight * signal / seconds;
    }
    rate[pixel] = weights > 0.0 ? static_cast<float>(weighted / weights) : missing;
    variance[pixel] = weights > 0.0 ? static_cast<float>(1.0 / weights) : missing;
  }
}

template void merge_exposures(const std::uint8_t*, const float*, const double*, int, std::int64_t, double,
                              const NoiseModel&, float*, float*);
template void merge_exposures(const std::uint16_t*, const float*, const double*, int, std::int64_t, double,
                              const NoiseModel&, float*, float*);
template void merge_exposures(const float*, const float*, const double*, int, std::int64_t, double, const NoiseModel&,
                              float*, float*);

void apply_reduction(const double* reduction, const double* measurement, int states, std::int64_t pixels,
                     const float* rate, const float* rate_variance, float* mueller, float* variance, float* residual) {
  const std::int64_t blocks = (pixels + block_pixels - 1) / block_pixels;
#pragma omp parallel
  {
    std::vector<double> elements(16 * block_pixels), spread(16 * block_pixels), predicted(block_pixels);
#pragma omp for schedule(static)
    for (std::int64_t block = 0; block < blocks; ++block) {
      const std::int64_t first = block * block_pixels;
      const std::int64_t count = std::min(block_pixels, pixels - first);
      std::fill(elements.begin(), elements.end(), 0.0);
      std::fill(spread.begin(), spread.end(), 0.0);
      for (int n = 0; n < states; ++n) {
        const float* i = rate + n * pixels + first;
        const float* v = rate_variance + n * pixels + first;
        for (int k = 0; k < 16; ++k) {
          const double w = reduction[k * states + n], w2 = w * w;
          double* m = elements.data() + k * block_pixels;
          double* s = spread.data() + k * block_pixels;
          for (std::int64_t p = 0; p < count; ++p) {
            m[p] += w * i[p];
            s[p] += w2 * v[p];
          }
        }
      }
      for (int k = 0; k < 16; ++k) {
        const double* m = elements.data() + k * block_pixels;
        const double* s = spread.data() + k * block_pixels;
        for (std::int64_t p = 0; p < count; ++p) {
          mueller[k * pixels + first + p] = static_cast<float>(m[p]);
          variance[k * pixels + first + p] = static_cast<float>(s[p]);
        }
      }
      float* squares = residual + first;
      std::fill(squares, squares + count, 0.0f);
      for (int n = 0; n < states; ++n) {
        std::fill(predicted.begin(), predicted.end(), 0.0);
        for (int k = 0; k < 16; ++k) {
          const double w = measurement[n * 16 + k];
          const double* m = elements.data() + k * block_pixels;
          for (std::int64_t p = 0; p < count; ++p) predicted[p] += w * m[p];
        }
        const float* i = rate + n * pixels + first;
        for (std::int64_t p = 0; p < count; ++p) {
          const double difference = i[p] - predicted[p];
          squares[p] += static_cast<float>(difference * difference);
        }
      }
    }
  }
}

}  // namespace pbrdf
