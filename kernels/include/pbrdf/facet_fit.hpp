// What a fit of the microfacet model to a table needs: the model over many directions, and its cost with the gradient.
#pragma once

#include <cstdint>

#include "pbrdf/facet.hpp"

namespace pbrdf {

// Nodes travel in blocks of 16, each quantity a row of 16 lanes, so that a loop over the lanes vectorises.
inline constexpr int fit_lanes = 16;

// FacetGeometry of 16 nodes. Lanes beyond the last node repeat the block's first one.
struct GeometryBlock {
  double cos_i[fit_lanes], sin2_i[fit_lanes];
  double cos_o[fit_lanes], sin2_o[fit_lanes];
  double cos2_h[fit_lanes], sin2_h[fit_lanes];
  double cos_d[fit_lanes], sin2_d[fit_lanes];
  double turn_i_cosine[fit_lanes], turn_i_sine[fit_lanes];
  double turn_o_cosine[fit_lanes], turn_o_sine[fit_lanes];
};

// Measured Mueller matrices of 16 nodes and the weights of these in the cost. Lanes of weight zero hold zeros.
struct TableBlock {
  float mueller[16][fit_lanes];
  float weight[fit_lanes];
};

inline constexpr int geometry_rows = sizeof(GeometryBlock) / (fit_lanes * sizeof(double));
inline constexpr int table_rows = sizeof(TableBlock) / (fit_lanes * sizeof(float));

inline std::int64_t fit_blocks(std::int64_t nodes) { return (nodes + fit_lanes - 1) / fit_lanes; }

// Model over n pairs of directions. light, camera: n x 3; mueller: n x 16.
void evaluate_facets(const double* light, const double* camera, std::int64_t n, const FacetMaterial& material,
                     double* mueller);

// light, camera: n x 3, above the horizon; blocks: fit_blocks(n).
void precompute_geometry(const double* light, const double* camera, std::int64_t n, GeometryBlock* blocks);

// mueller: n x 16, may hold NaN where the weight is zero; weight: n; blocks: fit_blocks(n).
void pack_table(const float* mueller, const float* weight, std::int64_t n, TableBlock* blocks);

struct CostGradient {
  double cost;         // sum of w sqrt(|M_model - M_table|_F^2 + epsilon^2) over the nodes
  double gradient[4];  // by alpha, eta, specular, albedo
};

// One band. The index is real (kappa is not looked at) and above 1. Same bytes for any number of threads.
CostGradient cost_gradient(const GeometryBlock* geometry, const TableBlock* table, std::int64_t blocks,
                           const FacetMaterial& material, double epsilon);

}  // namespace pbrdf
