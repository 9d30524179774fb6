#include "pbrdf/turned_variance.hpp"

#include <algorithm>
#include <cmath>

#include "pbrdf/isa.hpp"
#include "pbrdf/weighted_solve.hpp"

namespace pbrdf {
namespace {

constexpr std::int64_t block_nodes = 8;

// Triangles of the outer products of a matrix's states, one state after the other.
std::vector<double> outer_products(const double* values, int states, int state_step, int element_step) {
  std::vector<double> products;
  products.reserve(static_cast<std::size_t>(states) * triangle);
  for (int n = 0; n < states; ++n)
    for (int i = 0; i < elements; ++i)
      for (int j = 0; j <= i; ++j)
        products.push_back(values[n * state_step + i * element_step] * values[n * state_step + j * element_step]);
  return products;
}

// Nodes of one vector: all that is told of their states.
template <typename V>
struct States {
  V* variance;  // of each state's rate
  V* moved;     // states x exposures: inverse variance that an exposure adds, per second
};

struct Turn {
  Turning turning;
  MeasurementMatrix matrix;
  FrameNoise noise;
  std::vector<double> of_rows;       // outer products of the rows of W
  std::vector<double> of_reduction;  // and of the columns of W+
  double* out;

  std::size_t scratch_bytes() const {
    return static_cast<std::size_t>(matrix.states) * (1 + noise.exposures.count) * sizeof(CacheLine);
  }

  template <int bytes>
  [[gnu::always_inline]] inline void run(std::int64_t first, std::int64_t last, void* scratch) const {
    using V = Vector<double, bytes>;
    constexpr std::int64_t lanes = bytes / static_cast<int>(sizeof(double));
    V* rows = static_cast<V*>(scratch);
    const States<V> states{rows, rows + matrix.states};
    const std::int64_t end = std::min(last * block_nodes, turning.count);
    for (std::int64_t node = first * block_nodes; node < end; node += lanes)
      turn(node, static_cast<int>(std::min(lanes, end - node)), states);
  }

  template <typename V>
  [[gnu::always_inline]] inline void turn(std::int64_t node, int count, const States<V>& states) const {
    constexpr int lanes = sizeof(V) / sizeof(double);
    V mueller[elements], own[elements], turns[4];
    for (int l = 0; l < lanes; ++l) {
      const std::int64_t from = node + std::min(l, count - 1);
      for (int e = 0; e < elements; ++e) {
        mueller[e][l] = turning.mueller[from * elements + e];
        own[e][l] = turning.variance[from * elements + e];
      }
      for (int t = 0; t < 4; ++t) turns[t][l] = turning.turns[from * 4 + t];
    }
    V covariance[triangle];
    const auto uneven = spread(mueller, states);
    of_plain(states, covariance);
    bool any = false;
    for (int l = 0; l < lanes; ++l) any |= uneven[l] != 0;
    if (any) {
      V weighted[triangle];
      of_weighted(states, weighted);
      for (int k = 0; k < triangle; ++k) covariance[k] = uneven ? weighted[k] : covariance[k];
    }
    V turned[elements];
    quadratic_forms(covariance, own, turns, turned);
    for (int l = 0; l < count; ++l)
      for (int e = 0; e < elements; ++e) out[(node + l) * elements + e] = turned[e][l];
  }

  // What the states of nodes vary by; tells in which nodes they differ in exposures.
  template <typename V>
  [[gnu::always_inline]] inline auto spread(const V (&mueller)[elements], const States<V>& states) const {
    const Exposures& exposures = noise.exposures;
    const double read_variance = exposures.noise.read_noise_dn * exposures.noise.read_noise_dn;
    const V none = V{};
    V first_used = none;
    auto uneven = none != none;
    for (int n = 0; n < matrix.states; ++n) {
      V rate = none, sum = none, used = none;
      for (int e = 0; e < elements; ++e) rate += matrix.measurement[n * elements + e] * mueller[e];
      const V lit = rate > none ? rate : none;
      for (int e = 0; e < exposures.count; ++e) {
        const double seconds = exposures.seconds[e];
        const V certain = seconds * seconds / (read_variance + lit * (seconds * exposures.noise.dn_per_electron));
        // the shortest is all there is of a state that would saturate in it
        const auto usable = e == 0 ? none == none : lit * seconds < noise.saturation + none;
        const V counted = usable ? certain : none;
        sum += counted;
        used += usable ? none + 1.0 : none;
        states.moved[n * exposures.count + e] = counted / seconds;
      }
      states.variance[n] = 1.0 / sum;
      if (n == 0) first_used = used;
      uneven |= used != first_used;
    }
    return uneven;
  }

  // W+ S W+' and the noise of the dark frames.
  template <typename V>
  [[gnu::always_inline]] inline void of_plain(const States<V>& states, V (&covariance)[triangle]) const {
    for (V& entry : covariance) entry = V{};
    for (int n = 0; n < matrix.states; ++n)
      for (int k = 0; k < triangle; ++k) covariance[k] += of_reduction[n * triangle + k] * states.variance[n];
    for (int e = 0; e < dark_frames(); ++e) {
      V shift[elements] = {};
      for (int n = 0; n < matrix.states; ++n) {
        const V moved = states.moved[n * noise.exposures.count + e] * states.variance[n];
        for (int k = 0; k < elements; ++k) shift[k] += matrix.reduction[k * matrix.states + n] * moved;
      }
      add_outer(shift, covariance);
    }
  }

  // (W' S^-1 W)^-1 and the noise of the dark frames.
  template <typename V>
  [[gnu::always_inline]] inline void of_weighted(const States<V>& states, V (&covariance)[triangle]) const {
    for (V& entry : covariance) entry = V{};
    for (int n = 0; n < matrix.states; ++n) {
      const V weight = 1.0 / states.variance[n];
      for (int k = 0; k < triangle; ++k) covariance[k] += of_rows[n * triangle + k] * weight;
    }
    invert(covariance);
    V solved[triangle];
    std::copy_n(covariance, triangle, solved);
    for (int e = 0; e < dark_frames(); ++e) {
      V right[elements] = {}, shift[elements];
      for (int n = 0; n < matrix.states; ++n)
        for (int k = 0; k < elements; ++k)
          right[k] += matrix.measurement[n * elements + k] * states.moved[n * noise.exposures.count + e];
      apply_symmetric<V>(solved, right, shift);
      add_outer(shift, covariance);
    }
  }

  int dark_frames() const { return noise.dark_variance > 0.0 ? noise.exposures.count : 0; }

  template <typename V>
  [[gnu::always_inline]] inline void add_outer(const V (&shift)[elements], V (&covariance)[triangle]) const {
    for (int i = 0; i < elements; ++i)
      for (int j = 0; j <= i; ++j) covariance[at(i, j)] += shift[i] * shift[j] * noise.dark_variance;
  }

  // Diagonal of T C T', T = R(out) x R(in) as it acts on a matrix written as a vector, after C's diagonal has been
  // scaled to `own`.
  template <typename V>
  [[gnu::always_inline]] inline static void quadratic_forms(const V (&covariance)[triangle], const V (&own)[elements],
                                                            const V (&turns)[4], V (&turned)[elements]) {
    V scale[elements];
    for (int e = 0; e < elements; ++e) {
      const V square = own[e] / covariance[at(e, e)];
      for (std::size_t l = 0; l < sizeof(V) / sizeof(double); ++l) scale[e][l] = std::sqrt(square[l]);
    }
    const V one = V{} + 1.0, none = V{};
    // of row 1: cos and sin on rows 1 and 2; of row 2: -sin and cos
    const V in[4][2] = {{one, none}, {turns[0], turns[1]}, {-turns[1], turns[0]}, {one, none}};
    const V out[4][2] = {{one, none}, {turns[2], turns[3]}, {-turns[3], turns[2]}, {one, none}};
    constexpr int partner[4][2] = {{0, 0}, {1, 2}, {1, 2}, {3, 3}};
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) {
        V factor[4];
        int element[4];
        for (int a = 0; a < 2; ++a)
          for (int b = 0; b < 2; ++b) {
            element[2 * a + b] = 4 * partner[row][a] + partner[column][b];
            factor[2 * a + b] = out[row][a] * in[column][b] * scale[element[2 * a + b]];
          }
        V sum = none;
        for (int a = 0; a < 4; ++a)
          for (int b = 0; b < 4; ++b)
            sum += factor[a] * factor[b] *
                   covariance[at(std::max(element[a], element[b]), std::min(element[a], element[b]))];
        turned[4 * row + column] = sum;
      }
  }
};

}  // namespace

void turn_variances(const Turning& turning, const MeasurementMatrix& matrix, const FrameNoise& noise, double* out) {
  const Turn body{turning,
                  matrix,
                  noise,
                  outer_products(matrix.measurement, matrix.states, elements, 1),
                  outer_products(matrix.reduction, matrix.states, 1, matrix.states),
                  out};
  run_blocks(body, (turning.count + block_nodes - 1) / block_nodes);
}

}  // namespace pbrdf
