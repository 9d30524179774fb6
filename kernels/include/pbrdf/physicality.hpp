// Which Mueller matrices some ensemble of Jones matrices can make (Cloude 1986), and the nearest that one can.
//
// H = 1/4 sum_ij M_ij (sigma_i x conj(sigma_j)), Pauli matrices in the order of the Stokes parameters, is positive
// semidefinite for those alone; tr H = M00 and |M|_F = 2 |H|_F. All arrays are pixel-major: pixels x 16.
#pragma once

#include <cstdint>

namespace pbrdf {

// Eigenvalues of H, ascending, pixels x 4. NaN where an element is not finite.
template <typename T>
void coherency_eigenvalues(const T* mueller, std::int64_t pixels, T* eigenvalues);

// Whether the smallest eigenvalue is at least -tolerance M00. False where an element is not finite.
template <typename T>
void physicality_mask(const T* mueller, std::int64_t pixels, T tolerance, bool* physical);

// Nearest physical matrix in Frobenius norm: H without its negative eigenvalues. A physical one comes back bit for
// bit; one with an element that is not finite becomes NaN. `nearest` may be `mueller`.
template <typename T>
void nearest_physical(const T* mueller, std::int64_t pixels, T* nearest);

}  // namespace pbrdf
