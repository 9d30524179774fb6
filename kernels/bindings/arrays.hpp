// Checks that every binding makes of the arrays it is given.
#pragma once

#include <pybind11/numpy.h>

#include <initializer_list>
#include <stdexcept>
#include <string>

namespace pbrdf {

namespace py = pybind11;

template <typename T>
using Array = py::array_t<T, py::array::c_style>;

inline constexpr py::ssize_t any_length = -1;

// Refuses an array whose shape is not the expected one (any_length matches anything).
inline void check_shape(const char* name, const py::array& array, std::initializer_list<py::ssize_t> expected) {
  bool same = array.ndim() == static_cast<py::ssize_t>(expected.size());
  std::string wanted, found;
  py::ssize_t axis = 0;
  for (const py::ssize_t length : expected) {
    wanted += (wanted.empty() ? "" : ", ") + (length == any_length ? std::string("*") : std::to_string(length));
    same = same && (length == any_length || array.shape(axis) == length);
    ++axis;
  }
  if (same) return;
  for (py::ssize_t i = 0; i < array.ndim(); ++i) found += (i ? ", " : "") + std::to_string(array.shape(i));
  throw std::invalid_argument(std::string(name) + " has shape (" + found + "), expected (" + wanted + ")");
}

}  // namespace pbrdf
