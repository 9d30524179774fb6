#include "pbrdf/pixel_cells.hpp"

#include <algorithm>
#include <cmath>

#include "pbrdf/isa.hpp"

namespace pbrdf {
namespace {

constexpr double pi = 3.14159265358979323846;
constexpr int block_pixels = 256;
constexpr int newton_rounds = 5;

// Directions through a block's pixels, as tangents of their angles from the optical axis.
struct Tangents {
  double x[block_pixels], y[block_pixels];
};

// arctan for |t| <= tan(pi/8), by its series to 3e-9.
[[gnu::always_inline]] inline double arctan_small(double t) {
  const double s = t * t;
  double sum = -1.0 / 19;
  sum = sum * s + 1.0 / 17;
  sum = sum * s - 1.0 / 15;
  sum = sum * s + 1.0 / 13;
  sum = sum * s - 1.0 / 11;
  sum = sum * s + 1.0 / 9;
  sum = sum * s - 1.0 / 7;
  sum = sum * s + 1.0 / 5;
  sum = sum * s - 1.0 / 3;
  return t + t * s * sum;
}

// std::atan2 is a call that does not vectorise.
[[gnu::always_inline]] inline double arctan2(double y, double x) {
  const double ax = std::fabs(x), ay = std::fabs(y);
  const double longer = ax > ay ? ax : ay, shorter = ax > ay ? ay : ax;
  const double t = longer > 0 ? shorter / longer : 0.0;
  const bool steep = t > 0.41421356237309503;
  double angle = arctan_small(steep ? (t - 1) / (t + 1) : t) + (steep ? pi / 4 : 0.0);
  angle = ay > ax ? pi / 2 - angle : angle;
  angle = x < 0 ? pi - angle : angle;
  return y < 0 ? -angle : angle;
}

// Newton's method for the direction whose distorted image lies at the given tangents.
[[gnu::always_inline]] inline void undistort(const double* k, Tangents& t) {
  Tangents image = t;
  for (int round = 0; round < newton_rounds; ++round)
    for (int p = 0; p < block_pixels; ++p) {
      const double u = t.x[p], v = t.y[p], r2 = u * u + v * v;
      const double gain = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
      const double slope = 2 * (k[0] + r2 * (2 * k[1] + r2 * 3 * k[4]));
      const double short_x = image.x[p] - (u * gain + 2 * k[2] * u * v + k[3] * (r2 + 2 * u * u));
      const double short_y = image.y[p] - (v * gain + k[2] * (r2 + 2 * v * v) + 2 * k[3] * u * v);
      const double xx = gain + u * u * slope + 2 * k[2] * v + 6 * k[3] * u;
      const double yy = gain + v * v * slope + 6 * k[2] * v + 2 * k[3] * u;
      const double xy = u * v * slope + 2 * k[2] * u + 2 * k[3] * v;
      const double inverse = 1 / (xx * yy - xy * xy);
      t.x[p] = u + (yy * short_x - xy * short_y) * inverse;
      t.y[p] = v + (xx * short_y - xy * short_x) * inverse;
    }
}

[[gnu::always_inline]] inline double dot(const double (&a)[3], const double (&b)[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// How a ray passes the sphere.
struct Pass {
  double ray[3], along;
  double across[3];     // from the ray's nearest point to the centre
  double discriminant;  // square of half the way inside; what is not above zero misses
};

// By the nearest point, whose distance keeps the digits that a difference of squares would lose.
[[gnu::always_inline]] inline Pass pass(double x, double y, const LitSphere& scene) {
  const double length = 1 / std::sqrt(x * x + y * y + 1);
  Pass way{{x * length, y * length, length}, 0.0, {}, 0.0};
  way.along = dot(way.ray, scene.centre);
  for (int i = 0; i < 3; ++i) way.across[i] = scene.centre[i] - way.along * way.ray[i];
  way.discriminant = scene.radius * scene.radius - dot(way.across, way.across);
  return way;
}

[[gnu::always_inline]] inline bool misses(const Tangents& tangents, const LitSphere& scene) {
  double most = 0.0;
#pragma omp simd reduction(max : most)
  for (int p = 0; p < block_pixels; ++p) most = std::max(most, pass(tangents.x[p], tangents.y[p], scene).discriminant);
  return !(most > 0.0);
}

struct Found {
  double theta_h, phi_d;  // rad
  double gain;            // m^2; zero where nothing is seen
};

// h = norm(L + V) and n x h = n x V, so that theta_h and phi_d need no tangent frame: b.L and t.L of Rusinkiewicz'
// angles are, up to one positive factor, 2 n.(V x L) / |L + V| and n.V - n.L.
[[gnu::always_inline]] inline Found find(double x, double y, const LitSphere& scene, double least_cosine) {
  const Pass way = pass(x, y, scene);
  const double depth = std::sqrt(way.discriminant > 0 ? way.discriminant : 0.0);
  double normal[3], light[3], camera[3], half[3];
  for (int i = 0; i < 3; ++i) normal[i] = -(way.across[i] + depth * way.ray[i]) / scene.radius;
  for (int i = 0; i < 3; ++i) light[i] = scene.light[i] - (way.along - depth) * way.ray[i];
  const double distance_squared = dot(light, light), inverse = 1 / std::sqrt(distance_squared);
  for (int i = 0; i < 3; ++i) {
    light[i] *= inverse;
    camera[i] = -way.ray[i];
    half[i] = light[i] + camera[i];
  }
  const double cos_light = dot(normal, light), cos_camera = dot(normal, camera);
  const double half_length = std::sqrt(dot(half, half));
  const double turned[3] = {normal[1] * half[2] - normal[2] * half[1], normal[2] * half[0] - normal[0] * half[2],
                            normal[0] * half[1] - normal[1] * half[0]};
  const double triple = normal[0] * (camera[1] * light[2] - camera[2] * light[1]) +
                        normal[1] * (camera[2] * light[0] - camera[0] * light[2]) +
                        normal[2] * (camera[0] * light[1] - camera[1] * light[0]);
  const bool seen =
      (way.discriminant > 0) & (cos_light > least_cosine) & (cos_camera > least_cosine) & (half_length > 0);
  Found found;
  found.theta_h = arctan2(std::sqrt(dot(turned, turned)), dot(normal, half));
  found.phi_d = arctan2(2 * triple, (cos_camera - cos_light) * half_length);
  found.gain = seen ? distance_squared * 1e-6 / cos_light : 0.0;
  return found;
}

// In cells, as fractions.
struct Places {
  double theta_h[block_pixels], phi_d[block_pixels], gain[block_pixels];
};

struct Block {
  std::int64_t row, column;  // of its first pixel, in the frame
  int count;
  PixelCells out;  // from its first pixel on
};

[[gnu::always_inline]] inline void locate_block(const Lens& lens, const LitSphere& scene, double least_cosine,
                                                const CellGrid& grid, const Block& block) {
  Tangents tangents;
  const double y = (block.row - lens.principal[1]) / lens.focal[1];
  for (int p = 0; p < block_pixels; ++p) {
    tangents.x[p] = (static_cast<double>(block.column + p) - lens.principal[0]) / lens.focal[0];
    tangents.y[p] = y;
  }
  if (std::any_of(lens.distortion, lens.distortion + 5, [](double k) { return k != 0; }))
    undistort(lens.distortion, tangents);
  if (misses(tangents, scene)) {
    std::fill_n(block.out.cell, block.count, no_cell);
    std::fill_n(block.out.theta_h, block.count, 0.0f);
    std::fill_n(block.out.phi_d, block.count, 0.0f);
    std::fill_n(block.out.gain, block.count, 0.0f);
    return;
  }
  Places places;
  const double rows = grid.theta_h - 1, columns = grid.phi_d;
#pragma omp simd
  for (int p = 0; p < block_pixels; ++p) {
    const Found found = find(tangents.x[p], tangents.y[p], scene, least_cosine);
    places.theta_h[p] = std::sqrt(found.theta_h * (2 / pi)) * rows;
    places.phi_d[p] = (found.phi_d + pi) * (1 / (2 * pi)) * columns;
    places.gain[p] = found.gain;
  }
  for (int p = 0; p < block.count; ++p) {
    // halves round up; both places are positive
    const std::int32_t j = std::min(static_cast<std::int32_t>(places.theta_h[p] + 0.5), grid.theta_h - 1);
    const std::int32_t k = static_cast<std::int32_t>(places.phi_d[p] + 0.5);
    block.out.cell[p] = places.gain[p] > 0 ? j * grid.phi_d + (k == grid.phi_d ? 0 : k) : no_cell;
    block.out.theta_h[p] = static_cast<float>(places.theta_h[p] - j);
    block.out.phi_d[p] = static_cast<float>(places.phi_d[p] - k);
    block.out.gain[p] = static_cast<float>(places.gain[p]);
  }
}

}  // namespace

void locate_pixels(const Lens& lens, const LitSphere& scene, const Window& window, double least_cosine,
                   const CellGrid& grid, const PixelCells& out) {
#pragma omp parallel for schedule(dynamic, 8)
  for (std::int64_t row = 0; row < window.rows; ++row)
    for (std::int64_t column = 0; column < window.columns; column += block_pixels) {
      const std::int64_t at = row * window.columns + column;
      const Block block{window.row + row,
                        window.column + column,
                        static_cast<int>(std::min<std::int64_t>(block_pixels, window.columns - column)),
                        {out.cell + at, out.theta_h + at, out.phi_d + at, out.gain + at}};
      in_version([&]() __attribute__((always_inline)) { locate_block(lens, scene, least_cosine, grid, block); });
    }
}

}  // namespace pbrdf
