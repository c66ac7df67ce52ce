// Rows or tiles of an image shared out between threads. Each is computed alone, so the number of threads
// cannot show.
#pragma once

#include <algorithm>
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

/// Calls work(state, left, top) for every tile of `side` pixels that covers some of width x height, with one
/// make_state() for a band of tiles. Tiles are taken by squares of four by four: what one of them found in
/// memory its neighbours find in the cache.
template <class MakeState, class Work>
void parallel_tiles(int width, int height, int side, int threads, const MakeState& make_state,
                    const Work& work) {
  const int square = 4 * side;
  parallel_rows((height + square - 1) / square, threads, [&](int band) {
    auto state = make_state();
    const int bottom = std::min((band + 1) * square, height);
    for (int from = 0; from < width; from += square) {
      const int right = std::min(from + square, width);
      for (int top = band * square; top < bottom; top += side) {
        for (int left = from; left < right; left += side) work(state, left, top);
      }
    }
  });
}

}  // namespace pade::simulation
