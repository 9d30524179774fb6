// The microfacet pBRDF of Baek et al. 2018 for one pair of directions, in the table frames.
//
// Table frames: the incident beam travels along -L, the reflected one along +V, and both have x = norm(L x V), across
// the plane of L and V. A mirror facet, whose normal is the half vector, is therefore not turned: the specular term is
// a scalar times Fresnel's Mueller matrix. The diffuse term enters and leaves through the macroscopic surface, so that
// its s-axes are norm(n x -L) and norm(n x V) and have to be turned into the table frames.
//
// Double precision, no state: may be called from any number of threads.
#pragma once

#include <algorithm>
#include <cmath>

namespace pbrdf {

inline constexpr double pi = 3.14159265358979323846;

// Index n - ik with kappa >= 0 for a beam that varies as e^{+i omega t} (Verdet's signs).
struct FacetMaterial {
  double alpha;     // GGX roughness
  double eta;       // n, real part of the index
  double kappa;     // k >= 0; the diffuse term takes the real part alone
  double specular;  // weight of the specular term
  double albedo;    // of the diffuse term; 0 leaves it out
};

// Reflection at an interface, s and p components.
struct Reflection {
  double rs;          // |r_s|^2
  double rp;          // |r_p|^2
  double cross_real;  // of conj(r_s) r_p
  double cross_imag;
};

// Power transmitted through an interface: mean and half difference of s and p.
struct Transmission {
  double mean;        // (T_s + T_p) / 2
  double difference;  // (T_s - T_p) / 2, never positive for an index above 1
};

// cos and sin of twice the angle between two s-axes.
struct DoubledAngle {
  double cosine;
  double sine;
};

namespace detail {

inline double square(double x) { return x * x; }

// Fresnel with w = eta cos(theta_t) = sqrt(eta^2 - sin^2 theta), Re w >= 0 and Im w <= 0. From the textbook forms
// r_s = (c - w)/(c + w), r_p = (eta^2 c - w)/(eta^2 c + w) follows r_p/r_s = (sin^2 - c w)/(sin^2 + c w), which needs
// no second complex division and keeps its digits for a small k.
inline Reflection reflect(double cosine, double sine_squared, double eta, double kappa) {
  const double real = eta * eta - kappa * kappa - sine_squared;
  const double half_imag = eta * kappa;
  const double modulus = std::hypot(real, 2 * half_imag);
  double w_real, w_imag;
  if (real >= 0) {
    w_real = std::sqrt(0.5 * (modulus + real));
    w_imag = w_real > 0 ? -half_imag / w_real : 0.0;
  } else {
    w_imag = -std::sqrt(0.5 * (modulus - real));
    w_real = -half_imag / w_imag;
  }
  const double rs = (square(cosine - w_real) + square(w_imag)) / (square(cosine + w_real) + square(w_imag));
  const double along = cosine * w_real, across = cosine * w_imag;
  const double denominator = square(sine_squared + along) + square(across);
  if (denominator == 0) return {rs, rs, -rs, 0.0};  // an index that equals sin theta at grazing
  const double ratio_real = (square(sine_squared) - square(along) - square(across)) / denominator;
  const double ratio_imag = -2 * sine_squared * across / denominator;
  return {rs, rs * (square(ratio_real) + square(ratio_imag)), rs * ratio_real, rs * ratio_imag};
}

// 1 - R without the cancellation; the angle is the one outside, on either way through the interface.
inline Transmission transmit(double cosine, double sine_squared, double eta) {
  const double w_squared = eta * eta - sine_squared;
  if (w_squared <= 0) return {0.0, 0.0};  // total reflection
  const double w = std::sqrt(w_squared);
  const double ts = 4 * cosine * w / square(cosine + w);
  const double tp = ts * square(eta / (cosine * w + sine_squared));
  return {0.5 * (ts + tp), 0.5 * (ts - tp)};
}

// Where both legs vanish the axis is not defined: the beam runs along the normal, and its transmission does not depend
// on the axis, or L = V, and the limit phi_d -> 0 is taken, in which the axes coincide.
inline DoubledAngle doubled_angle(double along, double turned) {
  const double squared = square(along) + square(turned);
  if (squared == 0) return {1.0, 0.0};
  return {(square(along) - square(turned)) / squared, 2 * along * turned / squared};
}

}  // namespace detail

// What a pair of directions means to the model.
struct FacetGeometry {
  double cos_i, sin2_i;   // light from the normal; sin2 is the squared sine
  double cos_o, sin2_o;   // camera from the normal
  double cos2_h, sin2_h;  // half vector from the normal, squared
  double cos_d, sin2_d;   // light from the half vector
  DoubledAngle turn_i;    // about -L, from norm(n x -L) to norm(L x V)
  DoubledAngle turn_o;    // about V, from norm(n x V) to norm(L x V)
};

inline FacetGeometry facet_geometry(const double light[3], const double camera[3]) {
  using detail::square;
  FacetGeometry g;
  const double sum[3] = {light[0] + camera[0], light[1] + camera[1], light[2] + camera[2]};
  // The difference is exact for close directions, so that L x (V - L) keeps the digits that L x V would lose.
  const double difference[3] = {camera[0] - light[0], camera[1] - light[1], camera[2] - light[2]};
  const double sum_squared = square(sum[0]) + square(sum[1]) + square(sum[2]);
  const double difference_squared = square(difference[0]) + square(difference[1]) + square(difference[2]);
  g.cos_i = light[2];
  g.cos_o = camera[2];
  g.sin2_i = square(light[0]) + square(light[1]);
  g.sin2_o = square(camera[0]) + square(camera[1]);
  g.cos2_h = square(sum[2]) / sum_squared;
  g.sin2_h = (square(sum[0]) + square(sum[1])) / sum_squared;
  g.cos_d = 0.5 * std::sqrt(sum_squared);
  g.sin2_d = 0.25 * difference_squared;
  const double s[3] = {light[1] * difference[2] - light[2] * difference[1],
                       light[2] * difference[0] - light[0] * difference[2],
                       light[0] * difference[1] - light[1] * difference[0]};
  g.turn_i = detail::doubled_angle(light[1] * s[0] - light[0] * s[1], s[2]);
  g.turn_o = detail::doubled_angle(camera[0] * s[1] - camera[1] * s[0], s[2]);
  return g;
}

// D G / (4 cos_i cos_o) with the GGX distribution and the separable Smith term (Walter et al. 2007):
// D = a^2/(pi q^2), q = a^2 cos^2 + sin^2 of theta_h, and G/(4 cos_i cos_o) = 1/((cos_i + root_i)(cos_o + root_o)).
inline double facet_lobe(const FacetGeometry& g, double alpha) {
  const double a2 = alpha * alpha;
  const double q = a2 * g.cos2_h + g.sin2_h;
  const double root_i = std::sqrt(detail::square(g.cos_i) + a2 * g.sin2_i);
  const double root_o = std::sqrt(detail::square(g.cos_o) + a2 * g.sin2_o);
  return a2 / (pi * q * q * (g.cos_i + root_i) * (g.cos_o + root_o));
}

// Mueller matrix in 1/sr, row-major, without the cosine of the light; zero at and below the horizon.
//
// light, camera: unit vectors toward the light and the camera, normal along z. Baek et al. 2018, eqs. for the specular
// and the diffuse term, with Collett's Fresnel matrices in Verdet's signs: M32 > 0 and M23 < 0 for a metal.
inline void facet_mueller(const double light[3], const double camera[3], const FacetMaterial& material,
                          double mueller[16]) {
  std::fill_n(mueller, 16, 0.0);
  if (light[2] <= 0 || camera[2] <= 0) return;
  const FacetGeometry g = facet_geometry(light, camera);

  const double weight = material.specular * facet_lobe(g, material.alpha);
  const Reflection r = detail::reflect(g.cos_d, g.sin2_d, material.eta, material.kappa);
  mueller[0] = mueller[5] = 0.5 * weight * (r.rs + r.rp);
  mueller[1] = mueller[4] = 0.5 * weight * (r.rs - r.rp);
  mueller[10] = mueller[15] = weight * r.cross_real;
  mueller[11] = -weight * r.cross_imag;
  mueller[14] = weight * r.cross_imag;

  if (material.albedo == 0) return;
  const Transmission in = detail::transmit(g.cos_i, g.sin2_i, material.eta);
  const Transmission out = detail::transmit(g.cos_o, g.sin2_o, material.eta);
  const double stokes_in[3] = {in.mean, in.difference * g.turn_i.cosine, -in.difference * g.turn_i.sine};
  const double stokes_out[3] = {out.mean, out.difference * g.turn_o.cosine, -out.difference * g.turn_o.sine};
  for (int row = 0; row < 3; ++row)
    for (int col = 0; col < 3; ++col) mueller[4 * row + col] += material.albedo / pi * stokes_out[row] * stokes_in[col];
}

}  // namespace pbrdf
