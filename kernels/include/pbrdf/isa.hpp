// Versions of a hot loop for the processors of x86-64: the best that runs here, or the one of PBRDF_ISA (v2, v3, v4).
// v3 and v4 give equal bits; v2, which has no fused multiply-add, rounds more often.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define PBRDF_VERSIONS 1
#else
#define PBRDF_VERSIONS 0
#endif

namespace pbrdf {

enum class Isa { v2 = 2, v3 = 3, v4 = 4 };

inline Isa best_isa() {
#if PBRDF_VERSIONS
  if (__builtin_cpu_supports("x86-64-v4")) return Isa::v4;
  if (__builtin_cpu_supports("x86-64-v3")) return Isa::v3;
#endif
  return Isa::v2;
}

// Throws std::invalid_argument if PBRDF_ISA is no version, or one that this processor or compiler lacks.
inline Isa choose_isa() {
  const Isa best = best_isa();
  const char* wanted = std::getenv("PBRDF_ISA");
  if (wanted == nullptr || *wanted == '\0') return best;
  for (const Isa isa : {Isa::v2, Isa::v3, Isa::v4})
    if (isa <= best && wanted == "v" + std::to_string(static_cast<int>(isa))) return isa;
  throw std::invalid_argument("PBRDF_ISA is " + std::string(wanted) + "; this processor has v2 to v" +
                              std::to_string(static_cast<int>(best)));
}

inline Isa isa() {
  static const Isa chosen = choose_isa();
  return chosen;
}

// Memory of one thread, on cache lines.
struct alignas(64) CacheLine {
  unsigned char bytes[64];
};

// A body has `run<vector bytes>(first, last, scratch)`, always inline, for the blocks [first, last), and
// `scratch_bytes()`, what each thread needs for that.
#if PBRDF_VERSIONS
template <typename Body>
__attribute__((target("arch=x86-64-v4,prefer-vector-width=512"))) void run_v4(const Body& body, std::int64_t first,
                                                                              std::int64_t last, void* scratch) {
  body.template run<64>(first, last, scratch);
}

template <typename Body>
__attribute__((target("arch=x86-64-v3"))) void run_v3(const Body& body, std::int64_t first, std::int64_t last,
                                                      void* scratch) {
  body.template run<32>(first, last, scratch);
}
#endif

template <typename Body>
void run_v2(const Body& body, std::int64_t first, std::int64_t last, void* scratch) {
  body.template run<16>(first, last, scratch);
}

// Vectors that the compiler makes, of the width that it prefers.
#if PBRDF_VERSIONS
template <typename Body>
__attribute__((target("arch=x86-64-v4"))) void call_v4(const Body& body) {
  body();
}

template <typename Body>
__attribute__((target("arch=x86-64-v3"))) void call_v3(const Body& body) {
  body();
}
#endif

// Calls a body, always inline, that has no versions of its own.
template <typename Body>
[[gnu::always_inline]] inline void in_version(const Body& body) {
#if PBRDF_VERSIONS
  if (isa() == Isa::v4) return call_v4(body);
  if (isa() == Isa::v3) return call_v3(body);
#endif
  body();
}

// Runs the body over all blocks with all threads, some blocks at a time. What a block gives must not depend on others.
template <typename Body>
void run_blocks(const Body& body, std::int64_t blocks) {
  constexpr std::int64_t at_once = 32;
  auto run = run_v2<Body>;
#if PBRDF_VERSIONS
  if (isa() == Isa::v4) run = run_v4<Body>;
  if (isa() == Isa::v3) run = run_v3<Body>;
#endif
#pragma omp parallel
  {
    std::vector<CacheLine> scratch(body.scratch_bytes() / sizeof(CacheLine) + 1);
#pragma omp for schedule(dynamic)
    for (std::int64_t first = 0; first < blocks; first += at_once)
      run(body, first, first + at_once < blocks ? first + at_once : blocks, scratch.data());
  }
}

}  // namespace pbrdf
