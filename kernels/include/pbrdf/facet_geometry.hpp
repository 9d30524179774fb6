// What a pair of directions means to a facet model, in the table frames.
//
// Table frames: the incident beam travels along -L, the reflected one along +V, and both have x = norm(L x V), across
// the plane of L and V. A mirror facet, whose normal is the half vector, is therefore not turned.
#pragma once

#include <cmath>

#include "pbrdf/dual.hpp"

namespace pbrdf {

// Angles i and o: light and camera from the normal; h: half vector from the normal; d: light from the half vector.
template <class T>
struct FacetGeometry {
  T cos_i, cos_o;
  T sin2_h;  // squared sine
  T cos_d;
  T turn_i_cosine, turn_i_sine;  // of twice the angle about -L, from norm(n x -L) to norm(L x V)
  T turn_o_cosine, turn_o_sine;  // of twice the angle about V, from norm(n x V) to norm(L x V)
};

namespace detail {

struct DoubledAngle {
  double cosine, sine;
};

// Where both legs vanish the axis is not defined: the beam runs along the normal, and its transmission does not depend
// on the axis, or L = V, and the limit phi_d -> 0 is taken, in which the axes coincide.
inline DoubledAngle doubled_angle(double along, double turned) {
  const double squared = square(along) + square(turned);
  if (squared == 0) return {1.0, 0.0};
  return {(square(along) - square(turned)) / squared, 2 * along * turned / squared};
}

}  // namespace detail

// light, camera: unit vectors toward the light and the camera, normal along z.
inline FacetGeometry<double> facet_geometry(const double light[3], const double camera[3]) {
  const double sum[3] = {light[0] + camera[0], light[1] + camera[1], light[2] + camera[2]};
  // The difference is exact for close directions, so that L x (V - L) keeps the digits that L x V would lose.
  const double difference[3] = {camera[0] - light[0], camera[1] - light[1], camera[2] - light[2]};
  const double sum_squared = square(sum[0]) + square(sum[1]) + square(sum[2]);
  const double s[3] = {light[1] * difference[2] - light[2] * difference[1],
                       light[2] * difference[0] - light[0] * difference[2],
                       light[0] * difference[1] - light[1] * difference[0]};
  const auto turn_i = detail::doubled_angle(light[1] * s[0] - light[0] * s[1], s[2]);
  const auto turn_o = detail::doubled_angle(camera[0] * s[1] - camera[1] * s[0], s[2]);
  return {light[2],
          camera[2],
          (square(sum[0]) + square(sum[1])) / sum_squared,
          0.5 * std::sqrt(sum_squared),
          turn_i.cosine,
          turn_i.sine,
          turn_o.cosine,
          turn_o.sine};
}

template <class T>
[[gnu::always_inline]] inline T sine_squared(T cosine) {
  return T(1) - cosine * cosine;
}

}  // namespace pbrdf
