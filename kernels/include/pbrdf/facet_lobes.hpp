// Lobes of facets, D G / (4 cos_i cos_o): how many facets mirror the light into the camera and see both.
#pragma once

#include <cstdint>
#include <cstring>

#include "pbrdf/dual.hpp"
#include "pbrdf/facet_geometry.hpp"

namespace pbrdf {

inline constexpr double pi = 3.14159265358979323846;

namespace detail {

template <class T>
struct ExponentialFormat;

template <>
struct ExponentialFormat<float> {
  using Integer = std::uint32_t;
  static constexpr float rounder = 12582912.0f, least = -87.0f;  // 1.5 * 2^23
  static constexpr float ln2_high = 0.693359375f, ln2_low = -2.12194440e-4f;
  static constexpr int mantissa = 23, terms = 7;
};

template <>
struct ExponentialFormat<double> {
  using Integer = std::uint64_t;
  static constexpr double rounder = 6755399441055744.0, least = -708.0;  // 1.5 * 2^52
  static constexpr double ln2_high = 6.93145751953125e-1, ln2_low = 1.42860682030941723212e-6;
  static constexpr int mantissa = 52, terms = 14;
};

// e^x for x <= 0, zero where it would be below the least normal number: a loop over it vectorises, where std::exp is a
// call. Cody and Waite's reduction to |r| <= ln 2 / 2, then Taylor's series.
template <class T>
[[gnu::always_inline]] inline T exponential(T x) {
  using Format = ExponentialFormat<T>;
  using Integer = typename Format::Integer;
  const T bounded = x > Format::least ? x : Format::least;
  const T shifted = bounded * T(1.44269504088896340736) + Format::rounder;
  const T power = shifted - Format::rounder;
  const T r = (bounded - power * Format::ln2_high) - power * Format::ln2_low;
  T series = 1;
#pragma GCC unroll 16
  for (int k = Format::terms; k > 0; --k) series = T(1) + series * r * (T(1) / T(k));
  Integer bits, one;
  std::memcpy(&bits, &shifted, sizeof bits);
  const T unit = 1;
  std::memcpy(&one, &unit, sizeof one);
  // the sum has left the power of two in the low bits of `shifted`
  bits = (bits << Format::mantissa) + one;
  T scale;
  std::memcpy(&scale, &bits, sizeof scale);
  return x > Format::least ? series * scale : T(0);
}

}  // namespace detail

template <class T, int n>
[[gnu::always_inline]] inline Dual<T, n> exponential(Dual<T, n> x) {
  const T value = detail::exponential(x.value);
  return {value, scaled(value, x.slope)};
}

// GGX with Smith's separable masking (Walter et al. 2007): D = a^2/(pi q^2), q = a^2 cos^2 + sin^2 of theta_h, and
// G/(4 cos_i cos_o) = 1/((cos_i + root_i)(cos_o + root_o)).
struct GgxSmith {
  template <class T, int n>
  [[gnu::always_inline]] static inline Dual<T, n> lobe(const FacetGeometry<T>& g, Dual<T, n> alpha) {
    const Dual<T, n> a2 = square(alpha);
    // not 1 + (a^2 - 1) cos^2, which loses its digits in a narrow lobe
    const Dual<T, n> q = a2 * (T(1) - g.sin2_h) + g.sin2_h;
    const Dual<T, n> i = square_root(a2 * sine_squared(g.cos_i) + square(g.cos_i)) + g.cos_i;
    const Dual<T, n> o = square_root(a2 * sine_squared(g.cos_o) + square(g.cos_o)) + g.cos_o;
    return T(1 / pi) * a2 * inverse(square(q) * (i * o));
  }
};

// Facets whose slopes are Gaussian, D cos_h = e^{-tan^2/a^2}/(pi a^2 cos^3), without their masking.
template <class T, int n>
[[gnu::always_inline]] inline Dual<T, n> gaussian_facets(const FacetGeometry<T>& g, Dual<T, n> inverse_alpha_squared) {
  // cos_h = (cos_i + cos_o)/(2 cos_d), exact for a half vector along the horizon
  const T cos2_h = square(T(0.5) * (g.cos_i + g.cos_o) / g.cos_d);
  const Dual<T, n> decay = exponential(-(g.sin2_h / cos2_h) * inverse_alpha_squared);
  return (T(1 / pi) / square(cos2_h)) * inverse_alpha_squared * decay;
}

// Beckmann's distribution with the separable masking of Walter et al. 2007, their rational form.
struct BeckmannSmith {
  template <class T, int n>
  [[gnu::always_inline]] static inline Dual<T, n> lobe(const FacetGeometry<T>& g, Dual<T, n> alpha) {
    const Dual<T, n> facets = gaussian_facets(g, inverse(square(alpha)));
    return (T(0.25) / (g.cos_i * g.cos_o)) * facets * masking(g.cos_i, alpha) * masking(g.cos_o, alpha);
  }

 private:
  template <class T, int n>
  [[gnu::always_inline]] static inline Dual<T, n> masking(T cosine, Dual<T, n> alpha) {
    // Walter's a is 1/t; from 1.6 on nothing is masked
    const T sine2 = sine_squared(cosine), tangent = std::sqrt(sine2 > 0 ? sine2 : T(0)) / cosine;
    const Dual<T, n> t = tangent * alpha;
    const Dual<T, n> masked = (T(3.535) * t + T(2.181)) * inverse(square(t) + T(2.276) * t + T(2.577));
    return chosen(t.value * T(1.6) > T(1), masked, Dual<T, n>{T(1), {}});
  }
};

// Gaussian slopes of standard deviation sigma, alpha = sqrt(2) sigma, shadowed as by V-grooves (Torrance and Sparrow
// 1967, Blinn 1977): G = min(1, 2 cos_h cos_i/cos_d, 2 cos_h cos_o/cos_d). It depends on directions alone, so that its
// kinks are none of the parameters'.
struct GaussianBlinn {
  template <class T, int n>
  [[gnu::always_inline]] static inline Dual<T, n> lobe(const FacetGeometry<T>& g, Dual<T, n> sigma) {
    const T lower = g.cos_i < g.cos_o ? g.cos_i : g.cos_o;
    const T grooves = (g.cos_i + g.cos_o) * lower / square(g.cos_d);
    const T seen = (grooves < T(1) ? grooves : T(1)) / (T(4) * g.cos_i * g.cos_o);
    return seen * gaussian_facets(g, inverse(T(2) * square(sigma)));
  }
};

}  // namespace pbrdf
