#include "pbrdf/halves.hpp"

#include <algorithm>
#include <cstring>

#include "pbrdf/isa.hpp"
#include "pbrdf/tiles.hpp"

namespace pbrdf {
namespace {

constexpr std::int64_t block_values = 16384;

// Without an instruction for it (F16C comes with x86-64-v3).
std::uint16_t rounded(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  const std::uint32_t sign = bits >> 16 & 0x8000u, magnitude = bits & 0x7fffffffu;
  if (magnitude > 0x7f800000u) return static_cast<std::uint16_t>(sign | 0x7e00u);
  if (magnitude >= 0x477ff000u) return static_cast<std::uint16_t>(sign | 0x7c00u);
  if (magnitude < 0x38800000u) {
    // adding ½ moves a subnormal's last bit to the last of a float and rounds there
    float shifted;
    std::memcpy(&shifted, &magnitude, sizeof shifted);
    shifted += 0.5f;
    std::uint32_t subnormal;
    std::memcpy(&subnormal, &shifted, sizeof subnormal);
    return static_cast<std::uint16_t>(sign | (subnormal - 0x3f000000u));
  }
  const std::uint32_t even = magnitude >> 13 & 1u;
  return static_cast<std::uint16_t>(sign | ((magnitude - 0x38000000u + 0xfffu + even) >> 13));
}

struct ToHalves {
  const float* values;
  float factor;
  std::int64_t count;
  std::uint16_t* halves;

  std::size_t scratch_bytes() const { return 0; }

  template <int bytes>
  [[gnu::always_inline]] inline void run(std::int64_t first, std::int64_t last, void*) const {
    const std::int64_t end = std::min(last * block_values, count);
    std::int64_t i = first * block_values;
#if PBRDF_VERSIONS
    if constexpr (bytes > 16) {
      constexpr int lanes = bytes / static_cast<int>(sizeof(float));
      typedef std::uint16_t Halves __attribute__((vector_size(bytes / 2)));
      for (; i + lanes <= end; i += lanes) {
        Vector<float, bytes> scaled;
        std::memcpy(&scaled, values + i, sizeof scaled);
        scaled *= factor;
        // by inline assembly: the intrinsics of a wider version cannot be named in a template of the narrowest
        Halves packed;
        asm("vcvtps2ph $0, %1, %0" : "=v"(packed) : "v"(scaled));
        std::memcpy(halves + i, &packed, sizeof packed);
      }
    }
#endif
    for (; i < end; ++i) halves[i] = rounded(values[i] * factor);
  }
};

}  // namespace

void to_halves(const float* values, float factor, std::int64_t count, std::uint16_t* halves) {
  run_blocks(ToHalves{values, factor, count, halves}, (count + block_values - 1) / block_values);
}

}  // namespace pbrdf
