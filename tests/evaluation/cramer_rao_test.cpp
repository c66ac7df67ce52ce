// The bound is what the exact model, tried with noise, scatters by; and the figures of the method.
#include "pade/evaluation/cramer_rao.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade::evaluation {
namespace {

const Camera kCamera = {640, 480, 554.26, 554.26, 319.5, 239.5, Distortion::none, {}};

RelativeMotion motion_of(const Eigen::Vector3d& t, const Eigen::Vector3d& omega = Eigen::Vector3d::Zero()) {
  RelativeMotion motion;
  motion.t_reference_other = t;
  motion.R_reference_other = rotation_exp(omega).toRotationMatrix();
  return motion;
}

// The bound of a single pixel.
double bound_of(const Camera& camera, const RelativeMotion& motion, cv::Point pixel, double Z, double sigma,
                const PoseNoise& noise = {}) {
  cv::Mat depth(camera.size(), CV_32FC1, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
  depth.at<float>(pixel) = static_cast<float>(Z);
  return depth_bound(camera, motion, depth, sigma, noise).at<float>(pixel);
}

// Z of a pixel of the reference from where its point is seen in the other image: the exact form, least
// squares.
double depth_of(const Camera& camera, const RelativeMotion& motion, const Eigen::Vector2d& p,
                const Eigen::Vector2d& match) {
  const Eigen::Vector3d& t = motion.t_reference_other;
  const Eigen::Vector3d b = motion.R_reference_other * camera.unproject(match).value();
  const Eigen::Vector2d focal(camera.fx, camera.fy);
  const Eigen::Vector2d D = focal.cwiseProduct(b.head<2>() / b.z()) - p;
  const Eigen::Vector2d a = -focal.cwiseProduct(t.head<2>()) + p * t.z();
  return a.squaredNorm() / a.dot(D) + t.z();
}

struct Case {
  const char* name;
  Eigen::Vector3d t, omega;
  cv::Point pixel;
  double Z;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class Bound : public testing::TestWithParam<Case> {
 protected:
  // Another focal length in y, so that no one of them can stand for both.
  Camera camera_ = {640, 480, 554.26, 480, 319.5, 239.5, Distortion::none, {}};
  Case case_ = GetParam();
  RelativeMotion motion_ = motion_of(case_.t, case_.omega);
  Eigen::Vector2d pixel_{case_.pixel.x, case_.pixel.y};
  Eigen::Vector2d p_ = pixel_ - Eigen::Vector2d(camera_.cx, camera_.cy);
  Eigen::Vector3d point_ = case_.Z * camera_.unproject(pixel_).value();

  Eigen::Vector2d match() const {
    const Eigen::Matrix3d back = motion_.R_reference_other.transpose();
    return camera_.project(back * (point_ - case_.t)).value();
  }
};

TEST_P(Bound, IsNoiseOverTheSpeedOfTheMatchAlongItsLine) {
  // Fisher information of one pixel by numeric differentiation of the projection into the derotated other
  // camera.
  const double step = 1e-5 * case_.Z;
  const auto seen = [&](double Z) { return camera_.project(point_ / case_.Z * Z - case_.t).value(); };
  const double speed = (seen(case_.Z + step) - seen(case_.Z - step)).norm() / (2 * step);
  EXPECT_NEAR(bound_of(camera_, motion_, case_.pixel, case_.Z, 0.3) * speed / 0.3, 1, 1e-5);
}

TEST_P(Bound, IsWhatTheExactModelScattersByUnderFlowNoise) {
  const double sigma = 0.02;  // small against parallax: the bound is first order
  RelativeMotion derotated = motion_;
  derotated.R_reference_other.setIdentity();
  const Eigen::Vector2d there = camera_.project(point_ - case_.t).value();
  Random random(1);
  double squares = 0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::Vector2d noise(random.normal(), random.normal());
    squares += std::pow(depth_of(camera_, derotated, p_, there + sigma * noise) - case_.Z, 2);
  }
  const double bound = bound_of(camera_, motion_, case_.pixel, case_.Z, sigma);
  EXPECT_NEAR(std::sqrt(squares / kDraws) / bound, 1, 0.02);
}

TEST_P(Bound, IsWhatTheExactModelScattersByUnderPoseNoise) {
  const PoseNoise noise = {{3e-4, 5e-4, 7e-4}, {2e-5, 4e-5, 3e-5}};
  Random random(2);
  double squares = 0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    RelativeMotion believed = motion_;
    believed.t_reference_other += noise.translation.cwiseProduct(random.normal3());
    believed.R_reference_other =
        rotation_exp(noise.rotation.cwiseProduct(random.normal3())) * motion_.R_reference_other;
    squares += std::pow(depth_of(camera_, believed, p_, match()) - case_.Z, 2);
  }
  const double bound = bound_of(camera_, motion_, case_.pixel, case_.Z, 0, noise);
  EXPECT_NEAR(std::sqrt(squares / kDraws) / bound, 1, 0.02);
  const double both = bound_of(camera_, motion_, case_.pixel, case_.Z, 0.1, noise);
  EXPECT_NEAR(both, std::hypot(bound, bound_of(camera_, motion_, case_.pixel, case_.Z, 0.1)), 1e-5 * both);
}

INSTANTIATE_TEST_SUITE_P(
    Of, Bound,
    testing::Values(Case{"Sideways", {0.2, 0, 0}, {0, 0, 0}, {200, 100}, 6},
                    Case{"SidewaysWhileTurning", {0.2, 0.01, 0.03}, {0.01, 0.03, -0.02}, {500, 300}, 5},
                    Case{"ForwardToTheNewestFrame", {0.01, -0.02, -0.2}, {0, 0.02, 0}, {600, 40}, 4},
                    Case{"ForwardFromTheFirstFrame", {0, 0.01, 0.2}, {0.02, 0, 0.01}, {40, 400}, 3},
                    Case{"Upward", {0.02, -0.3, 0.05}, {-0.02, 0.01, 0.03}, {320, 240}, 8}),
    [](const auto& instance) { return instance.param.name; });

// Mean over the image outside `blind` px of its centre.
double image_mean(const RelativeMotion& motion, double Z, double sigma, double blind) {
  const cv::Mat bound = depth_bound(kCamera, motion, cv::Mat(kCamera.size(), CV_32FC1, cv::Scalar(Z)), sigma);
  double sum = 0;
  int count = 0;
  for (int v = 0; v < bound.rows; ++v) {
    for (int u = 0; u < bound.cols; ++u) {
      if (std::hypot(u - kCamera.cx, v - kCamera.cy) < blind) continue;
      sum += bound.at<float>(v, u);
      ++count;
    }
  }
  return sum / count;
}

TEST(DepthBound, HasTheFiguresOfTheMethodForOnePixelAndTwentyCentimetres) {
  constexpr std::array<double, 4> depths = {2, 6, 10, 14};
  constexpr std::array<double, 4> sideways = {0.036, 0.325, 0.90, 1.77};
  constexpr std::array<double, 4> forward = {0.14, 1.14, 3.1, 6.0};
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const double side = image_mean(motion_of({-0.2, 0, 0}), depths[i], 1, 0);
    EXPECT_NEAR(side / sideways[i], 1, 0.006) << depths[i] << " m sideways: " << side;
    const double ahead = image_mean(motion_of({0, 0, -0.2}), depths[i], 1, 20);
    EXPECT_NEAR(ahead / forward[i], 1, 0.03) << depths[i] << " m forward: " << ahead;
  }
}

TEST(DepthBound, AtTheBorderOfTheBlindZoneTheErrorIsTheDepth) {
  // Radius sigma (Z + b)² / (f b Z / f) px around the focus of expansion, 0.94 m at 10 m.
  const double Z = 10, baseline = 0.2;
  const double radius = std::pow(Z + baseline, 2) / (baseline * Z);
  EXPECT_NEAR(radius * Z / kCamera.fx, 0.94, 0.005);
  Camera camera = kCamera;
  camera.cx = 320 - radius;  // so that a pixel lies on that border
  camera.cy = 240;
  EXPECT_NEAR(bound_of(camera, motion_of({0, 0, -baseline}), {320, 240}, Z, 1), Z, 1e-3);
}

TEST(DepthBound, GrowsWithFlowNoiseInProportion) {
  const RelativeMotion motion = motion_of({0.1, 0.05, -0.2});
  const double one = bound_of(kCamera, motion, {100, 100}, 7, 1);
  EXPECT_NEAR(bound_of(kCamera, motion, {100, 100}, 7, 0.1), 0.1 * one, 1e-6);
}

TEST(DepthBound, IsNaNWhereTwoFramesHaveNoAnswer) {
  Camera camera = kCamera;
  camera.cx = 320;
  camera.cy = 240;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const RelativeMotion forward = motion_of({0, 0, 0.5});
  EXPECT_TRUE(std::isnan(bound_of(camera, forward, {320, 240}, 5, 1))) << "the epipole";
  EXPECT_TRUE(std::isnan(bound_of(camera, forward, {100, 100}, 0.4, 1))) << "behind the second camera";
  EXPECT_TRUE(std::isnan(bound_of(camera, motion_of({0, 0, 0}), {100, 100}, 5, 1))) << "hover";
  for (const double none : {nan, 0.0, -1.0, std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(std::isnan(bound_of(camera, forward, {100, 100}, none, 1))) << none;
  }
}

TEST(UniformNoise, HasTheSpreadOfAUniformError) {
  const RelativeMotion motion = motion_of({0.2, -0.1, 0}, {0, 0.03, -0.01});
  const PoseNoise noise = uniform_noise(motion, 0.2);
  Random random(4);
  double squares = 0;
  constexpr int kDraws = 100000;
  for (int i = 0; i < kDraws; ++i) squares += std::pow(0.2 * random.uniform(-0.2, 0.2), 2);
  EXPECT_NEAR(noise.translation.x() / std::sqrt(squares / kDraws), 1, 0.01);
  EXPECT_NEAR(noise.translation.y(), 0.5 * noise.translation.x(), 1e-12);
  EXPECT_EQ(noise.translation.z(), 0);
  EXPECT_NEAR(noise.rotation.y() / noise.rotation.z(), 3, 1e-9);
}

}  // namespace
}  // namespace pade::evaluation
