// A matrix times a block of planes, in tiles that stay in the registers.
#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

namespace pbrdf {

template <typename T, int bytes>
struct VectorOf {
  typedef T type __attribute__((vector_size(bytes)));
};

template <typename T, int bytes>
using Vector = typename VectorOf<T, bytes>::type;

// A row of a block is 2 KiB: 36 of them stay in the second cache.
template <typename T>
inline constexpr int row_length = 2048 / sizeof(T);

// Two vectors of 8 rows fill half of the 32 registers of v4, two of 4 half of the 16 of v3 and v2.
template <int bytes>
inline constexpr int tile_rows = bytes == 64 ? 8 : 4;

inline constexpr int row_padding = 8;

inline int padded_rows(int rows) { return (rows + row_padding - 1) / row_padding * row_padding; }

// matrix: rows x columns; the result is columns x padded_rows(rows), so that a tile reads its factors in order.
template <typename T>
std::vector<T> transposed(const double* matrix, int rows, int columns) {
  const int padded = padded_rows(rows);
  std::vector<T> result(static_cast<std::size_t>(columns) * padded);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      result[column * padded + row] = static_cast<T>(matrix[row * columns + column]);
  return result;
}

template <typename T, int bytes>
struct Tile {
  Vector<T, bytes> sum[tile_rows<bytes>][2];
};

// factors: a transposed matrix from the tile's first row on, `padded` numbers a column;
// block: columns x row_length, aligned, from the tile's first pixel on.
template <int bytes, typename T>
[[gnu::always_inline]] inline void multiply(const T* factors, int padded, int columns, const T* block,
                                            Tile<T, bytes>& tile) {
  constexpr int rows = tile_rows<bytes>;
  using V = Vector<T, bytes>;
  V sum[rows][2];
#pragma GCC unroll 8
  for (int row = 0; row < rows; ++row) sum[row][0] = sum[row][1] = V{};
  for (int column = 0; column < columns; ++column) {
    const V* from = reinterpret_cast<const V*>(block + column * row_length<T>);
    const V left = from[0], right = from[1];
    const T* factor = factors + column * padded;
#pragma GCC unroll 8
    for (int row = 0; row < rows; ++row) {
      sum[row][0] += factor[row] * left;
      sum[row][1] += factor[row] * right;
    }
  }
#pragma GCC unroll 8
  for (int row = 0; row < rows; ++row) {
    tile.sum[row][0] = sum[row][0];
    tile.sum[row][1] = sum[row][1];
  }
}

template <int bytes, typename T>
[[gnu::always_inline]] inline void store_tile(const Tile<T, bytes>& tile, T* block) {
#pragma GCC unroll 8
  for (int row = 0; row < tile_rows<bytes>; ++row)
    std::memcpy(block + row * row_length<T>, tile.sum[row], sizeof tile.sum[row]);
}

}  // namespace pbrdf
