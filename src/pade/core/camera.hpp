// Pinhole camera with lens distortion: projection, back-projection (Eq. 3, corrected) and undistortion.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace pade {

/// Lens models, with the coefficient order of OpenCV and ROS.
enum class Distortion {
  none,                 ///< ideal pinhole
  plumb_bob,            ///< k1 k2 p1 p2 k3 (Brown-Conrady; 4 or 5 numbers)
  rational_polynomial,  ///< k1 k2 p1 p2 k3 k4 k5 k6 (8 numbers)
  equidistant,          ///< k1 k2 k3 k4 (Kannala-Brandt fisheye; 4 numbers)
};

/// Intrinsics of one camera. Pixel centres are at integer coordinates: the centre of the top-left pixel is
/// (0, 0).
struct Camera {
  int width = 0;                             ///< pixels
  int height = 0;                            ///< pixels
  double fx = 0;                             ///< focal length, horizontal, pixels
  double fy = 0;                             ///< focal length, vertical, pixels
  double cx = 0;                             ///< principal point, x to the right, pixels
  double cy = 0;                             ///< principal point, y down, pixels
  Distortion distortion = Distortion::none;  ///< lens model
  std::array<double, 8> coefficients{};      ///< in the order of the model, the rest zero

  /// Width and height, pixels.
  [[nodiscard]] cv::Size size() const { return {width, height}; }
  [[nodiscard]] Eigen::Matrix3d matrix() const;  ///< K = [fx 0 cx; 0 fy cy; 0 0 1], pixels

  /// The distortion-free camera that undistorted images have: same size, focal lengths and principal point.
  [[nodiscard]] Camera undistorted() const;
  /// True if every coefficient is zero, so that images need no undistortion.
  [[nodiscard]] bool is_pinhole() const;

  /// Pixel of a point in camera coordinates (metres). Empty for points behind the camera (Z <= 0; for the
  /// fisheye model any point but the origin has a pixel up to 180 degrees off the axis) and beyond the angle
  /// up to which the distortion polynomial is monotonic.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;

  /// Viewing ray (x/z, y/z, 1) of a pixel, the inverse of project(). Empty if the inverse does not exist
  /// (outside the monotonic range, or 90 degrees and more off the axis).
  [[nodiscard]] std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const;

  bool operator==(const Camera&) const = default;  ///< all fields are equal
};

/// Resamples images of a distorted camera to its undistorted() pinhole. Built once, used for every frame.
class Undistorter {
 public:
  /// Images pass through unchanged if `camera.is_pinhole()`.
  explicit Undistorter(const Camera& camera);

  /// `image`: any type, of the camera's size. Pixels that see nothing are 0.
  [[nodiscard]] cv::Mat operator()(const cv::Mat& image) const;
  /// Depth maps: nearest neighbour (depth edges must not be mixed), NaN where nothing is seen. CV_32FC1.
  /// Values are Z along the optical axis, which undistortion does not change.
  [[nodiscard]] cv::Mat depth(const cv::Mat& depth) const;

  /// 255 where the undistorted pixel was seen by the camera, 0 elsewhere. CV_8UC1; empty = all valid.
  [[nodiscard]] const cv::Mat& valid() const { return valid_; }

 private:
  bool identity_ = true;
  cv::Mat map_x_, map_y_;  // CV_32FC1: position in the distorted image of each undistorted pixel
  cv::Mat valid_;
};

}  // namespace pade
