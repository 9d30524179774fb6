#include "pbrdf/solve.hpp"

#include <algorithm>
#include <atomic>
#include <limits>

#include "pbrdf/isa.hpp"
#include "pbrdf/tiles.hpp"

namespace pbrdf {
namespace {

constexpr int elements = 16;
constexpr int block_pixels = row_length<double>;

constexpr float missing = std::numeric_limits<float>::quiet_NaN();

std::int64_t blocks_of(std::int64_t pixels) { return (pixels + block_pixels - 1) / block_pixels; }

template <typename Raw>
struct Merge {
  const Raw* frames;
  const float* dark;
  const double* exposures_s;
  int exposures;
  std::int64_t pixels;
  double saturation;
  NoiseModel noise;
  float* rate;
  float* variance;
  std::atomic<std::int64_t>* unknown;

  std::size_t scratch_bytes() const { return 0; }

  template <int bytes>
  [[gnu::always_inline]] inline void run(std::int64_t first, std::int64_t last, void*) const {
    const double read_variance = noise.read_noise_dn * noise.read_noise_dn;
    const double gain = noise.dn_per_electron, top = saturation;
    std::int64_t without = 0;
    for (std::int64_t block = first; block < last; ++block) {
      const std::int64_t begin = block * block_pixels;
      const int count = static_cast<int>(std::min<std::int64_t>(block_pixels, pixels - begin));
      alignas(64) double weights[block_pixels] = {}, weighted[block_pixels] = {};
      for (int e = 0; e < exposures; ++e) {
        const Raw* from = frames + e * pixels + begin;
        const float* offset = dark + e * pixels + begin;
        const double seconds = exposures_s[e], squared = seconds * seconds, per_second = 1.0 / seconds;
#pragma omp simd
        for (int p = 0; p < count; ++p) {
          const double raw = static_cast<double>(from[p]);
          const double signal = raw - static_cast<double>(offset[p]);
          const double positive = signal > 0.0 ? signal : 0.0;
          const double certain = squared / (read_variance + positive * gain);
          const double weight = raw < top ? certain : 0.0;
          weights[p] += weight;
          weighted[p] += weight * (signal * per_second);
        }
      }
      float* to_rate = rate + begin;
      float* to_variance = variance + begin;
      int here = 0;
#pragma omp simd reduction(+ : here)
      for (int p = 0; p < count; ++p) {
        const bool known = weights[p] > 0.0;
        const double spread = 1.0 / weights[p];
        to_rate[p] = known ? static_cast<float>(weighted[p] * spread) : missing;
        to_variance[p] = known ? static_cast<float>(spread) : missing;
        here += known ? 0 : 1;
      }
      without += here;
    }
    unknown->fetch_add(without, std::memory_order_relaxed);
  }
};

struct Apply {
  const double* reduction;    // transposed: states x 16
  const double* measurement;  // transposed: 16 x padded states
  int states;
  std::int64_t pixels;
  const float* rate;
  float* mueller;
  float* residual;

  int rows() const { return padded_rows(states); }

  std::size_t scratch_bytes() const {
    return static_cast<std::size_t>(rows() + elements) * block_pixels * sizeof(double);
  }

  template <int bytes>
  [[gnu::always_inline]] inline void run(std::int64_t first, std::int64_t last, void* scratch) const {
    constexpr int lanes = bytes / static_cast<int>(sizeof(double)), width = 2 * lanes;
    using V = Vector<double, bytes>;
    double* measured = static_cast<double*>(scratch);
    double* solved = measured + rows() * block_pixels;
    for (std::int64_t block = first; block < last; ++block) {
      const std::int64_t begin = block * block_pixels;
      const int count = static_cast<int>(std::min<std::int64_t>(block_pixels, pixels - begin));
      for (int n = 0; n < states; ++n) {
        const float* from = rate + n * pixels + begin;
        double* to = measured + n * block_pixels;
        for (int p = 0; p < count; ++p) to[p] = static_cast<double>(from[p]);
        std::fill(to + count, to + block_pixels, 0.0);
      }
      // rows that only fill up the last tile
      std::fill(measured + states * block_pixels, solved, 0.0);
      const std::int64_t behind = begin + count;
      const int ahead = static_cast<int>(std::min<std::int64_t>(block_pixels, pixels - behind));
      for (int p = 0; p < count; p += width) {
        // the next block comes in while this one is computed, some of its states a tile
        for (int n = states * p / block_pixels; n < states * (p + width) / block_pixels; ++n)
          for (int q = 0; q < ahead; q += 16) __builtin_prefetch(rate + n * pixels + behind + q);
        for (int row = 0; row < elements; row += tile_rows<bytes>) {
          Tile<double, bytes> tile;
          multiply<bytes>(reduction + row, elements, states, measured + p, tile);
#pragma GCC unroll 8
          for (int r = 0; r < tile_rows<bytes>; ++r)
            std::memcpy(solved + (row + r) * block_pixels + p, tile.sum[r], sizeof tile.sum[r]);
        }
      }
      for (int k = 0; k < elements; ++k) {
        const double* from = solved + k * block_pixels;
        float* to = mueller + k * pixels + begin;
        for (int p = 0; p < count; ++p) to[p] = static_cast<float>(from[p]);
      }
      for (int p = 0; p < count; p += width) {
        V squares[2] = {V{}, V{}};
        for (int row = 0; row < rows(); row += tile_rows<bytes>) {
          Tile<double, bytes> tile;
          multiply<bytes>(measurement + row, rows(), elements, solved + p, tile);
#pragma GCC unroll 8
          for (int r = 0; r < tile_rows<bytes>; ++r)
            for (int half = 0; half < 2; ++half) {
              const V* from = reinterpret_cast<const V*>(measured + (row + r) * block_pixels + p);
              const V difference = from[half] - tile.sum[r][half];
              squares[half] += difference * difference;
            }
        }
        double values[width];
        std::memcpy(values, squares, sizeof values);
        for (int i = 0; i < std::min(width, count - p); ++i) residual[begin + p + i] = static_cast<float>(values[i]);
      }
    }
  }
};

}  // namespace

template <typename Raw>
std::int64_t merge_exposures(const Raw* frames, const float* dark, const double* exposures_s, int exposures,
                             std::int64_t pixels, double saturation, const NoiseModel& noise, float* rate,
                             float* variance) {
  std::atomic<std::int64_t> unknown{0};
  run_blocks(Merge<Raw>{frames, dark, exposures_s, exposures, pixels, saturation, noise, rate, variance, &unknown},
             blocks_of(pixels));
  return unknown;
}

template std::int64_t merge_exposures(const std::uint8_t*, const float*, const double*, int, std::int64_t, double,
                                      const NoiseModel&, float*, float*);
template std::int64_t merge_exposures(const std::uint16_t*, const float*, const double*, int, std::int64_t, double,
                                      const NoiseModel&, float*, float*);
template std::int64_t merge_exposures(const float*, const float*, const double*, int, std::int64_t, double,
                                      const NoiseModel&, float*, float*);

void apply_reduction(const double* reduction, const double* measurement, int states, std::int64_t pixels,
                     const float* rate, float* mueller, float* residual) {
  const std::vector<double> to_solve = transposed<double>(reduction, elements, states);
  const std::vector<double> to_predict = transposed<double>(measurement, states, elements);
  run_blocks(Apply{to_solve.data(), to_predict.data(), states, pixels, rate, mueller, residual}, blocks_of(pixels));
}

}  // namespace pbrdf
