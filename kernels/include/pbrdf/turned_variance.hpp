// Variances of Mueller matrices in turned frames, whose elements' noise hangs together.
#pragma once

#include <cstdint>

#include "pbrdf/exposures.hpp"
#include "pbrdf/solve.hpp"

namespace pbrdf {

// n matrices that were reconstructed in one pair of frames and are to be told in another.
struct Turning {
  const double* mueller;   // n x 16, DN/s as measured
  const double* variance;  // n x 16
  const double* turns;     // n x 4: cosine and sine of twice the angle of the incident, then of the outgoing frame
  std::int64_t count;
};

struct FrameNoise {
  Exposures exposures;
  double saturation;     // DN above the dark level from which on an exposure is not used
  double dark_variance;  // of a pixel in the mean dark frame of an exposure, DN^2
};

// out: n x 16. What the elements' noise has in common follows from states, exposures and sensor; how large it is, from
// `variance`. Of W+ i the covariance is W+ S W+'; where the states differ in exposures, of the weighted solution,
// (W' S^-1 W)^-1 (Goldstein, Polarized Light, on least squares). To either comes the noise of the mean dark frame,
// which all states share. Same bytes for any number of threads.
void turn_variances(const Turning& turning, const MeasurementMatrix& matrix, const FrameNoise& noise, double* out);

}  // namespace pbrdf
