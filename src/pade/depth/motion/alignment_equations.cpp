#include "pade/depth/motion/alignment_equations.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "pade/core/compute/median.hpp"

namespace pade::depth {
namespace {

constexpr double kLeastNoise = 1;      // grey values
constexpr float kNearestPoint = 0.1F;  // m
constexpr int kFewestResiduals = 2 * alignment_blocks_across * alignment_blocks_across;

/// A point as the newest frame sees it.
struct Seen {
  std::size_t point;
  float grey;          // at the exposure of the last frame
  float by_log_depth;  // d grey / d log Z
  Eigen::Matrix<float, 6, 1> by_motion;
};

/// Sums of one point's residuals that share their derivatives.
struct Weighed {
  double weight = 0, moment = 0;
};

/// @param residual  grey values. @param spread  of it that the depth makes, as its standard deviation
Weighed weigh(float residual, float spread, double noise) {
  const auto r = static_cast<double>(residual);
  const auto d = static_cast<double>(spread);
  const double variance = noise * noise + d * d;
  const double outlying = r * r / (variance * tukey_reach * tukey_reach);
  if (!(outlying < 1)) return {};
  const double weight = (1 - outlying) * (1 - outlying) / variance;
  return {weight, weight * r};
}

/// Those before, the longest baseline most: half as much of each next.
Weighed weigh_views(const Seen& seen, float relative_sigma,
                    const std::vector<std::vector<MotionAligner::Glimpse>>& glimpses, double noise) {
  Weighed sum;
  double share = 1;
  for (auto view = glimpses.rbegin(); view != glimpses.rend(); ++view, share /= 2) {
    const MotionAligner::Glimpse& glimpse = (*view)[seen.point];
    if (!std::isfinite(glimpse.grey)) continue;
    const Weighed one =
        weigh(seen.grey - glimpse.grey, (seen.by_log_depth - glimpse.by_log_depth) * relative_sigma, noise);
    sum.weight += share * one.weight;
    sum.moment += share * one.moment;
  }
  return sum;
}

std::vector<Seen> see(const Camera& camera, const cv::Mat& image, int level,
                      const std::vector<MotionAligner::Point>& points, const AlignmentState& at) {
  const float scale = 1.0F / static_cast<float>(1 << level);
  const float fx = static_cast<float>(camera.fx) * scale;
  const float fy = static_cast<float>(camera.fy) * scale;
  const float cx = static_cast<float>(camera.cx) * scale;
  const float cy = static_cast<float>(camera.cy) * scale;
  const float per_gain = 1 / static_cast<float>(at.gain);
  const Eigen::Matrix3f R = at.R.cast<float>();
  const Eigen::Vector3f t = at.t.cast<float>();
  std::vector<Seen> all;
  all.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f Y = R * points[i].X;
    const Eigen::Vector3f X = Y + t;
    if (!(X.z() > kNearestPoint)) continue;
    const float per_z = 1 / X.z();
    const float x = X.x() * per_z;
    const float y = X.y() * per_z;
    GreySample found{};
    if (!sample(image, fx * x + cx, fy * y + cy, found)) continue;
    // The mean of both images' slopes makes the step one of second order.
    const float jx = 0.5F * (found.gx + points[i].gx) * fx * per_z;
    const float jy = 0.5F * (found.gy + points[i].gy) * fy * per_z;
    const Eigen::Vector3f j(jx, jy, -(jx * x + jy * y));
    Seen seen;
    seen.point = i;
    seen.grey = (found.grey - static_cast<float>(at.offset)) * per_gain;
    seen.by_log_depth = j.dot(Y);  // dX = Y dlog Z
    // dX = dt + theta x Y
    seen.by_motion << j.x(), j.y(), j.z(), Y.y() * j.z() - Y.z() * j.y(), Y.z() * j.x() - Y.x() * j.z(),
        Y.x() * j.y() - Y.y() * j.x();
    all.push_back(seen);
  }
  return all;
}

void measure_scale(const std::vector<Seen>& all, const std::vector<MotionAligner::Point>& points,
                   AlignmentSums& sums) {
  std::vector<float> sizes;
  sizes.reserve(all.size());
  for (const Seen& seen : all) sizes.push_back(std::abs(seen.grey - points[seen.point].grey));
  sums.noise = std::max(kLeastNoise, median_to_sigma * static_cast<double>(median(sizes)));
  for (std::size_t i = 0; i < all.size(); ++i) sizes[i] = points[all[i].point].grey;
  const float typical = median(sizes);
  for (float& size : sizes) size = std::abs(size - typical);
  sums.contrast = median_to_sigma * static_cast<double>(median(sizes));
}

}  // namespace

bool sample(const cv::Mat& image, float u, float v, GreySample& out) {
  const auto right = static_cast<float>(image.cols - 2);
  const auto bottom = static_cast<float>(image.rows - 2);
  if (!(u >= 1 && v >= 1 && u < right && v < bottom)) return false;
  const int column = static_cast<int>(u);
  const int row = static_cast<int>(v);
  const float a = u - static_cast<float>(column);
  const float b = v - static_cast<float>(row);
  const auto* upper = image.ptr<std::uint8_t>(row) + column;
  const auto* lower = image.ptr<std::uint8_t>(row + 1) + column;
  const auto upper_slope = static_cast<float>(upper[1] - upper[0]);
  const auto lower_slope = static_cast<float>(lower[1] - lower[0]);
  const float above = static_cast<float>(upper[0]) + a * upper_slope;
  const float below = static_cast<float>(lower[0]) + a * lower_slope;
  out = {above + b * (below - above), upper_slope + b * (lower_slope - upper_slope), below - above};
  return true;
}

void NormalEquations::add(const Vector8d& j, double weight, double moment, int block) {
  information.selfadjointView<Eigen::Lower>().rankUpdate(j, weight);
  of_blocks_.col(block) += moment * j;
}

void NormalEquations::finish() {
  information = Matrix8d(information.selfadjointView<Eigen::Lower>());
  for (int block = 0; block < kBlocks; ++block) gradient += of_blocks_.col(block);
  Matrix8d scatter = Matrix8d::Zero();
  for (int block = 0; block < kBlocks; ++block) {
    const Vector8d centred = of_blocks_.col(block) - gradient / kBlocks;
    scatter += centred * centred.transpose();
  }
  scatter *= static_cast<double>(kBlocks) / (kBlocks - 1);
  constexpr double kLeast = 1e-9;
  const Matrix8d regular = information + kLeast * information.trace() * Matrix8d::Identity();
  correlation = std::max(1.0, regular.ldlt().solve(scatter).trace() / 8);
}

AlignmentSums alignment_sums(const Camera& camera, const cv::Mat& image, int level,
                             const std::vector<MotionAligner::Point>& points,
                             const std::vector<std::vector<MotionAligner::Glimpse>>& glimpses,
                             const AlignmentState& at) {
  AlignmentSums sums;
  const std::vector<Seen> all = see(camera, image, level, points, at);
  sums.used = static_cast<int>(all.size());
  if (sums.used < kFewestResiduals) return sums;
  measure_scale(all, points, sums);
  const double noise = sums.noise;
  for (const Seen& seen : all) {
    const MotionAligner::Point& point = points[seen.point];
    Vector8d j;
    j << seen.by_motion.cast<double>(), -static_cast<double>(point.grey), -1;
    const Weighed host = weigh(seen.grey - point.grey, seen.by_log_depth * point.relative_sigma, noise);
    if (host.weight > 0) {
      ++sums.inliers;
      sums.host.add(j, host.weight, host.moment, point.block);
    }
    if (glimpses.empty()) continue;
    const Weighed views = weigh_views(seen, point.relative_sigma, glimpses, noise);
    if (views.weight > 0) sums.views.add(j, views.weight, views.moment, point.block);
  }
  sums.host.finish();
  if (!glimpses.empty()) sums.views.finish();
  return sums;
}

}  // namespace pade::depth
