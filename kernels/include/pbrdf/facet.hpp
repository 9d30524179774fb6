// The microfacet models for pairs of directions, in the table frames (see facet_geometry.hpp).
//
// Mueller matrices in 1/sr, row-major, without the cosine of the light; zero at and below the horizon. Collett's
// Fresnel matrices in Verdet's signs: M32 > 0 and M23 < 0 for a metal. Double precision, no state.
#pragma once

#include <algorithm>
#include <cstdint>

#include "pbrdf/facet_models.hpp"

namespace pbrdf {

enum class FacetModel {
  baek_ggx,       // Baek et al. 2018; roughness: alpha
  baek_beckmann,  // the same with Beckmann's distribution
  hyde,           // Hyde et al. 2009 with a plain depolariser; roughness: sigma
  hyde_weighted,  // with the depolariser weighted by what the specular lobe leaves
};

// Calls `body` with a value of the type that computes a model.
template <class Body>
decltype(auto) with_model(FacetModel model, const Body& body) {
  switch (model) {
    case FacetModel::baek_beckmann:
      return body(Baek<BeckmannSmith>{});
    case FacetModel::hyde:
      return body(Hyde<false>{});
    case FacetModel::hyde_weighted:
      return body(Hyde<true>{});
    default:
      return body(Baek<GgxSmith>{});
  }
}

// Index n - ik with kappa >= 0 for a beam that varies as e^{+i omega t} (Verdet's signs).
struct FacetMaterial {
  double roughness;
  double eta;       // n, real part of the index
  double kappa;     // k >= 0
  double specular;  // weight of the specular term
  double albedo;    // of the diffuse term
};

// A model with its parameters, ready for any number of directions.
template <class Model>
class FacetEvaluator {
 public:
  explicit FacetEvaluator(const FacetMaterial& m)
      : parameters_{{m.roughness, {}}, {m.eta, {}}, {m.kappa, {}}, m.specular, m.albedo / pi} {
    if constexpr (Model::weighted) metal_ = grooved_metal(parameters_.roughness);
  }

  // light, camera: unit vectors toward the light and the camera, normal along z.
  void mueller(const double light[3], const double camera[3], double out[16]) const {
    std::fill_n(out, 16, 0.0);
    if (light[2] <= 0 || camera[2] <= 0) return;
    const FacetGeometry<double> g = facet_geometry(light, camera);
    Dual<double, 0> reflectance{};
    if constexpr (Model::weighted)
      grooved_metal_reflectance<1>(metal_, &g.cos_i, &reflectance.value, static_cast<double*>(nullptr));
    const auto s =
        SpecularTerm<double, 0, 0>{Model::Lobe::lobe(g, parameters_.roughness), mirror<true>(g, parameters_)}.elements(
            parameters_.specular);
    const auto d = Model::template diffuse<true>(g, parameters_, reflectance).elements(parameters_.diffuse);
    const double rows[4][4] = {{s.m00 + d.m00, s.m01 + d.m01, d.m02, 0.0},
                               {s.m10 + d.m10, s.m11 + d.m11, d.m12, 0.0},
                               {d.m20, d.m21, s.m22 + d.m22, s.m23},
                               {0.0, 0.0, s.m32, s.m33}};
    std::copy_n(rows[0], 16, out);
  }

 private:
  FacetParameters<double, 0, 0> parameters_;
  GroovedMetal<double, 0> metal_{};
};

// Baek et al. 2018 for one pair of directions.
inline void facet_mueller(const double light[3], const double camera[3], const FacetMaterial& material,
                          double mueller[16]) {
  FacetEvaluator<Baek<GgxSmith>>(material).mueller(light, camera, mueller);
}

// A model over n pairs of directions. light, camera: n x 3; mueller: n x 16.
void evaluate_facets(FacetModel model, const double* light, const double* camera, std::int64_t n,
                     const FacetMaterial& material, double* mueller);

}  // namespace pbrdf
