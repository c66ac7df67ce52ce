#include "pade/depth/edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace pade::depth {
namespace {

constexpr int kLargestEpipole = 24;  // px
constexpr double kForward = 0.1;     // share of the motion along the axis; with less the epipole is elsewhere

/// Whether the state leaves a pixel to what its neighbours know: matched, but without parallax.
bool without_parallax(std::uint8_t state) {
  return state == static_cast<std::uint8_t>(DepthState::epipole) ||
         state == static_cast<std::uint8_t>(DepthState::low_parallax) ||
         state == static_cast<std::uint8_t>(DepthState::far);
}

/// Calls visit(v, u, radius) for the pixels within `radius` of a place, and says whether all lie in the
/// image.
template <class Visitor>
bool around(cv::Size size, const Eigen::Vector2d& place, int radius, Visitor&& visit) {
  const int cu = static_cast<int>(std::lround(place.x()));
  const int cv = static_cast<int>(std::lround(place.y()));
  if (cu - radius < 0 || cv - radius < 0 || cu + radius >= size.width || cv + radius >= size.height)
    return false;
  for (int v = cv - radius; v <= cv + radius; ++v) {
    for (int u = cu - radius; u <= cu + radius; ++u) visit(v, u, std::hypot(u - place.x(), v - place.y()));
  }
  return true;
}

}  // namespace

void close_epipole(DepthImage& image, const Camera& camera, const RelativeMotion& motion, double hole) {
  const Eigen::Vector3d& t = motion.t_reference_other;
  if (!(hole > 0) || image.window != 1 || image.bound.empty() || !(std::abs(t.z()) > kForward * t.norm()))
    return;
  const Eigen::Vector2d epipole(camera.fx * t.x() / t.z() + camera.cx, camera.fy * t.y() / t.z() + camera.cy);
  const double limit = 1e4;  // px; far outside the image, and safe to round
  if (!(epipole.cwiseAbs().maxCoeff() < limit)) return;
  const auto cap = [&](int radius) { return camera.fx * hole / (2.0 * radius); };

  // The least bound on each ring; infinity where a ring is empty, 0 where one of its pixels knows nothing.
  std::array<double, kLargestEpipole + 2> ring;
  ring.fill(std::numeric_limits<double>::infinity());
  const bool inside =
      around(image.bound.size(), epipole, kLargestEpipole + 1, [&](int v, int u, double distance) {
        const auto r = static_cast<std::size_t>(std::lround(distance));
        if (r >= ring.size()) return;
        const float bound = image.bound.at<float>(v, u);
        ring[r] = std::min(ring[r], std::isnan(bound) ? 0.0 : static_cast<double>(bound));
      });
  if (!inside) return;
  int radius = 1;
  while (radius <= kLargestEpipole && ring[static_cast<std::size_t>(radius)] < cap(radius)) ++radius;
  if (radius > kLargestEpipole) return;
  const auto closed = static_cast<float>(cap(radius));
  around(image.bound.size(), epipole, radius, [&](int v, int u, double distance) {
    float& bound = image.bound.at<float>(v, u);
    if (distance > radius || !without_parallax(image.state.at<std::uint8_t>(v, u)) || bound >= closed) return;
    bound = closed;
  });
}

void guard_edges(DepthImage& image, const EdgeOptions& options) {
  if (options.radius < 1 || image.empty()) return;
  constexpr auto kMeasured = static_cast<std::uint8_t>(DepthState::measured);
  const float infinity = std::numeric_limits<float>::infinity();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat unknown = image.state != kMeasured;
  const cv::Mat square =
      cv::getStructuringElement(cv::MORPH_RECT, {2 * options.radius + 1, 2 * options.radius + 1});
  const auto nearest_of = [&](const cv::Mat& values) {
    cv::Mat nearest = values.clone();
    nearest.setTo(infinity, unknown | ~cv::Mat(values == values));
    cv::erode(nearest, nearest, square, {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(infinity));
    return nearest;
  };
  const cv::Mat nearest = nearest_of(image.depth);
  const cv::Mat first_end = nearest_of(image.bound);
  const auto nearness = static_cast<float>(options.nearness);
  for (int v = 0; v < image.depth.rows; ++v) {
    auto* depth = image.depth.ptr<float>(v);
    auto* variance = image.variance.ptr<float>(v);
    auto* own = image.own_variance.ptr<float>(v);
    auto* bound = image.bound.ptr<float>(v);
    auto* state = image.state.ptr<std::uint8_t>(v);
    const auto* near = nearest.ptr<float>(v);
    const auto* end = first_end.ptr<float>(v);
    for (int u = 0; u < image.depth.cols; ++u) {
      if (bound[u] > end[u]) bound[u] = end[u];
      if (state[u] != kMeasured || near[u] >= nearness * depth[u]) continue;
      state[u] = static_cast<std::uint8_t>(DepthState::inconsistent);
      depth[u] = variance[u] = own[u] = nan;
    }
  }
}

}  // namespace pade::depth
