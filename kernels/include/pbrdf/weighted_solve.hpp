// Weighted least squares of sixteen unknowns, for the pixels whose states differ in exposures.
#pragma once

#include "pbrdf/solve_block.hpp"

namespace pbrdf {

// Lower triangle of the inverse of a positive definite matrix, in place, by sweeping one row after the other (Goodnight
// 1979): within a sweep nothing waits for anything, where a factorisation is a chain of sums.
template <typename V>
[[gnu::always_inline]] inline void invert(V* a) {
  for (int k = 0; k < elements; ++k) {
    const V inverse_pivot = 1.0 / a[at(k, k)];
    V column[elements], scaled[elements];
    for (int i = 0; i < elements; ++i) {
      column[i] = i < k ? a[at(k, i)] : a[at(i, k)];
      scaled[i] = column[i] * inverse_pivot;
    }
#pragma GCC unroll 16
    for (int i = 0; i < elements; ++i)
#pragma GCC unroll 16
      for (int j = 0; j <= i; ++j) a[at(i, j)] -= scaled[i] * column[j];
    for (int i = 0; i < elements; ++i) a[i < k ? at(k, i) : at(i, k)] = scaled[i];
    a[at(k, k)] = -inverse_pivot;
  }
  for (int entry = 0; entry < triangle; ++entry) a[entry] = -a[entry];
}

template <typename V>
[[gnu::always_inline]] inline void apply_symmetric(const V* triangle_of, const V* vector, V* product) {
  for (int i = 0; i < elements; ++i) product[i] = V{};
  for (int i = 0; i < elements; ++i) {
    for (int j = 0; j < i; ++j) {
      product[i] += triangle_of[at(i, j)] * vector[j];
      product[j] += triangle_of[at(i, j)] * vector[i];
    }
    product[i] += triangle_of[at(i, i)] * vector[i];
  }
}

class WeightedSolve {
 public:
  static std::size_t bytes(int states, int exposures) {
    return (2 + static_cast<std::size_t>(exposures)) * states * block_pixels * sizeof(double);
  }

  WeightedSolve(void* scratch, const Matrices& matrices, const Exposures& exposures, double dark_variance)
      : matrices_(matrices),
        exposures_(exposures),
        dark_variance_(dark_variance),
        weight_(static_cast<double*>(scratch)),
        scaled_(weight_ + static_cast<std::size_t>(matrices.states) * block_pixels),
        moved_(scaled_ + static_cast<std::size_t>(matrices.states) * block_pixels) {}

  // Solves a block whose `spread` holds the rates that the variances of its states are told from.
  template <int bytes>
  [[gnu::always_inline]] inline void run(const Block& block) const {
    if (dark_variance_ > 0.0) move_by_dark(block);
    spread_of_states(matrices_, exposures_, block);
    weigh(block);
    solve<bytes>(block);
    predict<bytes>(matrices_, block);
  }

 private:
  // Weights of the states and weighted rates; the sum of the variances into `expected`.
  [[gnu::always_inline]] inline void weigh(const Block& block) const {
    std::fill_n(block.expected, block_pixels, 0.0f);
    for (int n = 0; n < matrices_.states; ++n) {
      const float* spread = block.spread + n * float_row;
      const double* measured = block.measured + n * block_pixels;
      double *weight = weight_ + n * block_pixels, *scaled = scaled_ + n * block_pixels;
#pragma omp simd
      for (int p = 0; p < block_pixels; ++p) {
        weight[p] = static_cast<double>(1.0f / spread[p]);
        scaled[p] = weight[p] * measured[p];
        block.expected[p] += spread[p];
      }
    }
  }

  template <int bytes>
  [[gnu::always_inline]] inline void solve(const Block& block) const {
    constexpr int lanes = bytes / static_cast<int>(sizeof(double)), width = 2 * lanes;
    using V = Vector<double, bytes>;
    for (int p = 0; p < block.count; p += width) {
      V normal[2][triangle], right[2][elements], solved[2][elements];
      times<bytes, triangle>(matrices_.to_normal, weight_ + p, normal);
      times<bytes, elements>(matrices_.to_project, scaled_ + p, right);
      for (int half = 0; half < 2; ++half) {
        invert(normal[half]);
        apply_symmetric<V>(normal[half], right[half], solved[half]);
        for (int k = 0; k < elements; ++k)
          std::memcpy(block.solved + k * block_pixels + p + half * lanes, &solved[half][k], sizeof(V));
      }
      V variance[2][elements];
      for (int half = 0; half < 2; ++half) {
        // what the fit takes of the states' variances
        V taken = V{};
        for (int i = 0; i < elements; ++i) {
          variance[half][i] = normal[half][at(i, i)];
          for (int j = 0; j <= i; ++j)
            taken += normal[half][at(i, j)] * (matrices_.gram[at(i, j)] * (i == j ? 1.0 : 2.0));
        }
        for (int lane = 0; lane < lanes; ++lane) {
          float& expected = block.expected[p + half * lanes + lane];
          expected = std::max(0.0f, expected - static_cast<float>(taken[lane]));
        }
      }
      if (dark_variance_ > 0.0) add_dark<bytes>(p, normal, variance);
      for (int half = 0; half < 2; ++half)
        for (int k = 0; k < elements; ++k)
          for (int lane = 0; lane < lanes; ++lane)
            block.variance[k * float_row + p + half * lanes + lane] = static_cast<float>(variance[half][k][lane]);
    }
  }

  // Each exposure's dark frame moves the states that use it, by different amounts: a merged rate's share of that
  // exposure, over the rate's variance, which cancels. From the rates that the variances are told from.
  [[gnu::always_inline]] inline void move_by_dark(const Block& block) const {
    const float read_variance = static_cast<float>(exposures_.noise.read_noise_dn * exposures_.noise.read_noise_dn);
    const float gain = static_cast<float>(exposures_.noise.dn_per_electron);
    for (int e = 0; e < exposures_.count; ++e)
      for (int n = 0; n < matrices_.states; ++n) {
        const float seconds = static_cast<float>(exposures_.seconds[e]), per_second = 1.0f / seconds;
        const float* rate = block.spread + n * float_row;
        const std::uint8_t* used = block.used + n * block_pixels;
        double* moved = moved_ + (e * matrices_.states + n) * block_pixels;
#pragma omp simd
        for (int p = 0; p < block_pixels; ++p) {
          const float share = certainty(rate[p], seconds, read_variance, gain) * per_second;
          moved[p] = static_cast<double>(static_cast<int>(used[p]) > e ? share : 0.0f);
        }
      }
  }

  template <int bytes>
  [[gnu::always_inline]] inline void add_dark(int p, const Vector<double, bytes> (*covariance)[triangle],
                                              Vector<double, bytes> (*variance)[elements]) const {
    using V = Vector<double, bytes>;
    for (int e = 0; e < exposures_.count; ++e) {
      V right[2][elements], shift[elements];
      times<bytes, elements>(matrices_.to_project, moved_ + e * matrices_.states * block_pixels + p, right);
      for (int half = 0; half < 2; ++half) {
        apply_symmetric<V>(covariance[half], right[half], shift);
        for (int k = 0; k < elements; ++k) variance[half][k] += shift[k] * shift[k] * dark_variance_;
      }
    }
  }

  // A matrix of some rows, transposed, times the states of two vectors of pixels.
  template <int bytes, int rows>
  [[gnu::always_inline]] inline void times(const std::vector<double>& factors, const double* states,
                                           Vector<double, bytes> (*product)[rows]) const {
    static_assert(rows % row_padding == 0);
    for (int row = 0; row < rows; row += tile_rows<bytes>) {
      Tile<double, bytes> tile;
      multiply<bytes>(factors.data() + row, rows, matrices_.states, states, tile);
      for (int r = 0; r < tile_rows<bytes>; ++r)
        for (int half = 0; half < 2; ++half) product[half][row + r] = tile.sum[r][half];
    }
  }

  const Matrices& matrices_;
  const Exposures& exposures_;
  double dark_variance_;
  // each states x block_pixels
  double* weight_;
  double* scaled_;
  double* moved_;  // for each exposure
};

}  // namespace pbrdf
