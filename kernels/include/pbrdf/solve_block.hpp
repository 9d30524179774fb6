// What solving works on: a measurement matrix prepared for tiles, and a block of pixels in a thread's scratch.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "pbrdf/exposures.hpp"
#include "pbrdf/solve.hpp"
#include "pbrdf/tiles.hpp"

namespace pbrdf {

inline constexpr int elements = 16;
inline constexpr int triangle = elements * (elements + 1) / 2;
inline constexpr int block_pixels = row_length<double>;
// Rows of floats are as far apart as `multiply` has them.
inline constexpr int float_row = row_length<float>;

// Place in the lower triangle of a symmetric matrix.
[[gnu::always_inline]] constexpr int at(int row, int column) { return row * (row + 1) / 2 + column; }

// Everything that follows from W alone.
struct Matrices {
  explicit Matrices(const MeasurementMatrix& matrix)
      : states(matrix.states),
        to_solve(transposed<double>(matrix.reduction, elements, states)),
        to_predict(transposed<float>(matrix.measurement, states, elements)),
        freedom(states),
        row_sums(elements),
        gram(triangle) {
    const double *w = matrix.measurement, *r = matrix.reduction;
    std::vector<double> squared(static_cast<std::size_t>(elements) * states);
    std::vector<double> back(squared.size()), products(static_cast<std::size_t>(triangle) * states);
    for (std::size_t k = 0; k < squared.size(); ++k) squared[k] = r[k] * r[k];
    for (int n = 0; n < states; ++n) {
      double leverage = 0.0;
      for (int i = 0; i < elements; ++i) {
        const double factor = w[n * elements + i];
        leverage += factor * r[i * states + n];
        row_sums[i] += r[i * states + n];
        back[i * states + n] = factor;
        for (int j = 0; j <= i; ++j) {
          const double product = factor * w[n * elements + j];
          products[at(i, j) * states + n] = product;
          gram[at(i, j)] += product;
        }
      }
      freedom[n] = static_cast<float>(1.0 - leverage);
    }
    squares = transposed<float>(squared.data(), elements, states);
    to_project = transposed<double>(back.data(), elements, states);
    to_normal = transposed<double>(products.data(), triangle, states);
  }

  int states;
  std::vector<double> to_solve;    // W+
  std::vector<float> to_predict;   // W, of which noise hides the rounding
  std::vector<double> to_project;  // W'
  std::vector<double> to_normal;   // from weights of the states to the triangle of W' S W
  std::vector<float> squares;      // of the entries of W+
  std::vector<float> freedom;      // share of a state's variance that stays in the residual
  std::vector<double> row_sums;    // of W+: what an offset that all states share does to each element
  std::vector<double> gram;        // triangle of W' W
};

// Pixels that are solved together. Rows are block_pixels doubles or bytes, or float_row floats.
struct Block {
  static std::size_t bytes(int states) {
    const std::size_t doubles = padded_rows(states) + elements, floats = 2 * padded_rows(states) + elements + 2;
    return doubles * block_pixels * sizeof(double) + floats * float_row * sizeof(float) +
           static_cast<std::size_t>(states) * block_pixels;
  }

  Block(void* scratch, int states)
      : measured(static_cast<double*>(scratch)),
        solved(measured + padded_rows(states) * block_pixels),
        rate(reinterpret_cast<float*>(solved + elements * block_pixels)),
        spread(rate + padded_rows(states) * float_row),
        variance(spread + padded_rows(states) * float_row),
        residual(variance + elements * float_row),
        expected(residual + float_row),
        used(reinterpret_cast<std::uint8_t*>(expected + float_row)) {}

  int count = 0;
  double* measured;    // padded states
  double* solved;      // 16
  float* rate;         // padded states: as measured
  float* spread;       // padded states: fitted rates, then their variances
  float* variance;     // 16
  float* residual;     // 1
  float* expected;     // 1
  std::uint8_t* used;  // states
};

template <int bytes>
[[gnu::always_inline]] inline void solve_plain(const Matrices& matrices, const Block& block) {
  constexpr int width = 2 * bytes / static_cast<int>(sizeof(double));
  for (int p = 0; p < block.count; p += width)
    for (int row = 0; row < elements; row += tile_rows<bytes>) {
      Tile<double, bytes> tile;
      multiply<bytes>(matrices.to_solve.data() + row, elements, matrices.states, block.measured + p, tile);
      store_tile<bytes>(tile, block.solved + row * block_pixels + p);
    }
}

// Fitted rates into `spread`, and how far the measured ones are from them.
template <int bytes>
[[gnu::always_inline]] inline void predict(const Matrices& matrices, const Block& block) {
  constexpr int width = 2 * bytes / static_cast<int>(sizeof(float));
  using V = Vector<float, bytes>;
  alignas(64) float solved[elements * float_row];
  for (int k = 0; k < elements; ++k)
    for (int p = 0; p < block.count; ++p)
      solved[k * float_row + p] = static_cast<float>(block.solved[k * block_pixels + p]);
  const int rows = padded_rows(matrices.states);
  for (int p = 0; p < block.count; p += width) {
    V squares[2] = {V{}, V{}};
    for (int row = 0; row < rows; row += tile_rows<bytes>) {
      Tile<float, bytes> tile;
      multiply<bytes>(matrices.to_predict.data() + row, rows, elements, solved + p, tile);
      store_tile<bytes>(tile, block.spread + row * float_row + p);
#pragma GCC unroll 8
      for (int r = 0; r < tile_rows<bytes>; ++r)
        for (int half = 0; half < 2; ++half) {
          const V* from = reinterpret_cast<const V*>(block.rate + (row + r) * float_row + p);
          const V difference = from[half] - tile.sum[r][half];
          squares[half] += difference * difference;
        }
    }
    std::memcpy(block.residual + p, squares, sizeof squares);
  }
}

// From fitted rates to their variances.
[[gnu::always_inline]] inline void spread_of_states(const Matrices& matrices, const Exposures& exposures,
                                                    const Block& block) {
  constexpr float missing = std::numeric_limits<float>::quiet_NaN();
  const float read_variance = static_cast<float>(exposures.noise.read_noise_dn * exposures.noise.read_noise_dn);
  const float gain = static_cast<float>(exposures.noise.dn_per_electron);
  std::fill_n(block.expected, block_pixels, 0.0f);
  for (int n = 0; n < matrices.states; ++n) {
    float* spread = block.spread + n * float_row;
    const std::uint8_t* used = block.used + n * block_pixels;
    float weight[block_pixels] = {};
    for (int e = 0; e < exposures.count; ++e) {
      const float seconds = static_cast<float>(exposures.seconds[e]);
#pragma omp simd
      for (int p = 0; p < block_pixels; ++p) {
        const float certain = certainty(spread[p], seconds, read_variance, gain);
        weight[p] += static_cast<int>(used[p]) > e ? certain : 0.0f;
      }
    }
    const float freedom = matrices.freedom[n];
#pragma omp simd
    for (int p = 0; p < block_pixels; ++p) {
      spread[p] = weight[p] > 0.0f ? 1.0f / weight[p] : missing;
      block.expected[p] += freedom * spread[p];
    }
  }
}

}  // namespace pbrdf
