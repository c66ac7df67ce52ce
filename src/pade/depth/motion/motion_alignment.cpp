#include "pade/depth/motion/motion_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

#include "pade/core/option_check.hpp"
#include "pade/depth/motion/alignment_equations.hpp"

namespace pade::depth {
namespace {

constexpr int kLargestCell = 8;  // px: each cell gives its best pixel
constexpr int kSmallestCell = 3;
constexpr double kPoints = 1200;  // cells at least, if they are not too small
constexpr int kFewest = 100;      // points
constexpr float kLeastSlope = 3;  // grey values per px
constexpr double kLeastInliers = 0.4;
constexpr double kMostNoise = 0.5;      // of the contrast: what differs more has not been found again
constexpr double kSurprise = 25;        // chi-square of 5 degrees of freedom beyond 1 - 1e-4
constexpr double kExposureGain = 0.3;   // from frame to frame
constexpr double kExposureOffset = 40;  // grey values
constexpr double kRadian = std::numbers::pi / 180;

cv::Mat smoothed(const cv::Mat& image) {
  constexpr double kSigma = 0.7;
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {3, 3}, kSigma);
  return smooth;
}

void make_levels(const cv::Mat& image, int levels, std::vector<cv::Mat>& out) {
  out.resize(static_cast<std::size_t>(levels));
  out[0] = smoothed(image);
  for (std::size_t i = 1; i < out.size(); ++i) cv::pyrDown(out[i - 1], out[i]);
}

/// Information of the prior, with any length as good as any other.
Matrix6d information_of(const RelativeMotion& prior) {
  const Eigen::Vector3d& t = prior.t_reference_other;
  Matrix6d covariance = prior.covariance;
  covariance.topLeftCorner<3, 3>() += t * t.transpose();
  Vector6d least;
  constexpr double kLeastLength = 1e-6;
  constexpr double kLeastAngle = 1e-7;
  least << Eigen::Vector3d::Constant(kLeastLength * std::max(t.norm(), 1e-3)),
      Eigen::Vector3d::Constant(kLeastAngle);
  covariance += Matrix6d(least.cwiseAbs2().asDiagonal());
  return covariance.ldlt().solve(Matrix6d::Identity());
}

Vector6d difference(const AlignmentState& state, const RelativeMotion& prior) {
  Vector6d d;
  d << state.t - prior.t_reference_other,
      rotation_log(Eigen::Matrix3d(state.R * prior.R_reference_other.transpose()));
  return d;
}

void move(AlignmentState& state, const Vector8d& step) {
  state.t += step.head<3>();
  state.R = rotation_exp(Eigen::Vector3d(step.segment<3>(3))).toRotationMatrix() * state.R;
  state.gain += step[6];
  state.offset += step[7];
}

/// Covariance of an error that all pixels share.
Vector6d shared_variance(const Eigen::Vector3d& t, double rotation_deg, double direction_deg) {
  constexpr double kLeast = 1e-12;
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(t.norm() * direction_deg * kRadian),
      Eigen::Vector3d::Constant(rotation_deg * kRadian);
  return sigma.cwiseMax(kLeast).cwiseAbs2();
}

/// Normal equations of images and prior together.
struct Equations {
  Matrix8d information;
  Vector8d gradient;
};

Equations equations(const AlignmentSums& sums, bool views, const AlignmentState& state,
                    const RelativeMotion& prior, const Matrix6d& prior_information,
                    const MotionAlignmentOptions& options) {
  const double count = options.inflation * sums.host.correlation;
  Equations out{sums.host.information / count, sums.host.gradient / count};
  if (views) {
    // The last depth is bent by an unknown motion: its variance is added, (H^-1 + F^-1)^-1 = F (H + F)^-1 H.
    constexpr double kExposureIsNot = 1e9;
    Vector8d stiffness = Vector8d::Constant(kExposureIsNot);
    stiffness.head<6>() =
        shared_variance(state.t, options.bent_rotation_deg, options.bent_direction_deg).cwiseInverse();
    const Matrix8d F = stiffness.asDiagonal();
    const Matrix8d share = (out.information + F).transpose().ldlt().solve(F).transpose();
    const Matrix8d bent = share * out.information;
    out.information = 0.5 * (bent + bent.transpose());
    out.gradient = share * out.gradient;
    const double of_views = options.inflation * sums.views.correlation;
    out.information += sums.views.information / of_views;
    out.gradient += sums.views.gradient / of_views;
  }
  out.information.topLeftCorner<6, 6>() += prior_information;
  out.gradient.head<6>() += prior_information * difference(state, prior);
  const double gain = 1 / (kExposureGain * kExposureGain);
  const double offset = 1 / (kExposureOffset * kExposureOffset);
  out.information(6, 6) += gain;
  out.gradient[6] += gain * (state.gain - 1);
  out.information(7, 7) += offset;
  out.gradient[7] += offset * state.offset;
  return out;
}

bool is_settled(const Vector8d& step, const Eigen::Vector3d& t) {
  constexpr double kLength = 1e-4;  // of the baseline
  constexpr double kAngle = 2e-6;
  return step.head<3>().norm() < kLength * t.norm() && step.segment<3>(3).norm() < kAngle;
}

/// Exposure of a view against the last frame: grey = gain * last + offset by least squares, thrice, each time
/// without what does not fit.
struct Exposure {
  double gain = 1, offset = 0;
  bool found = false;
};
Exposure exposure(const std::vector<MotionAligner::Point>& points,
                  const std::vector<MotionAligner::Glimpse>& glimpses) {
  Exposure now;
  for (const double limit : {40.0, 20.0, 20.0}) {
    double n = 0;
    double x = 0;
    double y = 0;
    double xx = 0;
    double xy = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto last = static_cast<double>(points[i].grey);
      const auto seen = static_cast<double>(glimpses[i].grey);
      if (!(std::abs(seen - now.gain * last - now.offset) < limit)) continue;  // NaN too
      n += 1;
      x += last;
      y += seen;
      xx += last * last;
      xy += last * seen;
    }
    const double determinant = n * xx - x * x;
    if (n < kFewest || !(determinant > 0)) return {};
    now.gain = (n * xy - x * y) / determinant;
    now.offset = (y - now.gain * x) / n;
  }
  constexpr double kLeastGain = 0.2;
  now.found = now.gain > kLeastGain;
  return now;
}

}  // namespace

Status check(const MotionAlignmentOptions& o) {
  constexpr double kHalfTurn = 180;
  const OptionRange ranges[] = {
      {"levels", static_cast<double>(o.levels), 1, 8},
      {"iterations", static_cast<double>(o.iterations), 1, 100},
      {"relative_sigma", o.relative_sigma, 0, 1},
      {"inflation", o.inflation, 1, 1e6},
      {"bent_rotation_deg", o.bent_rotation_deg, 0, kHalfTurn},
      {"bent_direction_deg", o.bent_direction_deg, 0, kHalfTurn},
      {"rotation_floor_deg", o.rotation_floor_deg, 0, kHalfTurn},
      {"direction_floor_deg", o.direction_floor_deg, 0, kHalfTurn},
  };
  return check_ranges(ranges);
}

/// Of each cell the pixel with depth whose slope is largest.
void MotionAligner::select(const AlignmentInput& input, int level) {
  points_.clear();
  const Camera& camera = input.camera;
  const cv::Mat& last = last_[static_cast<std::size_t>(level)];
  const int step = 1 << level;
  const double wanted = std::sqrt(static_cast<double>(last.total()) / kPoints);
  const int cell = std::clamp(static_cast<int>(wanted), kSmallestCell, kLargestCell);
  const int rows = last.rows / cell;
  const int columns = last.cols / cell;
  const auto most = static_cast<float>(options_.relative_sigma);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      Point best{};
      float best_slope = kLeastSlope * kLeastSlope;
      for (int v = std::max(1, row * cell); v < std::min(last.rows - 1, (row + 1) * cell); ++v) {
        const auto* above = last.ptr<std::uint8_t>(v - 1);
        const auto* line = last.ptr<std::uint8_t>(v);
        const auto* below = last.ptr<std::uint8_t>(v + 1);
        const int full_v = std::min(v * step, camera.height - 1);
        const auto* depth = input.depth.depth.ptr<float>(full_v);
        const auto* variance = input.depth.variance.ptr<float>(full_v);
        for (int u = std::max(1, column * cell); u < std::min(last.cols - 1, (column + 1) * cell); ++u) {
          const float gx = 0.5F * static_cast<float>(line[u + 1] - line[u - 1]);
          const float gy = 0.5F * static_cast<float>(below[u] - above[u]);
          const float slope = gx * gx + gy * gy;
          if (!(slope > best_slope)) continue;
          const int full_u = std::min(u * step, camera.width - 1);
          const float Z = depth[full_u];
          const float relative = std::sqrt(variance[full_u]) / Z;
          if (!(Z > 0) || !(relative <= most)) continue;
          best_slope = slope;
          best.X = Z * Eigen::Vector3f(static_cast<float>((u * step - camera.cx) / camera.fx),
                                       static_cast<float>((v * step - camera.cy) / camera.fy), 1);
          best.grey = static_cast<float>(line[u]);
          best.gx = gx;
          best.gy = gy;
          best.relative_sigma = relative;
        }
      }
      if (!(best.X.z() > 0)) continue;
      best.block = row * alignment_blocks_across / rows * alignment_blocks_across +
                   column * alignment_blocks_across / columns;
      points_.push_back(best);
    }
  }
}

void MotionAligner::look_from(const AlignmentInput::View& view, const Camera& camera,
                              std::vector<Glimpse>& out) {
  const Glimpse none{std::numeric_limits<float>::quiet_NaN(), 0};
  out.assign(points_.size(), none);
  const cv::Mat image = smoothed(view.image);
  const Eigen::Matrix3f R = view.T_view_last.matrix3().cast<float>();
  const Eigen::Vector3f t = view.T_view_last.translation.cast<float>();
  const auto fx = static_cast<float>(camera.fx);
  const auto fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx);
  const auto cy = static_cast<float>(camera.cy);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Eigen::Vector3f Y = R * points_[i].X;
    const Eigen::Vector3f X = Y + t;
    constexpr float kNearest = 0.1F;
    if (!(X.z() > kNearest)) continue;
    const float per_z = 1 / X.z();
    GreySample found{};
    if (!sample(image, fx * X.x() * per_z + cx, fy * X.y() * per_z + cy, found)) continue;
    const float jx = found.gx * fx * per_z;
    const float jy = found.gy * fy * per_z;
    out[i] = {found.grey, jx * Y.x() + jy * Y.y() - (jx * X.x() + jy * X.y()) * per_z * Y.z()};
  }
  const Exposure now = exposure(points_, out);
  if (!now.found) {
    out.assign(points_.size(), none);
    return;
  }
  const auto offset = static_cast<float>(now.offset);
  const auto per_gain = static_cast<float>(1 / now.gain);
  for (Glimpse& glimpse : out) {
    glimpse.grey = (glimpse.grey - offset) * per_gain;
    glimpse.by_log_depth *= per_gain;
  }
}

AlignedMotion MotionAligner::align(const AlignmentInput& input) {
  AlignedMotion out{input.start};
  const cv::Size size = input.camera.size();
  const bool fits =
      input.depth.depth.size() == size && input.newest.size() == size && input.last.size() == size;
  if (!options_.on || !fits || !input.prior.covariance.allFinite()) return out;
  make_levels(input.newest, options_.levels, newest_);
  make_levels(input.last, options_.levels, last_);

  const Matrix6d prior_information = information_of(input.prior);
  AlignmentState state{input.start.R_reference_other, input.start.t_reference_other};
  AlignmentSums sums;
  Equations last;
  for (int level = options_.levels - 1; level >= 0; --level) {
    select(input, level);
    glimpses_.clear();
    if (level == 0) {
      for (const AlignmentInput::View& view : input.views)
        look_from(view, input.camera, glimpses_.emplace_back());
    }
    for (int iteration = 0; iteration < options_.iterations; ++iteration) {
      sums = alignment_sums(input.camera, newest_[static_cast<std::size_t>(level)], level, points_, glimpses_,
                            state);
      if (sums.used < kFewest || sums.inliers < kFewest) break;
      last = equations(sums, !glimpses_.empty(), state, input.prior, prior_information, options_);
      const Vector8d step = -last.information.ldlt().solve(last.gradient);
      if (!step.allFinite()) return out;
      move(state, step);
      if (is_settled(step, state.t)) break;
    }
  }
  if (sums.used < kFewest || sums.inliers < kFewest) return out;
  out.pixels = sums.used;
  out.inlier_share = static_cast<double>(sums.inliers) / sums.used;
  const Vector6d moved = difference(state, input.prior);
  out.surprise = moved.dot(prior_information * moved);
  if (!(sums.noise < kMostNoise * sums.contrast) || !(out.inlier_share >= kLeastInliers) ||
      !(out.surprise <= kSurprise))
    return out;
  out.aligned = true;
  out.motion.t_reference_other = state.t;
  out.motion.R_reference_other = state.R;
  const Matrix6d left = last.information.ldlt().solve(Matrix8d::Identity()).topLeftCorner<6, 6>();
  out.motion.covariance = 0.5 * (left + left.transpose());
  out.motion.covariance.diagonal() +=
      shared_variance(state.t, options_.rotation_floor_deg, options_.direction_floor_deg);
  return out;
}

}  // namespace pade::depth
