#include "pade/flow/epipolar/multi_view.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pade/core/compute/simd.hpp"
#include "pade/core/option_check.hpp"
#include "pade/flow/kernels/epipolar_kernels.hpp"
#include "pade/flow/kernels/multi_view_kernels.hpp"
#include "pade/flow/kernels/pyramid_kernels.hpp"
#include "pade/flow/pyramid/pyramid.hpp"
#include "pade/flow/pyramid/split_plane.hpp"

namespace pade::flow {
namespace {

constexpr double kWindowSigma = 2.5;  // of the evidence
constexpr int kWindowRadius = 5;
constexpr double kTensorSigma = 0.4;
constexpr int kTensorRadius = 1;
constexpr float kGreyNoise = 1;

cv::Mat to_mat(const Plane& plane) {
  cv::Mat values(plane.height(), plane.width(), CV_32FC1);
  for (int y = 0; y < values.rows; ++y) std::copy_n(plane.row(y), values.cols, values.ptr<float>(y));
  return values;
}

}  // namespace

Status check(const MultiViewOptions& o) {
  const OptionRange ranges[] = {
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
    for (Plane* plane : {&base_u, &base_v, &direction_x, &direction_y, &mean, &difference, &distance0,
                         &distance, &spare, &j11, &j13, &j33, &sum11, &sum13, &information, &step, &step2,
                         &matching, &wrong}) {
      plane->resize(width, height);
    }
    for (SplitPlane* plane : {&split_distance, &inverse, &right_hand_side, &right, &below}) {
      plane->resize(width, height);
    }
    const long planes = kPlaneLines * (padded(width) + 2L * kRowMultiple);
    scratch.resize(static_cast<std::size_t>(
        std::max({planes, PADE_DISPATCH(clg_scratch, isa)(kTensorRadius, width),
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

ParallaxField MultiViewEstimator::estimate(const cv::Mat& reference, const std::vector<View>& views,
                                           const cv::Mat& initial) {
  if (reference.type() != CV_8UC1 || reference.empty() || views.empty() ||
      initial.type() != CV_32FC1 || initial.size() != reference.size()) {
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

  const auto geometry = [&](const View& view) {
    ViewGeometry g;
    for (int i = 0; i < 9; ++i) g.H[i] = view.H.val[i];
    for (int i = 0; i < 3; ++i) g.e[i] = view.e[i];
    g.largest_parallax2 = static_cast<float>(options_.largest_parallax * options_.largest_parallax);
    g.largest_scale = static_cast<float>(options_.largest_scale);
    return g;
  };

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
      PADE_DISPATCH(view_lines, b.isa)(geometry(views[i]), b.distance.view(), level.line, 0, height);
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
  evidence.noise = kGreyNoise;
  evidence.effective_size = static_cast<float>(effective_window(b.window));
  for (std::size_t i = 0; i < views.size(); ++i) {
    evidence.second = b.views[i].levels[0].view();
    PADE_DISPATCH(view_lines, b.isa)(geometry(views[i]), b.distance.view(), evidence.line, 0, height);
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
