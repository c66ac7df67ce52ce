#include "pade/core/compute/simd.hpp"

#include <array>
#include <cstdlib>

namespace pade::simd {
namespace {
constexpr std::array<std::string_view, 3> kNames = {"baseline", "avx2", "avx512"};

InstructionSet detect() {
#if defined(__x86_64__)
  // Every processor with AVX2 has F16C, which not every compiler knows to ask for.
  const bool avx2 =
      __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
  const bool avx512 = avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
  if (avx512) return InstructionSet::avx512;
  if (avx2) return InstructionSet::avx2;
#endif
  return InstructionSet::baseline;
}
}  // namespace

InstructionSet best() {
  static const InstructionSet set = [] {
    const InstructionSet machine = detect();
    if (const char* wanted = std::getenv("PADE_ISA")) {
      for (int i = 0; i <= static_cast<int>(machine); ++i) {
        if (kNames[static_cast<std::size_t>(i)] == wanted) return static_cast<InstructionSet>(i);
      }
    }
    return machine;
  }();
  return set;
}

std::string_view name(InstructionSet set) { return kNames[static_cast<std::size_t>(set)]; }

}  // namespace pade::simd
