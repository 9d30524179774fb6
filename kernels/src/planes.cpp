#include "pbrdf/planes.hpp"

#include <algorithm>

#include "pbrdf/isa.hpp"
#include "pbrdf/tiles.hpp"

#if PBRDF_VERSIONS
#include <immintrin.h>
#endif

namespace pbrdf {
namespace {

constexpr int outputs = 16;
constexpr int block_pixels = row_length<float>;
constexpr std::uintptr_t line = 64;

#if PBRDF_VERSIONS
// By inline assembly: the intrinsics of a wider version cannot be named in a template of the narrowest.
template <int bytes>
[[gnu::always_inline]] inline void stream(float* to, Vector<float, bytes> value) {
  Vector<float, bytes>* place = reinterpret_cast<Vector<float, bytes>*>(to);
  if constexpr (bytes == 16)
    asm("movntps %1, %0" : "=m"(*place) : "x"(value));
  else
    asm("vmovntps %1, %0" : "=m"(*place) : "v"(value));
}

inline void finish_streams() { _mm_sfence(); }
#else
template <int bytes>
[[gnu::always_inline]] inline void stream(float* to, Vector<float, bytes> value) {
  std::memcpy(to, &value, sizeof value);
}

inline void finish_streams() {}
#endif

template <typename Raw>
struct Combine {
  const Raw* planes;
  const float* factors;  // states x outputs
  int states;
  std::int64_t pixels;
  float* out;
  std::int64_t head;  // pixels before the first that lies on a cache line
  bool streaming;     // all planes of the output lie alike on the cache lines

  std::int64_t blocks() const { return (pixels + shift() + block_pixels - 1) / block_pixels; }

  // The first block is the shorter by as much, so that all others begin on a cache line.
  std::int64_t shift() const { return head == 0 ? 0 : block_pixels - head; }

  std::size_t scratch_bytes() const { return static_cast<std::size_t>(states) * block_pixels * sizeof(float); }

  template <int bytes>
  [[gnu::always_inline]] inline void run(std::int64_t first, std::int64_t last, void* scratch) const {
    for (std::int64_t block = first; block < last; ++block) {
      const std::int64_t begin = std::max<std::int64_t>(block * block_pixels - shift(), 0);
      const std::int64_t end = std::min((block + 1) * block_pixels - shift(), pixels);
      const int count = static_cast<int>(end - begin);
      float* rows = static_cast<float*>(scratch);
      for (int n = 0; n < states; ++n) {
        const Raw* from = planes + n * pixels + begin;
        float* to = rows + n * block_pixels;
        if (count == block_pixels)
          for (int p = 0; p < block_pixels; ++p) to[p] = static_cast<float>(from[p]);
        else {
          for (int p = 0; p < count; ++p) to[p] = static_cast<float>(from[p]);
          std::fill(to + count, to + block_pixels, 0.0f);
        }
      }
      const int ahead = static_cast<int>(std::min<std::int64_t>(block_pixels, pixels - end));
      if (count == block_pixels)
        whole_block<bytes>(rows, begin, ahead);
      else
        part_block<bytes>(rows, begin, count);
    }
    if (streaming) finish_streams();
  }

  template <int bytes>
  [[gnu::always_inline]] inline void whole_block(const float* rows, std::int64_t begin, int ahead) const {
    constexpr int width = 2 * bytes / static_cast<int>(sizeof(float));
    constexpr int tiles = block_pixels / width;
    for (int t = 0; t < tiles; ++t) {
      // the next block comes in while this one is computed, some of its planes a tile
      for (int n = states * t / tiles; n < states * (t + 1) / tiles; ++n) {
        const char* next = reinterpret_cast<const char*>(planes + n * pixels + begin + block_pixels);
        for (int byte = 0; byte < ahead * static_cast<int>(sizeof(Raw)); byte += line) __builtin_prefetch(next + byte);
      }
      for (int row = 0; row < outputs; row += tile_rows<bytes>) {
        Tile<float, bytes> tile;
        multiply<bytes>(factors + row, outputs, states, rows + t * width, tile);
        float* to = out + row * pixels + begin + t * width;
#pragma GCC unroll 8
        for (int r = 0; r < tile_rows<bytes>; ++r)
          for (int half = 0; half < 2; ++half) put<bytes>(tile.sum[r][half], to + r * pixels + half * width / 2);
      }
    }
  }

  template <int bytes>
  [[gnu::always_inline]] inline void put(Vector<float, bytes> value, float* to) const {
    if (streaming) return stream<bytes>(to, value);
    std::memcpy(to, &value, sizeof value);
  }

  template <int bytes>
  [[gnu::always_inline]] inline void part_block(const float* rows, std::int64_t begin, int count) const {
    constexpr int width = 2 * bytes / static_cast<int>(sizeof(float));
    for (int p = 0; p < count; p += width)
      for (int row = 0; row < outputs; row += tile_rows<bytes>) {
        Tile<float, bytes> tile;
        multiply<bytes>(factors + row, outputs, states, rows + p, tile);
        for (int r = 0; r < tile_rows<bytes>; ++r) {
          float values[width];
          std::memcpy(values, tile.sum[r], sizeof values);
          float* to = out + (row + r) * pixels + begin + p;
          for (int i = 0; i < std::min(width, count - p); ++i) to[i] = values[i];
        }
      }
  }
};

}  // namespace

template <typename Raw>
void combine_planes(const Raw* planes, const double* matrix, int states, std::int64_t pixels, float* out) {
  const std::vector<float> factors = transposed<float>(matrix, outputs, states);
  const std::uintptr_t over = reinterpret_cast<std::uintptr_t>(out) % line;
  const std::int64_t head = over == 0 ? 0 : static_cast<std::int64_t>((line - over) / sizeof(float));
  const bool streaming = pixels * sizeof(float) % line == 0;
  const Combine<Raw> body{planes, factors.data(), states, pixels, out, streaming ? head : 0, streaming};
  run_blocks(body, body.blocks());
}

template void combine_planes(const std::uint8_t*, const double*, int, std::int64_t, float*);
template void combine_planes(const std::uint16_t*, const double*, int, std::int64_t, float*);
template void combine_planes(const float*, const double*, int, std::int64_t, float*);

}  // namespace pbrdf
