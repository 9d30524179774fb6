// Numbers of 16 bits for the disk.
#pragma once

#include <cstdint>

namespace pbrdf {

// IEEE 754 binary16 of each value times `factor`, rounded to nearest, ties to even; NaN stays NaN, too large becomes
// infinite.
void to_halves(const float* values, float factor, std::int64_t count, std::uint16_t* halves);

}  // namespace pbrdf
