// What a fit of a facet model to a table needs: nodes in blocks, and the cost of a model over them with its gradient.
#pragma once

#include <cstdint>
#include <vector>

#include "pbrdf/facet.hpp"

namespace pbrdf {

// Nodes travel in blocks of 16, each quantity a row of 16 lanes, so that a loop over the lanes vectorises.
inline constexpr int fit_lanes = 16;

inline std::int64_t fit_blocks(std::int64_t nodes) { return (nodes + fit_lanes - 1) / fit_lanes; }

// FacetGeometry of 16 nodes; T is what a cost is computed in. Lanes beyond the last node repeat the block's first one.
template <class T>
struct GeometryBlock {
  T cos_i[fit_lanes], cos_o[fit_lanes], sin2_h[fit_lanes], cos_d[fit_lanes];
  T turn_i_cosine[fit_lanes], turn_i_sine[fit_lanes], turn_o_cosine[fit_lanes], turn_o_sine[fit_lanes];
};

// How the difference of two matrices becomes a number.
enum class CostKind {
  norms,    // w sqrt(|difference|^2 + epsilon^2), Frobenius
  roots,    // w sum of (difference^2 + epsilon^2)^(1/4) over the elements
  squares,  // sum of w difference^2 over the elements, each with its weight
};

// Rows of `Elements`, in its order.
inline constexpr int element_rows = 12;
using ElementRows = float[element_rows][fit_lanes];

// Measured Mueller matrices of 16 nodes and their weights. `rest` is of the four elements that no model fills. Lanes of
// weight zero hold zeros.
template <CostKind kind>
struct TableBlock;

template <>
struct TableBlock<CostKind::norms> {
  ElementRows mueller;
  float rest[fit_lanes];  // their squares' sum
  float weight[fit_lanes];
};

template <>
struct TableBlock<CostKind::roots> {
  ElementRows mueller;
  float rest[4][fit_lanes];
  float weight[fit_lanes];
};

template <>
struct TableBlock<CostKind::squares> {
  ElementRows mueller;
  ElementRows weight;
  float rest[fit_lanes];  // the sum of their weighted squares
};

template <class T>
inline constexpr int geometry_rows = sizeof(GeometryBlock<T>) / (fit_lanes * sizeof(T));
template <CostKind kind>
inline constexpr int table_rows = sizeof(TableBlock<kind>) / (fit_lanes * sizeof(float));

// light, camera: n x 3, above the horizon; blocks: fit_blocks(n).
template <class T>
void precompute_geometry(const double* light, const double* camera, std::int64_t n, GeometryBlock<T>* blocks);

// mueller: n x 16, may hold NaN where the weight is zero; weight: n, or n x 16 for squares; blocks: fit_blocks(n).
template <CostKind kind>
void pack_table(const float* mueller, const float* weight, std::int64_t n, TableBlock<kind>* blocks);

struct CostGradient {
  double cost;
  double gradient[5];  // by roughness, eta, kappa, specular, albedo
};

// A band with what it is compared with. The roughness is that of all bands.
template <CostKind kind>
struct FitBand {
  const TableBlock<kind>* table;
  FacetMaterial material;
  double epsilon;
};

// Each band's, in one pass over the nodes: what the roughness alone decides is computed once. With a real index kappa
// is not looked at, and eta has to be above 1. Same bytes for any number of threads.
template <class T, CostKind kind>
std::vector<CostGradient> cost_gradient(FacetModel model, bool complex, const GeometryBlock<T>* geometry,
                                        std::int64_t blocks, const std::vector<FitBand<kind>>& bands);

}  // namespace pbrdf
