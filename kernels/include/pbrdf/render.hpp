// The virtual camera: from a scene to the Mueller image of its light path, and from that to raw frames.
#pragma once

#include <cstdint>

#include "pbrdf/facet.hpp"
#include "pbrdf/scene.hpp"

namespace pbrdf {

// Mueller matrices in the modules' frames times cos(theta_i)/d^2, in 1/(sr m^2), averaged over `samples` x `samples`
// points of each pixel; zero where no lit surface is seen. out: rows x columns x 16.
void render_mueller(const Pinhole& camera, const SphereScene& scene, const FacetMaterial& material, int rows,
                    int columns, int samples, float* out);

struct Sensor {
  double electrons_per_dn;      // gain
  double read_noise_electrons;  // standard deviation
  double offset_dn;             // level of a dark frame
  int adc_bits;
  int shift;  // left alignment of the stored value
};

// One frame. electrons: mean photo-electrons for a unit of state . Mueller. dark_electrons: mean electrons of each
// pixel that no light has made, counted with them as Poisson says. The noise of a pixel depends on `key` and the
// pixel's index alone, so that a frame is the same whenever and on however many threads it is taken.
void expose(const float* mueller, const double state[16], std::int64_t pixels, double electrons,
            const float* dark_electrons, const Sensor& sensor, std::uint64_t key, std::uint16_t* out);

}  // namespace pbrdf
