// A few rows of a plane with repeated edges, for stencils that walk down an image.
#pragma once

#include "pade/flow/kernels/vec.hpp"

namespace pade::flow::PADE_ISA {

PADE_INLINE int clamp_index(int i, int size) { return i < 0 ? 0 : i >= size ? size - 1 : i; }

// Repeats the first and last of `width` elements `count` times on both sides of `line`; the elements up to
// padded(width) are filled in any case.
PADE_INLINE void repeat_edges(float* line, int width, int count) {
  for (int i = 1; i <= count; ++i) line[-i] = line[0];
  for (int i = width; i < padded(width) + count; ++i) line[i] = line[width - 1];
}

// The last kRows rows, each copied once; row y of the image, also outside of it, at [y]. Two elements beyond
// each end are valid.
template <int kRows>
class Lines {
 public:
  Lines(const PlaneView& from, float* scratch, int first) : plane_(from), memory_(scratch), copied_(first) {}
  static long floats(int width) { return kRows * (padded(width) + 2L * kRowMultiple); }

  // Makes rows up to `last` available.
  void advance(int last) {
    for (; copied_ <= last; ++copied_) {
      const float* from = plane_.row(clamp_index(copied_, plane_.height));
      float* line = slot(copied_);
      for (int x = 0; x < padded(plane_.width); x += kLanes) store(line + x, load(from + x));
      repeat_edges(line, plane_.width, 4);
    }
  }
  const float* operator[](int y) const { return slot(y); }

 private:
  float* slot(int y) const {
    return memory_ + ((y % kRows + kRows) % kRows) * (padded(plane_.width) + 2L * kRowMultiple) +
           kRowMultiple;
  }
  PlaneView plane_;
  float* memory_;
  int copied_;
};

// Five-point derivative [1 -8 0 8 -1] / 12.
PADE_INLINE V five_point(V far_back, V back, V ahead, V far_ahead) {
  return (ahead - back) * (8.0F / 12) - (far_ahead - far_back) * (1.0F / 12);
}
PADE_INLINE V along_x(const float* line) {
  return five_point(load(line - 2), load(line - 1), load(line + 1), load(line + 2));
}

}  // namespace pade::flow::PADE_ISA
