#include "pade/core/compute/worker_pool.hpp"

#include <atomic>
#include <stdexcept>

#include <gtest/gtest.h>

namespace pade::flow {
namespace {

TEST(WorkerPool, CallsEveryPartOnce) {
  WorkerPool pool(3);
  for (int round = 0; round < 100; ++round) {
    std::atomic<int> sum = 0;
    pool.run([&](int part) { sum += 1 << (8 * part); });
    ASSERT_EQ(sum, 0x010101);
  }
}

TEST(WorkerPool, WaitsForItsHelpersWhereTheCallersOwnPartThrows) {
  WorkerPool pool(2);
  for (int round = 0; round < 100; ++round) {
    std::atomic<bool> done = false;
    const auto work = [&](int part) {
      if (part == 0) throw std::runtime_error("part 0");
      for (int i = 0; i < 1000; ++i) std::atomic_signal_fence(std::memory_order_seq_cst);
      done = true;
    };
    EXPECT_THROW(pool.run(work), std::runtime_error);
    ASSERT_TRUE(done);
  }
}

}  // namespace
}  // namespace pade::flow
