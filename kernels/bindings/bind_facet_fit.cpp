#include <pybind11/pybind11.h>

#include <algorithm>
#include <type_traits>
#include <vector>

#include "facet_arguments.hpp"
#include "pbrdf/facet_fit.hpp"

namespace {

using namespace pbrdf;

// Calls `body` with the kind of that name as a constant.
template <class Body>
auto with_kind(const std::string& name, const Body& body) {
  static const std::map<std::string, CostKind> kinds = {
      {"norms", CostKind::norms}, {"roots", CostKind::roots}, {"squares", CostKind::squares}};
  switch (named("kind", kinds, name)) {
    case CostKind::roots:
      return body(std::integral_constant<CostKind, CostKind::roots>{});
    case CostKind::squares:
      return body(std::integral_constant<CostKind, CostKind::squares>{});
    default:
      return body(std::integral_constant<CostKind, CostKind::norms>{});
  }
}

template <class T>
Array<T> geometry(const Array<double>& to_light, const Array<double>& to_camera) {
  const py::ssize_t n = count_pairs(to_light, to_camera);
  Array<T> blocks({static_cast<py::ssize_t>(fit_blocks(n)), py::ssize_t{geometry_rows<T>}, py::ssize_t{fit_lanes}});
  const double *light = to_light.data(), *camera = to_camera.data();
  auto* out = reinterpret_cast<GeometryBlock<T>*>(blocks.mutable_data());
  {
    py::gil_scoped_release release;
    precompute_geometry(light, camera, n, out);
  }
  return blocks;
}

Array<float> pack(const Array<float>& mueller, const Array<float>& weight, const std::string& kind) {
  check_shape("mueller", mueller, {any_length, any_length, 16});
  const py::ssize_t bands = mueller.shape(0), n = mueller.shape(1);
  return with_kind(kind, [&](auto constant) {
    constexpr CostKind which = decltype(constant)::value;
    constexpr py::ssize_t weights_a_node = which == CostKind::squares ? 16 : 1;
    if constexpr (which == CostKind::squares)
      check_shape("weight", weight, {bands, n, 16});
    else
      check_shape("weight", weight, {bands, n});
    const auto blocks = static_cast<py::ssize_t>(fit_blocks(n));
    Array<float> packed({bands, blocks, py::ssize_t{table_rows<which>}, py::ssize_t{fit_lanes}});
    const float *matrices = mueller.data(), *weights = weight.data();
    auto* out = reinterpret_cast<TableBlock<which>*>(packed.mutable_data());
    {
      py::gil_scoped_release release;
      for (py::ssize_t band = 0; band < bands; ++band)
        pack_table<which>(matrices + band * n * 16, weights + band * n * weights_a_node, n, out + band * blocks);
    }
    return packed;
  });
}

// What the bands have of their own, from rows of eta, kappa, specular and albedo.
template <CostKind kind>
std::vector<FitBand<kind>> fit_bands(FacetModel model, bool complex, double roughness, const Array<double>& own,
                                     const Array<double>& epsilon, const TableBlock<kind>* table, py::ssize_t blocks) {
  std::vector<FitBand<kind>> bands;
  for (py::ssize_t band = 0; band < own.shape(0); ++band) {
    const double* values = own.data(band, 0);
    const FacetMaterial material{roughness, values[0], values[1], values[2], values[3]};
    check_material(model, material);
    check_range("eta", complex || material.eta > 1, "(1, inf)");
    check_range("epsilon", epsilon.at(band) > 0, "(0, inf)");
    bands.push_back({table + band * blocks, material, epsilon.at(band)});
  }
  return bands;
}

template <class T>
py::tuple cost(const Array<T>& geometry, const Array<float>& table, const std::string& kind, const std::string& model,
               bool complex, double roughness, const Array<double>& own, const Array<double>& epsilon) {
  const FacetModel which = facet_model(model);
  check_shape("geometry", geometry, {any_length, geometry_rows<T>, fit_lanes});
  check_shape("own", own, {any_length, 4});
  const py::ssize_t blocks = geometry.shape(0), bands = own.shape(0);
  check_shape("epsilon", epsilon, {bands});
  const auto* nodes = reinterpret_cast<const GeometryBlock<T>*>(geometry.data());
  const std::vector<CostGradient> results = with_kind(kind, [&](auto constant) {
    constexpr CostKind summed = decltype(constant)::value;
    check_shape("table", table, {bands, blocks, table_rows<summed>, fit_lanes});
    const auto* values = reinterpret_cast<const TableBlock<summed>*>(table.data());
    const auto compared = fit_bands<summed>(which, complex, roughness, own, epsilon, values, blocks);
    py::gil_scoped_release release;
    return cost_gradient<T, summed>(which, complex, nodes, blocks, compared);
  });
  Array<double> costs(bands), gradients({bands, py::ssize_t{5}});
  for (py::ssize_t band = 0; band < bands; ++band) {
    costs.mutable_at(band) = results[band].cost;
    std::copy_n(results[band].gradient, 5, gradients.mutable_data(band, 0));
  }
  return py::make_tuple(costs, gradients);
}

template <class T>
void register_cost(py::module_& m) {
  m.def(
      "cost_gradient", &cost<T>, py::arg("geometry").noconvert(), py::arg("table").noconvert(), py::arg("kind"),
      py::arg("model"), py::arg("complex"), py::arg("roughness"), py::arg("own").noconvert(),
      py::arg("epsilon").noconvert(),
      "Cost of each band (B,) and its gradient (B, 5) by roughness, eta, kappa, specular and albedo, in one pass over "
      "the nodes.\n\n"
      "own: eta, kappa, specular and albedo of each band (B, 4) float64; epsilon: (B,) float64. kind: \"norms\", the "
      "sum over the nodes of w sqrt(|difference|^2 + epsilon^2); \"roots\", of w sum (difference^2 + epsilon^2)^(1/4) "
      "over the elements; \"squares\", of sum w difference^2. Without `complex` the index is real and kappa is not "
      "looked at. Computed in the geometry's type, summed in float64; the bytes do not depend on the number of "
      "threads.");
}

}  // namespace

void register_facet_fit(py::module_& parent) {
  py::module_ m = parent.def_submodule("facet_fit", "Costs of the microfacet models against a table.");
  const char* about =
      "What `cost_gradient` needs of n pairs of directions above the horizon, (n, 3) float64: (ceil(n/16), 8, 16).";
  m.def("geometry_float32", &geometry<float>, py::arg("to_light").noconvert(), py::arg("to_camera").noconvert(), about);
  m.def("geometry_float64", &geometry<double>, py::arg("to_light").noconvert(), py::arg("to_camera").noconvert(),
        about);
  m.def(
      "pack", &pack, py::arg("mueller").noconvert(), py::arg("weight").noconvert(), py::arg("kind"),
      "Measured matrices (B, n, 16) float32 with the weights of the nodes (B, n) or, for \"squares\", of the elements "
      "(B, n, 16), float32, as `cost_gradient` of that kind reads them. What has the weight zero may be NaN.");
  register_cost<float>(m);
  register_cost<double>(m);
}
