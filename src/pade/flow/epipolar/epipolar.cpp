#include "pade/flow/epipolar/epipolar.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "pade/flow/kernels/confidence_kernels.hpp"
#include "pade/flow/kernels/epipolar_kernels.hpp"
#include "pade/flow/kernels/lucas_kanade_kernels.hpp"
#include "pade/flow/kernels/pyramid_kernels.hpp"
#include "pade/flow/pyramid/pyramid.hpp"
#include "pade/flow/pyramid/split_plane.hpp"

namespace pade::flow {
namespace {

// The window in which the residual across the line is measured.
constexpr int kAcrossRadius = 5;
constexpr double kAcrossSigma = 2.5;
constexpr float kAcrossDamping = 1.0F;
constexpr float kGreyNoise = 1.0F;

// The lines of one pyramid level.
struct LinePlanes {
  Plane base_u, base_v, direction_x, direction_y;

  void resize(int width, int height) {
    for (Plane* plane : {&base_u, &base_v, &direction_x, &direction_y}) plane->resize(width, height);
  }
  [[nodiscard]] EpipolarLevel view() const {
    return {base_u.view(), base_v.view(), direction_x.view(), direction_y.view()};
  }
};

bool fits(const cv::Mat& values, int type, cv::Size size) {
  return values.type() == type && values.size() == size;
}

class EpipolarPyramid : public EpipolarEstimator {
 public:
  using EpipolarEstimator::estimate;
  explicit EpipolarPyramid(const FlowOptions& options)
      : options_(options), across_taps_(gaussian_taps(kAcrossSigma, kAcrossRadius)) {}

  EpipolarFlow estimate(const cv::Mat& first, const cv::Mat& second, const EpipolarField& lines,
                        const cv::Mat& initial) final {
    const bool grey = first.type() == CV_8UC1 || first.type() == CV_16UC1;
    if (first.empty() || !grey || !fits(second, first.type(), first.size()) ||
        !fits(lines.direction, CV_32FC2, first.size()) ||
        (!lines.base.empty() && !fits(lines.base, CV_32FC2, first.size()))) {
      return {};
    }
    const int count = pyramid_levels(first.size(), options_.smallest_level);
    first_.build(first, count);
    second_.build(second, count);
    const long planes = kPlaneLines * (padded(first.cols) + 2L * kRowMultiple);
    scratch_.resize(static_cast<std::size_t>(
        std::max({planes, scratch_floats(first.cols),
                  PADE_DISPATCH(confidence_scratch, isa_)(kAcrossRadius, first.cols)})));
    load_lines(lines);
    for (int level = count - 1; level >= 0; --level) {
      start(level, count, initial);
      refine(level);
    }
    return result();
  }

 protected:
  virtual void refine(int level) = 0;
  [[nodiscard]] virtual long scratch_floats(int width) const = 0;

  void median(int size) {
    if (size < 3) return;
    auto* filter = size == 3 ? PADE_DISPATCH(median3, isa_) : PADE_DISPATCH(median5, isa_);
    spare_.resize(distance_.width(), distance_.height());
    filter(distance_.view(), spare_.view(), 0, distance_.height(), scratch_.data());
    std::swap(distance_, spare_);
  }

  FlowOptions options_;
  simd::InstructionSet isa_ = simd::best();
  Pyramid first_, second_;
  std::vector<LinePlanes> lines_;  // by level
  Plane distance_, spare_;
  AlignedFloats scratch_;

 private:
  void load_lines(const EpipolarField& field) {
    lines_.resize(first_.levels.size());
    LinePlanes& finest = lines_[0];
    finest.resize(first_.levels[0].width(), first_.levels[0].height());
    auto* split = PADE_DISPATCH(split_components, isa_);
    for (int y = 0; y < field.direction.rows; ++y) {
      split(field.direction.ptr<float>(y), finest.direction_x.row(y), finest.direction_y.row(y),
            field.direction.cols);
      if (field.base.empty()) continue;
      split(field.base.ptr<float>(y), finest.base_u.row(y), finest.base_v.row(y), field.base.cols);
    }
    if (field.base.empty()) {
      finest.base_u.fill(0);
      finest.base_v.fill(0);
    }
    // The line of a coarse pixel is that of the fine pixel on which it lies.
    auto* coarser = PADE_DISPATCH(every_other, isa_);
    for (std::size_t level = 1; level < lines_.size(); ++level) {
      const LinePlanes& from = lines_[level - 1];
      LinePlanes& to = lines_[level];
      const int height = first_.levels[level].height();
      to.resize(first_.levels[level].width(), height);
      coarser(from.direction_x.view(), to.direction_x.view(), 1, 0, height);
      coarser(from.direction_y.view(), to.direction_y.view(), 1, 0, height);
      coarser(from.base_u.view(), to.base_u.view(), 0.5F, 0, height);
      coarser(from.base_v.view(), to.base_v.view(), 0.5F, 0, height);
    }
  }

  void start(int level, int count, const cv::Mat& initial) {
    const Plane& size = first_.levels[static_cast<std::size_t>(level)];
    if (level < count - 1) {
      spare_.resize(size.width(), size.height());
      PADE_DISPATCH(upsample, isa_)(distance_.view(), spare_.view(), 2, 0, size.height());
      std::swap(distance_, spare_);
      return;
    }
    distance_.resize(size.width(), size.height());
    distance_.fill(0);
    const Plane& full = first_.levels[0];
    if (!fits(initial, CV_32FC1, {full.width(), full.height()})) return;
    const float factor = 1.0F / static_cast<float>(1 << level);
    const auto farthest = static_cast<float>(full.width() + full.height());  // beyond it all leaves the image
    for (int y = 0; y < size.height(); ++y) {
      for (int x = 0; x < size.width(); ++x) {
        const float d =
            initial.at<float>(std::min(y << level, initial.rows - 1), std::min(x << level, initial.cols - 1));
        distance_.row(y)[x] = std::abs(d) <= farthest ? d * factor : 0;
      }
    }
  }

  EpipolarFlow result() {
    const int height = distance_.height();
    flow_.resize(distance_.width(), height);
    PADE_DISPATCH(epipolar_flow, isa_)
    (lines_[0].view(), distance_.view(), flow_.u.view(), flow_.v.view(), 0, height);
    EpipolarFlow out;
    out.flow.vectors = to_vectors(flow_);
    out.distance = to_mat(distance_);
    if (options_.confidence != FlowConfidence::none) {
      out.flow.sigma = sigma();
      out.across = across();
    }
    return out;
  }

  static cv::Mat to_mat(const Plane& plane) {
    cv::Mat values(plane.height(), plane.width(), CV_32FC1);
    for (int y = 0; y < values.rows; ++y) std::copy_n(plane.row(y), values.cols, values.ptr<float>(y));
    return values;
  }

  cv::Mat sigma() {
    ConfidenceInput input;
    input.first = first_.levels[0].view();
    input.second = second_.levels[0].view();
    input.u = flow_.u.view();
    input.v = flow_.v.view();
    spare_.resize(distance_.width(), distance_.height());
    input.sigma = spare_.view();
    input.taps = across_taps_.data();
    input.radius = kAcrossRadius;
    input.noise = kGreyNoise;
    input.effective_size = static_cast<float>(effective_window(across_taps_));
    PADE_DISPATCH(flow_sigma, isa_)(input, 0, distance_.height(), scratch_.data());
    return to_mat(spare_);
  }

  // One Lucas-Kanade step at right angles to the line, from the solution.
  cv::Mat across() {
    const int width = distance_.width();
    const int height = distance_.height();
    Plane normal_x(width, height);
    Plane normal_y(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        normal_x.row(y)[x] = -lines_[0].direction_y.row(y)[x];
        normal_y.row(y)[x] = lines_[0].direction_x.row(y)[x];
      }
    }
    Plane slope(width, height);
    Plane inverse(width, height);
    Plane zero(width, height);
    spare_.resize(width, height);
    EpipolarLucasKanade level;
    level.line = {flow_.u.view(), flow_.v.view(), normal_x.view(), normal_y.view()};
    level.first = first_.levels[0].view();
    level.second = second_.levels[0].view();
    level.slope = slope.view();
    level.inverse = inverse.view();
    level.distance = zero.view();
    level.next_distance = spare_.view();
    level.taps = across_taps_.data();
    level.radius = kAcrossRadius;
    level.damping = kAcrossDamping;
    level.largest_step = 1e3F;
    PADE_DISPATCH(epipolar_lk_slope, isa_)(level, 0, height, scratch_.data());
    PADE_DISPATCH(epipolar_lk_prepare, isa_)(level, 0, height, scratch_.data());
    PADE_DISPATCH(epipolar_lk_iterate, isa_)(level, 0, height, scratch_.data());
    return cv::abs(to_mat(spare_));
  }

  FlowPlanes flow_;
  std::vector<float> across_taps_;
};

class EpipolarLk final : public EpipolarPyramid {
 public:
  explicit EpipolarLk(const LucasKanadeOptions& options)
      : EpipolarPyramid(options.pyramid), lk_(options), taps_(gaussian_taps(options.sigma, options.radius)) {
    if (options.local_mean > 0) mean_taps_ = local_mean_taps(options.local_mean);
  }

 protected:
  [[nodiscard]] long scratch_floats(int width) const override {
    return PADE_DISPATCH(lucas_kanade_scratch, isa_)(lk_.radius, width);
  }

  void refine(int index) override {
    const auto at = static_cast<std::size_t>(index);
    EpipolarLucasKanade level;
    level.first = relative(first_.levels[at], first_relative_);
    level.second = relative(second_.levels[at], second_relative_);
    const int height = level.first.height;
    slope_.resize(level.first.width, height);
    inverse_.resize(level.first.width, height);
    spare_.resize(level.first.width, height);
    level.line = lines_[at].view();
    level.slope = slope_.view();
    level.inverse = inverse_.view();
    level.taps = taps_.data();
    level.radius = lk_.radius;
    level.damping = static_cast<float>(lk_.damping);
    level.largest_step = static_cast<float>(lk_.largest_step);
    PADE_DISPATCH(epipolar_lk_slope, isa_)(level, 0, height, scratch_.data());
    PADE_DISPATCH(epipolar_lk_prepare, isa_)(level, 0, height, scratch_.data());
    for (int i = 0; i < (index == 0 ? lk_.iterations : lk_.coarse_iterations); ++i) {
      level.distance = distance_.view();
      level.next_distance = spare_.view();
      PADE_DISPATCH(epipolar_lk_iterate, isa_)(level, 0, height, scratch_.data());
      std::swap(distance_, spare_);
    }
    median(index == 0 ? lk_.median : lk_.coarse_median);
  }

 private:
  PlaneView relative(const Plane& grey, Plane& to) {
    if (mean_taps_.empty()) return grey.view();
    to.resize(grey.width(), grey.height());
    PADE_DISPATCH(smooth, isa_)
    (grey.view(), to.view(), mean_taps_.data(), static_cast<int>(mean_taps_.size()) - 1, 0, grey.height(),
     scratch_.data());
    PADE_DISPATCH(subtract_from, isa_)(grey.view(), to.view(), 0, grey.height());
    return to.view();
  }

  LucasKanadeOptions lk_;
  std::vector<float> taps_, mean_taps_;
  Plane first_relative_, second_relative_, slope_, inverse_;
};

struct EpipolarClgMemory {
  Plane mean, difference, distance0, j11, j13, j33;
  SplitPlane distance, inverse, right_hand_side, right, below;

  void resize(int width, int height) {
    for (Plane* plane : {&mean, &difference, &distance0, &j11, &j13, &j33}) plane->resize(width, height);
    for (SplitPlane* plane : {&distance, &inverse, &right_hand_side, &right, &below})
      plane->resize(width, height);
  }
};

class EpipolarClgFlow final : public EpipolarPyramid {
 public:
  explicit EpipolarClgFlow(const ClgOptions& options)
      : EpipolarPyramid(options.pyramid),
        clg_(options),
        taps_(gaussian_taps(std::max(options.rho, 0.01), options.radius)) {}

 protected:
  [[nodiscard]] long scratch_floats(int width) const override {
    return PADE_DISPATCH(clg_scratch, isa_)(clg_.radius, width);
  }

  void refine(int index) override {
    const auto at = static_cast<std::size_t>(index);
    memory_.resize(first_.levels.size());
    EpipolarClgMemory& m = memory_[at];
    const int height = distance_.height();
    m.resize(distance_.width(), height);
    for (int warp = 0; warp < (index == 0 ? clg_.warps : clg_.coarse_warps); ++warp) {
      EpipolarClg level = view(m);
      level.line = lines_[at].view();
      level.first = first_.levels[at].view();
      level.second = second_.levels[at].view();
      PADE_DISPATCH(epipolar_clg_warp, isa_)(level, 0, height);
      PADE_DISPATCH(epipolar_clg_tensor, isa_)(level, 0, height, scratch_.data());
      for (int i = 0; i < clg_.lagged; ++i) {
        PADE_DISPATCH(epipolar_clg_system, isa_)(level, 0, height, scratch_.data());
        PADE_DISPATCH(epipolar_clg_relax, isa_)(level, clg_.sweeps, static_cast<float>(clg_.omega));
        PADE_DISPATCH(clg_join, isa_)(level.split_distance, level.distance, 0, height);
      }
      median(index == 0 ? clg_.median : clg_.coarse_median);
    }
  }

 private:
  [[nodiscard]] EpipolarClg view(const EpipolarClgMemory& m) const {
    EpipolarClg level;
    level.mean = m.mean.view();
    level.difference = m.difference.view();
    level.distance0 = m.distance0.view();
    level.distance = distance_.view();
    level.j11 = m.j11.view();
    level.j13 = m.j13.view();
    level.j33 = m.j33.view();
    level.split_distance = m.distance.view();
    level.inverse = m.inverse.view();
    level.right_hand_side = m.right_hand_side.view();
    level.right = m.right.view();
    level.below = m.below.view();
    level.taps = taps_.data();
    level.radius = clg_.radius;
    level.alpha = static_cast<float>(clg_.alpha);
    level.gamma = static_cast<float>(clg_.gamma);
    level.data_epsilon2 = static_cast<float>(clg_.data_epsilon * clg_.data_epsilon);
    level.smooth_epsilon2 = static_cast<float>(clg_.smooth_epsilon * clg_.smooth_epsilon);
    return level;
  }

  ClgOptions clg_;
  std::vector<float> taps_;
  std::vector<EpipolarClgMemory> memory_;
};

}  // namespace

LucasKanadeOptions epipolar_lucas_kanade_options() {
  LucasKanadeOptions options;
  options.iterations = 1;
  options.coarse_iterations = 3;
  return options;
}

ClgOptions epipolar_clg_options() {
  ClgOptions options = clg_fast_options();
  options.coarse_warps = 3;
  options.sweeps = 6;
  return options;
}

std::unique_ptr<EpipolarEstimator> make_epipolar_lucas_kanade(const LucasKanadeOptions& options) {
  return std::make_unique<EpipolarLk>(options);
}

std::unique_ptr<EpipolarEstimator> make_epipolar_clg(const ClgOptions& options) {
  return std::make_unique<EpipolarClgFlow>(options);
}

}  // namespace pade::flow
