// Run-time choice of the instruction set. Kernels are compiled once per set (pade_add_kernels in
// cmake/PadeCompiler.cmake) into namespaces baseline, avx2 and avx512; this header picks one.
// Contraction is off and nothing is reassociated, so all sets give the same bits.
#pragma once

#include <string_view>

namespace pade::simd {

enum class InstructionSet { baseline = 0, avx2 = 1, avx512 = 2 };

/// The best set that both this machine and this build have. PADE_ISA=baseline|avx2|avx512 in the environment
/// lowers it (never raises it above what the machine has).
InstructionSet best();

/// All sets that can run here, from baseline to best().
inline constexpr bool available(InstructionSet set, InstructionSet highest) {
  return static_cast<int>(set) <= static_cast<int>(highest);
}

std::string_view name(InstructionSet set);

}  // namespace pade::simd

// PADE_DISPATCH(function, set): the address of `function` in the namespace of `set`. Each of
// baseline::function, avx2::function and avx512::function must be declared in the enclosing namespace.
#if defined(__x86_64__)
#define PADE_DISPATCH(function, set)                                 \
  ((set) == ::pade::simd::InstructionSet::avx512 ? &avx512::function \
   : (set) == ::pade::simd::InstructionSet::avx2 ? &avx2::function   \
                                                 : &baseline::function)
#define PADE_DECLARE_KERNEL(...) \
  namespace baseline {           \
  __VA_ARGS__;                   \
  }                              \
  namespace avx2 {               \
  __VA_ARGS__;                   \
  }                              \
  namespace avx512 {             \
  __VA_ARGS__;                   \
  }
#else
#define PADE_DISPATCH(function, set) (static_cast<void>(set), &baseline::function)
#define PADE_DECLARE_KERNEL(...) \
  namespace baseline {           \
  __VA_ARGS__;                   \
  }
#endif
