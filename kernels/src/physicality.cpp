#include "pbrdf/physicality.hpp"

#include <cmath>
#include <limits>

#include "pbrdf/hermitian_lanes.hpp"
#include "pbrdf/isa.hpp"
#include "pbrdf/mueller_lanes.hpp"

namespace pbrdf {
namespace {

// Below this, waking threads costs more than they save.
constexpr std::int64_t worth_threads = 1 << 14;
// Handed out as threads come for them, for a core may be busy with something else.
constexpr std::int64_t blocks_at_once = 256;

// 4 H of one pixel: its diagonal and upper triangle, with Pauli indices 00, 01, 10, 11 as 0 to 3.
template <typename T>
struct Coherency {
  T d0, d1, d2, d3;
  T re01, im01, re02, im02, re03, im03, re12, im12, re13, im13, re23, im23;
};

template <typename T>
[[gnu::always_inline]] inline Coherency<T> coherency(const MuellerLanes<T>& lane, int l) {
  const T(&m)[16][lanes] = lane.element;
  const T even = m[0][l] + m[5][l], odd = m[0][l] - m[5][l];
  const T sum = m[1][l] + m[4][l], difference = m[1][l] - m[4][l];
  Coherency<T> h;
  h.d0 = even + sum;
  h.d1 = odd - difference;
  h.d2 = odd + difference;
  h.d3 = even - sum;
  h.re01 = m[2][l] + m[6][l];
  h.im01 = m[3][l] + m[7][l];
  h.re23 = m[2][l] - m[6][l];
  h.im23 = m[3][l] - m[7][l];
  h.re02 = m[8][l] + m[9][l];
  h.im02 = -(m[12][l] + m[13][l]);
  h.re13 = m[8][l] - m[9][l];
  h.im13 = m[13][l] - m[12][l];
  h.re03 = m[10][l] + m[15][l];
  h.im03 = m[11][l] - m[14][l];
  h.re12 = m[10][l] - m[15][l];
  h.im12 = -(m[11][l] + m[14][l]);
  return h;
}

// A pivot of a semidefinite matrix may vanish, but only together with its column.
template <typename T>
[[gnu::always_inline]] inline T allowed(T pivot, T column_squares) {
  const T vanishes = pivot == 0 ? T(1) : T(0);
  const T alone = column_squares == 0 ? vanishes : T(0);
  return pivot > 0 ? T(1) : alone;
}

template <typename T>
[[gnu::always_inline]] inline T inverse_pivot(T pivot) {
  return pivot > 0 ? 1 / pivot : T(0);
}

// One where H + shift is positive semidefinite, else zero, by LDL^H without a branch. Success is backward stable, as
// Cholesky's is: the verdict is that of a matrix a few roundings away.
template <typename T>
[[gnu::always_inline]] inline T semidefinite(const Coherency<T>& h, T shift) {
  const T p0 = h.d0 + shift;
  const T i0 = inverse_pivot(p0);
  const T square01 = h.re01 * h.re01 + h.im01 * h.im01;
  const T square02 = h.re02 * h.re02 + h.im02 * h.im02;
  const T square03 = h.re03 * h.re03 + h.im03 * h.im03;
  const T l1re = h.re01 * i0, l1im = h.im01 * i0, l2re = h.re02 * i0, l2im = h.im02 * i0;
  const T p1 = h.d1 + shift - square01 * i0;
  const T q2 = h.d2 + shift - square02 * i0;
  const T q3 = h.d3 + shift - square03 * i0;
  // h_jk - conj(h_0j) h_0k / p0
  const T re12 = h.re12 - (l1re * h.re02 + l1im * h.im02), im12 = h.im12 - (l1re * h.im02 - l1im * h.re02);
  const T re13 = h.re13 - (l1re * h.re03 + l1im * h.im03), im13 = h.im13 - (l1re * h.im03 - l1im * h.re03);
  const T re23 = h.re23 - (l2re * h.re03 + l2im * h.im03), im23 = h.im23 - (l2re * h.im03 - l2im * h.re03);

  const T i1 = inverse_pivot(p1);
  const T square12 = re12 * re12 + im12 * im12, square13 = re13 * re13 + im13 * im13;
  const T k2re = re12 * i1, k2im = im12 * i1;
  const T p2 = q2 - square12 * i1;
  const T r3 = q3 - square13 * i1;
  const T last_re = re23 - (k2re * re13 + k2im * im13), last_im = im23 - (k2re * im13 - k2im * re13);

  const T square23 = last_re * last_re + last_im * last_im;
  const T p3 = r3 - square23 * inverse_pivot(p2);
  return allowed(p0, square01 + square02 + square03) * allowed(p1, square12 + square13) * allowed(p2, square23) *
         allowed(p3, T(0));
}

template <typename T>
[[gnu::always_inline]] inline void judge(const MuellerLanes<T>& m, T tolerance, T (&verdict)[lanes]) {
#pragma GCC ivdep
  for (int l = 0; l < lanes; ++l) verdict[l] = semidefinite(coherency(m, l), 4 * tolerance * m.element[0][l]);
}

template <typename T>
[[gnu::always_inline]] inline void mask_block(const T* mueller, int count, T tolerance, bool* physical) {
  MuellerLanes<T> m;
  load_lanes(mueller, count, m);
  alignas(64) T verdict[lanes];
  judge(m, tolerance, verdict);
  for (int l = 0; l < count; ++l) physical[l] = verdict[l] != 0;
}

// The largest element of each M, and zero or, where an element is not finite, NaN.
template <typename T>
[[gnu::always_inline]] inline void scales(const MuellerLanes<T>& m, T (&scale)[lanes], T (&poison)[lanes]) {
#pragma GCC ivdep
  for (int l = 0; l < lanes; ++l) {
    T largest = 0, zero = 0;
    for (int e = 0; e < 16; ++e) {
      const T size = std::fabs(m.element[e][l]);
      largest = size > largest ? size : largest;
      zero += 0 * size;
    }
    scale[l] = largest > 0 ? largest : T(1);
    poison[l] = zero;
  }
}

template <typename T>
[[gnu::always_inline]] inline void fill_hermitian(const MuellerLanes<T>& m, const T (&scale)[lanes], Hermitian<T>& h) {
#pragma GCC ivdep
  for (int l = 0; l < lanes; ++l) {
    const Coherency<T> c = coherency(m, l);
    const T quarter = T(0.25) / scale[l];
    h.diagonal[0][l] = quarter * c.d0;
    h.diagonal[1][l] = quarter * c.d1;
    h.diagonal[2][l] = quarter * c.d2;
    h.diagonal[3][l] = quarter * c.d3;
    set_element<0, 1>(h, l, {quarter * c.re01, quarter * c.im01});
    set_element<0, 2>(h, l, {quarter * c.re02, quarter * c.im02});
    set_element<0, 3>(h, l, {quarter * c.re03, quarter * c.im03});
    set_element<1, 2>(h, l, {quarter * c.re12, quarter * c.im12});
    set_element<1, 3>(h, l, {quarter * c.re13, quarter * c.im13});
    set_element<2, 3>(h, l, {quarter * c.re23, quarter * c.im23});
  }
}

template <typename T>
[[gnu::always_inline]] inline void order(T& low, T& high) {
  const T least = low < high ? low : high;
  high = low < high ? high : low;
  low = least;
}

template <typename T>
[[gnu::always_inline]] inline void eigenvalue_block(const T* mueller, int count, T* eigenvalues) {
  MuellerLanes<T> m;
  load_lanes(mueller, count, m);
  alignas(64) T scale[lanes], poison[lanes];
  scales(m, scale, poison);
  Hermitian<T> h;
  fill_hermitian(m, scale, h);
  Vectors<T> none;
  diagonalise<false>(h, none);
  for (int l = 0; l < count; ++l) {
    T a = h.diagonal[0][l], b = h.diagonal[1][l], c = h.diagonal[2][l], d = h.diagonal[3][l];
    order(a, b);
    order(c, d);
    order(a, c);
    order(b, d);
    order(b, c);
    eigenvalues[4 * l] = a * scale[l] + poison[l];
    eigenvalues[4 * l + 1] = b * scale[l] + poison[l];
    eigenvalues[4 * l + 2] = c * scale[l] + poison[l];
    eigenvalues[4 * l + 3] = d * scale[l] + poison[l];
  }
}

template <int P, int Q, typename T>
[[gnu::always_inline]] inline Complex<T> outer(const Vectors<T>& v, const T (&weight)[4], int l) {
  Complex<T> sum{0, 0};
  for (int n = 0; n < 4; ++n) {
    sum.re += weight[n] * (v.re[P][n][l] * v.re[Q][n][l] + v.im[P][n][l] * v.im[Q][n][l]);
    sum.im += weight[n] * (v.im[P][n][l] * v.re[Q][n][l] - v.re[P][n][l] * v.im[Q][n][l]);
  }
  return sum;
}

// Adds sum_n weight_n v_n v_n^H to H, told as a Mueller matrix.
template <typename T>
[[gnu::always_inline]] inline void add_to_coherency(const Vectors<T>& v, const T (&weight)[4], int l,
                                                    MuellerLanes<T>& m) {
  const T d0 = outer<0, 0>(v, weight, l).re, d1 = outer<1, 1>(v, weight, l).re;
  const T d2 = outer<2, 2>(v, weight, l).re, d3 = outer<3, 3>(v, weight, l).re;
  const Complex<T> h01 = outer<0, 1>(v, weight, l), h23 = outer<2, 3>(v, weight, l);
  const Complex<T> h02 = outer<0, 2>(v, weight, l), h13 = outer<1, 3>(v, weight, l);
  const Complex<T> h03 = outer<0, 3>(v, weight, l), h12 = outer<1, 2>(v, weight, l);
  m.element[0][l] += d0 + d1 + d2 + d3;
  m.element[1][l] += d0 - d1 + d2 - d3;
  m.element[2][l] += 2 * (h01.re + h23.re);
  m.element[3][l] += 2 * (h01.im + h23.im);
  m.element[4][l] += d0 + d1 - d2 - d3;
  m.element[5][l] += d0 - d1 - d2 + d3;
  m.element[6][l] += 2 * (h01.re - h23.re);
  m.element[7][l] += 2 * (h01.im - h23.im);
  m.element[8][l] += 2 * (h02.re + h13.re);
  m.element[9][l] += 2 * (h02.re - h13.re);
  m.element[10][l] += 2 * (h03.re + h12.re);
  m.element[11][l] += 2 * (h03.im - h12.im);
  m.element[12][l] -= 2 * (h02.im + h13.im);
  m.element[13][l] += 2 * (h13.im - h02.im);
  m.element[14][l] -= 2 * (h03.im + h12.im);
  m.element[15][l] += 2 * (h03.re - h12.re);
}

template <typename T>
[[gnu::always_inline]] inline void start_vectors(Vectors<T>& v) {
  for (int r = 0; r < 4; ++r)
    for (int n = 0; n < 4; ++n)
      for (int l = 0; l < lanes; ++l) {
        v.re[r][n][l] = r == n ? T(1) : T(0);
        v.im[r][n][l] = 0;
      }
}

template <typename T>
[[gnu::always_inline]] inline void nearest_block(const T* mueller, int count, T* nearest) {
  MuellerLanes<T> m;
  load_lanes(mueller, count, m);
  alignas(64) T scale[lanes], poison[lanes], physical[lanes];
  scales(m, scale, poison);
  judge(m, T(0), physical);
  Hermitian<T> h;
  fill_hermitian(m, scale, h);
  Vectors<T> v;
  start_vectors(v);
  diagonalise<true>(h, v);
#pragma GCC ivdep
  for (int l = 0; l < lanes; ++l) {
    T weight[4];
    for (int n = 0; n < 4; ++n) {
      const T negative = h.diagonal[n][l] < 0 ? -h.diagonal[n][l] : T(0);
      weight[n] = physical[l] != 0 ? T(0) : negative * scale[l] + poison[l];
    }
    add_to_coherency(v, weight, l, m);
  }
  store_lanes(m, count, nearest);
}

}  // namespace

template <typename T>
void coherency_eigenvalues(const T* mueller, std::int64_t pixels, T* eigenvalues) {
#pragma omp parallel for schedule(dynamic, blocks_at_once) if (pixels >= worth_threads)
  for (std::int64_t b = 0; b < lane_blocks(pixels); ++b)
    in_version([&]() __attribute__((always_inline)) {
      eigenvalue_block(mueller + 16 * lanes * b, lanes_in(b, pixels), eigenvalues + 4 * lanes * b);
    });
}

template <typename T>
void physicality_mask(const T* mueller, std::int64_t pixels, T tolerance, bool* physical) {
#pragma omp parallel for schedule(dynamic, blocks_at_once) if (pixels >= worth_threads)
  for (std::int64_t b = 0; b < lane_blocks(pixels); ++b)
    in_version([&]() __attribute__((always_inline)) {
      mask_block(mueller + 16 * lanes * b, lanes_in(b, pixels), tolerance, physical + lanes * b);
    });
}

template <typename T>
void nearest_physical(const T* mueller, std::int64_t pixels, T* nearest) {
#pragma omp parallel for schedule(dynamic, blocks_at_once) if (pixels >= worth_threads)
  for (std::int64_t b = 0; b < lane_blocks(pixels); ++b)
    in_version([&]() __attribute__((always_inline)) {
      nearest_block(mueller + 16 * lanes * b, lanes_in(b, pixels), nearest + 16 * lanes * b);
    });
}

template void coherency_eigenvalues(const float*, std::int64_t, float*);
template void coherency_eigenvalues(const double*, std::int64_t, double*);
template void physicality_mask(const float*, std::int64_t, float, bool*);
template void physicality_mask(const double*, std::int64_t, double, bool*);
template void nearest_physical(const float*, std::int64_t, float*);
template void nearest_physical(const double*, std::int64_t, double*);

}  // namespace pbrdf
