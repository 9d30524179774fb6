// Nodes that were never measured, from those around them: local polynomials under a Gaussian in angle space.
//
// Azimuths run from -pi to pi with both ends, evenly; the two ends are one node. Along a line of one theta_h and one
// phi_d, theta_d goes on through zero to -theta_d at phi_d + pi, where the frames are the same but for the sign of
// their axes: matrices are smooth there, and a gap around theta_d = 0 has two sides.
#pragma once

#include <cstdint>

#include "pbrdf/merge.hpp"

namespace pbrdf {

struct Grid {
  TableShape shape;
  const double* theta_h;  // rad
  const double* theta_d;
};

// Widths of Gaussians, rad: the narrowest, and around the azimuth.
struct Widths {
  double narrowest, azimuth;
};

// A target must not be known; done becomes 1 where one was filled, and its matrix is written.
struct Gaps {
  float* mueller;
  const std::uint8_t* known;
  const std::uint8_t* target;
  std::uint8_t* done;
};

// Targets with known nodes on both sides of their line, each nearer than `farthest` (rad): a cubic along it.
void fill_between(const Grid& grid, const Widths& widths, double farthest, const Gaps& gaps);

// Targets that share theta_h and phi_d, or theta_d and phi_d, with any known node of positive M00: linear in theta_d
// and theta_h, of the logarithm of M00 and of the elements over M00.
void fill_beyond(const Grid& grid, const Widths& widths, const Gaps& gaps);

}  // namespace pbrdf
