// Eigenvalues and eigenvectors of 32 Hermitian 4 x 4 matrices at a time, by Jacobi's rotations over rows of lanes.
#pragma once

#include <cmath>
#include <limits>

#include "pbrdf/mueller_lanes.hpp"

namespace pbrdf {

// Where row R and column C of the upper triangle lie among its six elements.
inline constexpr int pair_of[4][4] = {{-1, 0, 1, 2}, {0, -1, 3, 4}, {1, 3, -1, 5}, {2, 4, 5, -1}};

// Elements are of the order of one: what counts as zero is told for that.
template <typename T>
struct Hermitian {
  alignas(64) T diagonal[4][lanes];
  alignas(64) T re[6][lanes], im[6][lanes];
};

template <typename T>
struct Vectors {
  alignas(64) T re[4][4][lanes], im[4][4][lanes];
};

template <typename T>
struct Complex {
  T re, im;
};

template <int R, int C, typename T>
[[gnu::always_inline]] inline Complex<T> element(const Hermitian<T>& h, int l) {
  constexpr int k = pair_of[R][C];
  return {h.re[k][l], R < C ? h.im[k][l] : -h.im[k][l]};
}

template <int R, int C, typename T>
[[gnu::always_inline]] inline void set_element(Hermitian<T>& h, int l, Complex<T> value) {
  constexpr int k = pair_of[R][C];
  h.re[k][l] = value.re;
  h.im[k][l] = R < C ? value.im : -value.im;
}

// Columns p and q of one row become c p - s e q and s p + c e q.
template <typename T>
[[gnu::always_inline]] inline void turn(Complex<T>& p, Complex<T>& q, T c, T s, Complex<T> e) {
  const Complex<T> w{e.re * q.re - e.im * q.im, e.re * q.im + e.im * q.re};
  q = {s * p.re + c * w.re, s * p.im + c * w.im};
  p = {c * p.re - s * w.re, c * p.im - s * w.im};
}

template <int R, int P, int Q, typename T>
[[gnu::always_inline]] inline void turn_row(Hermitian<T>& h, int l, T c, T s, Complex<T> e) {
  Complex<T> p = element<R, P>(h, l), q = element<R, Q>(h, l);
  turn(p, q, c, s, e);
  set_element<R, P>(h, l, p);
  set_element<R, Q>(h, l, q);
}

// Squared off-diagonal element that counts as zero.
template <typename T>
inline constexpr T negligible = T(0.01) * std::numeric_limits<T>::epsilon() * std::numeric_limits<T>::epsilon();

template <int R, int P, int Q, typename T>
[[gnu::always_inline]] inline void turn_vector(Vectors<T>& v, int l, T c, T s, Complex<T> e) {
  Complex<T> p{v.re[R][P][l], v.im[R][P][l]}, q{v.re[R][Q][l], v.im[R][Q][l]};
  turn(p, q, c, s, e);
  v.re[R][P][l] = p.re;
  v.im[R][P][l] = p.im;
  v.re[R][Q][l] = q.re;
  v.im[R][Q][l] = q.im;
}

// Jacobi's rotation that clears h_PQ. One that is negligible stays as it is, with everything else: a pixel's result
// does not depend on how long its neighbours take.
template <int P, int Q, bool with_vectors, typename T>
[[gnu::always_inline]] inline void rotate(Hermitian<T>& h, Vectors<T>& v) {
  constexpr int k = pair_of[P][Q];
  constexpr int r0 = P == 0 ? (Q == 1 ? 2 : 1) : 0, r1 = 6 - P - Q - r0;
#pragma GCC ivdep
  for (int l = 0; l < lanes; ++l) {
    const T square = h.re[k][l] * h.re[k][l] + h.im[k][l] * h.im[k][l];
    const bool turns = square > negligible<T>;
    const T root = std::sqrt(square);
    const T modulus = turns ? root : T(0);
    const T inverse = 1 / (turns ? modulus : T(1));
    const Complex<T> e{turns ? h.re[k][l] * inverse : T(1), turns ? -h.im[k][l] * inverse : T(0)};
    const T gap = h.diagonal[Q][l] - h.diagonal[P][l];
    const T reach = std::fabs(gap) + std::sqrt(gap * gap + 4 * square);
    const T size = 2 * modulus / (turns ? reach : T(1));
    const T t = gap < 0 ? -size : size;
    const T c = 1 / std::sqrt(1 + t * t), s = t * c;
    h.diagonal[P][l] -= t * modulus;
    h.diagonal[Q][l] += t * modulus;
    h.re[k][l] = turns ? T(0) : h.re[k][l];
    h.im[k][l] = turns ? T(0) : h.im[k][l];
    turn_row<r0, P, Q>(h, l, c, s, e);
    turn_row<r1, P, Q>(h, l, c, s, e);
    if constexpr (with_vectors) {
      turn_vector<0, P, Q>(v, l, c, s, e);
      turn_vector<1, P, Q>(v, l, c, s, e);
      turn_vector<2, P, Q>(v, l, c, s, e);
      turn_vector<3, P, Q>(v, l, c, s, e);
    }
  }
}

template <typename T>
[[gnu::always_inline]] inline bool is_diagonal(const Hermitian<T>& h) {
  T largest = 0;
  for (int k = 0; k < 6; ++k)
#pragma omp simd reduction(max : largest)
    for (int l = 0; l < lanes; ++l) {
      const T square = h.re[k][l] * h.re[k][l] + h.im[k][l] * h.im[k][l];
      largest = square > largest ? square : largest;
    }
  return !(largest > negligible<T>);
}

// Cyclic Jacobi. Convergence is quadratic and 4 x 4 matrices take 4 or 5 sweeps; the bound only ends a loop.
template <bool with_vectors, typename T>
[[gnu::always_inline]] inline void diagonalise(Hermitian<T>& h, Vectors<T>& v) {
  constexpr int most_sweeps = 12;
  for (int sweep = 0; sweep < most_sweeps && !is_diagonal(h); ++sweep) {
    rotate<0, 1, with_vectors>(h, v);
    rotate<2, 3, with_vectors>(h, v);
    rotate<0, 2, with_vectors>(h, v);
    rotate<1, 3, with_vectors>(h, v);
    rotate<0, 3, with_vectors>(h, v);
    rotate<1, 2, with_vectors>(h, v);
  }
}

}  // namespace pbrdf
