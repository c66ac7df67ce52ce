// Separable weighted windows over products that exist only row by row: the common shape of Lucas-Kanade,
// Farneback and the smoothed tensors of CLG. The products of 2 radius + 1 rows live in a ring that stays in
// the second-level cache; nothing of the size of the image is written but the result.
#pragma once

#include "pade/flow/kernels/vec.hpp"

namespace pade::flow::PADE_ISA {

inline constexpr int kMaxRadius = 24;

// Stores the new flow, at most `largest` away from the old one: where the window hardly determines it,
// rounding could throw it anywhere. Not a number becomes the lower end.
PADE_INLINE void store_step(const float* old_flow, float* new_flow, V value, float largest) {
  const V from = load(old_flow);
  store(new_flow, from + clamp(value - from, -largest, largest));
}

// Floats of scratch that windowed() needs.
PADE_INLINE long window_scratch(int channels, int radius, int width) {
  const long line = padded(width) + 2 * kRowMultiple;
  return line * channels * (2 * radius + 2) + line;
}

// For each row y in [first_row, last_row): `produce(y, out)` fills channels rows of products, each
// padded(width) long; `consume(y, lines, taps)` gets their vertical weighted sums over y - radius to y +
// radius. Rows outside the image count as zero, and so do the `radius` elements before and behind each line,
// ready for convolve_horizontal().
template <int kChannels, class Radius, class Produce, class Consume>
PADE_INLINE void windowed(int first_row, int last_row, int width, int height, const float* taps,
                          Radius radius, float* scratch, const Produce& produce, const Consume& consume) {
  const int n = padded(width);
  const long line = n + 2 * kRowMultiple;
  const int rows = 2 * radius + 1;
  float* zero = scratch;
  for (long i = 0; i < line; ++i) zero[i] = 0;
  // The compiler must not think that writing a sum could change a tap.
  float own_taps[kMaxRadius + 1];
  for (int i = 0; i <= radius; ++i) own_taps[i] = taps[i];
  float* sums[kChannels];
  float* ring[kChannels];
  for (int c = 0; c < kChannels; ++c) {
    sums[c] = scratch + line * (1 + c) + kRowMultiple;
    ring[c] = scratch + line * (1 + kChannels + static_cast<long>(c) * rows);
    for (int i = -kRowMultiple; i < 0; ++i) sums[c][i] = 0;
    for (int i = 0; i < kRowMultiple; ++i) sums[c][n + i] = 0;
  }
  const auto slot = [&](int c, int y) { return ring[c] + line * ((y + rows) % rows); };
  for (int ahead = first_row - radius; ahead < last_row + radius; ++ahead) {
    if (ahead >= 0 && ahead < height) {
      float* out[kChannels];
      for (int c = 0; c < kChannels; ++c) out[c] = slot(c, ahead);
      produce(ahead, out);
    }
    const int y = ahead - radius;
    if (y < first_row) continue;
    for (int c = 0; c < kChannels; ++c) {
      const float* pointers[2 * kMaxRadius + 1];
      for (int i = -radius; i <= radius; ++i) {
        pointers[i + radius] = y + i >= 0 && y + i < height ? slot(c, y + i) : zero;
      }
      convolve_vertical(pointers + radius, own_taps, radius, sums[c], n);
      for (int x = width; x < n; ++x) sums[c][x] = 0;
    }
    consume(y, sums, own_taps);
  }
}

}  // namespace pade::flow::PADE_ISA
