// Lu and Chipman's polar decomposition of Mueller matrices, M = M_depolariser M_retarder M_diattenuator (1996).
#pragma once

#include <cstdint>

namespace pbrdf {

// What stood in the way of the plain formulas. Rounding of M leaves an error of about 8 epsilon / (1 - D^2) in m', the
// 3 x 3 matrix whose polar factors are wanted; a singular value below that counts as zero.
enum class Guard : std::uint8_t {
  none = 0,
  // One singular value of m' is zero: its vectors are completed to right-handed bases, so the retarder is a rotation.
  singular = 1,
  // At most one is not: of the retarders that fit, the one of least retardance; identity if m' is zero.
  rank_one = 2,
  // D = 1: the retarder of least retardance that takes D to the direction of the polarizance P, and a depolariser
  // |P| alike in all directions. Their product is M where M is physical.
  polariser = 3,
  // An element is not finite, M00 is not positive, or D > 1: all factors are NaN.
  undefined = 4,
};

// All matrices pixels x 16, row-major; guard: pixels.
template <typename T>
struct LuChipmanFactors {
  T* depolariser;
  T* retarder;
  T* diattenuator;
  Guard* guard;
};

template <typename T>
void lu_chipman(const T* mueller, std::int64_t pixels, const LuChipmanFactors<T>& factors);

}  // namespace pbrdf
