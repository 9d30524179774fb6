#include "pbrdf/solve.hpp"

#include <algorithm>

#include "pbrdf/isa.hpp"
#include "pbrdf/solve_block.hpp"
#include "pbrdf/weighted_solve.hpp"

namespace pbrdf {
namespace {

struct Solve {
  const Matrices& matrices;
  Exposures exposures;
  double dark_variance;
  std::int64_t pixels;
  SolvedPlanes planes;

  std::size_t scratch_bytes() const {
    return 2 * Block::bytes(states()) + WeightedSolve::bytes(states(), exposures.count);
  }

  int states() const { return matrices.states; }

  template <int bytes>
  [[gnu::always_inline]] inline void run(std::int64_t first, std::int64_t last, void* scratch) const {
    unsigned char* memory = static_cast<unsigned char*>(scratch);
    Block block(memory, states()), uneven(memory + Block::bytes(states()), states());
    const WeightedSolve weighted(memory + 2 * Block::bytes(states()), matrices, exposures, dark_variance);
    for (std::int64_t index = first; index < last; ++index) {
      const std::int64_t begin = index * block_pixels;
      block.count = static_cast<int>(std::min<std::int64_t>(block_pixels, pixels - begin));
      load(begin, block);
      prefetch(begin + block.count);
      solve_plain<bytes>(matrices, block);
      predict<bytes>(matrices, block);
      int chosen[block_pixels];
      std::uint8_t least[block_pixels];
      uneven.count = choose_uneven(block, chosen, least);
      gather(block, chosen, least, uneven);
      if (uneven.count < block.count) {
        spread_of_states(matrices, exposures, block);
        spread_of_elements<bytes>(block);
      }
      if (uneven.count > 0) {
        weighted.run<bytes>(uneven);
        scatter(uneven, chosen, block);
      }
      store(begin, block);
    }
  }

  [[gnu::always_inline]] inline void load(std::int64_t begin, const Block& block) const {
    for (int n = 0; n < states(); ++n) {
      const float* from = planes.rate + n * pixels + begin;
      double* to = block.measured + n * block_pixels;
      float* rate = block.rate + n * float_row;
      for (int p = 0; p < block.count; ++p) to[p] = static_cast<double>(rate[p] = from[p]);
      std::fill(to + block.count, to + block_pixels, 0.0);
      std::fill(rate + block.count, rate + block_pixels, 0.0f);
      const std::uint8_t* used = planes.used + n * pixels + begin;
      std::fill(std::copy_n(used, block.count, block.used + n * block_pixels), block.used + (n + 1) * block_pixels,
                std::uint8_t{1});
    }
    // rows that only fill up the last tile
    std::fill(block.measured + states() * block_pixels, block.solved, 0.0);
    std::fill(block.rate + states() * float_row, block.spread, 0.0f);
  }

  // The next block comes in while this one is computed.
  [[gnu::always_inline]] inline void prefetch(std::int64_t begin) const {
    const int ahead = static_cast<int>(std::min<std::int64_t>(block_pixels, pixels - begin));
    for (int n = 0; n < states(); ++n) {
      for (int q = 0; q < ahead; q += 16) __builtin_prefetch(planes.rate + n * pixels + begin + q);
      for (int q = 0; q < ahead; q += 64) __builtin_prefetch(planes.used + n * pixels + begin + q);
    }
  }

  template <int bytes>
  [[gnu::always_inline]] inline void spread_of_elements(const Block& block) const {
    constexpr int width = 2 * bytes / static_cast<int>(sizeof(float));
    for (int p = 0; p < block.count; p += width)
      for (int row = 0; row < elements; row += tile_rows<bytes>) {
        Tile<float, bytes> tile;
        multiply<bytes>(matrices.squares.data() + row, elements, states(), block.spread + p, tile);
        store_tile<bytes>(tile, block.variance + row * float_row + p);
      }
    if (dark_variance > 0.0) add_dark(block);
  }

  // The dark frame's noise is the same in all states. Where all use the same exposures it is that of one offset.
  [[gnu::always_inline]] inline void add_dark(const Block& block) const {
    const double read_variance = exposures.noise.read_noise_dn * exposures.noise.read_noise_dn;
    double mean[block_pixels] = {}, weight[block_pixels] = {}, squares[block_pixels] = {};
    for (int n = 0; n < states(); ++n)
      for (int p = 0; p < block_pixels; ++p) mean[p] += block.measured[n * block_pixels + p];
    for (int p = 0; p < block_pixels; ++p) mean[p] /= states();
    for (int e = 0; e < exposures.count; ++e) {
      const double seconds = exposures.seconds[e];
#pragma omp simd
      for (int p = 0; p < block_pixels; ++p) {
        const double certain = certainty(mean[p], seconds, read_variance, exposures.noise.dn_per_electron);
        const double counted = static_cast<int>(block.used[p]) > e ? certain : 0.0;
        weight[p] += counted;
        squares[p] += (counted / seconds) * (counted / seconds);
      }
    }
    float offset[block_pixels];
    for (int p = 0; p < block_pixels; ++p)
      offset[p] = static_cast<float>(dark_variance * squares[p] / (weight[p] * weight[p]));
    for (int k = 0; k < elements; ++k) {
      const float share = static_cast<float>(matrices.row_sums[k] * matrices.row_sums[k]);
      float* variance = block.variance + k * float_row;
      for (int p = 0; p < block_pixels; ++p) variance[p] += share * offset[p];
    }
  }

  // Places of the pixels all of whose states are known, but by different exposures.
  [[gnu::always_inline]] inline int choose_uneven(const Block& block, int* chosen, std::uint8_t* least) const {
    std::uint8_t most[block_pixels];
    std::copy_n(block.used, block_pixels, least);
    std::copy_n(block.used, block_pixels, most);
    for (int n = 1; n < states(); ++n) {
      const std::uint8_t* used = block.used + n * block_pixels;
#pragma omp simd
      for (int p = 0; p < block_pixels; ++p) {
        least[p] = used[p] < least[p] ? used[p] : least[p];
        most[p] = used[p] > most[p] ? used[p] : most[p];
      }
    }
    int count = 0;
    for (int p = 0; p < block.count; ++p) {
      chosen[count] = p;
      count += least[p] != most[p] && least[p] > 0 ? 1 : 0;
    }
    return count;
  }

  // Some pixels side by side; the last fills up the vectors. A state's variance is told from its fitted rate where it
  // has the fewest exposures, from its measured one where it has more: to weak states the plain fit brings the noise of
  // the strong ones.
  [[gnu::always_inline]] inline void gather(const Block& block, const int* chosen, const std::uint8_t* least,
                                            const Block& few) const {
    if (few.count == 0) return;
    for (int n = 0; n < states(); ++n)
      for (int q = 0; q < block_pixels; ++q) {
        const int p = chosen[std::min(q, few.count - 1)];
        const double measured = block.measured[n * block_pixels + p];
        const std::uint8_t used = block.used[n * block_pixels + p];
        few.measured[n * block_pixels + q] = measured;
        few.rate[n * float_row + q] = static_cast<float>(measured);
        few.used[n * block_pixels + q] = used;
        few.spread[n * float_row + q] =
            used > least[p] ? static_cast<float>(measured) : block.spread[n * float_row + p];
      }
    std::fill(few.measured + states() * block_pixels, few.solved, 0.0);
    std::fill(few.rate + states() * float_row, few.spread, 0.0f);
  }

  [[gnu::always_inline]] inline void scatter(const Block& few, const int* chosen, const Block& block) const {
    for (int q = 0; q < few.count; ++q) {
      const int p = chosen[q];
      for (int k = 0; k < elements; ++k) {
        block.solved[k * block_pixels + p] = few.solved[k * block_pixels + q];
        block.variance[k * float_row + p] = few.variance[k * float_row + q];
      }
      block.residual[p] = few.residual[q];
      block.expected[p] = few.expected[q];
    }
  }

  [[gnu::always_inline]] inline void store(std::int64_t begin, const Block& block) const {
    const float* gain = planes.inverse_flat == nullptr ? nullptr : planes.inverse_flat + begin;
    for (int k = 0; k < elements; ++k) {
      const double* solved = block.solved + k * block_pixels;
      const float* spread = block.variance + k * float_row;
      float* mueller = planes.mueller + k * pixels + begin;
      float* variance = planes.variance + k * pixels + begin;
      if (gain == nullptr) {
        for (int p = 0; p < block.count; ++p) mueller[p] = static_cast<float>(solved[p]);
        std::copy_n(spread, block.count, variance);
      } else {
        for (int p = 0; p < block.count; ++p) {
          mueller[p] = static_cast<float>(solved[p] * static_cast<double>(gain[p]));
          variance[p] = spread[p] * gain[p] * gain[p];
        }
      }
    }
    std::copy_n(block.residual, block.count, planes.residual + begin);
    std::copy_n(block.expected, block.count, planes.expected + begin);
  }
};

}  // namespace

void solve_states(const MeasurementMatrix& matrix, const Exposures& exposures, double dark_variance,
                  std::int64_t pixels, const SolvedPlanes& planes) {
  const Matrices matrices(matrix);
  run_blocks(Solve{matrices, exposures, dark_variance, pixels, planes}, (pixels + block_pixels - 1) / block_pixels);
}

}  // namespace pbrdf
