// Each SIMD kernel of the flow room against a scalar twin of a few lines, and across strips of rows. Depends
// on nothing but the kernels, so that it also runs cross-compiled.
#pragma once

#include <string>
#include <vector>

#include "pade/core/compute/simd.hpp"

namespace pade::flow::testing {

struct TwinResult {
  std::string kernel;
  double largest_difference;  ///< between kernel and twin, relative to the twin's largest value
  bool strips_agree;          ///< rows computed in strips have the same bits as in one go
  std::vector<float> values;  ///< the kernel's output, to compare instruction sets
};

/// Runs every kernel in one instruction set on random images of an awkward size.
std::vector<TwinResult> run_kernel_twins(simd::InstructionSet set);

}  // namespace pade::flow::testing
