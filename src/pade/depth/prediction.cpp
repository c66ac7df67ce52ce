#include "pade/depth/prediction.hpp"

#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace pade::depth {
namespace {

constexpr float kEpipoleRadius = 5;  // px: nearer to the epipole the parallax of a pair says little

/// a = -A t along a row of pixels: (x tz - fx tx, y tz - fy ty), in single precision.
struct Reach {
  Reach(const Camera& camera, const Eigen::Vector3d& t)
      : fx_tx(static_cast<float>(camera.fx * t.x())),
        fy_ty(static_cast<float>(camera.fy * t.y())),
        tz(static_cast<float>(t.z())) {}
  [[nodiscard]] float x(float column) const { return column * tz - fx_tx; }
  [[nodiscard]] float y(float row) const { return row * tz - fy_ty; }
  float fx_tx, fy_ty, tz;
};

/// Farther than the image is large nothing can be matched.
cv::Vec2f within(float u, float v, float largest) {
  const bool usable = std::abs(u) <= largest && std::abs(v) <= largest;  // false for NaN
  return usable ? cv::Vec2f(u, v) : cv::Vec2f(0, 0);
}

}  // namespace

cv::Mat predict_flow(const cv::Mat& flow, const Camera& camera, const RelativeMotion& from,
                     const RelativeMotion& to) {
  const Reach a(camera, from.t_reference_other);
  const Reach b(camera, to.t_reference_other);
  const float epipole = kEpipoleRadius * static_cast<float>(from.t_reference_other.norm());
  const float damping = epipole * epipole;
  const float forward = a.tz - b.tz;
  const auto cx = static_cast<float>(camera.cx);
  const auto cy = static_cast<float>(camera.cy);
  const auto largest = static_cast<float>(camera.width);
  cv::Mat out(flow.size(), CV_32FC2);
  for (int v = 0; v < flow.rows; ++v) {
    const auto* w = flow.ptr<cv::Vec2f>(v);
    auto* to_row = out.ptr<cv::Vec2f>(v);
    const float y = static_cast<float>(v) - cy;
    for (int u = 0; u < flow.cols; ++u) {
      const float x = static_cast<float>(u) - cx;
      const float ax = a.x(x);
      const float ay = a.y(y);
      const float ad = ax * w[u][0] + ay * w[u][1];
      const float rho = ad > 0 ? ad / (ax * ax + ay * ay + damping) : 0.0F;
      const float nearness = 1 + rho * forward;
      const float scale = nearness > 0 ? rho / nearness : 0.0F;
      to_row[u] = within(b.x(x) * scale, b.y(y) * scale, largest);
    }
  }
  return out;
}

cv::Mat filled_depth(const cv::Mat& depth) {
  constexpr int kReach = 31;                         // px
  const cv::Mat unknown = ~cv::Mat(depth == depth);  // NaN != NaN is false in OpenCV
  cv::Mat rho = 1 / depth;
  rho.setTo(0, unknown);
  cv::Mat known(depth.size(), CV_32FC1, cv::Scalar(1));
  known.setTo(0, unknown);
  cv::boxFilter(rho, rho, CV_32F, {kReach, kReach}, {-1, -1}, false, cv::BORDER_CONSTANT);
  cv::boxFilter(known, known, CV_32F, {kReach, kReach}, {-1, -1}, false, cv::BORDER_CONSTANT);
  cv::Mat filled = depth.clone();
  cv::Mat(known / rho).copyTo(filled, unknown & (known > 0.5F));
  return filled;
}

cv::Mat flow_of_depth(const cv::Mat& depth, const Camera& camera, const RelativeMotion& motion) {
  const Reach a(camera, motion.t_reference_other);
  const auto cx = static_cast<float>(camera.cx);
  const auto cy = static_cast<float>(camera.cy);
  const auto largest = static_cast<float>(camera.width);
  cv::Mat out(depth.size(), CV_32FC2);
  for (int v = 0; v < depth.rows; ++v) {
    const auto* z = depth.ptr<float>(v);
    auto* row = out.ptr<cv::Vec2f>(v);
    const float ay = a.y(static_cast<float>(v) - cy);
    for (int u = 0; u < depth.cols; ++u) {
      const float scale = z[u] > a.tz ? 1 / (z[u] - a.tz) : 0.0F;
      row[u] = within(a.x(static_cast<float>(u) - cx) * scale, ay * scale, largest);
    }
  }
  return out;
}

cv::Mat reproject_depth(const cv::Mat& depth, const Camera& camera, const Pose& T_to_from) {
  const float infinity = std::numeric_limits<float>::infinity();
  const Eigen::Matrix3f R = T_to_from.matrix3().cast<float>();
  const Eigen::Vector3f t = T_to_from.translation.cast<float>();
  const auto fx = static_cast<float>(camera.fx);
  const auto fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx);
  const auto cy = static_cast<float>(camera.cy);
  cv::Mat moved(depth.size(), CV_32FC1, cv::Scalar(infinity));
  for (int v = 0; v < depth.rows; ++v) {
    const auto* z = depth.ptr<float>(v);
    const float ry = (static_cast<float>(v) - cy) / fy;
    for (int u = 0; u < depth.cols; ++u) {
      if (!(z[u] > 0)) continue;
      const float rx = (static_cast<float>(u) - cx) / fx;
      const Eigen::Vector3f p = z[u] * (R * Eigen::Vector3f(rx, ry, 1)) + t;
      if (!(p.z() > 0.05F)) continue;
      const float x = fx * p.x() / p.z() + cx + 0.5F;
      const float y = fy * p.y() / p.z() + cy + 0.5F;
      const bool inside =
          x >= 0 && y >= 0 && x < static_cast<float>(depth.cols) && y < static_cast<float>(depth.rows);
      if (!inside) continue;
      auto& nearest = moved.at<float>(static_cast<int>(y), static_cast<int>(x));
      nearest = std::min(nearest, p.z());
    }
  }
  // A surface that comes nearer grows, and its pixels part: the nearest neighbour fills what is between them.
  cv::Mat grown;
  cv::erode(moved, grown, cv::Mat());
  cv::Mat filled = moved.clone();
  grown.copyTo(filled, moved == infinity);
  filled.setTo(std::numeric_limits<float>::quiet_NaN(), filled == infinity);
  return filled;
}

}  // namespace pade::depth
