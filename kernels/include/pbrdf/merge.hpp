// Nodes of the table between two neighbouring lights.
#pragma once

#include <cstdint>

namespace pbrdf {

// Numbers of nodes of theta_h, theta_d and phi_d; matrices are halves x differences x azimuths x 16.
struct TableShape {
  std::int64_t halves, differences, azimuths;
};

// One band of one light, halves x azimuths: matrices and variances x 16, pixels behind each node, theta_d actually
// seen (rad, NaN where none is).
struct LightSlice {
  const float* mueller;
  const float* variance;
  const std::uint16_t* count;
  const double* theta_d;
};

struct TableBand {
  float* mueller;
  float* variance;
  std::uint16_t* count;
};

// Writes the nodes whose theta_d lies between those of `low` and `high` where both see them, at most `widest_gap`
// apart, and those at exactly the theta_d of one that sees them. Other nodes stay as they are.
void interpolate_lights(const LightSlice& low, const LightSlice& high, const TableShape& shape, const double* theta_d,
                        double widest_gap, const TableBand& table);

}  // namespace pbrdf
