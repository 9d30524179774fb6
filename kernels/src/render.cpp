#include "pbrdf/render.hpp"

#include <algorithm>
#include <cmath>

namespace pbrdf {
namespace {

// Counter-based random numbers: SplitMix64 (Steele, Lea, Flood 2014) of key + counter.
std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

class PixelNoise {
 public:
  PixelNoise(std::uint64_t key, std::uint64_t pixel) : state_(mix(key ^ mix(pixel))) {}

  double uniform() {  // in (0, 1)
    state_ += 0x9e3779b97f4a7c15ULL;
    return (static_cast<double>(mix(state_) >> 11) + 0.5) * 0x1.0p-53;
  }

  double gaussian() {
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    return radius * std::cos(6.283185307179586 * uniform());
  }

  double poisson(double mean) {
    constexpr double gaussian_from = 50.0;  // its third moment is below 15 % of a standard deviation from here on
    if (mean >= gaussian_from) return std::max(0.0, std::round(mean + std::sqrt(mean) * gaussian()));
    double remaining = uniform(), probability = std::exp(-mean), count = 0.0;
    while (remaining > probability && probability > 0.0) {
      remaining -= probability;
      count += 1.0;
      probability *= mean / count;
    }
    return count;
  }

 private:
  std::uint64_t state_;
};

using RowMajorMueller = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

RowMajorMueller light_path(const SurfacePoint& seen, const FacetMaterial& material) {
  RowMajorMueller mueller;
  facet_mueller(seen.light_local.data(), seen.camera_local.data(), material, mueller.data());
  return seen.irradiance * change_frames(mueller, seen.angle_in, seen.angle_out);
}

}  // namespace

void render_mueller(const Pinhole& camera, const SphereScene& scene, const FacetMaterial& material, int rows,
                    int columns, int samples, float* out) {
#pragma omp parallel for schedule(dynamic, 4)
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      RowMajorMueller sum = RowMajorMueller::Zero();
      for (int sample = 0; sample < samples * samples; ++sample) {
        const double dx = (sample % samples + 0.5) / samples - 0.5;
        const double dy = (sample / samples + 0.5) / samples - 0.5;
        if (const auto seen = trace(camera, scene, column + dx, row + dy)) sum += light_path(*seen, material);
      }
      sum /= samples * samples;
      std::copy_n(sum.data(), 16, out + (static_cast<std::int64_t>(row) * columns + column) * 16);
    }
  }
}

void expose(const float* mueller, const double state[16], std::int64_t pixels, double electrons,
            const float* dark_electrons, const Sensor& sensor, std::uint64_t key, std::uint16_t* out) {
  const double highest = static_cast<double>((1 << sensor.adc_bits) - 1);
#pragma omp parallel for schedule(static)
  for (std::int64_t pixel = 0; pixel < pixels; ++pixel) {
    const float* m = mueller + pixel * 16;
    double signal = 0.0;
    for (int k = 0; k < 16; ++k) signal += state[k] * m[k];
    PixelNoise noise(key, static_cast<std::uint64_t>(pixel));
    const double mean = std::max(0.0, signal * electrons) + static_cast<double>(dark_electrons[pixel]);
    const double collected = (mean > 0.0 ? noise.poisson(mean) : 0.0) + sensor.read_noise_electrons * noise.gaussian();
    const double level = std::round(collected / sensor.electrons_per_dn + sensor.offset_dn);
    out[pixel] =
        static_cast<std::uint16_t>(static_cast<std::uint32_t>(std::clamp(level, 0.0, highest)) << sensor.shift);
  }
}

}  // namespace pbrdf
