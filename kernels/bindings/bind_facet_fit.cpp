#include <pybind11/pybind11.h>

#include <type_traits>

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
  check_shape("mueller", mueller, {any_length, 16});
  const py::ssize_t n = mueller.shape(0);
  return with_kind(kind, [&](auto constant) {
    constexpr CostKind which = decltype(constant)::value;
    if constexpr (which == CostKind::squares)
      check_shape("weight", weight, {n, 16});
    else
      check_shape("weight", weight, {n});
    Array<float> blocks(
        {static_cast<py::ssize_t>(fit_blocks(n)), py::ssize_t{table_rows<which>}, py::ssize_t{fit_lanes}});
    const float *matrices = mueller.data(), *weights = weight.data();
    auto* out = reinterpret_cast<TableBlock<which>*>(blocks.mutable_data());
    {
      py::gil_scoped_release release;
      pack_table<which>(matrices, weights, n, out);
    }
    return blocks;
  });
}

template <class T>
py::tuple cost(const Array<T>& geometry, const Array<float>& table, const std::string& kind, const std::string& model,
               bool complex, double roughness, double eta, double kappa, double specular, double albedo,
               double epsilon) {
  const FacetModel which = facet_model(model);
  const FacetMaterial material{roughness, eta, kappa, specular, albedo};
  check_material(which, material);
  check_range("eta", complex || eta > 1, "(1, inf)");
  check_range("epsilon", epsilon > 0, "(0, inf)");
  check_shape("geometry", geometry, {any_length, geometry_rows<T>, fit_lanes});
  const py::ssize_t blocks = geometry.shape(0);
  const auto* nodes = reinterpret_cast<const GeometryBlock<T>*>(geometry.data());
  const CostGradient result = with_kind(kind, [&](auto constant) {
    constexpr CostKind summed = decltype(constant)::value;
    check_shape("table", table, {blocks, table_rows<summed>, fit_lanes});
    const auto* values = reinterpret_cast<const TableBlock<summed>*>(table.data());
    py::gil_scoped_release release;
    return cost_gradient<T, summed>(which, complex, nodes, values, blocks, material, epsilon);
  });
  return py::make_tuple(result.cost, Array<double>(5, result.gradient));
}

template <class T>
void register_cost(py::module_& m) {
  m.def("cost_gradient", &cost<T>, py::arg("geometry").noconvert(), py::arg("table").noconvert(), py::arg("kind"),
        py::arg("model"), py::arg("complex"), py::arg("roughness"), py::arg("eta"), py::arg("kappa"),
        py::arg("specular"), py::arg("albedo"), py::arg("epsilon"),
        "Cost of one band and its gradient (5,) by roughness, eta, kappa, specular and albedo.\n\n"
        "kind: \"norms\", the sum over the nodes of w sqrt(|difference|^2 + epsilon^2); \"roots\", of w sum "
        "(difference^2 + epsilon^2)^(1/4) over the elements; \"squares\", of sum w difference^2. Without `complex` the "
        "index is real and kappa is not looked at. Computed in the geometry's type, summed in float64; the bytes do "
        "not depend on the number of threads.");
}

}  // namespace

void register_facet_fit(py::module_& parent) {
  py::module_ m = parent.def_submodule("facet_fit", "Costs of the microfacet models against a table.");
  const char* about =
      "What `cost_gradient` needs of n pairs of directions above the horizon, (n, 3) float64: (ceil(n/16), 8, 16).";
  m.def("geometry_float32", &geometry<float>, py::arg("to_light").noconvert(), py::arg("to_camera").noconvert(), about);
  m.def("geometry_float64", &geometry<double>, py::arg("to_light").noconvert(), py::arg("to_camera").noconvert(),
        about);
  m.def("pack", &pack, py::arg("mueller").noconvert(), py::arg("weight").noconvert(), py::arg("kind"),
        "Measured matrices (n, 16) float32 with the weights of the nodes (n,) or, for \"squares\", of the elements "
        "(n, 16), float32, as `cost_gradient` of that kind reads them. What has the weight zero may be NaN.");
  register_cost<float>(m);
  register_cost<double>(m);
}
