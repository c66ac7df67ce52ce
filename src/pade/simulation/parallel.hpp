// Rows of an image shared out between threads. Each row is computed alone, so the number of threads cannot
// show.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace pade::simulation {

/// Calls work(row) for every row in [0, rows); the threads take rows as they come free.
template <class Work>
void parallel_rows(int rows, int threads, const Work& work) {
  std::atomic<int> next = 0;
  const auto run = [&] {
    for (int row = next.fetch_add(1); row < rows; row = next.fetch_add(1)) work(row);
  };
  std::vector<std::jthread> helpers;
  for (int i = 1; i < threads; ++i) helpers.emplace_back(run);
  run();
}

/// Rows of tiles of `side` pixels that cover `pixels` rows.
constexpr int tile_rows(int pixels, int side) { return (pixels + side - 1) / side; }

}  // namespace pade::simulation
