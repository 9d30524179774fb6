#include "pbrdf/exposures.hpp"

#include <algorithm>
#include <atomic>
#include <limits>
#include <vector>

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
  int states;
  std::int64_t pixels;
  float saturation;
  float* rate;
  std::uint8_t* used;
  std::atomic<std::int64_t>* unknown;

  std::size_t scratch_bytes() const { return 0; }

  template <int bytes>
  [[gnu::always_inline]] inline void run(std::int64_t first, std::int64_t last, void*) const {
    for (std::int64_t block = first; block < last; ++block) {
      const std::int64_t begin = block * block_pixels;
      const int count = static_cast<int>(std::min<std::int64_t>(block_pixels, pixels - begin));
      // the dark frames' part of the block stays in the cache for all states
      for (int n = 0; n < states; ++n) merge(n, begin, count);
    }
  }

  [[gnu::always_inline]] inline void merge(int state, std::int64_t begin, int count) const {
    const float read_variance = static_cast<float>(exposures.noise.read_noise_dn * exposures.noise.read_noise_dn);
    const float gain = static_cast<float>(exposures.noise.dn_per_electron), top = saturation;
    alignas(64) float counted[block_pixels] = {}, sum[block_pixels] = {}, time[block_pixels] = {};
    alignas(64) float limit[block_pixels];
    for (int p = 0; p < count; ++p) limit[p] = static_cast<float>(usable[begin + p]);
    for (int e = 0; e < exposures.count; ++e) {
      const Raw* from = frames + (state * exposures.count + e) * pixels + begin;
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
      const Raw* from = frames + (state * exposures.count + e) * pixels + begin;
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
    float* to_rate = rate + state * pixels + begin;
    std::uint8_t* to_used = used + state * pixels + begin;
    int without = 0;
#pragma omp simd reduction(+ : without)
    for (int p = 0; p < count; ++p) {
      const bool known = counted[p] > 0.0f;
      to_rate[p] = known ? weighted[p] / weights[p] : missing;
      to_used[p] = static_cast<std::uint8_t>(static_cast<int>(counted[p]));
      without += known ? 0 : 1;
    }
    unknown[state].fetch_add(without, std::memory_order_relaxed);
  }
};

}  // namespace

template <typename Raw>
void merge_exposures(const Raw* frames, const float* dark, const std::uint8_t* usable, const Exposures& exposures,
                     int states, std::int64_t pixels, double saturation, float* rate, std::uint8_t* used,
                     std::int64_t* unknown) {
  std::vector<std::atomic<std::int64_t>> without(states);
  const float top = static_cast<float>(saturation);
  run_blocks(Merge<Raw>{frames, dark, usable, exposures, states, pixels, top, rate, used, without.data()},
             (pixels + block_pixels - 1) / block_pixels);
  std::copy(without.begin(), without.end(), unknown);
}

template void merge_exposures(const std::uint8_t*, const float*, const std::uint8_t*, const Exposures&, int,
                              std::int64_t, double, float*, std::uint8_t*, std::int64_t*);
template void merge_exposures(const std::uint16_t*, const float*, const std::uint8_t*, const Exposures&, int,
                              std::int64_t, double, float*, std::uint8_t*, std::int64_t*);
template void merge_exposures(const float*, const float*, const std::uint8_t*, const Exposures&, int, std::int64_t,
                              double, float*, std::uint8_t*, std::int64_t*);

}  // namespace pbrdf
