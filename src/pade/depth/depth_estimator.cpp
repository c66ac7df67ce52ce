#include "pade/depth/depth_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pade/core/compute/median.hpp"
#include "pade/depth/depth_kernel.hpp"
#include "pade/depth/derotation.hpp"
#include "pade/depth/texture.hpp"

namespace pade::depth {
namespace {

constexpr double kLeastFlowSigma = 0.01;   // px; no flow method is better, and thresholds need a scale
constexpr double kUnknownFlowSigma = 0.5;  // px, where too few pixels are left to measure it
constexpr std::size_t kFewestSamples = 50;
constexpr double kNoiseSamples = 1000;  // pixels, on a grid, that measure the noise of the flow
constexpr double kFocusSamples = 4800;  // and that find the focus of expansion
constexpr double kEpipoleCone =
    0.25;                             // tangent of the angle from the epipole beyond which it is not to blame
constexpr double kFarthestFocus = 3;  // image diagonals from the centre; beyond, the flow is parallel
constexpr double kLeastForwardShare = 0.05;  // of the translation; less is not forward motion

static_assert(static_cast<int>(DepthState::epipole) == 1 && static_cast<int>(DepthState::low_parallax) == 2 &&
              static_cast<int>(DepthState::no_texture) == 3 &&
              static_cast<int>(DepthState::inconsistent) == 4 &&
              static_cast<int>(DepthState::out_of_view) == 5 &&
              static_cast<int>(DepthState::far) == 6);  // the kernel's constants

constexpr auto kOutOfView = static_cast<std::uint8_t>(DepthState::out_of_view);

/// Robust standard deviation of the flow across the epipolar lines: zero for the right pose and perfect flow,
/// at any depth, so it measures the noise of one component of the flow (and the error of the pose with it).
double across_sigma(const std::vector<FlowSample>& samples, const Camera& camera, const Eigen::Vector3d& t) {
  std::vector<double> residuals;
  residuals.reserve(samples.size());
  for (const FlowSample& s : samples) {
    const Eigen::Vector2d a = times_A(camera, s.position, t);
    const double length = a.norm();
    if (length > 0) residuals.push_back(std::abs(a.x() * s.flow.y() - a.y() * s.flow.x()) / length);
  }
  if (residuals.size() < kFewestSamples) return kUnknownFlowSigma;
  return std::max(kLeastFlowSigma, median_to_sigma * median(residuals));
}

void copy_turn(const Eigen::Matrix3d& rotation, float* turn) {
  const Eigen::Matrix3d difference = rotation - Eigen::Matrix3d::Identity();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) turn[3 * r + c] = static_cast<float>(difference(r, c));
  }
}

KernelParameters kernel_parameters(const DepthInput& input, const DepthOptions& options,
                                   const Eigen::Vector3d& t, double sigma, double axis_variance) {
  const Camera& camera = input.camera;
  KernelParameters k{};
  k.fx = static_cast<float>(camera.fx);
  k.fy = static_cast<float>(camera.fy);
  k.inverse_fx = static_cast<float>(1 / camera.fx);
  k.inverse_fy = static_cast<float>(1 / camera.fy);
  k.fx_tx = static_cast<float>(camera.fx * t.x());
  k.fy_ty = static_cast<float>(camera.fy * t.y());
  k.tz = static_cast<float>(t.z());
  copy_turn(input.R_left(), k.turn);
  copy_turn(input.R_removed().transpose(), k.view);
  const Eigen::Vector3d omega = input.motion.rotation_vector();
  for (int i = 0; i < 3; ++i) k.omega[i] = static_cast<float>(omega[i]);
  k.add_tz = options.model == Model::exact ? k.tz : 0.0F;
  k.sigma2 = static_cast<float>(sigma * sigma);
  k.sigma_scale2 = static_cast<float>(options.flow_sigma_scale * options.flow_sigma_scale);
  k.relative2 = static_cast<float>(options.flow_relative_sigma * options.flow_relative_sigma);
  const bool gates = options.gates == Gates::on;
  k.parallax2 = gates ? static_cast<float>(options.parallax_gate * options.parallax_gate) : 0.0F;
  k.residual2 = gates ? static_cast<float>(options.residual_gate * options.residual_gate)
                      : std::numeric_limits<float>::infinity();
  k.tangent2 = static_cast<float>(std::pow(std::tan(options.residual_angle), 2));
  // |a| at which a thing at depth Z has just enough parallax.
  const double least = gates ? options.parallax_gate * sigma : sigma;
  const auto needed = [&](double Z) { return least * std::max(Z - t.z(), 0.1 * Z); };
  const double cone = kEpipoleCone * std::max(camera.fx, camera.fy) * t.norm();
  k.blind2 = static_cast<float>(std::pow(needed(options.nearest), 2));
  k.epipole2 = static_cast<float>(std::pow(std::min(needed(options.far), cone), 2));
  k.range = static_cast<float>(options.range);
  k.axis_variance = static_cast<float>(axis_variance);
  // A match outside the other image is guessed by the flow method from its surroundings: doubtful.
  const float beyond = gates ? 0 : std::numeric_limits<float>::infinity();
  k.left = static_cast<float>(-camera.cx) - beyond;
  k.right = static_cast<float>(camera.width - 1 - camera.cx) + beyond;
  k.top = static_cast<float>(-camera.cy) - beyond;
  k.bottom = static_cast<float>(camera.height - 1 - camera.cy) + beyond;
  int index = 0;
  for (int r = 0; r < 6; ++r) {
    for (int c = r; c < 6; ++c) k.pose[index++] = static_cast<float>(input.motion.covariance(r, c));
  }
  k.has_pose = !input.motion.covariance.isZero(0);
  k.samelson = options.reading == Reading::samelson;
  k.bound_k = static_cast<float>(options.bound_sigmas);
  k.derotation = input.derotation == Derotation::image
                     ? (input.rotation_removed ? KernelDerotation::remaining : KernelDerotation::none)
                 : options.model == Model::exact ? KernelDerotation::exact
                                                 : KernelDerotation::first_order;
  return k;
}

/// A pixel whose match falls on one that the other frame does not see is out of view, and has no bound.
void hide_invalid_matches(const DepthInput& input, int n, const FlowField& flow, DepthImage& out) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int r = 0; r < out.depth.rows; ++r) {
    auto* state = out.state.ptr<std::uint8_t>(r);
    const auto* bound = out.bound.ptr<float>(r);
    for (int c = 0; c < out.depth.cols; ++c) {
      if (state[c] != static_cast<std::uint8_t>(DepthState::measured) && std::isnan(bound[c])) continue;
      const auto& w = flow.vectors.at<cv::Vec2f>(r, c);
      double u = cell_centre(c, n) + static_cast<double>(w[0]);
      double v = cell_centre(r, n) + static_cast<double>(w[1]);
      if (input.derotation == Derotation::image) {
        const Eigen::Vector3d ray((u - input.camera.cx) / input.camera.fx,
                                  (v - input.camera.cy) / input.camera.fy, 1);
        const Eigen::Vector3d seen = input.R_removed().transpose() * ray;
        u = input.camera.fx * seen.x() / seen.z() + input.camera.cx;
        v = input.camera.fy * seen.y() / seen.z() + input.camera.cy;
      }
      const int x = std::clamp(static_cast<int>(std::lround(u)), 0, input.camera.width - 1);
      const int y = std::clamp(static_cast<int>(std::lround(v)), 0, input.camera.height - 1);
      if (input.valid.at<std::uint8_t>(y, x) != 0) continue;
      state[c] = kOutOfView;
      out.depth.at<float>(r, c) = nan;
      out.variance.at<float>(r, c) = nan;
      out.own_variance.at<float>(r, c) = nan;
      out.bound.at<float>(r, c) = nan;
    }
  }
}

/// Of the pixels of a window of which none was used: the weakest reason for which any was left out.
std::uint8_t weakest_reason(const cv::Mat& gate, cv::Rect window) {
  double weakest = 0;
  cv::minMaxLoc(gate(window & cv::Rect({0, 0}, gate.size())), &weakest);
  return static_cast<std::uint8_t>(weakest);
}

/// Standard deviation of the mean of the flow vectors of a window, from those of its usable pixels; NaN for
/// none.
float sigma_of_mean(const cv::Mat& sigma, const cv::Mat& gate, cv::Rect window) {
  window &= cv::Rect({0, 0}, sigma.size());
  float variance = 0;
  float used = 0;
  for (int v = window.y; v < window.br().y; ++v) {
    for (int u = window.x; u < window.br().x; ++u) {
      const float value = sigma.at<float>(v, u);
      if (gate.at<std::uint8_t>(v, u) != 0 || !std::isfinite(value)) continue;
      variance += value * value;
      used += 1;
    }
  }
  return std::sqrt(variance) / used;
}

/// Averages flow and gate over n x n windows (paper, Section 2.3.1); invalid and gated flow is left out. The
/// mean of m vectors with independent noise has 1/m of its variance: from the flow's own sigmas, else from
/// `sigma` where that is not zero.
void average(const FlowField& flow, const cv::Mat& gate, int n, double sigma, std::vector<float>& sums,
             FlowField& cells, cv::Mat& cell_gate) {
  const cv::Size size((flow.vectors.cols + n - 1) / n, (flow.vectors.rows + n - 1) / n);
  const auto width = static_cast<std::size_t>(flow.vectors.cols);
  const auto accumulate = PADE_DISPATCH(accumulate_flow_row, simd::best());
  const auto sum_columns = PADE_DISPATCH(sum_columns, simd::best());
  const auto mean_flow = PADE_DISPATCH(mean_flow, simd::best());
  cells.vectors.create(size, CV_32FC2);
  cell_gate.create(size, CV_8UC1);
  sums.resize(6 * width);
  cells.sigma.release();
  if (!flow.sigma.empty() || sigma > 0) cells.sigma.create(size, CV_32FC1);
  for (int r = 0; r < size.height; ++r) {
    std::fill_n(sums.begin(), 3 * width, 0.0F);
    float* const sum_u = sums.data();
    float* const sum_v = sum_u + width;
    float* const valid = sum_v + width;
    float* const cell_u = valid + width;
    float* const cell_v = cell_u + width;
    float* const cell_valid = cell_v + width;
    const int last = std::min(flow.vectors.rows, (r + 1) * n);
    for (int v = r * n; v < last; ++v) {
      accumulate(flow.vectors.ptr<float>(v), gate.ptr<std::uint8_t>(v), width, sum_u, sum_v, valid);
    }
    sum_columns(sum_u, width, n, cell_u);
    sum_columns(sum_v, width, n, cell_v);
    sum_columns(valid, width, n, cell_valid);
    auto* const gates = cell_gate.ptr<std::uint8_t>(r);
    mean_flow(cell_u, cell_v, cell_valid, static_cast<std::size_t>(size.width), cells.vectors.ptr<float>(r),
              gates);
    for (int c = 0; c < size.width; ++c) {
      if (gates[c] != 0) gates[c] = weakest_reason(gate, cv::Rect(c * n, r * n, n, n));
    }
    if (cells.sigma.empty()) continue;
    for (int c = 0; c < size.width; ++c) {
      cells.sigma.at<float>(r, c) = flow.sigma.empty()
                                        ? static_cast<float>(sigma) / std::sqrt(cell_valid[c])
                                        : sigma_of_mean(flow.sigma, gate, cv::Rect(c * n, r * n, n, n));
    }
  }
}

}  // namespace

void DepthEstimator::make_gate(const DepthInput& input) {
  const cv::Size size = input.flow.vectors.size();
  if (!input.texture.empty()) {
    if (input.texture.data != gate_.data) input.texture.copyTo(gate_);
    return;
  }
  diagnostics_.image_noise = 0;
  const bool judge = options_.gates == Gates::on && options_.texture_gate > 0 && !input.reference.empty() &&
                     size.width >= 3 && size.height >= 3;
  if (judge) {
    diagnostics_.image_noise = image_noise(input.reference, input.other, input.flow);
    gate_ = texture_gate(input.reference, input.other, input.flow, input.camera, input.motion,
                         {options_.texture_gate, options_.texture_correlation}, diagnostics_.image_noise);
  } else {
    gate_.create(size, CV_8UC1);
    gate_.setTo(0);
  }
  if (!input.valid.empty()) gate_.setTo(kOutOfView, input.valid == 0);
}

std::vector<FlowSample> DepthEstimator::sample(const DepthInput& input, double wanted) const {
  const bool cells = options_.window > 1;
  const cv::Mat& vectors = cells ? averaged_.vectors : input.flow.vectors;
  const cv::Mat& gate = cells ? cell_gate_ : gate_;
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(vectors.total()) / wanted)));
  const Derotator derotate = input.rotation_removed && input.derotation == Derotation::image
                                 ? Derotator(input.camera, input.R_left())
                                 : Derotator(input.camera, input.motion, options_.model, input.derotation);
  std::vector<FlowSample> samples;
  samples.reserve(vectors.total() / static_cast<std::size_t>(step * step) + 1);
  for (int r = step / 2; r < vectors.rows; r += step) {
    for (int c = step / 2; c < vectors.cols; c += step) {
      const auto& w = vectors.at<cv::Vec2f>(r, c);
      if (gate.at<std::uint8_t>(r, c) != 0) continue;
      const Eigen::Vector2d p(cell_centre(c, options_.window) - input.camera.cx,
                              cell_centre(r, options_.window) - input.camera.cy);
      const Eigen::Vector2d d = derotate(p, {w[0], w[1]});
      if (d.allFinite()) samples.push_back({p, d});
    }
  }
  return samples;
}

void DepthEstimator::estimate(const DepthInput& input, DepthImage& out) {
  make_gate(input);
  const int n = options_.window;
  if (n > 1) average(input.flow, gate_, n, options_.flow_sigma, sums_, averaged_, cell_gate_);
  const FlowField& flow = n > 1 ? averaged_ : input.flow;
  const cv::Mat& gate = n > 1 ? cell_gate_ : gate_;

  // Which translation direction, and how noisy the flow is.
  Eigen::Vector3d t = input.motion.t_reference_other;
  double axis_variance = 0;
  diagnostics_.focus.reset();
  diagnostics_.flow_sigma = options_.flow_sigma;
  if (options_.method == Method::ttc) {
    const double diagonal = std::hypot(input.camera.width, input.camera.height);
    if (std::abs(t.z()) > kLeastForwardShare * t.norm()) {
      diagnostics_.focus = focus_of_expansion(sample(input, kFocusSamples), kFarthestFocus * diagonal);
    }
    if (const auto& focus = diagnostics_.focus) {
      t = t.z() *
          Eigen::Vector3d(focus->position.x() / input.camera.fx, focus->position.y() / input.camera.fy, 1);
      axis_variance = 0.5 * focus->covariance.trace() * t.z() * t.z();
      if (options_.flow_sigma <= 0) diagnostics_.flow_sigma = std::max(kLeastFlowSigma, focus->flow_sigma);
    } else {
      t.setZero();  // TTC has no answer
      if (options_.flow_sigma <= 0) diagnostics_.flow_sigma = kUnknownFlowSigma;
    }
  } else if (options_.flow_sigma <= 0) {
    diagnostics_.flow_sigma = across_sigma(sample(input, kNoiseSamples), input.camera, t);
  }
  KernelParameters k = kernel_parameters(input, options_, t, diagnostics_.flow_sigma, axis_variance);
  if (options_.method == Method::ttc && !diagnostics_.focus) {
    k.epipole2 = std::numeric_limits<float>::infinity();  // wherever the focus may be, nothing is known
  }

  out.window = n;
  out.depth.create(flow.vectors.size(), CV_32FC1);
  out.variance.create(flow.vectors.size(), CV_32FC1);
  out.own_variance.create(flow.vectors.size(), CV_32FC1);
  out.bound.create(flow.vectors.size(), CV_32FC1);
  out.state.create(flow.vectors.size(), CV_8UC1);
  columns_.resize(static_cast<std::size_t>(flow.vectors.cols));
  for (int c = 0; c < flow.vectors.cols; ++c) {
    columns_[static_cast<std::size_t>(c)] = static_cast<float>(cell_centre(c, n) - input.camera.cx);
  }
  const auto depth_row = PADE_DISPATCH(depth_row, simd::best());
  for (int r = 0; r < flow.vectors.rows; ++r) {
    depth_row(k, columns_.data(), static_cast<float>(cell_centre(r, n) - input.camera.cy),
              flow.vectors.ptr<float>(r), flow.sigma.empty() ? nullptr : flow.sigma.ptr<float>(r),
              gate.ptr<std::uint8_t>(r), columns_.size(),
              {out.depth.ptr<float>(r), out.variance.ptr<float>(r), out.own_variance.ptr<float>(r),
               out.bound.ptr<float>(r), out.state.ptr<std::uint8_t>(r)});
  }
  if (!input.valid.empty()) hide_invalid_matches(input, n, flow, out);
}

}  // namespace pade::depth
