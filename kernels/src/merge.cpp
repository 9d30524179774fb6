#include "pbrdf/merge.hpp"

#include <algorithm>
#include <limits>

namespace pbrdf {
namespace {

constexpr int elements = 16;

struct Weights {
  float low, high;
};

// Whether a node at this weight of the higher light is known, from one light where it lies on that light.
bool known(double weight, bool low_sees, bool high_sees, bool near) {
  if (weight == 0) return low_sees;
  if (weight == 1) return high_sees;
  return near && low_sees && high_sees;
}

std::uint16_t pixels(const LightSlice& low, const LightSlice& high, std::int64_t node, const Weights& weight) {
  const unsigned sum = (weight.low > 0 ? low.count[node] : 0u) + (weight.high > 0 ? high.count[node] : 0u);
  return static_cast<std::uint16_t>(std::min<unsigned>(sum, std::numeric_limits<std::uint16_t>::max()));
}

// Nothing of a light whose weight is zero, for it may hold NaN there.
void weigh(const float* low, const float* high, float low_weight, float high_weight, float* out) {
  if (high_weight == 0)
    std::copy(low, low + elements, out);
  else if (low_weight == 0)
    std::copy(high, high + elements, out);
  else
    for (int e = 0; e < elements; ++e) out[e] = low_weight * low[e] + high_weight * high[e];
}

}  // namespace

void interpolate_lights(const LightSlice& low, const LightSlice& high, const TableShape& shape, const double* theta_d,
                        double widest_gap, const TableBand& table) {
  const double* last = theta_d + shape.differences;
#pragma omp parallel for schedule(static)
  for (std::int64_t h = 0; h < shape.halves; ++h)
    for (std::int64_t p = 0; p < shape.azimuths; ++p) {
      const std::int64_t node = h * shape.azimuths + p;
      const bool low_sees = low.count[node] > 0, high_sees = high.count[node] > 0;
      const double from = low.theta_d[node], to = high.theta_d[node], gap = to - from;
      // written so that NaN, where a light has no point for the node, counts as no gap
      if (!(gap > 0) || !(low_sees || high_sees)) continue;
      for (const double* at = std::lower_bound(theta_d, last, from); at != last && *at <= to; ++at) {
        const double w = *at == to ? 1 : (*at - from) / gap;
        if (!known(w, low_sees, high_sees, gap <= widest_gap)) continue;
        const Weights weight{static_cast<float>(1 - w), static_cast<float>(w)};
        const std::int64_t out = (h * shape.differences + (at - theta_d)) * shape.azimuths + p;
        weigh(low.mueller + elements * node, high.mueller + elements * node, weight.low, weight.high,
              table.mueller + elements * out);
        weigh(low.variance + elements * node, high.variance + elements * node, weight.low * weight.low,
              weight.high * weight.high, table.variance + elements * out);
        table.count[out] = pixels(low, high, node, weight);
      }
    }
}

}  // namespace pbrdf
