// Fresnel's equations at an interface from the index 1 to n - ik, k >= 0, for a beam that varies as e^{+i omega t}
// (Verdet's signs), as what Collett's Mueller matrices hold.
#pragma once

#include "pbrdf/dual.hpp"

namespace pbrdf {

// w = sqrt(index^2 - sin^2 theta) = p - iq, the index times the cosine inside. q counts with a complex index alone.
template <class S, bool complex>
struct InnerWave {
  S p, q;
};

// Mueller elements of a mirror: 00 = 11, 01 = 10, 22 = 33, 32 = -23.
template <class S>
struct Reflection {
  S even, odd, cross, turned;
};

// Power transmitted: mean and half difference of s and p, the latter never positive for a real index above 1.
template <class S>
struct Transmission {
  S mean, difference;
};

template <bool complex, class T, int n>
[[gnu::always_inline]] inline InnerWave<Dual<T, n>, complex> inner_wave(T sine_squared, Dual<T, n> eta,
                                                                        Dual<T, n> kappa) {
  if constexpr (!complex) {
    const Dual<T, n> p = square_root(square(eta) - sine_squared);
    return {p, p};
  } else {
    const Dual<T, n> real = square(eta) - square(kappa) - sine_squared, half = eta * kappa;
    // At the critical angle of a lossless medium the slopes are infinite: they are taken from beside it.
    const T beside = sizeof(T) == 8 ? T(1e-60) : T(1e-30);
    const Dual<T, n> modulus = square_root(square(real) + 4 * square(half) + beside);
    const bool dense = real.value >= 0;
    // p q = half; the larger one first, for the other would lose its digits in a difference
    const Dual<T, n> larger = square_root(T(0.5) * (modulus + chosen(dense, real, -real)));
    const Dual<T, n> smaller = half * inverse(larger);
    return {chosen(dense, larger, smaller), chosen(dense, smaller, larger)};
  }
}

// |c + w|^2 and |sin^2 + c w|^2: with c the cosine outside, r_s = (c - w)/(c + w) and, from the textbook form
// (index^2 c - w)/(index^2 c + w), r_p = r_s (sin^2 - c w)/(sin^2 + c w), which needs no second complex division.
template <class S>
struct FresnelSums {
  S across, along, inverse_product;
};

template <bool complex, class T, int n>
[[gnu::always_inline]] inline FresnelSums<Dual<T, n>> fresnel_sums(T cosine, T sine_squared,
                                                                   const InnerWave<Dual<T, n>, complex>& w) {
  Dual<T, n> across = square(w.p + cosine), along = square(cosine * w.p + sine_squared);
  if constexpr (complex) {
    across = across + square(w.q);
    along = along + square(cosine * w.q);
  }
  return {across, along, inverse(across * along)};
}

template <bool complex, class T, int n>
[[gnu::always_inline]] inline Reflection<Dual<T, n>> reflect(T cosine, T sine_squared,
                                                             const InnerWave<Dual<T, n>, complex>& w) {
  using S = Dual<T, n>;
  const FresnelSums<S> sums = fresnel_sums(cosine, sine_squared, w);
  S minus = square(w.p - cosine), norm = square(w.p);
  if constexpr (complex) {
    minus = minus + square(w.q);
    norm = norm + square(w.q);
  }
  const S s = minus * sums.along * sums.inverse_product;
  const S inverse_along = sums.across * sums.inverse_product;
  // r_p / r_s, its real and imaginary part
  const S ratio = (square(sine_squared) - square(cosine) * norm) * inverse_along;
  S ratio_squared = square(ratio), turned{};
  if constexpr (complex) {
    const S ratio_imag = (2 * sine_squared * cosine) * w.q * inverse_along;
    ratio_squared = ratio_squared + square(ratio_imag);
    turned = s * ratio_imag;
  }
  const S half = T(0.5) * s;
  return {half + half * ratio_squared, half - half * ratio_squared, s * ratio, turned};
}

// 1 - R without the cancellation; the angle is the one outside, on either way through the interface.
template <bool complex, class T, int n>
[[gnu::always_inline]] inline Transmission<Dual<T, n>> transmit(T cosine, T sine_squared,
                                                                const InnerWave<Dual<T, n>, complex>& w) {
  using S = Dual<T, n>;
  const FresnelSums<S> sums = fresnel_sums(cosine, sine_squared, w);
  S norm = square(w.p) + sine_squared;
  if constexpr (complex) norm = norm + square(w.q);
  const S common = (2 * cosine) * w.p * sums.inverse_product;
  return {common * (sums.along + norm), common * (sums.along - norm)};
}

}  // namespace pbrdf
