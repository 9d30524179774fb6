// What the symmetries of an isotropic, mirror-symmetric and reciprocal surface say of a table's nodes.
//
// Mirror: M(-phi_d) = Q M(phi_d) Q, Q = diag(1, 1, -1, -1). Light and camera exchanged: M(phi_d +- pi) = P M(phi_d)^T
// P, P = diag(1, 1, -1, 1). Azimuths run from -pi to pi with both ends, evenly; the two ends are one node. The first
// half angle is zero, where all azimuths are one measurement: its nodes are left alone.
#pragma once

#include <cstdint>

#include "pbrdf/merge.hpp"

namespace pbrdf {

// Origins of nodes as the table's format numbers them.
inline constexpr std::uint8_t unseen = 1, measured = 2, mirrored = 3, reciprocal = 4;

struct SymmetricBand {
  float* mueller;
  float* variance;
  std::uint16_t* count;
  std::uint8_t* origin;
  const double* weight;  // of a measurement: pixels x this, at each of halves x differences x azimuths
};

// Every measured node becomes the weighted mean of all measurements of its matrix, and unseen nodes get it too.
void pool_partners(const TableShape& shape, const SymmetricBand& band);

// Unseen nodes become copies of a measured partner: the mirror image before the exchange. Weights are not used.
void copy_partners(const TableShape& shape, const SymmetricBand& band);

// Of one theta_h, theta_d and symmetry, over its pairs of measured nodes, each pair once.
struct Disagreement {
  double pairs;         // with finite matrices
  double m00;           // sum of both M00
  double absolute[16];  // sum of |difference|
  double known[16];     // pairs with a variance above zero
  double squares[16];   // sum of difference^2 / variance of the difference
};

// halves x differences x 2 (mirror, exchange), zero at theta_h = 0, whose azimuths are one measurement.
// `variance` may be null. Same bytes for any number of threads.
void compare_partners(const TableShape& shape, const float* mueller, const float* variance, const std::uint8_t* origin,
                      Disagreement* out);

}  // namespace pbrdf
