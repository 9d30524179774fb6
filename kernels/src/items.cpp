#include "pbrdf/items.hpp"

#include <cstring>

namespace pbrdf {

// The first axis is innermost: a table is stored with its azimuths side by side and written with them outermost, and
// so both sides run along memory, the written one in as many streams as there are azimuths.
void gather_items(const ItemView& view, unsigned char* out) {
  const std::int64_t (&n)[4] = view.shape;
  const std::int64_t (&step)[4] = view.strides;
#pragma omp parallel for schedule(static)
  for (std::int64_t d = 0; d < n[1]; ++d)
    for (std::int64_t h = 0; h < n[2]; ++h)
      for (std::int64_t b = 0; b < n[3]; ++b) {
        const unsigned char* from = view.data + d * step[1] + h * step[2] + b * step[3];
        unsigned char* to = out + item_bytes * ((d * n[2] + h) * n[3] + b);
        for (std::int64_t p = 0; p < n[0]; ++p)
          std::memcpy(to + item_bytes * (p * n[1] * n[2] * n[3]), from + p * step[0], item_bytes);
      }
}

}  // namespace pbrdf
