// The scalar-twin tests without a test framework, for cross-compiled kernels (NEON under qemu-user).
#include <cstdio>

#include "flow/kernels/kernel_twins.hpp"

int main() {
  int failures = 0;
  for (const auto& twin : pade::flow::testing::run_kernel_twins(pade::simd::InstructionSet::baseline)) {
    const bool good = twin.largest_difference < 1e-4 && twin.strips_agree;
    std::printf("%-24s %.2e %s\n", twin.kernel.c_str(), twin.largest_difference, good ? "ok" : "FAILED");
    failures += good ? 0 : 1;
  }
  return failures == 0 ? 0 : 1;
}
