#include "pbrdf/cell_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbrdf {
namespace {

constexpr int elements = 16;
constexpr int terms = 6;  // 1, x, y, x x, x y, y y
constexpr int around = 9;
constexpr int third = 3;
// Mean over all places between four pixels of the sum of the squared weights of a bilinear interpolation.
constexpr double interpolated_noise = 4.0 / 9.0;
constexpr double least_pivot = 1e-9;
constexpr double most_pixels = std::numeric_limits<std::uint16_t>::max();

struct Neighbour {
  const float* sums;
  double pixels;
  double terms[pbrdf::terms];  // means over its pixels, places from the node
};

// Moments of a cell that lies `x` and `y` cells from the node.
Neighbour neighbour(const float* sums, double x, double y) {
  const float* moment = sums + moments_at;
  const double pixels = moment[0], share = pixels > 0 ? 1 / pixels : 0.0;
  const double u = moment[1] * share, v = moment[2] * share;
  return {sums,
          pixels,
          {1.0, x + u, y + v, x * x + 2 * x * u + moment[3] * share, x * y + x * v + y * u + moment[4] * share,
           y * y + 2 * y * v + moment[5] * share}};
}

// First column of the inverse of a positive definite matrix; false if it is as good as singular.
bool first_of_inverse(double (&a)[terms][terms], double (&z)[terms]) {
  for (int i = 0; i < terms; ++i) z[i] = i == 0 ? 1.0 : 0.0;
  for (int k = 0; k < terms; ++k) {
    if (!(a[k][k] > least_pivot * a[0][0])) return false;
    for (int i = k + 1; i < terms; ++i) {
      const double factor = a[i][k] / a[k][k];
      for (int j = k; j < terms; ++j) a[i][j] -= factor * a[k][j];
      z[i] -= factor * z[k];
    }
  }
  for (int k = terms - 1; k >= 0; --k) {
    for (int j = k + 1; j < terms; ++j) z[k] -= a[k][j] * z[j];
    z[k] /= a[k][k];
  }
  return true;
}

// What each pixel of the cells weighs in the value at the node; false if the cells do not tell it well enough.
bool pixel_weights(const Neighbour (&cells)[around], double (&weights)[around]) {
  double normal[terms][terms] = {}, z[terms];
  for (const Neighbour& cell : cells) {
    if (cell.pixels == 0) return false;
    for (int i = 0; i < terms; ++i)
      for (int j = 0; j < terms; ++j) normal[i][j] += cell.pixels * cell.terms[i] * cell.terms[j];
  }
  if (!first_of_inverse(normal, z)) return false;
  double noise = 0.0;
  for (int c = 0; c < around; ++c) {
    weights[c] = 0.0;
    for (int i = 0; i < terms; ++i) weights[c] += z[i] * cells[c].terms[i];
    noise += cells[c].pixels * weights[c] * weights[c];
  }
  return noise < interpolated_noise;
}

void fit_node(const float* sums, const CellGrid& grid, std::int32_t row, std::int32_t column, const NodeValues& out) {
  std::fill_n(out.mueller, elements, std::numeric_limits<float>::quiet_NaN());
  std::fill_n(out.variance, elements, std::numeric_limits<float>::quiet_NaN());
  *out.count = 0;
  if (row == 0 || row == grid.theta_h - 1) return;
  Neighbour cells[around];
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y) {
      const std::int64_t cell =
          static_cast<std::int64_t>(row + x) * grid.phi_d + (column + y + grid.phi_d) % grid.phi_d;
      cells[third * (x + 1) + y + 1] = neighbour(sums + cell * sums_per_cell, x, y);
    }
  double weights[around];
  if (!pixel_weights(cells, weights)) return;
  double mueller[elements] = {}, variance[elements] = {}, pixels = 0.0;
  for (int c = 0; c < around; ++c) {
    pixels += cells[c].pixels;
    for (int e = 0; e < elements; ++e) {
      mueller[e] += weights[c] * cells[c].sums[e];
      variance[e] += weights[c] * weights[c] * cells[c].sums[elements + e];
    }
  }
  for (int e = 0; e < elements; ++e) {
    out.mueller[e] = static_cast<float>(mueller[e]);
    out.variance[e] = static_cast<float>(variance[e]);
  }
  *out.count = static_cast<std::uint16_t>(std::min(pixels, most_pixels));
}

}  // namespace

void fit_cells(const float* sums, const CellGrid& grid, const CellGrid& stride, const NodeValues& out) {
  const std::int32_t rows = (grid.theta_h - 1) / stride.theta_h + 1, columns = grid.phi_d / stride.phi_d;
#pragma omp parallel for schedule(dynamic)
  for (std::int32_t j = 0; j < rows; ++j)
    for (std::int32_t k = 0; k < columns; ++k) {
      const std::int64_t node = static_cast<std::int64_t>(j) * columns + k;
      fit_node(sums, grid, j * stride.theta_h, k * stride.phi_d,
               {out.mueller + node * elements, out.variance + node * elements, out.count + node});
    }
}

}  // namespace pbrdf
