// The value of a smooth function at the nodes of a grid from the means over the cells around them.
#pragma once

#include <cstdint>

#include "pbrdf/cell_sums.hpp"

namespace pbrdf {

// Outputs of nodes x 16 (count: nodes); a node whose cells do not tell it has a count of zero and NaN.
struct NodeValues {
  float* mueller;
  float* variance;
  std::uint16_t* count;  // pixels behind the value
};

// Nodes lie on every so manieth cell of theta_h and phi_d as `stride` tells. To the means over the 3 x 3 cells around a
// node a quadratic in both angles is fitted by least squares, each mean taken for what it is, the mean over places that
// the cell's moments tell. All pixels count alike, and what is found is free of the bias of a plain mean up to the
// third order.
//
// Left to others are the nodes with an empty cell about them, and those at which the fit would be as noisy as a value
// interpolated between four pixels.
void fit_cells(const float* sums, const CellGrid& grid, const CellGrid& stride, const NodeValues& out);

}  // namespace pbrdf
