#include "pbrdf/gaps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace pbrdf {
namespace {

constexpr int elements = 16;
constexpr int most_terms = 5;
constexpr double pi = 3.14159265358979323846;
constexpr double no_node = std::numeric_limits<double>::infinity();

// A Gaussian is as wide as this share of the way to the known nodes, and is cut off at so many widths.
constexpr double share_of_way = 0.5, cut = 3;
// Azimuths beyond this many widths weigh too little to be worth reading.
constexpr double azimuth_cut = 2;
// Held against what the nodes do not determine; far from them a slope is worth less than a mean.
constexpr double ridge_between = 1e-6, ridge_beyond = 1e-2;
// An extrapolated logarithm stays this near the mean.
constexpr double farthest_logarithm = 3;

struct Neighbour {
  std::int64_t node;
  double weight;
  double terms[most_terms];
};

// What each neighbour counts for in the value of a local polynomial at its middle.
struct LocalFit {
  std::vector<Neighbour> neighbours;
  std::vector<double> shares;
  double total = 0;

  void clear() {
    neighbours.clear();
    total = 0;
  }

  void add(const Neighbour& one) {
    neighbours.push_back(one);
    total += one.weight;
  }

  // Weighted least squares by Cholesky. A term without a pivot is left out; the first is the constant.
  void solve(int count, double ridge) {
    double a[most_terms][most_terms] = {}, solution[most_terms];
    for (const Neighbour& one : neighbours)
      for (int i = 0; i < count; ++i)
        for (int j = 0; j <= i; ++j) a[i][j] += one.weight * one.terms[i] * one.terms[j];
    for (int i = 1; i < count; ++i) a[i][i] += ridge * total;
    for (int i = 0; i < count; ++i)
      for (int j = 0; j <= i; ++j) {
        for (int k = 0; k < j; ++k) a[i][j] -= a[i][k] * a[j][k];
        if (j < i)
          a[i][j] /= a[j][j];
        else
          a[i][i] = std::sqrt(std::max(a[i][i], 1e-9 * total));
      }
    for (int i = 0; i < count; ++i) {
      solution[i] = i == 0 ? 1 : 0;
      for (int k = 0; k < i; ++k) solution[i] -= a[i][k] * solution[k];
      solution[i] /= a[i][i];
    }
    for (int i = count - 1; i >= 0; --i) {
      for (int k = i + 1; k < count; ++k) solution[i] -= a[k][i] * solution[k];
      solution[i] /= a[i][i];
    }
    shares.resize(neighbours.size());
    for (std::size_t n = 0; n < neighbours.size(); ++n) {
      shares[n] = 0;
      for (int i = 0; i < count; ++i) shares[n] += solution[i] * neighbours[n].terms[i];
      shares[n] *= neighbours[n].weight;
    }
  }
};

struct Search {
  Grid grid;
  Gaps gaps;
  std::vector<double> steps, weights;  // of the azimuths from -beside() to beside(), in widths

  Search(const Grid& nodes, double azimuth_width, const Gaps& where) : grid(nodes), gaps(where) {
    const double step = 2 * pi / around() / azimuth_width;
    const int beside = static_cast<int>(azimuth_cut / step);
    for (int b = -beside; b <= beside; ++b) {
      steps.push_back(b * step);
      weights.push_back(std::exp(-0.5 * b * step * b * step));
    }
  }

  std::int64_t around() const { return grid.shape.azimuths - 1; }

  std::int64_t node(std::int64_t h, std::int64_t d, std::int64_t k) const {
    return (h * grid.shape.differences + d) * grid.shape.azimuths + (k % around() + around()) % around();
  }

  // The other half of a line; without a node opposite, there is none.
  bool has_opposite() const { return around() % 2 == 0; }
  std::int64_t opposite(std::int64_t k) const { return k + around() / 2; }

  // Steps along the line to the nearest known nodes below and above.
  void nearest_on_line(std::int64_t h, std::int64_t d, std::int64_t k, double& below, double& above) const {
    const double here = grid.theta_d[d];
    below = above = no_node;
    for (std::int64_t e = 0; e < grid.shape.differences; ++e) {
      const double there = grid.theta_d[e];
      if (gaps.known[node(h, e, k)])
        (there < here ? below : above) = std::min(there < here ? below : above, std::fabs(there - here));
      if (has_opposite() && there > 0 && gaps.known[node(h, e, opposite(k))]) below = std::min(below, there + here);
    }
  }

  double nearest_half(std::int64_t h, std::int64_t d, std::int64_t k) const {
    double nearest = no_node;
    for (std::int64_t g = 0; g < grid.shape.halves; ++g)
      if (gaps.known[node(g, d, k)]) nearest = std::min(nearest, std::fabs(grid.theta_h[g] - grid.theta_h[h]));
    return nearest;
  }

  // Adds the known nodes of one theta_h and theta_d around an azimuth; u and t are steps along theta_d and theta_h.
  template <typename Terms>
  void add_around(std::int64_t h, std::int64_t d, std::int64_t k, double u, double t, const Terms& terms,
                  LocalFit& fit) const {
    const std::int64_t count = static_cast<std::int64_t>(steps.size());
    const double weight = std::exp(-0.5 * (u * u + t * t));
    for (std::int64_t b = 0; b < count; ++b) {
      const std::int64_t at = node(h, d, k + b - count / 2);
      if (!gaps.known[at]) continue;
      Neighbour one{at, weight * weights[b], {}};
      if (terms(one, u, t, steps[b])) fit.add(one);
    }
  }

  template <typename Terms>
  void add_line(std::int64_t h, std::int64_t d, std::int64_t k, double width, const Terms& terms, LocalFit& fit) const {
    const double here = grid.theta_d[d];
    for (std::int64_t e = 0; e < grid.shape.differences; ++e) {
      const double u = (grid.theta_d[e] - here) / width, v = (-grid.theta_d[e] - here) / width;
      if (std::fabs(u) <= cut) add_around(h, e, k, u, 0, terms, fit);
      // theta_d = 0 is counted on one half
      if (has_opposite() && grid.theta_d[e] > 0 && std::fabs(v) <= cut) add_around(h, e, opposite(k), v, 0, terms, fit);
    }
  }

  // Calls body(h, d, k, scratch) for every target; ends of the circle become equal.
  template <typename Body>
  void each_target(const Body& body) const {
    const std::int64_t differences = grid.shape.differences;
#pragma omp parallel
    {
      LocalFit scratch;
#pragma omp for schedule(dynamic, 16)
      for (std::int64_t row = 0; row < grid.shape.halves * differences; ++row) {
        const std::int64_t h = row / differences, d = row % differences;
        for (std::int64_t k = 0; k < around(); ++k) {
          const std::int64_t at = node(h, d, k);
          if (gaps.target[at]) gaps.done[at] = body(h, d, k, scratch);
        }
        const std::int64_t first = node(h, d, 0), last = first + around();
        if (!gaps.target[last] || !gaps.done[first]) continue;
        std::copy_n(gaps.mueller + elements * first, elements, gaps.mueller + elements * last);
        gaps.done[last] = 1;
      }
    }
  }
};

// Of M00, where it is known and positive.
std::vector<float> logarithms_of(const TableShape& shape, const Gaps& gaps) {
  const std::int64_t nodes = shape.halves * shape.differences * shape.azimuths;
  std::vector<float> logarithms(nodes);
#pragma omp parallel for schedule(static)
  for (std::int64_t n = 0; n < nodes; ++n) {
    const float m00 = gaps.mueller[elements * n];
    logarithms[n] = gaps.known[n] && m00 > 0 ? std::log(m00) : 0.0f;
  }
  return logarithms;
}

bool cubic_terms(Neighbour& one, double u, double, double v) {
  const double terms[most_terms] = {1, v, u, u * u, u * u * u};
  std::copy_n(terms, most_terms, one.terms);
  return true;
}

}  // namespace

void fill_between(const Grid& grid, const Widths& widths, double farthest, const Gaps& gaps) {
  const Search search(grid, widths.azimuth, gaps);
  search.each_target([&](std::int64_t h, std::int64_t d, std::int64_t k, LocalFit& fit) {
    double below, above;
    search.nearest_on_line(h, d, k, below, above);
    if (!(std::max(below, above) < farthest)) return false;
    fit.clear();
    search.add_line(h, d, k, std::max(widths.narrowest, share_of_way * std::max(below, above)), cubic_terms, fit);
    fit.solve(most_terms, ridge_between);
    double sum[elements] = {};
    for (std::size_t n = 0; n < fit.shares.size(); ++n) {
      const float* matrix = gaps.mueller + elements * fit.neighbours[n].node;
      for (int e = 0; e < elements; ++e) sum[e] += fit.shares[n] * matrix[e];
    }
    std::copy_n(sum, elements, gaps.mueller + elements * search.node(h, d, k));
    return true;
  });
}

void fill_beyond(const Grid& grid, const Widths& widths, const Gaps& gaps) {
  const Search search(grid, widths.azimuth, gaps);
  const std::vector<float> logarithms = logarithms_of(grid.shape, gaps);
  const auto linear_terms = [&](Neighbour& one, double u, double t, double v) {
    const double terms[most_terms] = {1, v, u, t, 0};
    std::copy_n(terms, most_terms, one.terms);
    return gaps.mueller[elements * one.node] > 0;
  };
  search.each_target([&](std::int64_t h, std::int64_t d, std::int64_t k, LocalFit& fit) {
    double below, above;
    search.nearest_on_line(h, d, k, below, above);
    const double way = std::min({below, above, search.nearest_half(h, d, k)});
    if (way == no_node) return false;
    const double width = std::max(2 * widths.narrowest, share_of_way * way);
    fit.clear();
    search.add_line(h, d, k, width, linear_terms, fit);
    for (std::int64_t g = 0; g < grid.shape.halves; ++g) {
      const double t = (grid.theta_h[g] - grid.theta_h[h]) / width;
      if (g != h && std::fabs(t) <= cut) search.add_around(g, d, k, 0, t, linear_terms, fit);
    }
    if (!(fit.total > 0)) return false;
    fit.solve(4, ridge_beyond);
    double logarithm = 0, mean = 0, normalised[elements] = {};
    for (std::size_t n = 0; n < fit.shares.size(); ++n) {
      const float* matrix = gaps.mueller + elements * fit.neighbours[n].node;
      const double own = logarithms[fit.neighbours[n].node], share = fit.shares[n] / matrix[0];
      logarithm += fit.shares[n] * own;
      mean += fit.neighbours[n].weight / fit.total * own;
      for (int e = 0; e < elements; ++e) normalised[e] += share * matrix[e];
    }
    const double m00 = std::exp(std::clamp(logarithm, mean - farthest_logarithm, mean + farthest_logarithm));
    float* to = gaps.mueller + elements * search.node(h, d, k);
    to[0] = static_cast<float>(m00);
    for (int e = 1; e < elements; ++e) to[e] = static_cast<float>(m00 * normalised[e]);
    return true;
  });
}

}  // namespace pbrdf
