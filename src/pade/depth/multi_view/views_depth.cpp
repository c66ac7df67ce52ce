#include "pade/depth/multi_view/views_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

#include "pade/core/option_check.hpp"

namespace pade::depth {
namespace {

constexpr float kEpipoleRadius = 5;  // px: nearer to the epipole the parallax of a pair says little
constexpr float kNearest = 0.05F;    // m
constexpr int kBoundRadius = 2;      // px
constexpr float kTexture = 1.6F;     // least squared slopes, in those of noise
constexpr float kVague = 0.5F;       // px: sigma of the parallax from which on the image says nothing of it

constexpr auto code(DepthState state) { return static_cast<std::uint8_t>(state); }

/// Bilinear; NaN outside.
float at(const cv::Mat& values, float x, float y) {
  const bool inside =
      x >= 0 && y >= 0 && x < static_cast<float>(values.cols - 1) && y < static_cast<float>(values.rows - 1);
  if (!inside) return std::numeric_limits<float>::quiet_NaN();
  const int ix = static_cast<int>(x);
  const int iy = static_cast<int>(y);
  const float ax = x - static_cast<float>(ix);
  const float ay = y - static_cast<float>(iy);
  const auto* top = values.ptr<float>(iy) + ix;
  const auto* bottom = values.ptr<float>(iy + 1) + ix;
  const float above = top[0] + ax * (top[1] - top[0]);
  const float below = bottom[0] + ax * (bottom[1] - bottom[0]);
  return above + ay * (below - above);
}

/// Looks up in another frame what it knows of a point.
class Lookup {
 public:
  Lookup(const InverseDepthImage& last, const Camera& camera, const Pose& T_world_camera)
      : rho_(last.rho),
        fx_(static_cast<float>(camera.fx)),
        fy_(static_cast<float>(camera.fy)),
        cx_(static_cast<float>(camera.cx)),
        cy_(static_cast<float>(camera.cy)) {
    const Pose T_last_camera = last.T_world_camera.inverse() * T_world_camera;
    R_ = T_last_camera.matrix3().cast<float>();
    t_ = T_last_camera.translation.cast<float>();
  }
  /// Inverse depth, here, of what the last frame saw where a point of inverse depth `rho` on the ray of (x,
  /// y) was; NaN = it did not see it.
  [[nodiscard]] float operator()(float x, float y, float rho) const {
    const Eigen::Vector3f ray = R_ * Eigen::Vector3f((x - cx_) / fx_, (y - cy_) / fy_, 1);
    const Eigen::Vector3f q = ray + rho * t_;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    if (!(q.z() > 0)) return nan;
    const float there = at(rho_, fx_ * q.x() / q.z() + cx_, fy_ * q.y() / q.z() + cy_);
    // Z_last = Z ray_z + t_z
    const float here = there * ray.z() / (1 - there * t_.z());
    return here * kNearest < 1 ? here : nan;
  }

 private:
  cv::Mat rho_;
  float fx_, fy_, cx_, cy_;
  Eigen::Matrix3f R_;
  Eigen::Vector3f t_;
};

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
  const float fx_tx = static_cast<float>(camera.fx) * t.x();
  const float fy_ty = static_cast<float>(camera.fy) * t.y();
  const float damping = std::pow(kEpipoleRadius * t.norm(), 2.0F);
  const auto cx = static_cast<float>(camera.cx);
  const auto cy = static_cast<float>(camera.cy);
  const auto agreement = static_cast<float>(options.agreement);
  const auto slack = static_cast<float>(3 / (camera.fx * baseline));
  const bool asks = !last.empty();
  const Lookup lookup(last, camera, T_world_camera);
  cv::Mat start(flow.size(), CV_32FC1);
  for (int v = 0; v < flow.rows; ++v) {
    const auto* w = flow.ptr<cv::Vec2f>(v);
    const auto* depth = two_view.depth.ptr<float>(v);
    auto* out = start.ptr<float>(v);
    const auto y = static_cast<float>(v);
    const float ay = (y - cy) * t.z() - fy_ty;
    for (int u = 0; u < flow.cols; ++u) {
      const auto x = static_cast<float>(u);
      const float ax = (x - cx) * t.z() - fx_tx;
      const float ad = ax * w[u][0] + ay * w[u][1];
      const float reach = ad > 0 ? ad / (ax * ax + ay * ay + damping) : 0.0F;  // of Z - t_z
      float rho = depth[u] > 0 ? 1 / depth[u] : reach / (1 + reach * t.z());
      if (!(rho >= 0) || rho * kNearest > 1) rho = 0;
      if (asks) {
        const float found = lookup(x, y, rho);
        if (std::abs(found - rho) < agreement * std::max(found, rho) + slack) rho = found;
      }
      out[u] = rho;
    }
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
      const float shared = scale2 * common(u, v, std::max(d[u], 0.0F) * per_scale);
      bound[u] = reader.bound(d[u], sigma2 + shared);
      if (!(row.bound[u] >= bound[u])) row.bound[u] = bound[u];
      if (reader.is_measured(d[u], sigma2)) {
        reader.place(row, u, d[u], sigma2, shared);
      } else {
        reader.refuse(row, u, sigma2);
      }
    }
  }
  shorten_bounds(bounds, image.bound);
}

}  // namespace pade::depth
