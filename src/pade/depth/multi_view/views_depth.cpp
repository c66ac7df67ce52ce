#include "pade/depth/multi_view/views_depth.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "pade/core/compute/simd.hpp"
#include "pade/core/option_check.hpp"
#include "pade/depth/multi_view/read_kernel.hpp"
#include "pade/depth/multi_view/start_kernel.hpp"

namespace pade::depth {
namespace {

constexpr float kEpipoleRadius = 5;     // px: nearer to the epipole the parallax of a pair says little
constexpr float kUntold = 1.5F;         // px: less parallax of a pair does not gainsay what was found
constexpr float kNearestDepth = 0.05F;  // m
constexpr int kBoundRadius = 2;         // px
}  // namespace

Status check(const ViewsDepthOptions& o) {
  const OptionRange ranges[] = {
      {"sigma_scale", o.sigma_scale, above_zero, finite},
      {"relative_sigma", o.relative_sigma, 0, finite},
      {"agreement", o.agreement, 0, 1},
  };
  return check_ranges(ranges);
}

cv::Mat start_of_views(const DepthImage& two_view, const cv::Mat& flow, const Camera& camera,
                       const RelativeMotion& motion, const Pose& T_world_camera,
                       const InverseDepthImage& last, double baseline, const ViewsDepthOptions& options) {
  const Eigen::Vector3f t = motion.t_reference_other.cast<float>();
  StartParameters p{};
  p.fx = static_cast<float>(camera.fx);
  p.fy = static_cast<float>(camera.fy);
  p.cx = static_cast<float>(camera.cx);
  p.cy = static_cast<float>(camera.cy);
  p.fx_tx = p.fx * t.x();
  p.fy_ty = p.fy * t.y();
  p.tz = t.z();
  p.damping = std::pow(kEpipoleRadius * t.norm(), 2.0F);
  p.most = 1 / kNearestDepth;
  p.width = flow.cols;
  p.height = flow.rows;
  p.agreement = static_cast<float>(options.agreement);
  p.slack = static_cast<float>(3 / (camera.fx * baseline));
  p.untold = kUntold / (p.fx * t.norm());
  if (!last.empty()) {
    p.last = last.rho.ptr<float>();
    p.last_stride = static_cast<int>(last.rho.step1());
    const Pose T_last_reference = last.T_world_camera.inverse() * T_world_camera;
    const Eigen::Matrix3d R = T_last_reference.matrix3();
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) p.R[3 * r + c] = static_cast<float>(R(r, c));
      p.t[r] = static_cast<float>(T_last_reference.translation[r]);
    }
  }
  cv::Mat start(flow.size(), CV_32FC1);
  const auto isa = simd::best();
  for (int y = 0; y < flow.rows; ++y) {
    PADE_DISPATCH(start_row, isa)
    (p, y, two_view.depth.ptr<float>(y), flow.ptr<float>(y), start.ptr<float>(y));
  }
  return start;
}

namespace {

/// What a window has matched may be that of a pixel beside: no bound is beyond those around it.
void shorten_bounds(const cv::Mat& of_views, cv::Mat& bound) {
  constexpr int kSide = 2 * kBoundRadius + 1;
  cv::Mat least;
  cv::erode(of_views, least, cv::getStructuringElement(cv::MORPH_RECT, {kSide, kSide}));
  least.copyTo(bound, bound > least);
}

}  // namespace

void read_views(const ParallaxField& field, double scale, const CommonError& common,
                const DepthOptions& depth, const ViewsDepthOptions& options, DepthImage& image) {
  ReadParameters p{};
  p.scale = static_cast<float>(scale);
  p.per_scale = static_cast<float>(1 / scale);
  p.scale2 = static_cast<float>(scale * scale);
  p.range = static_cast<float>(depth.range);
  p.bound_sigmas = static_cast<float>(depth.bound_sigmas);
  p.gate2 = static_cast<float>(depth.parallax_gate * depth.parallax_gate);
  p.sigma_scale2 = static_cast<float>(options.sigma_scale * options.sigma_scale);
  p.relative2 = static_cast<float>(options.relative_sigma * options.relative_sigma);
  p.largest_parallax2 = common.largest_parallax2();
  p.views = common.views();
  const auto read = PADE_DISPATCH(read_row, simd::best());
  std::vector<float> errors;
  cv::Mat bounds(image.depth.size(), CV_32FC1);
  for (int v = 0; v < image.depth.rows; ++v) {
    if (v % CommonError::cell == 0) common.expand(v / CommonError::cell, image.depth.cols, errors);
    const ReadField row = {field.distance.ptr<float>(v),
                           field.information.ptr<float>(v),
                           field.spread.ptr<float>(v),
                           field.offset.ptr<float>(v),
                           field.matching.ptr<float>(v),
                           field.texture.ptr<float>(v),
                           errors.data()};
    read(p, row, image.depth.cols,
         {image.depth.ptr<float>(v), image.variance.ptr<float>(v), image.own_variance.ptr<float>(v),
          image.bound.ptr<float>(v), bounds.ptr<float>(v), image.state.ptr<std::uint8_t>(v)});
  }
  shorten_bounds(bounds, image.bound);
}

}  // namespace pade::depth
