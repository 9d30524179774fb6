// Nodes of the table between neighbouring lights.
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

// Lights by ascending theta_d, two to four: lights[low] and lights[low + 1] bracket the nodes, those beyond them help.
struct Lights {
  const LightSlice* of;
  int count, low;
};

// Writes the nodes whose theta_d lies between those of the two lights that bracket them where both see them, at most
// `widest_gap` apart, and those at exactly the theta_d of one that sees them. Other nodes stay as they are.
//
// Through the two, and through those beyond them that see the node as well, goes a polynomial in theta_d (Lagrange):
// the cubic of four lights has a few hundredths of the error of the straight line between two. A light beyond helps if
// it is no farther than `widest_gap` and no nearer than half the gap, for it would only amplify noise.
void interpolate_lights(const Lights& lights, const TableShape& shape, const double* theta_d, double widest_gap,
                        const TableBand& table);

}  // namespace pbrdf
