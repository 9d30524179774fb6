#include "pbrdf/merge.hpp"

#include <algorithm>
#include <limits>

namespace pbrdf {
namespace {

constexpr int elements = 16;
constexpr int most_lights = 4;
constexpr double least_gap = 0.5;  // from a light beyond, in gaps between the two that bracket

// Lights that tell a node, and where it stands for them.
struct Helpers {
  const LightSlice* light[most_lights];
  double theta_d[most_lights];
  int count = 0;

  void add(const LightSlice& one, std::int64_t node) {
    light[count] = &one;
    theta_d[count++] = one.theta_d[node];
  }
};

struct Gap {
  double from, to, widest;

  // NaN, where a light has no point for the node, is no distance
  bool helps(double distance) const { return distance >= least_gap * (to - from) && distance <= widest; }
};

Helpers helpers(const Lights& lights, std::int64_t node, const Gap& gap) {
  const LightSlice *low = lights.of + lights.low, *high = low + 1;
  const LightSlice *before = low - 1, *after = high + 1;
  Helpers found;
  if (lights.low > 0 && before->count[node] > 0 && gap.helps(gap.from - before->theta_d[node]))
    found.add(*before, node);
  found.add(*low, node);
  found.add(*high, node);
  if (lights.low + 2 < lights.count && after->count[node] > 0 && gap.helps(after->theta_d[node] - gap.to))
    found.add(*after, node);
  return found;
}

// Value of the polynomial through the helpers' matrices, of Lagrange's weights.
void write_node(const Helpers& by, std::int64_t node, double at, const TableBand& table, std::int64_t out) {
  double mueller[elements] = {}, variance[elements] = {};
  unsigned pixels = 0;
  for (int i = 0; i < by.count; ++i) {
    double weight = 1;
    for (int j = 0; j < by.count; ++j)
      if (j != i) weight *= (at - by.theta_d[j]) / (by.theta_d[i] - by.theta_d[j]);
    for (int e = 0; e < elements; ++e) {
      mueller[e] += weight * by.light[i]->mueller[elements * node + e];
      variance[e] += weight * weight * by.light[i]->variance[elements * node + e];
    }
    pixels += by.light[i]->count[node];
  }
  for (int e = 0; e < elements; ++e) {
    table.mueller[elements * out + e] = static_cast<float>(mueller[e]);
    table.variance[elements * out + e] = static_cast<float>(variance[e]);
  }
  table.count[out] = static_cast<std::uint16_t>(std::min<unsigned>(pixels, std::numeric_limits<std::uint16_t>::max()));
}

void copy_node(const LightSlice& light, std::int64_t node, const TableBand& table, std::int64_t out) {
  std::copy_n(light.mueller + elements * node, elements, table.mueller + elements * out);
  std::copy_n(light.variance + elements * node, elements, table.variance + elements * out);
  table.count[out] = light.count[node];
}

}  // namespace

void interpolate_lights(const Lights& lights, const TableShape& shape, const double* theta_d, double widest_gap,
                        const TableBand& table) {
  const LightSlice &low = lights.of[lights.low], &high = lights.of[lights.low + 1];
  const double* last = theta_d + shape.differences;
#pragma omp parallel for schedule(static)
  for (std::int64_t h = 0; h < shape.halves; ++h)
    for (std::int64_t p = 0; p < shape.azimuths; ++p) {
      const std::int64_t node = h * shape.azimuths + p;
      const bool low_sees = low.count[node] > 0, high_sees = high.count[node] > 0;
      const Gap gap{low.theta_d[node], high.theta_d[node], widest_gap};
      // written so that NaN counts as no gap
      if (!(gap.to > gap.from) || !(low_sees || high_sees)) continue;
      const bool both = low_sees && high_sees && gap.to - gap.from <= widest_gap;
      const Helpers by = both ? helpers(lights, node, gap) : Helpers{};
      for (const double* at = std::lower_bound(theta_d, last, gap.from); at != last && *at <= gap.to; ++at) {
        const std::int64_t out = (h * shape.differences + (at - theta_d)) * shape.azimuths + p;
        if (*at == gap.from || *at == gap.to) {
          const LightSlice& on = *at == gap.from ? low : high;
          if (on.count[node] > 0) copy_node(on, node, table, out);
        } else if (both) {
          write_node(by, node, *at, table, out);
        }
      }
    }
}

}  // namespace pbrdf
