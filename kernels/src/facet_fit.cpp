#include "pbrdf/facet_fit.hpp"

#include <algorithm>
#include <vector>

#include "pbrdf/isa.hpp"

namespace pbrdf {
namespace {

// Sums run within a chunk, then over the chunks in order: the number of threads does not enter.
constexpr std::int64_t blocks_per_chunk = 64;
// Below this, waking threads costs more than they save, much more where other jobs keep the cores busy.
constexpr std::int64_t worth_threads = 1 << 15;

// Nodes that no cache holds are asked of the memory this many blocks before they are computed.
constexpr std::int64_t blocks_ahead = 4;
constexpr std::int64_t cached_bytes = 16 << 20;

template <class Block>
[[gnu::always_inline]] inline void fetch(const Block& block) {
#if defined(__GNUC__)
  const char* bytes = reinterpret_cast<const char*>(&block);
  for (std::size_t line = 0; line < sizeof(Block); line += 64) __builtin_prefetch(bytes + line);
#endif
}

// Where `Elements` lie in a row-major matrix, and the four that are none of them.
constexpr int element_places[element_rows] = {0, 1, 2, 4, 5, 6, 8, 9, 10, 11, 14, 15};
constexpr int rest_places[4] = {3, 7, 12, 13};

template <class T>
[[gnu::always_inline]] inline FacetGeometry<T> lane(const GeometryBlock<T>& g, int l) {
  return {g.cos_i[l],         g.cos_o[l],       g.sin2_h[l],        g.cos_d[l],
          g.turn_i_cosine[l], g.turn_i_sine[l], g.turn_o_cosine[l], g.turn_o_sine[l]};
}

template <class T>
[[gnu::always_inline]] inline Elements<T> lane(const ElementRows& rows, int l) {
  return {T(rows[0][l]), T(rows[1][l]), T(rows[2][l]), T(rows[3][l]), T(rows[4][l]),  T(rows[5][l]),
          T(rows[6][l]), T(rows[7][l]), T(rows[8][l]), T(rows[9][l]), T(rows[10][l]), T(rows[11][l])};
}

template <class Function, class T, class... More>
[[gnu::always_inline]] inline Elements<T> each(Function f, const Elements<T>& a, const More&... b) {
  return {f(a.m00, b.m00...), f(a.m01, b.m01...), f(a.m02, b.m02...), f(a.m10, b.m10...),
          f(a.m11, b.m11...), f(a.m12, b.m12...), f(a.m20, b.m20...), f(a.m21, b.m21...),
          f(a.m22, b.m22...), f(a.m23, b.m23...), f(a.m32, b.m32...), f(a.m33, b.m33...)};
}

template <class T>
[[gnu::always_inline]] inline T product(const Elements<T>& a, const Elements<T>& b) {
  return ((a.m00 * b.m00 + a.m01 * b.m01) + (a.m02 * b.m02 + a.m10 * b.m10)) +
         ((a.m11 * b.m11 + a.m12 * b.m12) + (a.m20 * b.m20 + a.m21 * b.m21)) +
         ((a.m22 * b.m22 + a.m23 * b.m23) + (a.m32 * b.m32 + a.m33 * b.m33));
}

template <class T>
[[gnu::always_inline]] inline T sum(const Elements<T>& a) {
  return ((a.m00 + a.m01) + (a.m02 + a.m10)) + ((a.m11 + a.m12) + (a.m20 + a.m21)) +
         ((a.m22 + a.m23) + (a.m32 + a.m33));
}

// Functors, not lambdas: one that captures keeps a loop over lanes from being vectorised.
struct Residual {
  template <class T>
  [[gnu::always_inline]] inline T operator()(T specular, T diffuse, T measured) const {
    return specular + (diffuse - measured);
  }
};

// A struct copied whole keeps the loop from being vectorised, too.
struct Same {
  template <class T>
  [[gnu::always_inline]] inline T operator()(T x) const {
    return x;
  }
};

struct Product {
  template <class T>
  [[gnu::always_inline]] inline T operator()(T x, T y) const {
    return x * y;
  }
};

template <class T>
struct Root {
  T epsilon_squared;
  [[gnu::always_inline]] inline T operator()(T x) const { return std::sqrt(std::sqrt(x * x + epsilon_squared)); }
};

// Twice the slope of the root.
struct RootSlope {
  template <class T>
  [[gnu::always_inline]] inline T operator()(T x, T root) const {
    return x / (root * root * root);
  }
};

// Cost of a node and its slopes by the elements of the model's matrix, `factor` times `slope`: the slopes of the cost
// by the parameters need not wait for the factor.
template <class T>
struct NodeCost {
  T cost;
  T factor;
  Elements<T> slope;
};

template <class T>
[[gnu::always_inline]] inline NodeCost<T> node_cost(const TableBlock<CostKind::norms>& t, int l,
                                                    const Elements<T>& residual, T epsilon_squared) {
  const T weight = t.weight[l];
  const T norm = std::sqrt(product(residual, residual) + (T(t.rest[l]) + epsilon_squared));
  return {weight * norm, weight / norm, each(Same{}, residual)};
}

template <class T>
[[gnu::always_inline]] inline NodeCost<T> node_cost(const TableBlock<CostKind::roots>& t, int l,
                                                    const Elements<T>& residual, T epsilon_squared) {
  const T weight = t.weight[l];
  const Root<T> root{epsilon_squared};
  const Elements<T> roots = each(root, residual);
  const T rest = (root(t.rest[0][l]) + root(t.rest[1][l])) + (root(t.rest[2][l]) + root(t.rest[3][l]));
  return {weight * (sum(roots) + rest), T(0.5) * weight, each(RootSlope{}, residual, roots)};
}

template <class T>
[[gnu::always_inline]] inline NodeCost<T> node_cost(const TableBlock<CostKind::squares>& t, int l,
                                                    const Elements<T>& residual, T) {
  const Elements<T> weighted = each(Product{}, lane<T>(t.weight, l), residual);
  return {product(weighted, residual) + T(t.rest[l]), T(2), weighted};
}

// Sums of each lane over the blocks of a chunk.
struct LaneSums {
  double cost[fit_lanes] = {};
  double roughness[fit_lanes] = {};
  double eta[fit_lanes] = {};
  double kappa[fit_lanes] = {};
  double specular[fit_lanes] = {};
  double albedo[fit_lanes] = {};
};

template <class T, int i>
struct BandParameters {
  FacetParameters<T, 1, i> values;
  T epsilon_squared;
};

// What all bands have in common in 16 nodes, each with its slope by the roughness.
template <class T>
struct SharedRows {
  T lobe[fit_lanes], lobe_slope[fit_lanes];
  T reflectance[fit_lanes], reflectance_slope[fit_lanes];  // of the grooved metal, where the model is weighted by it
};

template <class Model, class T>
[[gnu::always_inline]] inline void share(const GeometryBlock<T>& geometry, Dual<T, 1> roughness,
                                         const GroovedMetal<T, 1>& metal, SharedRows<T>& shared) {
  if constexpr (Model::weighted)
    grooved_metal_reflectance<fit_lanes>(metal, geometry.cos_i, shared.reflectance, shared.reflectance_slope);
#pragma GCC ivdep
  for (int l = 0; l < fit_lanes; ++l) {
    const Dual<T, 1> lobe = Model::Lobe::lobe(lane(geometry, l), roughness);
    shared.lobe[l] = lobe.value;
    shared.lobe_slope[l] = lobe.slope.first;
  }
}

template <class Model, bool complex, class T, CostKind kind, int i>
[[gnu::always_inline]] inline void add_block(const GeometryBlock<T>& geometry, const SharedRows<T>& shared,
                                             const TableBlock<kind>& table, const BandParameters<T, i>& parameters,
                                             LaneSums& sums) {
  const FacetParameters<T, 1, i> p = parameters.values;
  const T epsilon_squared = parameters.epsilon_squared;
#pragma GCC ivdep
  for (int l = 0; l < fit_lanes; ++l) {
    const FacetGeometry<T> g = lane(geometry, l);
    const SpecularTerm<T, 1, i> specular{{shared.lobe[l], {shared.lobe_slope[l]}}, mirror<complex>(g, p)};
    Dual<T, 1> reflected{};
    if constexpr (Model::weighted) reflected = {shared.reflectance[l], {shared.reflectance_slope[l]}};
    const auto diffuse = Model::template diffuse<complex>(g, p, reflected);
    const Elements<T> residual =
        each(Residual{}, specular.elements(p.specular), diffuse.elements(p.diffuse), lane<T>(table.mueller, l));
    const NodeCost<T> node = node_cost(table, l, residual, epsilon_squared);
    const TermSlope<T, 1, i> s = specular.along(node.slope), d = diffuse.along(node.slope);
    sums.cost[l] += node.cost;
    sums.roughness[l] +=
        node.factor * (p.specular * s.by_roughness.slope.first + p.diffuse * d.by_roughness.slope.first);
    sums.eta[l] += node.factor * (p.specular * s.by_index.slope.first + p.diffuse * d.by_index.slope.first);
    if constexpr (complex)
      sums.kappa[l] += node.factor * (p.specular * s.by_index.slope.second + p.diffuse * d.by_index.slope.second);
    sums.specular[l] += node.factor * s.by_index.value;
    sums.albedo[l] += node.factor * d.by_index.value;
  }
}

double total(const double (&lanes)[fit_lanes]) {
  double sum = 0.0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

CostGradient totals(const LaneSums& sums) {
  return {total(sums.cost),
          {total(sums.roughness), total(sums.eta), total(sums.kappa), total(sums.specular), total(sums.albedo) / pi}};
}

template <bool complex, class T>
BandParameters<T, complex ? 2 : 1> band_parameters(const FacetMaterial& m, double epsilon) {
  BandParameters<T, complex ? 2 : 1> p{};
  p.values.roughness = {T(m.roughness), {T(1)}};
  p.values.eta.value = T(m.eta);
  p.values.eta.slope.first = T(1);
  if constexpr (complex) {
    p.values.kappa.value = T(m.kappa);
    p.values.kappa.slope.second = T(1);
  }
  p.values.specular = T(m.specular);
  p.values.diffuse = T(m.albedo / pi);
  p.epsilon_squared = T(epsilon * epsilon);
  return p;
}

void add(const CostGradient& part, CostGradient& sum) {
  sum.cost += part.cost;
  for (int p = 0; p < 5; ++p) sum.gradient[p] += part.gradient[p];
}

// Rounding the parameters to T would make the cost a staircase: it is led on to where they are, by its gradient.
template <class T>
void make_up_for_rounding(const FacetMaterial& m, CostGradient& sum) {
  const double exact[5] = {m.roughness, m.eta, m.kappa, m.specular, m.albedo / pi};
  const double slopes[5] = {sum.gradient[0], sum.gradient[1], sum.gradient[2], sum.gradient[3], sum.gradient[4] * pi};
  for (int p = 0; p < 5; ++p) sum.cost += slopes[p] * (exact[p] - static_cast<double>(T(exact[p])));
}

template <class Model, bool complex, class T, CostKind kind>
std::vector<CostGradient> sum_chunks(const GeometryBlock<T>* geometry, std::int64_t blocks,
                                     const std::vector<FitBand<kind>>& bands) {
  const std::size_t count = bands.size();
  std::vector<BandParameters<T, complex ? 2 : 1>> parameters;
  for (const FitBand<kind>& band : bands)
    parameters.push_back(band_parameters<complex, T>(band.material, band.epsilon));
  const Dual<T, 1> roughness = parameters.front().values.roughness;
  GroovedMetal<T, 1> metal{};
  if constexpr (Model::weighted) metal = grooved_metal(roughness);

  const bool from_memory =
      blocks * static_cast<std::int64_t>(sizeof(GeometryBlock<T>) + count * sizeof(TableBlock<kind>)) > cached_bytes;
  const std::int64_t chunks = (blocks + blocks_per_chunk - 1) / blocks_per_chunk;
  std::vector<CostGradient> parts(chunks * count);
#pragma omp parallel for schedule(dynamic) if (blocks * fit_lanes * static_cast<std::int64_t>(count) >= worth_threads)
  for (std::int64_t c = 0; c < chunks; ++c) {
    const std::int64_t first = c * blocks_per_chunk, last = std::min(first + blocks_per_chunk, blocks);
    std::vector<LaneSums> sums(count);
    in_version([&]() __attribute__((always_inline)) {
      for (std::int64_t b = first; b < last; ++b) {
        if (from_memory) {
          const std::int64_t next = std::min(b + blocks_ahead, blocks - 1);
          fetch(geometry[next]);
          for (const FitBand<kind>& band : bands) fetch(band.table[next]);
        }
        SharedRows<T> shared;
        share<Model>(geometry[b], roughness, metal, shared);
        for (std::size_t k = 0; k < count; ++k)
          add_block<Model, complex>(geometry[b], shared, bands[k].table[b], parameters[k], sums[k]);
      }
    });
    std::transform(sums.begin(), sums.end(), parts.begin() + c * count, totals);
  }
  std::vector<CostGradient> sums(count);
  for (std::size_t part = 0; part < parts.size(); ++part) add(parts[part], sums[part % count]);
  for (std::size_t k = 0; k < count; ++k) make_up_for_rounding<T>(bands[k].material, sums[k]);
  return sums;
}

// The table's weight of one element, or of the node.
template <CostKind kind>
float weight_of(const float* weight, std::int64_t node, int element) {
  return kind == CostKind::squares ? weight[16 * node + element] : weight[node];
}

template <CostKind kind>
void pack_node(const float* mueller, const float* weight, std::int64_t node, int l, TableBlock<kind>& block) {
  const auto value = [&](int place) {
    return weight_of<kind>(weight, node, place) != 0.0f ? mueller[16 * node + place] : 0.0f;
  };
  for (int e = 0; e < element_rows; ++e) block.mueller[e][l] = value(element_places[e]);
  if constexpr (kind == CostKind::roots)
    for (int e = 0; e < 4; ++e) block.rest[e][l] = value(rest_places[e]);
  else
    for (const int place : rest_places)
      block.rest[l] += square(value(place)) * (kind == CostKind::squares ? weight_of<kind>(weight, node, place) : 1.0f);
  if constexpr (kind == CostKind::squares)
    for (int e = 0; e < element_rows; ++e) block.weight[e][l] = weight[16 * node + element_places[e]];
  else
    block.weight[l] = weight[node];
}

}  // namespace

template <class T>
void precompute_geometry(const double* light, const double* camera, std::int64_t n, GeometryBlock<T>* blocks) {
#pragma omp parallel for schedule(static) if (n >= worth_threads)
  for (std::int64_t b = 0; b < fit_blocks(n); ++b) {
    GeometryBlock<T>& block = blocks[b];
    for (int l = 0; l < fit_lanes; ++l) {
      const std::int64_t i = std::min(b * fit_lanes + l, n - 1);
      const FacetGeometry<double> g = facet_geometry(light + 3 * i, camera + 3 * i);
      block.cos_i[l] = static_cast<T>(g.cos_i);
      block.cos_o[l] = static_cast<T>(g.cos_o);
      block.sin2_h[l] = static_cast<T>(g.sin2_h);
      block.cos_d[l] = static_cast<T>(g.cos_d);
      block.turn_i_cosine[l] = static_cast<T>(g.turn_i_cosine);
      block.turn_i_sine[l] = static_cast<T>(g.turn_i_sine);
      block.turn_o_cosine[l] = static_cast<T>(g.turn_o_cosine);
      block.turn_o_sine[l] = static_cast<T>(g.turn_o_sine);
    }
  }
}

template <CostKind kind>
void pack_table(const float* mueller, const float* weight, std::int64_t n, TableBlock<kind>* blocks) {
#pragma omp parallel for schedule(static) if (n >= worth_threads)
  for (std::int64_t b = 0; b < fit_blocks(n); ++b) {
    blocks[b] = {};
    for (int l = 0; l < fit_lanes && b * fit_lanes + l < n; ++l)
      pack_node<kind>(mueller, weight, b * fit_lanes + l, l, blocks[b]);
  }
}

template <class T, CostKind kind>
std::vector<CostGradient> cost_gradient(FacetModel model, bool complex, const GeometryBlock<T>* geometry,
                                        std::int64_t blocks, const std::vector<FitBand<kind>>& bands) {
  if (bands.empty()) return {};
  return with_model(model, [&](auto type) {
    using Model = decltype(type);
    return complex ? sum_chunks<Model, true>(geometry, blocks, bands)
                   : sum_chunks<Model, false>(geometry, blocks, bands);
  });
}

template void precompute_geometry(const double*, const double*, std::int64_t, GeometryBlock<float>*);
template void precompute_geometry(const double*, const double*, std::int64_t, GeometryBlock<double>*);

#define PBRDF_COST(kind)                                                                                         \
  template void pack_table(const float*, const float*, std::int64_t, TableBlock<CostKind::kind>*);               \
  template std::vector<CostGradient> cost_gradient(FacetModel, bool, const GeometryBlock<float>*, std::int64_t,  \
                                                   const std::vector<FitBand<CostKind::kind>>&);                 \
  template std::vector<CostGradient> cost_gradient(FacetModel, bool, const GeometryBlock<double>*, std::int64_t, \
                                                   const std::vector<FitBand<CostKind::kind>>&);
PBRDF_COST(norms)
PBRDF_COST(roots)
PBRDF_COST(squares)
#undef PBRDF_COST

}  // namespace pbrdf
