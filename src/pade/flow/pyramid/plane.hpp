// Owns the memory of float images that kernels work on, and keeps it between frames.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

#include "pade/flow/kernels/plane_view.hpp"

namespace pade::flow {

/// Whole vectors at multiples of kRowMultiple never straddle two cache lines.
inline constexpr std::size_t kAlignment = 128;

template <class Value>
struct AlignedAllocator {
  using value_type = Value;
  AlignedAllocator() = default;
  template <class Other>
  explicit AlignedAllocator(const AlignedAllocator<Other>& /*other*/) {}
  Value* allocate(std::size_t count) {
    return static_cast<Value*>(::operator new(count * sizeof(Value), std::align_val_t(kAlignment)));
  }
  void deallocate(Value* memory, std::size_t /*count*/) {
    ::operator delete(memory, std::align_val_t(kAlignment));
  }
  friend bool operator==(const AlignedAllocator&, const AlignedAllocator&) { return true; }
};

/// Scratch memory of kernels.
using AlignedFloats = std::vector<float, AlignedAllocator<float>>;

/// A float image with aligned, padded rows. Growing reallocates and zeroes; shrinking keeps the memory, so a
/// stream of frames of one size allocates once.
class Plane {
 public:
  Plane() = default;
  Plane(int width, int height) { resize(width, height); }

  void resize(int width, int height) {
    view_.width = width;
    view_.height = height;
    // One vector of slack behind each row for bilinear reads, and one row behind the last.
    view_.stride = padded(width + 1);
    const std::size_t size = static_cast<std::size_t>(view_.stride) * static_cast<std::size_t>(height + 2);
    if (size > capacity_) {
      memory_.reset(static_cast<float*>(std::aligned_alloc(kAlignment, size * sizeof(float))));
      std::fill_n(memory_.get(), size, 0.0F);
      capacity_ = size;
    }
    view_.data = memory_.get();
  }

  [[nodiscard]] const PlaneView& view() const { return view_; }
  [[nodiscard]] int width() const { return view_.width; }
  [[nodiscard]] int height() const { return view_.height; }
  [[nodiscard]] int stride() const { return view_.stride; }
  [[nodiscard]] float* row(int y) const { return view_.row(y); }
  [[nodiscard]] float* data() const { return view_.data; }
  [[nodiscard]] bool empty() const { return view_.data == nullptr; }

  void fill(float value) {
    std::fill_n(memory_.get(),
                static_cast<std::size_t>(view_.stride) * static_cast<std::size_t>(view_.height + 1), value);
  }

 private:
  struct Free {
    void operator()(float* memory) const { std::free(memory); }
  };
  std::unique_ptr<float, Free> memory_;
  std::size_t capacity_ = 0;
  PlaneView view_;
};

}  // namespace pade::flow
