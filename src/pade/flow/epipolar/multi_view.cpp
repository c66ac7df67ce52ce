#include "pade/flow/epipolar/multi_view.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "pade/core/compute/simd.hpp"
#include "pade/core/option_check.hpp"
#include "pade/flow/kernels/epipolar_kernels.hpp"
#include "pade/flow/kernels/multi_view_kernels.hpp"
#include "pade/flow/kernels/pyramid_kernels.hpp"
#include "pade/flow/pyramid/pyramid.hpp"
#include "pade/flow/pyramid/split_plane.hpp"

namespace pade::flow {
namespace {

constexpr double kWindowSigma = 1.2;  // of the evidence
constexpr int kWindowRadius = 3;
constexpr double kTensorSigma = 0.4;
constexpr int kTensorRadius = 1;
constexpr float kGreyNoise = 1;
constexpr float kRounding = 0.3F;  // grey values
constexpr int kCostWindow = 3;
constexpr float kClearly = 0.25F;  // grey values
constexpr float kUnseen = 1e3F;    // cost where no view sees a pixel

ViewGeometry geometry(const View& view, const MultiViewOptions& options) {
  ViewGeometry g;
  for (int i = 0; i < 9; ++i) g.H[i] = view.H.val[i];
  for (int i = 0; i < 3; ++i) g.e[i] = view.e[i];
  g.largest_parallax2 = static_cast<float>(options.largest_parallax * options.largest_parallax);
  g.largest_scale = static_cast<float>(options.largest_scale);
  return g;
}

/// The plane as a matrix that shares its memory.
cv::Mat header(const Plane& plane) {
  return {plane.height(), plane.width(), CV_32FC1, plane.data(),
          static_cast<std::size_t>(plane.stride()) * sizeof(float)};
}

void copy(const cv::Mat& values, const Plane& plane) {
  for (int y = 0; y < values.rows; ++y) std::copy_n(values.ptr<float>(y), values.cols, plane.row(y));
}

cv::Mat to_mat(const Plane& plane) {
  cv::Mat values(plane.height(), plane.width(), CV_32FC1);
  for (int y = 0; y < values.rows; ++y) std::copy_n(plane.row(y), values.cols, values.ptr<float>(y));
  return values;
}

}  // namespace

Status check(const MultiViewOptions& o) {
  const OptionRange ranges[] = {
      {"reach", static_cast<double>(o.reach), 0, 64},
      {"switching", o.switching, 0, 1},
      {"warps", static_cast<double>(o.warps), 0, 100},
      {"sweeps", static_cast<double>(o.sweeps), 0, 1000},
      {"omega", o.omega, above_zero, 1.999},
      {"alpha", o.alpha, above_zero, finite},
      {"gamma", o.gamma, 0, finite},
      {"data_epsilon", o.data_epsilon, above_zero, finite},
      {"smooth_epsilon", o.smooth_epsilon, above_zero, finite},
      {"median", static_cast<double>(o.median), 0, 5},
      {"largest_parallax", o.largest_parallax, above_zero, 1e6},
      {"largest_scale", o.largest_scale, 1, finite},
  };
  return check_ranges(ranges);
}

struct MultiViewEstimator::Buffers {
  simd::InstructionSet isa = simd::best();
  Pyramid first;
  std::vector<Pyramid> views;
  Plane base_u, base_v, direction_x, direction_y;
  Plane mean, difference, distance0, distance, spare, j11, j13, j33, sum11, sum13;
  Plane information, step, step2, matching, wrong;
  SplitPlane split_distance, inverse, right_hand_side, right, below;
  AlignedFloats scratch;
  std::vector<float> taps = gaussian_taps(kTensorSigma, kTensorRadius);
  std::vector<float> window = gaussian_taps(kWindowSigma, kWindowRadius);

  void resize(int width, int height) {
    for (Plane* plane :
         {&base_u, &base_v, &direction_x, &direction_y, &mean, &difference, &distance0, &distance, &spare,
          &j11, &j13, &j33, &sum11, &sum13, &information, &step, &step2, &matching, &wrong}) {
      plane->resize(width, height);
    }
    for (SplitPlane* plane : {&split_distance, &inverse, &right_hand_side, &right, &below}) {
      plane->resize(width, height);
    }
    const long planes = kPlaneLines * (padded(width) + 2L * kRowMultiple);
    scratch.resize(
        static_cast<std::size_t>(std::max({planes, PADE_DISPATCH(clg_scratch, isa)(kTensorRadius, width),
                                           PADE_DISPATCH(evidence_scratch, isa)(kWindowRadius, width)})));
  }
  [[nodiscard]] EpipolarLevel line() const {
    return {base_u.view(), base_v.view(), direction_x.view(), direction_y.view()};
  }
};

MultiViewEstimator::MultiViewEstimator(const MultiViewOptions& options)
    : options_(options), buffers_(std::make_unique<Buffers>()) {}
MultiViewEstimator::MultiViewEstimator(MultiViewEstimator&&) noexcept = default;
MultiViewEstimator& MultiViewEstimator::operator=(MultiViewEstimator&&) noexcept = default;
MultiViewEstimator::~MultiViewEstimator() = default;

/// Mean truncated residual over the views that see a pixel, in a small window.
cv::Mat MultiViewEstimator::cost(const std::vector<View>& views, const Plane& distance) {
  Buffers& b = *buffers_;
  for (std::size_t i = 0; i < views.size(); ++i) {
    PADE_DISPATCH(view_cost, b.isa)
    (geometry(views[i], options_), b.first.levels[0].view(), b.views[i].levels[0].view(), distance.view(),
     b.sum11.view(), b.sum13.view(), i == 0, 0, distance.height());
  }
  const cv::Mat count = header(b.sum13);
  cv::Mat mean = header(b.sum11) / cv::max(count, 1);
  mean.setTo(kUnseen, count < 0.5);
  cv::boxFilter(mean, mean, -1, {kCostWindow, kCostWindow});
  return mean;
}

/// Beside an edge a pixel has the depth of the wrong side, and gradients do not lead to the other one. It
/// takes the nearest or the farthest depth around where the views like that clearly better.
void MultiViewEstimator::compete(const std::vector<View>& views) {
  Buffers& b = *buffers_;
  const int side = 2 * options_.reach + 1;
  const cv::Mat square = cv::getStructuringElement(cv::MORPH_RECT, {side, side});
  const cv::Mat own = header(b.distance);
  const cv::Mat own_cost = cost(views, b.distance);
  cv::Mat others[2];
  cv::Mat costs[2];
  cv::dilate(own, others[0], square);
  cv::erode(own, others[1], square);
  for (int i = 0; i < 2; ++i) {
    copy(others[i], b.spare);
    costs[i] = cost(views, b.spare);
  }
  const auto share = static_cast<float>(options_.switching);
  for (int y = 0; y < own.rows; ++y) {
    const auto* c0 = own_cost.ptr<float>(y);
    const auto* c1 = costs[0].ptr<float>(y);
    const auto* c2 = costs[1].ptr<float>(y);
    const auto* nearest = others[0].ptr<float>(y);
    const auto* farthest = others[1].ptr<float>(y);
    float* d = b.distance.row(y);
    for (int x = 0; x < own.cols; ++x) {
      const float limit = share * c0[x] - kClearly;
      const float best = std::min(c1[x], c2[x]);
      if (best < limit) d[x] = c1[x] <= c2[x] ? nearest[x] : farthest[x];
    }
  }
}

ParallaxField MultiViewEstimator::estimate(const cv::Mat& reference, const std::vector<View>& views,
                                           const cv::Mat& initial, double noise) {
  if (reference.type() != CV_8UC1 || reference.empty() || views.empty() || initial.type() != CV_32FC1 ||
      initial.size() != reference.size()) {
    return {};
  }
  for (const View& view : views) {
    if (view.image.type() != CV_8UC1 || view.image.size() != reference.size()) return {};
  }
  Buffers& b = *buffers_;
  const int width = reference.cols;
  const int height = reference.rows;
  b.resize(width, height);
  b.first.build(reference, 1);
  b.views.resize(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) b.views[i].build(views[i].image, 1);
  for (int y = 0; y < height; ++y) {
    const auto* from = initial.ptr<float>(y);
    float* to = b.distance.row(y);
    for (int x = 0; x < width; ++x) to[x] = std::isfinite(from[x]) ? from[x] : 0.0F;
    for (int x = width; x < padded(width); ++x) to[x] = to[width - 1];
  }

  if (options_.reach > 0) compete(views);

  EpipolarClg level;
  level.line = b.line();
  level.first = b.first.levels[0].view();
  level.mean = b.mean.view();
  level.difference = b.difference.view();
  level.distance0 = b.distance0.view();
  level.split_distance = b.split_distance.view();
  level.inverse = b.inverse.view();
  level.right_hand_side = b.right_hand_side.view();
  level.right = b.right.view();
  level.below = b.below.view();
  level.taps = b.taps.data();
  level.radius = kTensorRadius;
  level.alpha = static_cast<float>(options_.alpha);
  level.gamma = static_cast<float>(options_.gamma);
  level.smooth_epsilon2 = static_cast<float>(options_.smooth_epsilon * options_.smooth_epsilon);
  ViewTensor tensor;
  tensor.epsilon2 = static_cast<float>(options_.data_epsilon * options_.data_epsilon);
  for (int warp = 0; warp < options_.warps; ++warp) {
    for (std::size_t i = 0; i < views.size(); ++i) {
      level.distance = b.distance.view();
      level.second = b.views[i].levels[0].view();
      level.j11 = b.j11.view();
      level.j13 = b.j13.view();
      level.j33 = b.j33.view();
      PADE_DISPATCH(view_lines, b.isa)
      (geometry(views[i], options_), b.distance.view(), level.line, 0, height);
      PADE_DISPATCH(epipolar_clg_warp, b.isa)(level, 0, height);
      PADE_DISPATCH(epipolar_clg_tensor, b.isa)(level, 0, height, b.scratch.data());
      tensor.j11 = b.j11.view();
      tensor.j13 = b.j13.view();
      tensor.j33 = b.j33.view();
      tensor.sum11 = b.sum11.view();
      tensor.sum13 = b.sum13.view();
      PADE_DISPATCH(view_add, b.isa)(tensor, i == 0, 0, height);
    }
    level.j11 = b.sum11.view();
    level.j13 = b.sum13.view();
    PADE_DISPATCH(epipolar_clg_system, b.isa)(level, 0, height, b.scratch.data());
    PADE_DISPATCH(epipolar_clg_relax, b.isa)(level, options_.sweeps, static_cast<float>(options_.omega));
    PADE_DISPATCH(clg_join, b.isa)(level.split_distance, level.distance, 0, height);
    if (options_.median >= 3) {
      auto* filter = options_.median == 3 ? PADE_DISPATCH(median3, b.isa) : PADE_DISPATCH(median5, b.isa);
      filter(b.distance.view(), b.spare.view(), 0, height, b.scratch.data());
      std::swap(b.distance, b.spare);
    }
  }

  ViewEvidence evidence;
  evidence.line = b.line();
  evidence.first = b.first.levels[0].view();
  evidence.distance = b.distance.view();
  evidence.information = b.information.view();
  evidence.step = b.step.view();
  evidence.step2 = b.step2.view();
  evidence.matching = b.matching.view();
  evidence.wrong = b.wrong.view();
  evidence.taps = b.window.data();
  evidence.radius = kWindowRadius;
  evidence.noise = std::max(kGreyNoise, static_cast<float>(noise));
  evidence.image_noise = std::max(kRounding, static_cast<float>(noise));
  evidence.effective_size = static_cast<float>(effective_window(b.window));
  for (std::size_t i = 0; i < views.size(); ++i) {
    evidence.second = b.views[i].levels[0].view();
    PADE_DISPATCH(view_lines, b.isa)
    (geometry(views[i], options_), b.distance.view(), evidence.line, 0, height);
    PADE_DISPATCH(view_evidence, b.isa)(evidence, i == 0, 0, height, b.scratch.data());
  }
  ParallaxField out{to_mat(b.distance), to_mat(b.information), to_mat(b.step),
                    to_mat(b.step2),    to_mat(b.matching),    to_mat(b.wrong)};
  cv::Mat mean;
  cv::divide(out.step, out.information, mean);  // 0 / 0 = 0 in OpenCV
  mean.setTo(0, out.information <= 0);
  cv::Mat explained;
  cv::multiply(out.step, mean, explained);
  out.spread -= explained;
  out.step = mean;
  return out;
}

}  // namespace pade::flow
