#include "pade/core/camera.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

namespace pade {
namespace {

using Coefficients = std::array<double, 8>;

/// Distorted point and 2x2 Jacobian, in normalised image coordinates. Brown-Conrady with the rational factor;
/// plumb_bob is the case k4 = k5 = k6 = 0.
struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d jacobian;
};

Distorted distort_rational(const Coefficients& c, const Eigen::Vector2d& p) {
  const auto [k1, k2, p1, p2, k3, k4, k5, k6] = c;
  const double x = p.x();
  const double y = p.y();
  const double r2 = x * x + y * y;
  const double numerator = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double denominator = 1 + r2 * (k4 + r2 * (k5 + r2 * k6));
  const double radial = numerator / denominator;
  // d radial / d r2
  const double slope =
      ((k1 + r2 * (2 * k2 + 3 * r2 * k3)) - radial * (k4 + r2 * (2 * k5 + 3 * r2 * k6))) / denominator;
  Distorted out;
  out.point = {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
               y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
  out.jacobian(0, 0) = radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x;
  out.jacobian(0, 1) = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y;
  out.jacobian(1, 0) = out.jacobian(0, 1);
  out.jacobian(1, 1) = radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x;
  return out;
}

double equidistant_angle(const Coefficients& c, double theta) {
  const double t2 = theta * theta;
  return theta * (1 + t2 * (c[0] + t2 * (c[1] + t2 * (c[2] + t2 * c[3]))));
}

double equidistant_slope(const Coefficients& c, double theta) {
  const double t2 = theta * theta;
  return 1 + t2 * (3 * c[0] + t2 * (5 * c[1] + t2 * (7 * c[2] + t2 * 9 * c[3])));
}

/// The largest angle up to which the equidistant polynomial grows, at most pi.
double equidistant_limit(const Coefficients& c) {
  constexpr int kSteps = 1024;
  for (int i = 1; i <= kSteps; ++i) {
    const double theta = std::numbers::pi * i / kSteps;
    if (equidistant_slope(c, theta) <= 0) return std::numbers::pi * (i - 1) / kSteps;
  }
  return std::numbers::pi;
}

/// The largest radius (normalised, undistorted) up to which the radial polynomial grows; infinity where it
/// always does. Beyond it two scene points share a pixel, and the model means nothing.
double radial_limit(const Coefficients& c) {
  constexpr double kFarthest = 20;  // 87 degrees off the axis
  constexpr int kSteps = 200;
  Coefficients radial = c;
  radial[2] = radial[3] = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double r = kFarthest * i / kSteps;
    const double denominator = 1 + r * r * (c[5] + r * r * (c[6] + r * r * c[7]));
    const Distorted d = distort_rational(radial, {r, 0});
    if (!(denominator > 0) || !(d.jacobian(0, 0) > 0)) return kFarthest * (i - 1) / kSteps;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

Eigen::Matrix3d Camera::matrix() const {
  return (Eigen::Matrix3d() << fx, 0, cx, 0, fy, cy, 0, 0, 1).finished();
}

Camera Camera::undistorted() const {
  Camera ideal = *this;
  ideal.distortion = Distortion::none;
  ideal.coefficients = {};
  return ideal;
}

bool Camera::is_pinhole() const {
  if (distortion == Distortion::none) return true;
  if (distortion == Distortion::equidistant) return false;  // all zero is still a fisheye
  for (const double k : coefficients) {
    if (k != 0) return false;
  }
  return true;
}

std::optional<Eigen::Vector2d> Camera::project(const Eigen::Vector3d& point) const {
  Eigen::Vector2d image;  // normalised image coordinates
  if (distortion == Distortion::equidistant) {
    const double radius = std::hypot(point.x(), point.y());
    const double theta = std::atan2(radius, point.z());
    if (!(theta <= equidistant_limit(coefficients)) || (radius == 0 && !(point.z() > 0))) return std::nullopt;
    const double scale = radius > 0 ? equidistant_angle(coefficients, theta) / radius : 1 / point.z();
    image = scale * point.head<2>();
  } else {
    if (!(point.z() > 0)) return std::nullopt;
    image = point.head<2>() / point.z();
    if (!is_pinhole()) {
      if (!(image.norm() <= radial_limit(coefficients))) return std::nullopt;
      image = distort_rational(coefficients, image).point;
    }
  }
  return Eigen::Vector2d(fx * image.x() + cx, fy * image.y() + cy);
}

std::optional<Eigen::Vector3d> Camera::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d image((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (is_pinhole()) return Eigen::Vector3d(image.x(), image.y(), 1);

  constexpr int kIterations = 50;
  constexpr double kTolerance = 1e-12;
  if (distortion == Distortion::equidistant) {
    const double distorted = image.norm();
    if (distorted < 1e-12) return Eigen::Vector3d(image.x(), image.y(), 1);
    // Bisection inside the monotonic range: it cannot leave it, whatever the coefficients are.
    double low = 0;
    double high = std::min(equidistant_limit(coefficients), std::numbers::pi / 2);
    if (equidistant_angle(coefficients, high) <= distorted) return std::nullopt;
    for (int i = 0; i < kIterations; ++i) {
      const double middle = 0.5 * (low + high);
      (equidistant_angle(coefficients, middle) < distorted ? low : high) = middle;
    }
    const double theta = 0.5 * (low + high);
    const Eigen::Vector2d ray = std::tan(theta) / distorted * image;
    return Eigen::Vector3d(ray.x(), ray.y(), 1);
  }

  const double limit = radial_limit(coefficients);
  Eigen::Vector2d p = image;
  for (int i = 0; i < kIterations; ++i) {
    const Distorted d = distort_rational(coefficients, p);
    const Eigen::Vector2d residual = d.point - image;
    if (residual.norm() < kTolerance) break;
    Eigen::Vector2d step = d.jacobian.inverse() * residual;
    const double longest = 0.5 * (1 + p.norm());
    if (step.norm() > longest) step *= longest / step.norm();
    p -= step;
  }
  const bool converged = (distort_rational(coefficients, p).point - image).norm() < 1e-9;
  if (!converged || !(p.norm() <= limit)) return std::nullopt;
  return Eigen::Vector3d(p.x(), p.y(), 1);
}

Undistorter::Undistorter(const Camera& camera) : identity_(camera.is_pinhole()) {
  if (identity_) return;
  map_x_.create(camera.size(), CV_32FC1);
  map_y_.create(camera.size(), CV_32FC1);
  valid_.create(camera.size(), CV_8UC1);
  const double limit = camera.distortion == Distortion::equidistant ? equidistant_limit(camera.coefficients)
                                                                    : radial_limit(camera.coefficients);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector2d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
      Eigen::Vector2d image = ray;
      bool seen = true;
      if (camera.distortion == Distortion::equidistant) {
        const double radius = ray.norm();
        const double theta = std::atan(radius);
        seen = theta <= limit;
        if (radius > 0) image = equidistant_angle(camera.coefficients, theta) / radius * ray;
      } else {
        seen = ray.norm() <= limit;
        image = distort_rational(camera.coefficients, ray).point;
      }
      const double x = camera.fx * image.x() + camera.cx;
      const double y = camera.fy * image.y() + camera.cy;
      seen = seen && x >= 0 && y >= 0 && x <= camera.width - 1 && y <= camera.height - 1;
      map_x_.at<float>(v, u) = seen ? static_cast<float>(x) : -1e6F;
      map_y_.at<float>(v, u) = seen ? static_cast<float>(y) : -1e6F;
      valid_.at<std::uint8_t>(v, u) = seen ? 255 : 0;
    }
  }
}

cv::Mat Undistorter::operator()(const cv::Mat& image) const {
  if (identity_) return image;
  cv::Mat out;
  cv::remap(image, out, map_x_, map_y_, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar::all(0));
  return out;
}

cv::Mat Undistorter::depth(const cv::Mat& depth) const {
  if (identity_) return depth;
  cv::Mat out;
  cv::remap(depth, out, map_x_, map_y_, cv::INTER_NEAREST, cv::BORDER_CONSTANT,
            cv::Scalar::all(std::numeric_limits<double>::quiet_NaN()));
  return out;
}

}  // namespace pade
