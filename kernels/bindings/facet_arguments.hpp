// Arguments that the bindings of the facet models share.
#pragma once

#include <map>
#include <string>

#include "arrays.hpp"
#include "pbrdf/facet.hpp"

namespace pbrdf {

template <class Value>
Value named(const char* argument, const std::map<std::string, Value>& values, const std::string& name) {
  const auto found = values.find(name);
  if (found != values.end()) return found->second;
  throw std::invalid_argument(std::string(argument) + " '" + name + "' is not known");
}

inline FacetModel facet_model(const std::string& name) {
  static const std::map<std::string, FacetModel> models = {{"baek_ggx", FacetModel::baek_ggx},
                                                           {"baek_beckmann", FacetModel::baek_beckmann},
                                                           {"hyde", FacetModel::hyde},
                                                           {"hyde_weighted", FacetModel::hyde_weighted}};
  return named("model", models, name);
}

inline void check_range(const char* name, bool inside, const char* range) {
  if (!inside) throw std::invalid_argument(std::string(name) + " is outside " + range);
}

inline void check_material(FacetModel model, const FacetMaterial& material) {
  check_range("roughness", material.roughness > 0, "(0, inf)");
  if (model == FacetModel::hyde_weighted)
    check_range("roughness", material.roughness <= grooved_metal_most_sigma, "(0, 0.75], where its weight is known");
  check_range("eta", material.eta > 0, "(0, inf)");
  check_range("kappa", material.kappa >= 0, "[0, inf)");
}

inline py::ssize_t count_pairs(const Array<double>& to_light, const Array<double>& to_camera) {
  check_shape("to_light", to_light, {any_length, 3});
  check_shape("to_camera", to_camera, {to_light.shape(0), 3});
  return to_light.shape(0);
}

}  // namespace pbrdf
