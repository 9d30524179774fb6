// How much of the light from one direction a perfectly reflecting surface of V-grooves with Gaussian slopes sends on by
// single reflections: the directional-hemispherical reflectance that Hyde et al. 2009 weight their diffuse term by.
#pragma once

#include <cmath>

#include "pbrdf/dual.hpp"
#include "pbrdf/grooved_metal_series.hpp"

namespace pbrdf {

// For one sigma in (0, grooved_metal_most_sigma]: a Chebyshev series in u = (sigma tan - c)/(sigma tan + c) of the
// angle of the light, c = grooved_metal_middle. `r`: 1 with the slope by sigma, 0 without.
template <class T, int r>
struct GroovedMetal {
  Dual<T, r> sigma;
  Dual<T, r> coefficient[grooved_metal_degrees];
};

template <int r>
[[gnu::always_inline]] inline Dual<double, r> chebyshev(const double* coefficient, int count, Dual<double, r> u) {
  Dual<double, r> next{}, after{};
  for (int k = count - 1; k > 0; --k) {
    const Dual<double, r> now = 2 * u * next - after + coefficient[k];
    after = next;
    next = now;
  }
  return u * next - after + coefficient[0];
}

template <class T, int r>
GroovedMetal<T, r> grooved_metal(Dual<T, r> sigma) {
  GroovedMetal<T, r> result;
  result.sigma = sigma;
  Dual<double, r> u{2 / grooved_metal_most_sigma * static_cast<double>(sigma.value) - 1, {}};
  if constexpr (r == 1) u.slope.first = 2 / grooved_metal_most_sigma;
  for (int k = 0; k < grooved_metal_degrees; ++k) {
    const Dual<double, r> c = chebyshev(grooved_metal_series[k], grooved_metal_sigma_degrees, u);
    result.coefficient[k].value = static_cast<T>(c.value);
    if constexpr (r == 1) result.coefficient[k].slope.first = static_cast<T>(c.slope.first);
  }
  return result;
}

// Some directions at once, so that the loop over the degrees stands outside one that vectorises. slope: by sigma.
template <int lanes, class T, int r>
[[gnu::always_inline]] inline void grooved_metal_reflectance(const GroovedMetal<T, r>& metal, const T* cosine,
                                                             T* reflectance, T* slope) {
  T twice_u[lanes], twice_u_slope[lanes], after[lanes], after_slope[lanes];
#pragma GCC ivdep
  for (int l = 0; l < lanes; ++l) {
    const T sine2 = T(1) - cosine[l] * cosine[l], middle = T(grooved_metal_middle) * cosine[l];
    const Dual<T, r> x = std::sqrt(sine2 > 0 ? sine2 : T(0)) * metal.sigma;
    const Dual<T, r> u = 2 * (x - middle) * inverse(x + middle);
    twice_u[l] = u.value;
    reflectance[l] = after[l] = 0;
    if constexpr (r == 1) {
      twice_u_slope[l] = u.slope.first;
      slope[l] = after_slope[l] = 0;
    }
  }
  for (int k = grooved_metal_degrees - 1; k >= 0; --k) {
    const Dual<T, r> coefficient = metal.coefficient[k];
    const T last = k > 0 ? T(1) : T(0.5);
#pragma GCC ivdep
    for (int l = 0; l < lanes; ++l) {
      const T now = last * twice_u[l] * reflectance[l] - after[l] + coefficient.value;
      if constexpr (r == 1) {
        const T now_slope = last * (twice_u[l] * slope[l] + twice_u_slope[l] * reflectance[l]) - after_slope[l] +
                            coefficient.slope.first;
        after_slope[l] = slope[l];
        slope[l] = now_slope;
      }
      after[l] = reflectance[l];
      reflectance[l] = now;
    }
  }
}

}  // namespace pbrdf
