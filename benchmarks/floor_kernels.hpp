// Loops that show what the machine can do at best, for comparison with the flow kernels.
#pragma once

#include "pade/core/compute/simd.hpp"

namespace pade::flow {

/// Vector operations that one call to floor_arithmetic() does per repetition, and floats in a vector.
inline constexpr int kFloorOperations = 24;
PADE_DECLARE_KERNEL(int floor_lanes())
/// Multiplications and additions on values that never leave the registers, independent in twelve chains.
PADE_DECLARE_KERNEL(void floor_arithmetic(long repetitions, float* result))
/// to = a + b.
PADE_DECLARE_KERNEL(void floor_memory(const float* a, const float* b, float* to, long size))

}  // namespace pade::flow
