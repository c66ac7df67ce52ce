#include "pade/io/recording/flight/recorded_camera.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "pade/io/sequence/calibration_fields.hpp"

namespace pade::io {

bool is_rectified(std::string_view name) {
  while (!name.empty()) {
    const std::size_t end = std::min(name.find_first_of("/_"), name.size());
    if (name.substr(0, end) == "rect" || name.substr(0, end) == "rectified") return true;
    name.remove_prefix(std::min(end + 1, name.size()));
  }
  return false;
}

Result<Camera> camera_of(const CameraInfoMessage& info, bool rectified) {
  if (info.binning_x > 1 || info.binning_y > 1 || info.x_offset > 0 || info.y_offset > 0)
    return Error{"the images are binned or cut, expected the calibration of the images as they are"};
  Camera camera;
  camera.width = static_cast<int>(std::min<std::uint32_t>(info.width, 1U << 20));
  camera.height = static_cast<int>(std::min<std::uint32_t>(info.height, 1U << 20));
  constexpr std::array<double, 9> kIdentity = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  if (rectified && info.r != kIdentity) {
    return Error{
        "the rectified images are turned against the camera (R is not 1), which is not understood: take "
        "those that "
        "are not rectified"};
  }
  const auto& p = info.p;
  camera.fx = rectified ? p[0] : info.k[0];
  camera.cx = rectified ? p[2] : info.k[2];
  camera.fy = rectified ? p[5] : info.k[4];
  camera.cy = rectified ? p[6] : info.k[5];
  if (!(camera.fx > 0) || !(camera.fy > 0) || !std::isfinite(camera.fx + camera.fy + camera.cx + camera.cy)) {
    return Error{
        fmt::format("found the focal lengths {} and {}, expected positive numbers: the camera was never "
                    "calibrated",
                    camera.fx, camera.fy)};
  }
  if (!rectified && std::abs(info.k[1]) > 1e-6 * camera.fx) return Error{"found a skew, expected none"};
  if (rectified || info.d.empty()) return camera;
  if (const auto problem = set_distortion(camera, info.model, info.d)) return Error{*problem};
  return camera;
}

}  // namespace pade::io
