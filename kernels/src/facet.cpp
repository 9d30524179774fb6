#include "pbrdf/facet.hpp"

namespace pbrdf {
namespace {

constexpr std::int64_t directions_per_chunk = 1024;
// Below this, waking threads costs more than they save, much more where other jobs keep the cores busy.
constexpr std::int64_t worth_threads = 1 << 16;

}  // namespace

void evaluate_facets(FacetModel model, const double* light, const double* camera, std::int64_t n,
                     const FacetMaterial& material, double* mueller) {
  with_model(model, [&](auto type) {
    const FacetEvaluator<decltype(type)> evaluator(material);
#pragma omp parallel for schedule(static, directions_per_chunk) if (n >= worth_threads)
    for (std::int64_t i = 0; i < n; ++i) evaluator.mueller(light + 3 * i, camera + 3 * i, mueller + 16 * i);
  });
}

}  // namespace pbrdf
