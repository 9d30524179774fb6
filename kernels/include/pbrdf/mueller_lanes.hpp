// Mueller matrices of 32 pixels as 16 rows of lanes, so that a loop over the lanes vectorises.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace pbrdf {

inline constexpr int lanes = 32;

inline std::int64_t lane_blocks(std::int64_t pixels) { return (pixels + lanes - 1) / lanes; }

// Pixels in one block of lanes: fewer in the last one.
inline int lanes_in(std::int64_t block, std::int64_t pixels) {
  return static_cast<int>(std::min<std::int64_t>(lanes, pixels - block * lanes));
}

template <typename T>
struct MuellerLanes {
  alignas(64) T element[16][lanes];
};

// Turns the 4 x 4 numbers at `from` (rows `from_step` apart) over the diagonal into `to`.
template <typename T>
[[gnu::always_inline]] inline void transpose_four(const T* from, int from_step, T* to, int to_step) {
  typedef T Four __attribute__((vector_size(4 * sizeof(T))));
  Four a, b, c, d;
  std::memcpy(&a, from, sizeof a);
  std::memcpy(&b, from + from_step, sizeof b);
  std::memcpy(&c, from + 2 * from_step, sizeof c);
  std::memcpy(&d, from + 3 * from_step, sizeof d);
  const Four ab_even = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab_odd = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Four cd_even = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd_odd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(ab_even, cd_even, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab_odd, cd_odd, 0, 1, 4, 5);
  c = __builtin_shufflevector(ab_even, cd_even, 2, 3, 6, 7);
  d = __builtin_shufflevector(ab_odd, cd_odd, 2, 3, 6, 7);
  std::memcpy(to, &a, sizeof a);
  std::memcpy(to + to_step, &b, sizeof b);
  std::memcpy(to + 2 * to_step, &c, sizeof c);
  std::memcpy(to + 3 * to_step, &d, sizeof d);
}

// pixels: count x 16, count at most `lanes`. Lanes beyond the last pixel repeat the first one.
template <typename T>
[[gnu::always_inline]] inline void load_lanes(const T* pixels, int count, MuellerLanes<T>& m) {
  alignas(64) T padded[16 * lanes];
  if (count < lanes) {
    for (int p = 0; p < lanes; ++p) std::copy_n(pixels + 16 * (p < count ? p : 0), 16, padded + 16 * p);
    pixels = padded;
  }
  for (int p = 0; p < lanes; p += 4)
    for (int row = 0; row < 4; ++row) transpose_four(pixels + 16 * p + 4 * row, 16, m.element[4 * row] + p, lanes);
}

// The reverse, into pixels: count x 16.
template <typename T>
[[gnu::always_inline]] inline void store_lanes(const MuellerLanes<T>& m, int count, T* pixels) {
  alignas(64) T padded[16 * lanes];
  T* to = count < lanes ? padded : pixels;
  for (int p = 0; p < lanes; p += 4)
    for (int row = 0; row < 4; ++row) transpose_four(m.element[4 * row] + p, lanes, to + 16 * p + 4 * row, 16);
  if (count < lanes) std::copy_n(padded, 16 * count, pixels);
}

}  // namespace pbrdf
