#include "pbrdf/exposures.hpp"

#include <algorithm>
#include <atomic>
#include <limits>

#include "pbrdf/isa.hpp"
#include "pbrdf/tiles.hpp"

namespace pbrdf {
namespace {

constexpr int block_pixels = row_length<float>;
constexpr float missing = std::numeric_limits<float>::quiet_NaN();

template <typename Raw>
struct Merge {
  const Raw* frames;
  const float* dark;
  const std::uint8_t* usable;
  Exposures exposures;
  std::int64_t pixels;
  double saturation;
  float* rate;
  std::uint8_t* used;
  std::atomic<std::int64_t>* unknown;

  std::size_t scratch_bytes() const { return 0; }

  template <int bytes>
  [[gnu::always_inline]] inline void run(std::int64_t first, std::int64_t last, void*) const {
    const float read_variance = static_cast<float>(exposures.noise.read_noise_dn * exposures.noise.read_noise_dn);
    const float gain = static_cast<float>(exposures.noise.dn_per_electron), top = static_cast<float>(saturation);
    std::int64_t without = 0;
    for (std::int64_t block = first; block < last; ++block) {
      const std::int64_t begin = block * block_pixels;
      const int count = static_cast<int>(std::min<std::int64_t>(block_pixels, pixels - begin));
      alignas(64) float counted[block_pixels] = {}, sum[block_pixels] = {}, time[block_pixels] = {};
      alignas(64) float limit[block_pixels];
      for (int p = 0; p < count; ++p) limit[p] = static_cast<float>(usable[begin + p]);
      for (int e = 0; e < exposures.count; ++e) {
        const Raw* from = frames + e * pixels + begin;
        const float* offset = dark + e * pixels + begin;
        const float seconds = static_cast<float>(exposures.seconds[e]), before = static_cast<float>(e);
#pragma omp simd
        for (int p = 0; p < count; ++p) {
          const float raw = static_cast<float>(from[p]);
          const bool counts = (counted[p] == before) & (limit[p] > before) & (raw < top);
          counted[p] += counts ? 1.0f : 0.0f;
          sum[p] += counts ? raw - offset[p] : 0.0f;
          time[p] += counts ? seconds : 0.0f;
        }
      }
      // the rate that all weights follow from takes the place of the sum
      for (int p = 0; p < count; ++p) sum[p] /= time[p];
      alignas(64) float weights[block_pixels] = {}, weighted[block_pixels] = {};
      for (int e = 0; e < exposures.count; ++e) {
        const Raw* from = frames + e * pixels + begin;
        const float* offset = dark + e * pixels + begin;
        const float seconds = static_cast<float>(exposures.seconds[e]), per_second = 1.0f / seconds;
        const float before = static_cast<float>(e);
#pragma omp simd
        for (int p = 0; p < count; ++p) {
          const float signal = static_cast<float>(from[p]) - offset[p];
          const float weight = counted[p] > before ? certainty(sum[p], seconds, read_variance, gain) : 0.0f;
          weights[p] += weight;
          weighted[p] += weight * (signal * per_second);
        }
      }
      float* to_rate = rate + begin;
      std::uint8_t* to_used = used + begin;
      int here = 0;
#pragma omp simd reduction(+ : here)
      for (int p = 0; p < count; ++p) {
        const bool known = counted[p] > 0.0f;
        to_rate[p] = known ? weighted[p] / weights[p] : missing;
        to_used[p] = static_cast<std::uint8_t>(static_cast<int>(counted[p]));
        here += known ? 0 : 1;
      }
      without += here;
    }
    unknown->fetch_add(without, std::memory_order_relaxed);
  }
};

}  // namespace

template <typename Raw>
std::int64_t merge_exposures(const Raw* frames, const float* dark, const std::uint8_t* usable,
                             const Exposures& exposures, std::int64_t pixels, double saturation, float* rate,
                             std::uint8_t* used) {
  std::atomic<std::int64_t> unknown{0};
  run_blocks(Merge<Raw>{frames, dark, usable, exposures, pixels, saturation, rate, used, &unknown},
             (pixels + block_pixels - 1) / block_pixels);
  return unknown;
}

template std::int64_t merge_exposures(const std::uint8_t*, const float*, const std::uint8_t*, const Exposures&,
                                      std::int64_t, double, float*, std::uint8_t*);
template std::int64_t merge_exposures(const std::uint16_t*, const float*, const std::uint8_t*, const Exposures&,
                                      std::int64_t, double, float*, std::uint8_t*);
template std::int64_t merge_exposures(const float*, const float*, const std::uint8_t*, const Exposures&, std::int64_t,
                                      double, float*, std::uint8_t*);

}  // namespace pbrdf
