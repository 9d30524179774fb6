// How many fused multiply-adds of float32 a core does in a second, for `python -m bench`.
#include <chrono>

namespace {

#if defined(__AVX512F__)
constexpr int bytes = 64;
#elif defined(__AVX__)
constexpr int bytes = 32;
#else
constexpr int bytes = 16;
#endif

typedef float Vector __attribute__((vector_size(bytes)));

// Two units of four cycles each: fewer sums than eight would wait for one another.
constexpr int sums = 12;

}  // namespace

// Multiply-adds per second of the calling thread over `rounds` rounds.
extern "C" double fma_rate(long rounds) {
  Vector sum[sums], factor = Vector{} + 0.999f, term = Vector{} + 0.001f;
  for (Vector& s : sum) s = Vector{};
  const auto start = std::chrono::steady_clock::now();
  for (long round = 0; round < rounds; ++round) {
#pragma GCC unroll 12
    for (int s = 0; s < sums; ++s) {
      sum[s] = sum[s] * factor + term;
      // each stays in a register, and none is worked out beforehand
      asm volatile("" : "+v"(sum[s]));
    }
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  return static_cast<double>(rounds) * sums * (bytes / 4) / seconds.count();
}
