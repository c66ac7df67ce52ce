#include "pade/depth/image/outlines.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "pade/depth/image/outlines_kernel.hpp"

namespace pade::depth {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::infinity();
constexpr float kOpen = -1;
constexpr auto kBlank = static_cast<std::uint8_t>(DepthState::no_texture);

/// Memory of a row; pixels -1 and `width` are the border of the image.
class OutlineMemory {
 public:
  explicit OutlineMemory(int width)
      : length_(static_cast<std::size_t>(width) + 2 + kOutlineSlack),
        rho_(kOutlineRays * length_, -1.0F),
        steps_(kOutlineRays * length_, 0.0F) {}
  [[nodiscard]] OutlineRow row() {
    OutlineRow out{};
    for (std::size_t i = 0; i < kOutlineRays; ++i) {
      out.rho[i] = rho_.data() + i * length_ + 1;
      out.steps[i] = steps_.data() + i * length_ + 1;
    }
    return out;
  }

 private:
  std::size_t length_;
  std::vector<float> rho_, steps_;
};

/// What the rays of open pixels meet above, of all rows one after the other: the image is walked through
/// twice, from above and from below, and little of it is open.
class Above {
 public:
  explicit Above(int open)
      : values_(std::make_unique_for_overwrite<float[]>(2 * kOutlineRays * static_cast<std::size_t>(open) +
                                                        kOutlineSlack)),
        end_(values_.get()) {}
  /// Takes the pixels from `first` to before `last` of a row.
  void push(const OutlineRow& row, int first, int last) {
    for (const auto& lines : {row.rho, row.steps}) {
      for (int i = 0; i < kOutlineRays; ++i) end_ = std::copy(lines[i] + first, lines[i] + last, end_);
    }
  }
  /// The last ones that were taken, as many as then.
  [[nodiscard]] OutlineRow pop(int count) {
    end_ -= 2L * kOutlineRays * count;
    OutlineRow out{};
    for (int i = 0; i < kOutlineRays; ++i) {
      out.rho[i] = end_ + static_cast<std::ptrdiff_t>(i) * count;
      out.steps[i] = end_ + static_cast<std::ptrdiff_t>(kOutlineRays + i) * count;
    }
    return out;
  }

 private:
  std::unique_ptr<float[]> values_;
  float* end_;
};

/// Calls work(first, last) for the runs of open pixels, from the left or from the right.
template <class Work>
void over_runs(const float* own, int width, int step, const Work& work) {
  const auto open = [&](int j) { return own[step > 0 ? j : width - 1 - j] < 0; };
  for (int j = 0; j < width;) {
    if (!open(j)) {
      ++j;
      continue;
    }
    const int begin = j;
    while (j < width && open(j)) ++j;
    step > 0 ? work(begin, j) : work(width - j, width - begin);
  }
}

}  // namespace

void bound_by_outlines(DepthImage& image) {
  if (image.bound.empty()) return;
  const int width = image.bound.cols;
  const int height = image.bound.rows;
  const auto isa = simd::best();
  std::vector<float> own(static_cast<std::size_t>(width) + kOutlineSlack);
  const auto look = [&](int v) {
    const auto* bound = image.bound.ptr<float>(v);
    const auto* state = image.state.ptr<std::uint8_t>(v);
    for (int u = 0; u < width; ++u) {
      const float inverse = 1 / bound[u];  // in any case: so that the loop vectorises
      const float rho = bound[u] > 0 ? inverse : kUnknown;
      own[static_cast<std::size_t>(u)] = state[u] == kBlank ? kOpen : rho;
    }
  };
  const OutlineMemory outside(width);
  std::array<OutlineMemory, 2> rows = {outside, outside};
  Above above(cv::countNonZero(image.state == kBlank));
  for (int v = 0; v < height; ++v) {
    look(v);
    const OutlineRow here = rows[v % 2].row();
    PADE_DISPATCH(outline_row, isa)(own.data(), width, 1, rows[(v + 1) % 2].row(), here);
    over_runs(own.data(), width, 1, [&](int first, int last) { above.push(here, first, last); });
  }
  rows = {outside, outside};
  std::vector<float> found(own.size());
  for (int v = height - 1; v >= 0; --v) {
    look(v);
    const OutlineRow here = rows[v % 2].row();
    PADE_DISPATCH(outline_row, isa)(own.data(), width, -1, rows[(v + 1) % 2].row(), here);
    over_runs(own.data(), width, -1, [&](int first, int last) {
      OutlineRow below = here;
      for (float*& line : below.rho) line += first;
      for (float*& line : below.steps) line += first;
      PADE_DISPATCH(outline_bounds, isa)(above.pop(last - first), below, last - first, found.data());
      auto* bound = image.bound.ptr<float>(v) + first;
      for (int u = 0; u < last - first; ++u) {
        const float rho = found[static_cast<std::size_t>(u)];
        if (rho < kUnknown && !(bound[u] * rho >= 1)) bound[u] = 1 / rho;
      }
    });
  }
}

}  // namespace pade::depth
