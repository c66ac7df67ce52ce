// What a kernel sees of an image: a pointer, a stride, a size. No other header, so that kernel files stay
// light.
#pragma once

namespace pade::flow {

/// Rows are readable up to the next multiple of this many floats, and planes one row beyond their height.
/// What lies there has no meaning, but it is initialised and kernels may overwrite it.
inline constexpr int kRowMultiple = 32;

/// `width` rounded up to whole vectors.
inline constexpr int padded(int width) { return (width + kRowMultiple - 1) / kRowMultiple * kRowMultiple; }

/// A float image. `stride` is in floats, the same for all planes of one size.
struct PlaneView {
  float* data = nullptr;
  int stride = 0;
  int width = 0;
  int height = 0;

  [[nodiscard]] float* row(int y) const { return data + static_cast<long>(y) * stride; }
};

}  // namespace pade::flow
