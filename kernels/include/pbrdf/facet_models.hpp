// Models of facets: a specular term, mirrors at the half vector weighted by a lobe, and a diffuse term.
//
// All is written on Dual numbers: r of a template is 1 with slopes by the roughness, i is 1 or 2 with slopes by the
// index (n alone, or n and k), and both are 0 for values alone. Functions of one direction, for loops over lanes.
#pragma once

#include "pbrdf/facet_lobes.hpp"
#include "pbrdf/fresnel.hpp"
#include "pbrdf/grooved_metal.hpp"

namespace pbrdf {

// Elements of a Mueller matrix that some model fills; the other four are zero in all of them.
template <class T>
struct Elements {
  T m00, m01, m02, m10, m11, m12, m20, m21, m22, m23, m32, m33;
};

template <class T, int r, int i>
struct FacetParameters {
  Dual<T, r> roughness;
  Dual<T, i> eta, kappa;
  T specular;
  T diffuse;  // albedo / pi
};

// Slope of a term's product with given elements.
template <class T, int r, int i>
struct TermSlope {
  Dual<T, r> by_roughness;  // the value of both is the product itself
  Dual<T, i> by_index;
};

template <class T, int r, int i>
struct SpecularTerm {
  Dual<T, r> lobe;
  Reflection<Dual<T, i>> mirror;

  [[gnu::always_inline]] inline Elements<T> elements(T weight) const {
    const T weighted = weight * lobe.value;
    const T even = weighted * mirror.even.value, odd = weighted * mirror.odd.value;
    const T cross = weighted * mirror.cross.value, turned = weighted * mirror.turned.value;
    return {even, odd, T(0), odd, even, T(0), T(0), T(0), cross, -turned, turned, cross};
  }

  [[gnu::always_inline]] inline TermSlope<T, r, i> along(const Elements<T>& e) const {
    const Dual<T, i> on = mirror.even * (e.m00 + e.m11) + mirror.odd * (e.m01 + e.m10) +
                          mirror.cross * (e.m22 + e.m33) + mirror.turned * (e.m32 - e.m23);
    return {lobe * on.value, on * lobe.value};
  }
};

// First three components of Stokes, in the table frames.
template <class S>
struct LinearStokes {
  S s0, s1, s2;
};

// Baek et al. 2018: Fresnel's transmission into the macroscopic surface, whose s-axes are norm(n x -L) and norm(n x V),
// full depolarisation, transmission out.
template <class T, int r, int i>
struct RefractedTerm {
  LinearStokes<Dual<T, i>> in, out;

  [[gnu::always_inline]] inline Elements<T> elements(T weight) const {
    const T i0 = in.s0.value, i1 = in.s1.value, i2 = in.s2.value;
    const T o0 = weight * out.s0.value, o1 = weight * out.s1.value, o2 = weight * out.s2.value;
    return {o0 * i0, o0 * i1, o0 * i2, o1 * i0, o1 * i1, o1 * i2, o2 * i0, o2 * i1, o2 * i2, T(0), T(0), T(0)};
  }

  [[gnu::always_inline]] inline TermSlope<T, r, i> along(const Elements<T>& e) const {
    const Dual<T, i> on0 = in.s0 * e.m00 + in.s1 * e.m01 + in.s2 * e.m02;
    const Dual<T, i> on1 = in.s0 * e.m10 + in.s1 * e.m11 + in.s2 * e.m12;
    const Dual<T, i> on2 = in.s0 * e.m20 + in.s1 * e.m21 + in.s2 * e.m22;
    const Dual<T, i> on = out.s0 * on0 + out.s1 * on1 + out.s2 * on2;
    return {{on.value, {}}, on};
  }
};

// Hyde et al. 2009: a depolariser; `share` is 1 or what the specular lobe leaves.
template <class T, int r, int i>
struct DepolarisedTerm {
  Dual<T, r> share;

  [[gnu::always_inline]] inline Elements<T> elements(T weight) const {
    return {weight * share.value, T(0), T(0), T(0), T(0), T(0), T(0), T(0), T(0), T(0), T(0), T(0)};
  }

  [[gnu::always_inline]] inline TermSlope<T, r, i> along(const Elements<T>& e) const {
    const Dual<T, r> on = share * e.m00;
    return {on, {on.value, {}}};
  }
};

// What a facet along the half vector reflects.
template <bool complex, class T, int r, int i>
[[gnu::always_inline]] inline Reflection<Dual<T, i>> mirror(const FacetGeometry<T>& g,
                                                            const FacetParameters<T, r, i>& p) {
  const T sine2 = sine_squared(g.cos_d);
  return reflect(g.cos_d, sine2, inner_wave<complex>(sine2, p.eta, p.kappa));
}

template <bool complex, class T, int i>
[[gnu::always_inline]] inline LinearStokes<Dual<T, i>> refracted(T cosine, T turn_cosine, T turn_sine, Dual<T, i> eta,
                                                                 Dual<T, i> kappa) {
  const T sine2 = sine_squared(cosine);
  const Transmission<Dual<T, i>> t = transmit(cosine, sine2, inner_wave<complex>(sine2, eta, kappa));
  return {t.mean, t.difference * turn_cosine, t.difference * -turn_sine};
}

template <class Distribution>
struct Baek {
  using Lobe = Distribution;
  static constexpr bool weighted = false;

  template <bool complex, class T, int r, int i>
  [[gnu::always_inline]] static inline RefractedTerm<T, r, i> diffuse(const FacetGeometry<T>& g,
                                                                      const FacetParameters<T, r, i>& p, Dual<T, r>) {
    return {refracted<complex>(g.cos_i, g.turn_i_cosine, g.turn_i_sine, p.eta, p.kappa),
            refracted<complex>(g.cos_o, g.turn_o_cosine, g.turn_o_sine, p.eta, p.kappa)};
  }
};

// weighted: the diffuse term by what single reflections of a perfect conductor leave, as in the paper.
template <bool with_weight>
struct Hyde {
  using Lobe = GaussianBlinn;
  static constexpr bool weighted = with_weight;

  // reflectance: that of `grooved_metal`, not looked at without the weight.
  template <bool complex, class T, int r, int i>
  [[gnu::always_inline]] static inline DepolarisedTerm<T, r, i> diffuse(const FacetGeometry<T>&,
                                                                        const FacetParameters<T, r, i>&,
                                                                        Dual<T, r> reflectance) {
    if constexpr (with_weight) return {T(1) - reflectance};
    return {{T(1), {}}};
  }
};

}  // namespace pbrdf
