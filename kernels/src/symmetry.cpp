#include "pbrdf/symmetry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbrdf {
namespace {

constexpr int elements = 16;
constexpr int itself = 0, mirror = 1, exchange = 2, both = 3;

constexpr int transposed(int e) { return 4 * (e % 4) + e / 4; }

constexpr float mirror_sign(int e) { return (e / 4 >= 2) == (e % 4 >= 2) ? 1.0f : -1.0f; }

constexpr float exchange_sign(int e) { return (e / 4 == 2) == (e % 4 == 2) ? 1.0f : -1.0f; }

// Element of the partner that tells element e, and with which sign. Each transformation is its own inverse.
struct Transformations {
  int source[4][elements];
  float sign[4][elements];
};

constexpr Transformations make_transformations() {
  Transformations made{};
  for (int t = itself; t <= both; ++t)
    for (int e = 0; e < elements; ++e) {
      made.source[t][e] = t >= exchange ? transposed(e) : e;
      made.sign[t][e] = (t % 2 == 1 ? mirror_sign(e) : 1.0f) * (t >= exchange ? exchange_sign(e) : 1.0f);
    }
  return made;
}

constexpr Transformations transformations = make_transformations();

int source(int t, int e) { return transformations.source[t][e]; }
float sign(int t, int e) { return transformations.sign[t][e]; }

// Azimuths that hold one matrix, told from the first of them: partner[t] tells it by transformation t.
struct Group {
  std::int64_t partner[4];
  int size;  // 4, or 2 where no node lies opposite another
};

Group group_of(std::int64_t k, std::int64_t around) {
  const std::int64_t half = around / 2;
  Group group{{k, (around - k) % around, (k + half) % around, (around - k + half) % around}, around % 2 ? 2 : 4};
  return group;
}

bool first_of_group(const Group& group) {
  for (int t = 1; t < group.size; ++t)
    if (group.partner[t] < group.partner[0]) return false;
  return true;
}

// What a transformation brings out of one node.
void bring(const float* from, int t, bool signs, float* to) {
  for (int e = 0; e < elements; ++e) to[e] = (signs ? sign(t, e) : 1.0f) * from[source(t, e)];
}

struct Pool {
  float mueller[elements], variance[elements];
  std::uint16_t count;  // 0 where nothing was measured
};

// Weights of the partners that tell one element from the same element of the same node as partner t: one measurement.
double weight_of_same(const Group& group, const double (&weight)[4], int t, int e) {
  double same = 0;
  for (int s = 0; s < group.size; ++s)
    if (group.partner[s] == group.partner[t] && source(s, e) == source(t, e)) same += weight[s];
  return same;
}

// Weighted mean over the measured partners. The variance of an element that is one measurement does not shrink, not
// even where the mean is zero by symmetry.
Pool pool_of(const Group& group, std::int64_t row, const SymmetricBand& band) {
  double weight[4], total = 0;
  unsigned pixels = 0;
  bool repeated = false;
  for (int t = 0; t < group.size; ++t) {
    const std::int64_t node = row + group.partner[t];
    weight[t] = band.origin[node] == measured ? band.count[node] * band.weight[node] : 0;
    total += weight[t];
    bool counted = weight[t] == 0;
    for (int s = 0; s < t; ++s) {
      counted = counted || group.partner[s] == group.partner[t];
      repeated = repeated || group.partner[s] == group.partner[t];
    }
    if (!counted) pixels += band.count[node];
  }
  double mean[elements] = {}, variance[elements] = {};
  for (int t = 0; t < group.size; ++t) {
    if (weight[t] == 0) continue;
    const double w = weight[t] / total;
    const std::int64_t at = elements * (row + group.partner[t]);
    for (int e = 0; e < elements; ++e) {
      const double same = repeated ? weight_of_same(group, weight, t, e) / total : w;
      mean[e] += w * sign(t, e) * band.mueller[at + source(t, e)];
      variance[e] += w * same * band.variance[at + source(t, e)];
    }
  }
  Pool pool;
  pool.count = static_cast<std::uint16_t>(std::min<unsigned>(pixels, std::numeric_limits<std::uint16_t>::max()));
  std::copy_n(mean, elements, pool.mueller);
  std::copy_n(variance, elements, pool.variance);
  return pool;
}

// The transformation whose partner a node that is not measured would be copied from, or itself.
int copied_by(const Group& group, std::int64_t row, const std::uint8_t* origin) {
  for (int t = 1; t < group.size; ++t)
    if (origin[row + group.partner[t]] == measured) return t;
  return itself;
}

std::uint8_t origin_of_copy(int t) { return t == mirror ? mirrored : reciprocal; }

void copy_node(std::int64_t from, std::int64_t to, const SymmetricBand& band) {
  std::copy_n(band.mueller + elements * from, elements, band.mueller + elements * to);
  std::copy_n(band.variance + elements * from, elements, band.variance + elements * to);
  band.count[to] = band.count[from];
  band.origin[to] = band.origin[from];
}

// The node at pi tells that at -pi, should it alone be measured; the other way around in the end.
void open_circle(std::int64_t row, std::int64_t around, const SymmetricBand& band) {
  if (band.origin[row] != measured && band.origin[row + around] == measured) copy_node(row + around, row, band);
}

void close_circle(std::int64_t row, std::int64_t around, const SymmetricBand& band) {
  copy_node(row, row + around, band);
}

void pool_row(std::int64_t row, std::int64_t around, const SymmetricBand& band) {
  open_circle(row, around, band);
  for (std::int64_t k = 0; k < around; ++k) {
    const Group group = group_of(k, around);
    if (!first_of_group(group)) continue;
    std::uint8_t origin[4];
    for (int t = 0; t < group.size; ++t) {
      const std::int64_t node = row + group.partner[t];
      origin[t] = band.origin[node];
      if (origin[t] == unseen) {
        const int by = copied_by(group_of(group.partner[t], around), row, band.origin);
        if (by != itself) origin[t] = origin_of_copy(by);
      }
    }
    const Pool pool = pool_of(group, row, band);
    if (pool.count == 0) continue;
    for (int t = 0; t < group.size; ++t) {
      const std::int64_t node = row + group.partner[t];
      if (origin[t] < measured) continue;
      bring(pool.mueller, t, true, band.mueller + elements * node);
      bring(pool.variance, t, false, band.variance + elements * node);
      band.count[node] = pool.count;
      band.origin[node] = origin[t];
    }
  }
  close_circle(row, around, band);
}

void copy_row(std::int64_t row, std::int64_t around, const SymmetricBand& band) {
  open_circle(row, around, band);
  for (std::int64_t k = 0; k < around; ++k) {
    const std::int64_t node = row + k;
    if (band.origin[node] != unseen) continue;
    const Group group = group_of(k, around);
    const int by = copied_by(group, row, band.origin);
    if (by == itself) continue;
    const std::int64_t from = row + group.partner[by];
    bring(band.mueller + elements * from, by, true, band.mueller + elements * node);
    bring(band.variance + elements * from, by, false, band.variance + elements * node);
    band.count[node] = band.count[from];
    band.origin[node] = origin_of_copy(by);
  }
  close_circle(row, around, band);
}

void add_pair(const float* one, const float* other, const float* one_variance, const float* other_variance, int t,
              Disagreement& sum) {
  float brought[elements], spread[elements];
  bring(other, t, true, brought);
  float difference[elements], finite = 0;
  for (int e = 0; e < elements; ++e) {
    difference[e] = one[e] - brought[e];
    finite += 0 * difference[e];
  }
  if (finite != 0) return;  // NaN
  sum.pairs += 1;
  sum.m00 += one[0] + other[0];
  for (int e = 0; e < elements; ++e) sum.absolute[e] += std::fabs(difference[e]);
  if (one_variance == nullptr) return;
  bring(other_variance, t, false, spread);
  for (int e = 0; e < elements; ++e) {
    const double variance = static_cast<double>(one_variance[e]) + spread[e];
    if (!(variance > 0)) continue;
    sum.known[e] += 1;
    sum.squares[e] += static_cast<double>(difference[e]) * difference[e] / variance;
  }
}

// All but theta_h = 0, where all azimuths are one measurement.
template <typename Row>
void over_rows(const TableShape& shape, const Row& one_row) {
#pragma omp parallel for schedule(dynamic, 16)
  for (std::int64_t r = shape.differences; r < shape.halves * shape.differences; ++r)
    one_row(r * shape.azimuths, shape.azimuths - 1);
}

}  // namespace

void pool_partners(const TableShape& shape, const SymmetricBand& band) {
  over_rows(shape, [&](std::int64_t row, std::int64_t around) { pool_row(row, around, band); });
}

void copy_partners(const TableShape& shape, const SymmetricBand& band) {
  over_rows(shape, [&](std::int64_t row, std::int64_t around) { copy_row(row, around, band); });
}

void compare_partners(const TableShape& shape, const float* mueller, const float* variance, const std::uint8_t* origin,
                      Disagreement* out) {
  std::fill(out, out + 2 * shape.halves * shape.differences, Disagreement{});
  over_rows(shape, [&](std::int64_t row, std::int64_t around) {
    Disagreement* sums = out + 2 * (row / shape.azimuths);
    for (std::int64_t k = 0; k < around; ++k) {
      const Group group = group_of(k, around);
      for (const int t : {mirror, exchange}) {
        if (t >= group.size || group.partner[t] <= k) continue;
        const std::int64_t one = row + k, other = row + group.partner[t];
        if (origin[one] != measured || origin[other] != measured) continue;
        const float* spread = variance == nullptr ? nullptr : variance + elements * one;
        const float* other_spread = variance == nullptr ? nullptr : variance + elements * other;
        add_pair(mueller + elements * one, mueller + elements * other, spread, other_spread, t, sums[t - mirror]);
      }
    }
  });
}

}  // namespace pbrdf
