#include <pybind11/pybind11.h>

#include "pbrdf/processor.hpp"

void register_processor(pybind11::module_& parent) {
  pybind11::module_ m = parent.def_submodule("processor", "Which versions of the hot loops run here.");
  // a version that does not exist is refused when the module is loaded, not amid a parallel loop
  pbrdf::instruction_set();
  m.def("isa", &pbrdf::instruction_set,
        "Version of x86-64 that the hot loops use: v2, v3 or v4; PBRDF_ISA in the environment pins one.");
}
