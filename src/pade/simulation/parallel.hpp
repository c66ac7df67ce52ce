// Rows of an image shared out between threads. Each row is computed alone, so the number of threads cannot
// show.
#pragma once

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace pade::simulation {

/// Calls work(row) for every row in [0, rows), in blocks that the threads take as they come free.
template <class Work>
void parallel_rows(int rows, int threads, const Work& work) {
  constexpr int kBlock = 8;
  std::atomic<int> next = 0;
  const auto run = [&] {
    for (int first = next.fetch_add(kBlock); first < rows; first = next.fetch_add(kBlock)) {
      for (int row = first; row < std::min(first + kBlock, rows); ++row) work(row);
    }
  };
  std::vector<std::jthread> helpers;
  for (int i = 1; i < threads; ++i) helpers.emplace_back(run);
  run();
}

}  // namespace pade::simulation
