// Which cell of the table's (theta_h, phi_d) grid each pixel of a photograph shows.
#pragma once

#include <cstdint>

namespace pbrdf {

// A camera at the origin that looks along z; Brown's k1 k2 p1 p2 k3, zeros for a pinhole.
struct Lens {
  double focal[2], principal[2];  // along columns and rows, px
  double distortion[5];
};

// Lengths in millimetres, camera frame.
struct LitSphere {
  double centre[3], radius, light[3];
};

// A rectangle of the frame, px.
struct Window {
  std::int64_t row, column, rows, columns;
};

// Cells around theta_h = (j / (theta_h - 1))^2 90 degrees and phi_d = -180 + k 360 / phi_d degrees. Cells of phi_d run
// around: there is no second one at +180.
struct CellGrid {
  std::int32_t theta_h, phi_d;
  std::int64_t count() const { return static_cast<std::int64_t>(theta_h) * phi_d; }
};

inline constexpr std::int32_t no_cell = -1;

// All of rows x columns of the window.
struct PixelCells {
  std::int32_t* cell;  // j phi_d + k, or no_cell where no surface is seen, or light or camera stand too low
  float* theta_h;      // place within the cell, in cells from its centre
  float* phi_d;
  float* gain;  // d^2 / cos(theta_i), m^2: what the light's distance and slant took away
};

// least_cosine: of the angles of light and camera from the normal.
void locate_pixels(const Lens& lens, const LitSphere& scene, const Window& window, double least_cosine,
                   const CellGrid& grid, const PixelCells& out);

}  // namespace pbrdf
