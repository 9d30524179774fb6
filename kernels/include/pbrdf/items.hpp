// Matrices of a table in another order of its axes.
#pragma once

#include <cstdint>

namespace pbrdf {

inline constexpr int item_bytes = 64;

// A view of items of 64 contiguous bytes over four axes; strides in bytes, which may be anything.
struct ItemView {
  const unsigned char* data;
  std::int64_t shape[4], strides[4];
};

// Copies them to `out` in the order of the axes, the last fastest.
void gather_items(const ItemView& view, unsigned char* out);

}  // namespace pbrdf
