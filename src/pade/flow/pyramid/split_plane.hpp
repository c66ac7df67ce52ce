// Owns the memory of a SplitView (kernels/clg_kernels.hpp).
#pragma once

#include <cstddef>

#include "pade/flow/kernels/clg_kernels.hpp"
#include "pade/flow/pyramid/plane.hpp"

namespace pade::flow {

/// All zero but for what kernels write between the guards. Another size starts from zero again.
class SplitPlane {
 public:
  void resize(int width, int height) {
    if (view_.half == padded(width) / 2 && view_.height == height) return;
    view_.half = padded(width) / 2;
    view_.height = height;
    memory_.assign(static_cast<std::size_t>(view_.stride()) * static_cast<std::size_t>(height + 2), 0.0F);
    view_.data = memory_.data();
  }
  [[nodiscard]] const SplitView& view() const { return view_; }

 private:
  SplitView view_;
  AlignedFloats memory_;
};

}  // namespace pade::flow
