// Sums over the pixels of each cell: what a photograph says of the table's grid.
#pragma once

#include <cstdint>

#include "pbrdf/pixel_cells.hpp"

namespace pbrdf {

// Of one cell: sums of gain M (16), of gain^2 variance (16), and of 1, x, y, x x, x y, y y over its pixels, x and y
// their places within the cell; two zeros fill the row.
inline constexpr int moments_at = 32;
inline constexpr int sums_per_cell = 40;

// mueller, variance: 16 x pixels, NaN where there is no matrix; cells: of the same pixels, in rows of `columns`.
// sums: cells x sums_per_cell. Same bytes for any number of threads.
void sum_cells(const float* mueller, const float* variance, const PixelCells& cells, std::int64_t rows,
               std::int64_t columns, std::int64_t cell_count, float* sums);

}  // namespace pbrdf
