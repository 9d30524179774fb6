#include <algorithm>
#include <vector>

#include "pbrdf/facet_fit.hpp"
#include "pbrdf/isa.hpp"

namespace pbrdf {
namespace {

constexpr std::int64_t directions_per_chunk = 1024;
// Sums run within a chunk, then over the chunks in order: the number of threads does not enter.
constexpr std::int64_t blocks_per_chunk = 64;
// Below this, waking threads costs more than they save, much more where other jobs keep the cores busy.
constexpr std::int64_t worth_threads = 1 << 16;

using detail::square;

// T+ and T- of one interface with their derivatives by the index.
struct TransmissionSlope {
  double mean, difference, mean_slope, difference_slope;
};

[[gnu::always_inline]] inline TransmissionSlope transmission_slope(double cosine, double sine_squared, double eta) {
  const double w = std::sqrt(eta * eta - sine_squared);
  const double w_slope = eta / w;
  const double sum = 1.0 / (cosine + w);
  const double u = 1.0 / (cosine * w + sine_squared);
  const double ts = 4.0 * cosine * w * sum * sum;
  const double ts_slope = 4.0 * cosine * (cosine - w) * sum * sum * sum * w_slope;
  const double ratio = square(eta * u);
  const double ratio_slope = 2.0 * eta * u * u * (1.0 - eta * u * cosine * w_slope);
  const double tp = ts * ratio;
  const double tp_slope = ts_slope * ratio + ts * ratio_slope;
  return {0.5 * (ts + tp), 0.5 * (ts - tp), 0.5 * (ts_slope + tp_slope), 0.5 * (ts_slope - tp_slope)};
}

// Sums of one lane over the blocks of a chunk.
struct Lanes {
  double cost[fit_lanes] = {};
  double alpha[fit_lanes] = {};
  double eta[fit_lanes] = {};
  double specular[fit_lanes] = {};
  double albedo[fit_lanes] = {};
};

[[gnu::always_inline]] inline void add_block(const GeometryBlock& g, const TableBlock& t, double alpha, double eta,
                                             double specular, double albedo, double epsilon_squared, Lanes& sums) {
  const double a2 = alpha * alpha;
  const double diffuse = albedo / pi;
#pragma omp simd
  for (int l = 0; l < fit_lanes; ++l) {
    const double root_i = std::sqrt(square(g.cos_i[l]) + a2 * g.sin2_i[l]);
    const double root_o = std::sqrt(square(g.cos_o[l]) + a2 * g.sin2_o[l]);
    const double mask_i = 1.0 / (g.cos_i[l] + root_i);
    const double mask_o = 1.0 / (g.cos_o[l] + root_o);
    const double q = 1.0 / (a2 * g.cos2_h[l] + g.sin2_h[l]);
    const double lobe = a2 * q * q * mask_i * mask_o / pi;
    const double lobe_slope =
        lobe *
        (2.0 / alpha - alpha * (4.0 * g.cos2_h[l] * q + g.sin2_i[l] * mask_i / root_i + g.sin2_o[l] * mask_o / root_o));

    const double cd = g.cos_d[l], sd2 = g.sin2_d[l];
    const double w = std::sqrt(eta * eta - sd2);
    const double w_slope = eta / w;
    const double sum = 1.0 / (cd + w);
    const double u = 1.0 / (sd2 + cd * w);
    const double rs = (cd - w) * sum;
    const double rs_slope = -2.0 * cd * sum * sum * w_slope;
    const double ratio = (sd2 - cd * w) * u;
    const double rp = rs * ratio;
    const double rp_slope = rs_slope * ratio - 2.0 * rs * cd * sd2 * u * u * w_slope;
    const double even = 0.5 * (rs * rs + rp * rp), even_slope = rs * rs_slope + rp * rp_slope;
    const double odd = 0.5 * (rs * rs - rp * rp), odd_slope = rs * rs_slope - rp * rp_slope;
    const double cross = rs * rp, cross_slope = rs_slope * rp + rs * rp_slope;

    const TransmissionSlope in = transmission_slope(g.cos_i[l], g.sin2_i[l], eta);
    const TransmissionSlope out = transmission_slope(g.cos_o[l], g.sin2_o[l], eta);
    const double in1 = in.difference * g.turn_i_cosine[l], in1_slope = in.difference_slope * g.turn_i_cosine[l];
    const double in2 = -in.difference * g.turn_i_sine[l], in2_slope = -in.difference_slope * g.turn_i_sine[l];
    const double out1 = out.difference * g.turn_o_cosine[l], out1_slope = out.difference_slope * g.turn_o_cosine[l];
    const double out2 = -out.difference * g.turn_o_sine[l], out2_slope = -out.difference_slope * g.turn_o_sine[l];

    const double weight = specular * lobe;
    const double r00 = weight * even + diffuse * out.mean * in.mean - t.mueller[0][l];
    const double r01 = weight * odd + diffuse * out.mean * in1 - t.mueller[1][l];
    const double r02 = diffuse * out.mean * in2 - t.mueller[2][l];
    const double r10 = weight * odd + diffuse * out1 * in.mean - t.mueller[4][l];
    const double r11 = weight * even + diffuse * out1 * in1 - t.mueller[5][l];
    const double r12 = diffuse * out1 * in2 - t.mueller[6][l];
    const double r20 = diffuse * out2 * in.mean - t.mueller[8][l];
    const double r21 = diffuse * out2 * in1 - t.mueller[9][l];
    const double r22 = weight * cross + diffuse * out2 * in2 - t.mueller[10][l];
    const double r33 = weight * cross - t.mueller[15][l];
    // The model has zeros in the rest of the last row and column.
    const double rest = square(t.mueller[3][l]) + square(t.mueller[7][l]) + square(t.mueller[11][l]) +
                        square(t.mueller[12][l]) + square(t.mueller[13][l]) + square(t.mueller[14][l]);
    const double squares = square(r00) + square(r01) + square(r02) + square(r10) + square(r11) + square(r12) +
                           square(r20) + square(r21) + square(r22) + square(r33) + rest;
    const double norm = std::sqrt(squares + epsilon_squared);
    const double scale = t.weight[l] / norm;

    const double on_fresnel = even * (r00 + r11) + odd * (r01 + r10) + cross * (r22 + r33);
    const double on_fresnel_slope = even_slope * (r00 + r11) + odd_slope * (r01 + r10) + cross_slope * (r22 + r33);
    // Residual applied to the incoming and to the outgoing Stokes vector of the diffuse term.
    const double to_out0 = r00 * in.mean + r01 * in1 + r02 * in2;
    const double to_out1 = r10 * in.mean + r11 * in1 + r12 * in2;
    const double to_out2 = r20 * in.mean + r21 * in1 + r22 * in2;
    const double to_in0 = out.mean * r00 + out1 * r10 + out2 * r20;
    const double to_in1 = out.mean * r01 + out1 * r11 + out2 * r21;
    const double to_in2 = out.mean * r02 + out1 * r12 + out2 * r22;
    const double on_diffuse = out.mean * to_out0 + out1 * to_out1 + out2 * to_out2;
    const double on_diffuse_slope = out.mean_slope * to_out0 + out1_slope * to_out1 + out2_slope * to_out2 +
                                    to_in0 * in.mean_slope + to_in1 * in1_slope + to_in2 * in2_slope;

    sums.cost[l] += t.weight[l] * norm;
    sums.alpha[l] += scale * specular * lobe_slope * on_fresnel;
    sums.eta[l] += scale * (weight * on_fresnel_slope + diffuse * on_diffuse_slope);
    sums.specular[l] += scale * lobe * on_fresnel;
    sums.albedo[l] += scale * on_diffuse / pi;
  }
}

double total(const double (&lanes)[fit_lanes]) {
  double sum = 0.0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

[[gnu::always_inline]] inline CostGradient chunk_cost(const GeometryBlock* geometry, const TableBlock* table,
                                                      std::int64_t blocks, const FacetMaterial& material,
                                                      double epsilon) {
  Lanes sums;
  for (std::int64_t b = 0; b < blocks; ++b)
    add_block(geometry[b], table[b], material.alpha, material.eta, material.specular, material.albedo,
              epsilon * epsilon, sums);
  return {total(sums.cost), {total(sums.alpha), total(sums.eta), total(sums.specular), total(sums.albedo)}};
}

}  // namespace

void evaluate_facets(const double* light, const double* camera, std::int64_t n, const FacetMaterial& material,
                     double* mueller) {
#pragma omp parallel for schedule(static, directions_per_chunk) if (n >= worth_threads)
  for (std::int64_t i = 0; i < n; ++i) facet_mueller(light + 3 * i, camera + 3 * i, material, mueller + 16 * i);
}

void precompute_geometry(const double* light, const double* camera, std::int64_t n, GeometryBlock* blocks) {
#pragma omp parallel for schedule(static) if (n >= worth_threads)
  for (std::int64_t b = 0; b < fit_blocks(n); ++b) {
    GeometryBlock& block = blocks[b];
    for (int l = 0; l < fit_lanes; ++l) {
      const std::int64_t i = b * fit_lanes + l < n ? b * fit_lanes + l : b * fit_lanes;
      const FacetGeometry g = facet_geometry(light + 3 * i, camera + 3 * i);
      block.cos_i[l] = g.cos_i;
      block.sin2_i[l] = g.sin2_i;
      block.cos_o[l] = g.cos_o;
      block.sin2_o[l] = g.sin2_o;
      block.cos2_h[l] = g.cos2_h;
      block.sin2_h[l] = g.sin2_h;
      block.cos_d[l] = g.cos_d;
      block.sin2_d[l] = g.sin2_d;
      block.turn_i_cosine[l] = g.turn_i.cosine;
      block.turn_i_sine[l] = g.turn_i.sine;
      block.turn_o_cosine[l] = g.turn_o.cosine;
      block.turn_o_sine[l] = g.turn_o.sine;
    }
  }
}

void pack_table(const float* mueller, const float* weight, std::int64_t n, TableBlock* blocks) {
#pragma omp parallel for schedule(static) if (n >= worth_threads)
  for (std::int64_t b = 0; b < fit_blocks(n); ++b) {
    TableBlock& block = blocks[b];
    for (int l = 0; l < fit_lanes; ++l) {
      const std::int64_t i = b * fit_lanes + l;
      const bool counted = i < n && weight[i] != 0.0f;
      block.weight[l] = counted ? weight[i] : 0.0f;
      for (int e = 0; e < 16; ++e) block.mueller[e][l] = counted ? mueller[16 * i + e] : 0.0f;
    }
  }
}

CostGradient cost_gradient(const GeometryBlock* geometry, const TableBlock* table, std::int64_t blocks,
                           const FacetMaterial& material, double epsilon) {
  const std::int64_t chunks = (blocks + blocks_per_chunk - 1) / blocks_per_chunk;
  std::vector<CostGradient> parts(chunks);
#pragma omp parallel for schedule(static) if (blocks * fit_lanes >= worth_threads)
  for (std::int64_t c = 0; c < chunks; ++c) {
    const std::int64_t first = c * blocks_per_chunk;
    const std::int64_t count = std::min(blocks_per_chunk, blocks - first);
    in_version([&]() __attribute__((always_inline)) {
      parts[c] = chunk_cost(geometry + first, table + first, count, material, epsilon);
    });
  }
  CostGradient sum{};
  for (const CostGradient& part : parts) {
    sum.cost += part.cost;
    for (int p = 0; p < 4; ++p) sum.gradient[p] += part.gradient[p];
  }
  return sum;
}

}  // namespace pbrdf
