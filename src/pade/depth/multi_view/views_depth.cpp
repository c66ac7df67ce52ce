#include "pade/depth/multi_view/views_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

#include "pade/core/compute/simd.hpp"
#include "pade/core/option_check.hpp"
#include "pade/depth/multi_view/start_kernel.hpp"

namespace pade::depth {
namespace {

constexpr float kEpipoleRadius = 5;     // px: nearer to the epipole the parallax of a pair says little
constexpr float kUntold = 1.5F;         // px: less parallax of a pair does not gainsay what was found
constexpr float kNearestDepth = 0.05F;  // m
constexpr int kBoundRadius = 2;         // px
constexpr float kTexture = 1.6F;        // least squared slopes, in those of noise
constexpr float kClearTexture = 2.4F;   // ... of a pixel that has a bound, but no depth
constexpr float kVague = 0.5F;  // px: sigma of the parallax from which on the image says nothing of it

constexpr auto code(DepthState state) { return static_cast<std::uint8_t>(state); }

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

/// Rows of the planes of a depth image.
struct Row {
  Row(DepthImage& image, int v)
      : depth(image.depth.ptr<float>(v)),
        variance(image.variance.ptr<float>(v)),
        own_variance(image.own_variance.ptr<float>(v)),
        bound(image.bound.ptr<float>(v)),
        state(image.state.ptr<std::uint8_t>(v)) {}
  float* depth;
  float* variance;
  float* own_variance;
  float* bound;
  std::uint8_t* state;
};

/// What is decided per pixel.
class Reader {
 public:
  Reader(double scale, const DepthOptions& depth, const ViewsDepthOptions& options)
      : scale_(static_cast<float>(scale)),
        range_(static_cast<float>(depth.range)),
        k_(static_cast<float>(depth.bound_sigmas)),
        gate2_(static_cast<float>(depth.parallax_gate * depth.parallax_gate)),
        sigma_scale2_(static_cast<float>(options.sigma_scale * options.sigma_scale)),
        relative2_(static_cast<float>(options.relative_sigma * options.relative_sigma)) {}

  /// sigma^2 of d: the views' own, more where they contradict each other, and a share of d.
  [[nodiscard]] float variance(float d, float information, float matching, float spread) const {
    const float contradiction = matching > 1 ? std::max(1.0F, spread / (matching - 1)) : 1.0F;
    return sigma_scale2_ * contradiction / information + relative2_ * d * d;
  }
  /// Z before which there is nothing.
  [[nodiscard]] float bound(float d, float sigma2) const {
    return scale_ / (std::max(d, 0.0F) + k_ * std::sqrt(sigma2));
  }
  /// A pixel whose depth was no good.
  static void drop(const Row& row, int u, DepthState why) {
    row.depth[u] = row.variance[u] = row.own_variance[u] = std::numeric_limits<float>::quiet_NaN();
    row.state[u] = code(why);
  }
  /// Whether a depth with this variance is one to publish.
  [[nodiscard]] bool is_measured(float d, float sigma2) const {
    return d > 0 && sigma2 * gate2_ < d * d && scale_ <= range_ * d;
  }
  /// Depth, variance and state in place of what pixel u has.
  /// @param common  variance of d that all pixels share
  void place(const Row& row, int u, float d, float sigma2, float common) const {
    const float z = scale_ / d;
    const float e2 = sigma2 / (d * d);
    row.depth[u] = z;
    row.own_variance[u] = z * z * e2 * (1 + e2 * (18 + 400 * e2));
    row.variance[u] = row.own_variance[u] + z * z * common / (d * d);
    row.state[u] = code(DepthState::measured);
  }
  /// What a pixel is that the views have seen without measuring it.
  void refuse(const Row& row, int u, float sigma2) const {
    if (row.state[u] == code(DepthState::epipole)) return;
    const bool vague = sigma2 > kVague * kVague;
    if (row.state[u] == code(DepthState::measured) || vague) {
      drop(row, u, vague ? DepthState::no_texture : DepthState::low_parallax);
    }
    const bool low = row.state[u] == code(DepthState::low_parallax);
    if (low && row.bound[u] >= range_) row.state[u] = code(DepthState::far);
  }

 private:
  float scale_, range_, k_, gate2_, sigma_scale2_, relative2_;
};

/// States of a pair in which several views are not asked.
bool is_blind(std::uint8_t state) {
  return state == code(DepthState::inconsistent) || state == code(DepthState::out_of_view) ||
         state == code(DepthState::no_texture);
}

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
  const Reader reader(scale, depth, options);
  const auto per_scale = static_cast<float>(1 / scale);
  const auto scale2 = static_cast<float>(scale * scale);
  cv::Mat bounds(image.depth.size(), CV_32FC1, cv::Scalar(std::numeric_limits<float>::infinity()));
  for (int v = 0; v < image.depth.rows; ++v) {
    const Row row(image, v);
    const auto* d = field.distance.ptr<float>(v);
    const auto* information = field.information.ptr<float>(v);
    const auto* spread = field.spread.ptr<float>(v);
    const auto* matching = field.matching.ptr<float>(v);
    const auto* offset = field.offset.ptr<float>(v);
    const auto* texture = field.texture.ptr<float>(v);
    auto* bound = bounds.ptr<float>(v);
    for (int u = 0; u < image.depth.cols; ++u) {
      if (is_blind(row.state[u])) continue;
      if (!(information[u] > 0) || !(texture[u] > kTexture)) {
        if (matching[u] > 0) Reader::drop(row, u, DepthState::no_texture);
        continue;
      }
      const float sigma2 =
          reader.variance(d[u], information[u], matching[u], spread[u]) + offset[u] * offset[u];
      const bool measured = reader.is_measured(d[u], sigma2);
      // A vague bound is worse than that of the outline around.
      if (!measured && !(texture[u] > kClearTexture)) {
        Reader::drop(row, u, DepthState::no_texture);
        continue;
      }
      const float shared = scale2 * common(u, v, std::max(d[u], 0.0F) * per_scale);
      bound[u] = reader.bound(d[u], sigma2 + shared);
      if (!(row.bound[u] >= bound[u])) row.bound[u] = bound[u];
      if (measured) {
        reader.place(row, u, d[u], sigma2, shared);
      } else {
        reader.refuse(row, u, sigma2);
      }
    }
  }
  shorten_bounds(bounds, image.bound);
}

}  // namespace pade::depth
