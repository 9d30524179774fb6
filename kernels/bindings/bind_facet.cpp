#include <pybind11/pybind11.h>

#include "arrays.hpp"
#include "pbrdf/facet_fit.hpp"

namespace {

using namespace pbrdf;

void check_range(const char* name, bool inside, const char* range) {
  if (!inside) throw std::invalid_argument(std::string(name) + " is outside " + range);
}

FacetMaterial material_of(double alpha, double eta, double kappa, double specular, double albedo) {
  check_range("alpha", alpha > 0, "(0, inf)");
  check_range("eta", eta > 0, "(0, inf)");
  check_range("kappa", kappa >= 0, "[0, inf)");
  return {alpha, eta, kappa, specular, albedo};
}

py::ssize_t count_pairs(const Array<double>& to_light, const Array<double>& to_camera) {
  check_shape("to_light", to_light, {any_length, 3});
  check_shape("to_camera", to_camera, {to_light.shape(0), 3});
  return to_light.shape(0);
}

void evaluate(const Array<double>& to_light, const Array<double>& to_camera, double alpha, double eta, double kappa,
              double specular, double albedo, Array<double>& out) {
  const py::ssize_t n = count_pairs(to_light, to_camera);
  check_shape("out", out, {n, 16});
  const FacetMaterial material = material_of(alpha, eta, kappa, specular, albedo);
  const double *light = to_light.data(), *camera = to_camera.data();
  double* mueller = out.mutable_data();
  py::gil_scoped_release release;
  evaluate_facets(light, camera, n, material, mueller);
}

Array<double> geometry(const Array<double>& to_light, const Array<double>& to_camera) {
  const py::ssize_t n = count_pairs(to_light, to_camera);
  Array<double> blocks({static_cast<py::ssize_t>(fit_blocks(n)), py::ssize_t{geometry_rows}, py::ssize_t{fit_lanes}});
  const double *light = to_light.data(), *camera = to_camera.data();
  auto* out = reinterpret_cast<GeometryBlock*>(blocks.mutable_data());
  {
    py::gil_scoped_release release;
    precompute_geometry(light, camera, n, out);
  }
  return blocks;
}

Array<float> pack(const Array<float>& mueller, const Array<float>& weight) {
  check_shape("mueller", mueller, {any_length, 16});
  const py::ssize_t n = mueller.shape(0);
  check_shape("weight", weight, {n});
  Array<float> blocks({static_cast<py::ssize_t>(fit_blocks(n)), py::ssize_t{table_rows}, py::ssize_t{fit_lanes}});
  const float *matrices = mueller.data(), *weights = weight.data();
  auto* out = reinterpret_cast<TableBlock*>(blocks.mutable_data());
  {
    py::gil_scoped_release release;
    pack_table(matrices, weights, n, out);
  }
  return blocks;
}

py::tuple cost(const Array<double>& geometry, const Array<float>& table, double alpha, double eta, double specular,
               double albedo, double epsilon) {
  check_shape("geometry", geometry, {any_length, geometry_rows, fit_lanes});
  check_shape("table", table, {geometry.shape(0), table_rows, fit_lanes});
  const FacetMaterial material = material_of(alpha, eta, 0.0, specular, albedo);
  check_range("eta", eta > 1, "(1, inf)");
  check_range("epsilon", epsilon > 0, "(0, inf)");
  const auto* nodes = reinterpret_cast<const GeometryBlock*>(geometry.data());
  const auto* values = reinterpret_cast<const TableBlock*>(table.data());
  const py::ssize_t blocks = geometry.shape(0);
  CostGradient result;
  {
    py::gil_scoped_release release;
    result = cost_gradient(nodes, values, blocks, material, epsilon);
  }
  return py::make_tuple(result.cost, Array<double>(4, result.gradient));
}

}  // namespace

void register_facet(py::module_& parent) {
  py::module_ m = parent.def_submodule("facet", "The microfacet pBRDF of Baek et al. 2018 in the table frames.");
  m.def(
      "evaluate", &evaluate, py::arg("to_light").noconvert(), py::arg("to_camera").noconvert(), py::arg("alpha"),
      py::arg("eta"), py::arg("kappa"), py::arg("specular"), py::arg("albedo"), py::arg("out").noconvert(),
      "Mueller matrices in 1/sr, without the cosine, into `out` (n, 16) float64, row-major.\n\n"
      "to_light, to_camera: (n, 3) float64 unit vectors with z the normal; the index is eta - i kappa for the specular "
      "term and eta for the diffuse one. Zero at and below the horizon.");
  m.def("geometry", &geometry, py::arg("to_light").noconvert(), py::arg("to_camera").noconvert(),
        "What `cost_gradient` needs of n pairs of directions above the horizon, (n, 3) float64: an array "
        "(ceil(n/16), 12, 16) float64.");
  m.def("pack", &pack, py::arg("mueller").noconvert(), py::arg("weight").noconvert(),
        "Measured matrices (n, 16) float32 with the weights (n,) float32 of the nodes, as `cost_gradient` reads them: "
        "(ceil(n/16), 17, 16) float32. A node of weight zero may hold NaN.");
  m.def("cost_gradient", &cost, py::arg("geometry").noconvert(), py::arg("table").noconvert(), py::arg("alpha"),
        py::arg("eta"), py::arg("specular"), py::arg("albedo"), py::arg("epsilon"),
        "Sum over the nodes of w sqrt(|M_model - M_table|_F^2 + epsilon^2), in 1/sr, and its gradient (4,) by alpha, "
        "eta, specular and albedo; real index. The bytes do not depend on the number of threads.");
}
