#include "pade/depth/motion/motion_alignment.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "pade/core/random.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade::depth {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Images and exact depth of a flight at half the paper's resolution.
struct Flown {
  simulation::AnalyticFlight flight;
  std::vector<cv::Mat> images, depth;
  explicit Flown(const std::string& name, int frames = 10)
      : flight(*simulation::make_analytic_flight(name, frames, simulation::analytic_camera(320, 240))) {
    for (const Pose& pose : flight.T_world_camera) {
      simulation::AnalyticRenderOptions options;
      options.noise_sigma = 1;
      options.noise_seed = images.size() + 1;
      images.push_back(simulation::render_image(flight.scene, flight.camera, pose, options));
      depth.push_back(simulation::exact_depth(flight.scene, flight.camera, pose));
    }
  }
  /// Of frame `other` seen from `reference`.
  [[nodiscard]] RelativeMotion motion(std::size_t reference, std::size_t other) const {
    return relative_motion(flight.T_world_camera[reference], flight.T_world_camera[other], -0.1);
  }
  /// Exact depth of frame k, said to have a standard deviation of 1 %.
  [[nodiscard]] DepthImage depth_of(std::size_t k) const {
    DepthImage image;
    image.time = flight.times[k];
    image.depth = depth[k].clone();
    image.variance = depth[k].mul(depth[k], 1e-4);
    return image;
  }
};
const Flown& flown(const std::string& name) {
  static const Flown forward("forward");
  static const Flown turning("turning");
  static const Flown sideways("sideways");
  return name == "forward" ? forward : name == "turning" ? turning : sideways;
}

Matrix6d covariance(double across, double turn) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(across), Eigen::Vector3d::Constant(turn);
  return sigma.cwiseAbs2().asDiagonal();
}

/// `truth` with an error drawn from the covariance that it carries.
RelativeMotion drawn(const RelativeMotion& truth, double across, double turn, Random& random) {
  RelativeMotion prior = truth;
  prior.t_reference_other += across * random.normal3();
  prior.R_reference_other =
      rotation_exp(turn * random.normal3()).toRotationMatrix() * truth.R_reference_other;
  prior.covariance = covariance(across, turn);
  return prior;
}

struct Error {
  double rotation, direction;  // degrees
  double length;               // relative
};
Error error_of(const RelativeMotion& found, const RelativeMotion& truth) {
  const Eigen::Matrix3d turn = truth.R_reference_other.transpose() * found.R_reference_other;
  const double cosine = found.t_reference_other.normalized().dot(truth.t_reference_other.normalized());
  return {rotation_log(turn).norm() / kDegree, std::acos(std::min(1.0, cosine)) / kDegree,
          found.t_reference_other.norm() / truth.t_reference_other.norm() - 1};
}

TEST(MotionAligner, FindsTheMotionWhateverTheExposure) {
  MotionAligner aligner;
  Random random(1);
  for (const std::string name : {"forward", "turning", "sideways"}) {
    const Flown& f = flown(name);
    for (const double gain : {1.0, 0.8, 1.15}) {
      SCOPED_TRACE(name + ", gain " + std::to_string(gain));
      cv::Mat newest;
      f.images[5].convertTo(newest, CV_8U, gain, gain < 1 ? 12 : -8);
      const RelativeMotion truth = f.motion(5, 4);
      const RelativeMotion prior = drawn(truth, 0.03, 0.1 * kDegree, random);
      const DepthImage depth = f.depth_of(4);
      const AlignedMotion found = aligner.align({f.flight.camera, newest, f.images[4], depth, prior, prior});
      ASSERT_TRUE(found.aligned);
      EXPECT_GT(found.pixels, 500);
      EXPECT_GT(found.inlier_share, 0.8);
      const Error error = error_of(found.motion, truth);
      EXPECT_LT(error.rotation, 0.02);
      EXPECT_LT(error.direction, 0.8);
      EXPECT_NEAR(error.length, 0, 0.01);
    }
  }
}

TEST(MotionAligner, TheLengthIsThatOfTheDepthNotOfThePrior) {
  MotionAligner aligner;
  const Flown& f = flown("forward");
  const RelativeMotion truth = f.motion(5, 4);
  RelativeMotion prior = truth;
  prior.covariance = covariance(0.005, 0.1 * kDegree);
  for (const double scale : {0.8, 1.0, 1.25}) {
    DepthImage depth = f.depth_of(4);
    depth.depth *= scale;
    depth.variance *= scale * scale;
    const AlignedMotion found =
        aligner.align({f.flight.camera, f.images[5], f.images[4], depth, prior, prior});
    ASSERT_TRUE(found.aligned);
    EXPECT_NEAR(found.motion.t_reference_other.norm() / truth.t_reference_other.norm(), scale, 0.01 * scale);
  }
}

TEST(MotionAligner, WhatThePriorKnowsExactlyStays) {
  MotionAligner aligner;
  const Flown& f = flown("turning");
  RelativeMotion prior = f.motion(5, 4);
  prior.covariance = covariance(0.02, 0);
  prior.t_reference_other += Eigen::Vector3d(0.02, -0.01, 0.01);
  const DepthImage depth = f.depth_of(4);
  const AlignedMotion found = aligner.align({f.flight.camera, f.images[5], f.images[4], depth, prior, prior});
  ASSERT_TRUE(found.aligned);
  const Error error = error_of(found.motion, f.motion(5, 4));
  EXPECT_LT(error.rotation, 1e-4);
  EXPECT_LT(error.direction, 0.8);
}

TEST(MotionAligner, TheCovarianceIsAsLargeAsTheErrors) {
  // Of the noise of images, depth and prior together: the mean squared Mahalanobis distance of six unknowns
  // is 6.
  double sum = 0;
  int count = 0;
  MotionAligner aligner;
  Random random(7);
  for (const std::string name : {"forward", "turning", "sideways"}) {
    const Flown& f = flown(name);
    for (std::size_t k = 1; k < f.images.size(); ++k) {
      const RelativeMotion truth = f.motion(k, k - 1);
      const RelativeMotion prior = drawn(truth, 0.02, 0.1 * kDegree, random);
      DepthImage depth = f.depth_of(k - 1);
      for (int v = 0; v < depth.depth.rows; ++v)
        for (int u = 0; u < depth.depth.cols; ++u)
          depth.depth.at<float>(v, u) *= static_cast<float>(1 + 0.01 * random.normal());
      const AlignedMotion found =
          aligner.align({f.flight.camera, f.images[k], f.images[k - 1], depth, prior, prior});
      ASSERT_TRUE(found.aligned);
      Vector6d error;
      error << found.motion.t_reference_other - truth.t_reference_other,
          rotation_log(Eigen::Matrix3d(found.motion.R_reference_other * truth.R_reference_other.transpose()));
      sum += error.dot(found.motion.covariance.ldlt().solve(error));
      ++count;
    }
  }
  RecordProperty("nees", std::to_string(sum / count));
  EXPECT_GT(sum / count, 1);
  EXPECT_LT(sum / count, 12);
}

/// The depth of frame k as somebody has it who believes that the camera turned by `turn` (rad) too much since
/// the frame `steps` before it: each pixel is moved to where the wrong motion sees the same flow.
DepthImage bent(const Flown& f, std::size_t k, std::size_t steps, const Eigen::Vector3d& turn) {
  DepthImage image = f.depth_of(k);
  const RelativeMotion wide = f.motion(k, k - steps);
  const Camera& c = f.flight.camera;
  const Eigen::Matrix3d wrong = rotation_exp(turn).toRotationMatrix();
  for (int v = 0; v < c.height; ++v) {
    for (int u = 0; u < c.width; ++u) {
      float& Z = image.depth.at<float>(v, u);
      if (!std::isfinite(Z)) continue;
      const Eigen::Vector3d p((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
      const Eigen::Vector3d X = Z * p;
      // Ray of the match, turned too far; depth where it comes nearest to the pixel's own ray.
      const Eigen::Vector3d ray = wrong * (X - wide.t_reference_other).normalized();
      const Eigen::Vector3d normal = ray.cross(p.cross(ray));
      const double depth = wide.t_reference_other.dot(normal) / p.dot(normal);
      Z = std::isfinite(depth) && depth > 0.5 ? static_cast<float>(depth)
                                              : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return image;
}

TEST(MotionAligner, ViewsFartherBackUndoWhatIsBent) {
  // The depth of frame 8 is that of somebody who has frame 0 turned by 0.07 degrees. By it alone frame 9 is
  // turned as much, and more, against frame 0.
  const std::size_t k = 9;
  const Eigen::Vector3d turn = Eigen::Vector3d(0.06, 0.04, 0) * kDegree;
  MotionAligner aligner;
  double alone = 0;
  double with_views = 0;
  for (const std::string name : {"forward", "turning"}) {
    const Flown& f = flown(name);
    const DepthImage depth = bent(f, k - 1, 8, turn);
    RelativeMotion wide = f.motion(k - 1, 0);
    wide.R_reference_other = rotation_exp(turn).toRotationMatrix() * wide.R_reference_other;
    const Pose T_last_view{Eigen::Quaterniond(wide.R_reference_other), wide.t_reference_other};
    RelativeMotion prior = f.motion(k, k - 1);
    prior.covariance = covariance(0.01, 0.1 * kDegree);
    const auto against_the_view = [&](const AlignedMotion& found) {
      EXPECT_TRUE(found.aligned);
      RelativeMotion whole;
      whole.R_reference_other = found.motion.R_reference_other * wide.R_reference_other;
      whole.t_reference_other =
          found.motion.R_reference_other * wide.t_reference_other + found.motion.t_reference_other;
      return error_of(whole, f.motion(k, 0)).rotation;
    };
    AlignmentInput input{f.flight.camera, f.images[k], f.images[k - 1], depth, prior, prior};
    alone += against_the_view(aligner.align(input));
    input.views.push_back({f.images[0], T_last_view.inverse()});
    with_views += against_the_view(aligner.align(input));
  }
  RecordProperty("rotation", std::to_string(alone) + " alone, " + std::to_string(with_views));
  EXPECT_GT(alone, 0.12);
  EXPECT_LT(with_views, 0.85 * alone);
}

TEST(MotionAligner, SaysWhenTheImagesTellNothing) {
  MotionAligner aligner;
  const Flown& f = flown("forward");
  RelativeMotion prior = f.motion(5, 4);
  prior.covariance = covariance(0.01, 0.1 * kDegree);
  const DepthImage depth = f.depth_of(4);
  const auto is_start = [&](const AlignedMotion& found) {
    return !found.aligned && found.motion.t_reference_other == prior.t_reference_other &&
           found.motion.R_reference_other == prior.R_reference_other &&
           found.motion.covariance == prior.covariance;
  };
  const cv::Mat blank(f.images[5].size(), CV_8UC1, cv::Scalar(90));
  EXPECT_TRUE(is_start(aligner.align({f.flight.camera, f.images[5], blank, depth, prior, prior})));
  DepthImage none = f.depth_of(4);
  none.depth.setTo(std::numeric_limits<float>::quiet_NaN());
  EXPECT_TRUE(is_start(aligner.align({f.flight.camera, f.images[5], f.images[4], none, prior, prior})));
  EXPECT_TRUE(is_start(aligner.align({f.flight.camera, f.images[5], f.images[4], {}, prior, prior})));
  // Another place altogether: the prior is not left for what fits by chance.
  cv::Mat foreign;
  cv::flip(f.images[5], foreign, -1);
  EXPECT_TRUE(is_start(aligner.align({f.flight.camera, foreign, f.images[4], depth, prior, prior})));
}

TEST(MotionAligner, IsTheSameAtAnyTime) {
  const Flown& f = flown("turning");
  RelativeMotion prior = f.motion(5, 4);
  prior.covariance = covariance(0.02, 0.1 * kDegree);
  const DepthImage depth = f.depth_of(4);
  AlignmentInput input{f.flight.camera, f.images[5], f.images[4], depth, prior, prior};
  input.views.push_back({f.images[1], f.flight.T_world_camera[1].inverse() * f.flight.T_world_camera[4]});
  MotionAligner fresh;
  MotionAligner used;
  (void)used.align({f.flight.camera, f.images[3], f.images[4], depth, prior, prior});
  const RelativeMotion a = fresh.align(input).motion;
  const RelativeMotion b = used.align(input).motion;
  EXPECT_EQ(a.t_reference_other, b.t_reference_other);
  EXPECT_EQ(a.R_reference_other, b.R_reference_other);
  EXPECT_EQ(a.covariance, b.covariance);
}

}  // namespace
}  // namespace pade::depth
