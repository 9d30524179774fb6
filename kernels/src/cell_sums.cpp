#include "pbrdf/cell_sums.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "pbrdf/isa.hpp"
#include "pbrdf/tiles.hpp"

namespace pbrdf {
namespace {

constexpr int elements = 16;
constexpr int block_pixels = 64;
constexpr int quads = block_pixels / 4;
// Each stripe of rows has sums of its own, merged in order: the order of summation is that of the picture.
constexpr std::int64_t stripes = 8;

using Quad = Vector<float, 16>;

struct alignas(64) Block {
  float planes[sums_per_cell][block_pixels];
  float pixels[block_pixels][sums_per_cell];
};

[[gnu::always_inline]] inline void transpose_quad(const float (*planes)[block_pixels], float* pixels) {
  typedef int Order __attribute__((vector_size(16)));
  Quad a, b, c, d;
  std::memcpy(&a, planes[0], sizeof a);
  std::memcpy(&b, planes[1], sizeof b);
  std::memcpy(&c, planes[2], sizeof c);
  std::memcpy(&d, planes[3], sizeof d);
  const Order low{0, 4, 1, 5}, high{2, 6, 3, 7}, first{0, 1, 4, 5}, second{2, 3, 6, 7};
  const Quad ab_low = __builtin_shuffle(a, b, low), ab_high = __builtin_shuffle(a, b, high);
  const Quad cd_low = __builtin_shuffle(c, d, low), cd_high = __builtin_shuffle(c, d, high);
  const Quad rows[4] = {__builtin_shuffle(ab_low, cd_low, first), __builtin_shuffle(ab_low, cd_low, second),
                        __builtin_shuffle(ab_high, cd_high, first), __builtin_shuffle(ab_high, cd_high, second)};
  for (int p = 0; p < 4; ++p) std::memcpy(pixels + p * sums_per_cell, &rows[p], sizeof(Quad));
}

struct Summing {
  const float* mueller;
  const float* variance;
  PixelCells cells;
  std::int64_t pixels;  // of a plane

  [[gnu::always_inline]] inline void load(std::int64_t first, int count, Block& block) const {
    float gain[block_pixels], x[block_pixels], y[block_pixels];
    std::fill_n(gain, block_pixels, 0.0f);
    std::fill_n(x, block_pixels, 0.0f);
    std::fill_n(y, block_pixels, 0.0f);
    std::memcpy(gain, cells.gain + first, count * sizeof(float));
    std::memcpy(x, cells.theta_h + first, count * sizeof(float));
    std::memcpy(y, cells.phi_d + first, count * sizeof(float));
    for (int e = 0; e < elements; ++e) {
      const float *matrix = mueller + e * pixels + first, *spread = variance + e * pixels + first;
      if (count == block_pixels)
        for (int p = 0; p < block_pixels; ++p) {
          block.planes[e][p] = gain[p] * matrix[p];
          block.planes[elements + e][p] = gain[p] * gain[p] * spread[p];
        }
      else
        for (int p = 0; p < count; ++p) {
          block.planes[e][p] = gain[p] * matrix[p];
          block.planes[elements + e][p] = gain[p] * gain[p] * spread[p];
        }
    }
    float (*moment)[block_pixels] = block.planes + moments_at;
    for (int p = 0; p < block_pixels; ++p) {
      moment[0][p] = 1.0f;
      moment[1][p] = x[p];
      moment[2][p] = y[p];
      moment[3][p] = x[p] * x[p];
      moment[4][p] = x[p] * y[p];
      moment[5][p] = y[p] * y[p];
      moment[6][p] = moment[7][p] = 0.0f;
    }
    for (int plane = 0; plane < sums_per_cell; plane += 4)
      for (int quad = 0; quad < quads; ++quad) {
        const float (*from)[block_pixels] =
            reinterpret_cast<const float (*)[block_pixels]>(&block.planes[plane][4 * quad]);
        transpose_quad(from, &block.pixels[4 * quad][plane]);
      }
  }

  // Neighbours mostly share a cell: their sum goes to memory when the cell changes.
  [[gnu::always_inline]] inline void add(std::int64_t first, int count, Block& block, float* sums) const {
    const std::int32_t* cell = cells.cell + first;
    if (std::all_of(cell, cell + count, [](std::int32_t c) { return c == no_cell; })) return;
    load(first, count, block);
    float sum[sums_per_cell];
    std::int32_t current = no_cell;
    for (int p = 0; p < count; ++p) {
      const float* pixel = block.pixels[p];
      if (cell[p] == no_cell || std::isnan(pixel[0])) continue;
      if (cell[p] == current) {
        for (int i = 0; i < sums_per_cell; ++i) sum[i] += pixel[i];
        continue;
      }
      if (current != no_cell) put(sum, sums + static_cast<std::int64_t>(current) * sums_per_cell);
      std::copy_n(pixel, sums_per_cell, sum);
      current = cell[p];
    }
    if (current != no_cell) put(sum, sums + static_cast<std::int64_t>(current) * sums_per_cell);
  }

  [[gnu::always_inline]] static inline void put(const float* sum, float* to) {
    for (int i = 0; i < sums_per_cell; ++i) to[i] += sum[i];
  }
};

}  // namespace

void sum_cells(const float* mueller, const float* variance, const PixelCells& cells, std::int64_t rows,
               std::int64_t columns, std::int64_t cell_count, float* sums) {
  const std::int64_t length = cell_count * sums_per_cell;
  const Summing summing{mueller, variance, cells, rows * columns};
  std::vector<std::vector<float>> parts(stripes);
#pragma omp parallel
  {
    Block block;
#pragma omp for schedule(dynamic)
    for (std::int64_t s = 0; s < stripes; ++s) {
      parts[s].assign(length, 0.0f);
      in_version([&]() __attribute__((always_inline)) {
        const std::int64_t last = rows * (s + 1) / stripes * columns;
        for (std::int64_t at = rows * s / stripes * columns; at < last; at += block_pixels)
          summing.add(at, static_cast<int>(std::min<std::int64_t>(block_pixels, last - at)), block, parts[s].data());
      });
    }
#pragma omp for schedule(static)
    for (std::int64_t i = 0; i < length; ++i) {
      float sum = 0.0f;
      for (const std::vector<float>& part : parts) sum += part[i];
      sums[i] = sum;
    }
  }
}

}  // namespace pbrdf
