#include <pybind11/pybind11.h>

#include "facet_arguments.hpp"
#include "pbrdf/facet.hpp"

namespace {

using namespace pbrdf;

void evaluate(const Array<double>& to_light, const Array<double>& to_camera, const std::string& model, double roughness,
              double eta, double kappa, double specular, double albedo, Array<double>& out) {
  const py::ssize_t n = count_pairs(to_light, to_camera);
  check_shape("out", out, {n, 16});
  const FacetModel which = facet_model(model);
  const FacetMaterial material{roughness, eta, kappa, specular, albedo};
  check_material(which, material);
  const double *light = to_light.data(), *camera = to_camera.data();
  double* mueller = out.mutable_data();
  py::gil_scoped_release release;
  evaluate_facets(which, light, camera, n, material, mueller);
}

}  // namespace

void register_facet(py::module_& parent) {
  py::module_ m = parent.def_submodule("facet", "Microfacet models in the table frames.");
  m.def("evaluate", &evaluate, py::arg("to_light").noconvert(), py::arg("to_camera").noconvert(), py::arg("model"),
        py::arg("roughness"), py::arg("eta"), py::arg("kappa"), py::arg("specular"), py::arg("albedo"),
        py::arg("out").noconvert(),
        "Mueller matrices in 1/sr, without the cosine, into `out` (n, 16) float64, row-major.\n\n"
        "to_light, to_camera: (n, 3) float64 unit vectors with z the normal; model: \"baek_ggx\", \"baek_beckmann\" "
        "(roughness: alpha), \"hyde\" or \"hyde_weighted\" (sigma); the index is eta - i kappa. Zero at and below the "
        "horizon.");
}
