#include "pade/depth/multi_view/views_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pade/core/option_check.hpp"

namespace pade::depth {
namespace {

constexpr float kEpipoleRadius = 5;  // px: nearer to the epipole the parallax of a pair says little
constexpr float kNearest = 0.05F;    // m

constexpr auto code(DepthState state) { return static_cast<std::uint8_t>(state); }

/// Bilinear; NaN outside.
float at(const cv::Mat& values, float x, float y) {
  const bool inside = x >= 0 && y >= 0 && x < static_cast<float>(values.cols - 1) &&
                      y < static_cast<float>(values.rows - 1);
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
    const Eigen::Vector3f ray =
        R_ * Eigen::Vector3f((x - cx_) / fx_, (y - cy_) / fy_, 1);
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

void read_views(const ParallaxField& field, double scale, const DepthOptions& depth,
                const ViewsDepthOptions& options, DepthImage& image) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto s = static_cast<float>(scale);
  const auto range = static_cast<float>(depth.range);
  const auto k = static_cast<float>(depth.bound_sigmas);
  const auto gate2 = static_cast<float>(depth.parallax_gate * depth.parallax_gate);
  const auto sigma_scale2 = static_cast<float>(options.sigma_scale * options.sigma_scale);
  const auto relative2 = static_cast<float>(options.relative_sigma * options.relative_sigma);
  for (int v = 0; v < image.depth.rows; ++v) {
    const auto* d_row = field.distance.ptr<float>(v);
    const auto* information = field.information.ptr<float>(v);
    const auto* spread = field.spread.ptr<float>(v);
    const auto* matching = field.matching.ptr<float>(v);
    auto* z_row = image.depth.ptr<float>(v);
    auto* variance = image.variance.ptr<float>(v);
    auto* own = image.own_variance.ptr<float>(v);
    auto* bound = image.bound.ptr<float>(v);
    auto* state = image.state.ptr<std::uint8_t>(v);
    for (int u = 0; u < image.depth.cols; ++u) {
      const bool blind = state[u] == code(DepthState::inconsistent) ||
                         state[u] == code(DepthState::out_of_view) ||
                         state[u] == code(DepthState::no_texture);
      if (blind || !(information[u] > 0)) continue;
      const float d = d_row[u];
      const float contradiction = matching[u] > 1 ? std::max(1.0F, spread[u] / (matching[u] - 1)) : 1.0F;
      const float sigma2 = sigma_scale2 * contradiction / information[u] + relative2 * d * d;
      const float nothing_before = s / (std::max(d, 0.0F) + k * std::sqrt(sigma2));
      if (!(bound[u] >= nothing_before)) bound[u] = nothing_before;
      const float z = s / d;
      const float e2 = sigma2 / (d * d);
      const float common = state[u] == code(DepthState::measured) ? variance[u] - own[u] : 0.0F;
      if (d > 0 && e2 * gate2 < 1 && z <= range) {
        const float common_here = common > 0 ? common * std::pow(z / z_row[u], 4.0F) : 0.0F;
        z_row[u] = z;
        own[u] = z * z * e2 * (1 + e2 * (18 + 400 * e2));
        variance[u] = own[u] + common_here;
        state[u] = code(DepthState::measured);
      } else if (state[u] == code(DepthState::measured)) {
        z_row[u] = variance[u] = own[u] = nan;
        state[u] = code(bound[u] >= range ? DepthState::far : DepthState::low_parallax);
      } else if (state[u] == code(DepthState::low_parallax) && bound[u] >= range) {
        state[u] = code(DepthState::far);
      }
    }
  }
}

}  // namespace pade::depth
