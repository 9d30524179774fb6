// Sixteen weighted sums of any number of planes.
#pragma once

#include <cstdint>

namespace pbrdf {

// out = matrix planes in float32.
// planes: states x pixels; matrix: 16 x states (row-major); out: 16 x pixels. NaN in any plane makes the pixel NaN.
template <typename Raw>
void combine_planes(const Raw* planes, const double* matrix, int states, std::int64_t pixels, float* out);

}  // namespace pbrdf
