#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "digests.hpp"

void register_cell_fit(pybind11::module_& m);
void register_cell_sums(pybind11::module_& m);
void register_decomposition(pybind11::module_& m);
void register_exposures(pybind11::module_& m);
void register_facet(pybind11::module_& m);
void register_facet_fit(pybind11::module_& m);
void register_gaps(pybind11::module_& m);
void register_halves(pybind11::module_& m);
void register_items(pybind11::module_& m);
void register_merge(pybind11::module_& m);
void register_physicality(pybind11::module_& m);
void register_pixel_cells(pybind11::module_& m);
void register_planes(pybind11::module_& m);
void register_processor(pybind11::module_& m);
void register_render(pybind11::module_& m);
void register_solve(pybind11::module_& m);
void register_symmetry(pybind11::module_& m);
void register_turned_variance(pybind11::module_& m);

PYBIND11_MODULE(_kernels, m, pybind11::mod_gil_not_used()) {
  m.doc() = "Hot loops of pbrdf, one submodule a topic.";
  m.attr("digests") = pybind11::cast(pbrdf::digests);
  register_cell_fit(m);
  register_cell_sums(m);
  register_decomposition(m);
  register_exposures(m);
  register_facet(m);
  register_facet_fit(m);
  register_gaps(m);
  register_halves(m);
  register_items(m);
  register_merge(m);
  register_physicality(m);
  register_pixel_cells(m);
  register_planes(m);
  register_processor(m);
  register_render(m);
  register_solve(m);
  register_symmetry(m);
  register_turned_variance(m);
}
