#include "floor_kernels.hpp"

#include "pade/flow/kernels/vec.hpp"

namespace pade::flow::PADE_ISA {

int floor_lanes() { return kLanes; }

void floor_arithmetic(long repetitions, float* result) {
  constexpr int kChains = kFloorOperations / 2;
  V chain[kChains];
  for (int i = 0; i < kChains; ++i) chain[i] = set(1.0F + static_cast<float>(i));
  const V factor = set(0.999F);
  const V term = set(0.001F);
  for (long r = 0; r < repetitions; ++r) {
    for (int i = 0; i < kChains; ++i) chain[i] = chain[i] * factor + term;
  }
  for (int i = 1; i < kChains; ++i) chain[0] += chain[i];
  store(result, chain[0]);
}

void floor_memory(const float* a, const float* b, float* to, long size) {
  for (long i = 0; i < size; i += kLanes) store(to + i, load(a + i) + load(b + i));
}

}  // namespace pade::flow::PADE_ISA
