#include "pade/depth/prediction.hpp"

#include <algorithm>
#include <cmath>

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

constexpr int kCoarse = 4;  // px of the image per pixel of the foretold depth

/// The camera that sees blocks of kCoarse pixels as its pixels.
Camera coarse(const Camera& camera) {
  Camera c = camera;
  c.width = (camera.width + kCoarse - 1) / kCoarse;
  c.height = (camera.height + kCoarse - 1) / kCoarse;
  c.fx /= kCoarse;
  c.fy /= kCoarse;
  c.cx = (camera.cx + 0.5) / kCoarse - 0.5;
  c.cy = (camera.cy + 0.5) / kCoarse - 0.5;
  return c;
}

/// Inverse depth on the pixels of `seen_by`, of every fourth pixel of another frame: the nearest where
/// several fall together, 0 where none does.
cv::Mat moved_inverse_depth(const cv::Mat& depth, const Camera& camera, const Pose& T_to_from,
                            const Camera& seen_by) {
  const Eigen::Matrix3f R = T_to_from.matrix3().cast<float>();
  const Eigen::Vector3f t = T_to_from.translation.cast<float>();
  const auto fx = static_cast<float>(seen_by.fx);
  const auto fy = static_cast<float>(seen_by.fy);
  const float cx = static_cast<float>(seen_by.cx) + 0.5F;
  const float cy = static_cast<float>(seen_by.cy) + 0.5F;
  const float per_fx = 1 / static_cast<float>(camera.fx);
  const float per_fy = 1 / static_cast<float>(camera.fy);
  cv::Mat moved(seen_by.height, seen_by.width, CV_32FC1, cv::Scalar(0));
  for (int v = kCoarse / 2; v < depth.rows; v += kCoarse) {
    const auto* z = depth.ptr<float>(v);
    const Eigen::Vector3f row = R * Eigen::Vector3f(0, (static_cast<float>(v - camera.cy)) * per_fy, 1);
    for (int u = kCoarse / 2; u < depth.cols; u += kCoarse) {
      if (!(z[u] > 0)) continue;
      const Eigen::Vector3f p = z[u] * (row + R.col(0) * (static_cast<float>(u - camera.cx) * per_fx)) + t;
      if (!(p.z() > 0.05F)) continue;
      const float rho = 1 / p.z();
      const float x = fx * p.x() * rho + cx;
      const float y = fy * p.y() * rho + cy;
      const bool inside =
          x >= 0 && y >= 0 && x < static_cast<float>(moved.cols) && y < static_cast<float>(moved.rows);
      if (!inside) continue;
      auto& nearest = moved.at<float>(static_cast<int>(y), static_cast<int>(x));
      nearest = std::max(nearest, rho);
    }
  }
  return moved;
}

/// Where nothing is known: the mean of what is known of the 9 x 9 pixels around.
void fill(cv::Mat& rho) {
  constexpr int kReach = 9;
  const cv::Mat unknown = rho == 0;
  cv::Mat known;
  cv::Mat(~unknown).convertTo(known, CV_32F, 1.0 / 255);
  cv::Mat sum;
  cv::boxFilter(rho, sum, CV_32F, {kReach, kReach}, {-1, -1}, false, cv::BORDER_CONSTANT);
  cv::boxFilter(known, known, CV_32F, {kReach, kReach}, {-1, -1}, false, cv::BORDER_CONSTANT);
  cv::Mat(sum / cv::max(known, 1)).copyTo(rho, unknown);
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

cv::Mat foretell_flow(const cv::Mat& depth, const Camera& camera, const Pose& T_reference_frame,
                      const RelativeMotion& motion) {
  const Camera seen_by = coarse(camera);
  cv::Mat rho = moved_inverse_depth(depth, camera, T_reference_frame, seen_by);
  fill(rho);
  const Reach a(seen_by, motion.t_reference_other);
  const auto cx = static_cast<float>(seen_by.cx);
  const auto cy = static_cast<float>(seen_by.cy);
  const auto largest = static_cast<float>(camera.width);
  cv::Mat flow(rho.size(), CV_32FC2);
  for (int v = 0; v < rho.rows; ++v) {
    const auto* r = rho.ptr<float>(v);
    auto* row = flow.ptr<cv::Vec2f>(v);
    const float ay = a.y(static_cast<float>(v) - cy);
    for (int u = 0; u < rho.cols; ++u) {
      const float nearness = 1 - r[u] * a.tz;  // D = a / (Z - t_z)
      const float scale = nearness > 0 ? kCoarse * r[u] / nearness : 0.0F;
      row[u] = within(a.x(static_cast<float>(u) - cx) * scale, ay * scale, largest);
    }
  }
  cv::Mat full;
  cv::resize(flow, full, {}, kCoarse, kCoarse, cv::INTER_NEAREST);
  return {full, cv::Rect(0, 0, camera.width, camera.height)};
}

}  // namespace pade::depth
