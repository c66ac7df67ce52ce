#include "pade/depth/motion/motion_refinement.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade::depth {
namespace {

using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;
using Depth = std::function<double(double x, double y)>;  // of a pixel relative to the principal point, m

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kSpacing = 16;  // px between pixels that have flow: one per cell of the refinement

Camera camera() { return {640, 480, 554.26, 554.26, 319.5, 239.5}; }

double wall_and_ground(double /*x*/, double y) {
  constexpr double kHeight = 1.5;
  constexpr double kWall = 12;
  return y > 0 ? std::min(kWall, kHeight * 554.26 / y) : kWall;
}
double forest(double x, double y) {  // trunks at many distances: neighbours have nothing in common
  const double hash =
      std::sin(std::floor(x / kSpacing) * 12.9898 + std::floor(y / 120) * 78.233) * 43758.5453;
  return 4 + 16 * (hash - std::floor(hash));
}
double plane(double /*x*/, double /*y*/) { return 8; }

RelativeMotion motion(const Eigen::Vector3d& t, const Eigen::Vector3d& rotation_deg = {0.3, -0.5, 0.8}) {
  RelativeMotion m;
  m.t_reference_other = t;
  m.R_reference_other = rotation_exp(kDegree * rotation_deg).toRotationMatrix();
  m.duration = -0.1;
  return m;
}

/// Covariance of a pose: rotation and direction of t in degrees per axis, 1 % of length.
Matrix6d covariance(const Eigen::Vector3d& t, double rotation_deg, double direction_deg) {
  const Eigen::Matrix3d along = t.normalized() * t.normalized().transpose();
  Matrix6d c = Matrix6d::Zero();
  c.topLeftCorner<3, 3>() =
      t.squaredNorm() *
      (std::pow(direction_deg * kDegree, 2) * (Eigen::Matrix3d::Identity() - along) + 1e-4 * along);
  c.bottomRightCorner<3, 3>() = std::pow(rotation_deg * kDegree, 2) * Eigen::Matrix3d::Identity();
  return c;
}

/// The truth with an error drawn from the covariance, which it carries.
RelativeMotion drawn_prior(const RelativeMotion& truth, double rotation_deg, double direction_deg,
                           Random& random) {
  RelativeMotion prior = truth;
  const double length = truth.t_reference_other.norm() * (1 + 0.01 * random.normal());
  const Eigen::Vector3d direction = truth.t_reference_other.normalized();
  const Eigen::Vector3d turn = direction_deg * kDegree * random.normal3();
  prior.t_reference_other = length * (rotation_exp(turn - direction * direction.dot(turn)) * direction);
  prior.R_reference_other =
      rotation_exp(rotation_deg * kDegree * random.normal3()).toRotationMatrix() * truth.R_reference_other;
  prior.covariance = covariance(prior.t_reference_other, rotation_deg, direction_deg);
  return prior;
}

struct Noise {
  double sigma = 0.3;   // px per component
  double outliers = 0;  // share
  double mover = 0;     // share of the image's width, from the left, that moves by (6, 3) px
  int shared = 1;       // this many pixels in a row and column have the same noise
};

/// Flow of a static scene to the other image after `R_removed` was taken out of it; NaN but at one pixel of
/// each cell.
FlowField flow_of(const Depth& depth, const RelativeMotion& m, const Eigen::Matrix3d& R_removed,
                  const Noise& noise, Random& random) {
  const Camera c = camera();
  FlowField flow{cv::Mat(c.size(), CV_32FC2, cv::Scalar::all(std::numeric_limits<double>::quiet_NaN())), {}};
  const auto seed = static_cast<std::uint64_t>(random.uniform() * 0x1p53);
  for (int v = 2, row = 0; v < c.height; v += kSpacing, ++row) {
    for (int u = 2, column = 0; u < c.width; u += kSpacing, ++column) {
      const Eigen::Vector2d p(u - c.cx, v - c.cy);
      const Eigen::Vector3d point = depth(p.x(), p.y()) * Eigen::Vector3d(p.x() / c.fx, p.y() / c.fy, 1);
      const Eigen::Vector3d seen =
          R_removed * m.R_reference_other.transpose() * (point - m.t_reference_other);
      Eigen::Vector2d w(c.fx * seen.x() / seen.z() - p.x(), c.fy * seen.y() / seen.z() - p.y());
      Random of_patch(seed + static_cast<std::uint64_t>(row / noise.shared * 1000 + column / noise.shared));
      w += noise.sigma * of_patch.normal3().head<2>();
      if (random.uniform() < noise.outliers)
        w += Eigen::Vector2d(random.uniform(-8, 8), random.uniform(-8, 8));
      if (u < noise.mover * c.width) w += Eigen::Vector2d(6, 3);
      flow.vectors.at<cv::Vec2f>(v, u) = {static_cast<float>(w.x()), static_cast<float>(w.y())};
    }
  }
  return flow;
}

Eigen::Vector3d rotation_error(const RelativeMotion& truth, const RelativeMotion& estimate) {
  return rotation_log(Eigen::Matrix3d(truth.R_reference_other * estimate.R_reference_other.transpose()));
}

/// Two axes across the baseline.
Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& t) {
  Eigen::Matrix<double, 3, 2> axes;
  axes.col(0) = t.unitOrthogonal();
  axes.col(1) = t.normalized().cross(axes.col(0));
  return axes;
}

/// Error of direction, rad along across(estimate).
Eigen::Vector2d direction_error(const RelativeMotion& truth, const RelativeMotion& estimate) {
  return across(estimate.t_reference_other).transpose() * truth.t_reference_other.normalized();
}

/// Covariance of (direction, rotation) of a motion.
Matrix5d of_direction_and_rotation(const RelativeMotion& m) {
  Eigen::Matrix<double, 5, 6> pick = Eigen::Matrix<double, 5, 6>::Zero();
  pick.topLeftCorner<2, 3>() = across(m.t_reference_other).transpose() / m.t_reference_other.norm();
  pick.bottomRightCorner<3, 3>().setIdentity();
  return pick * m.covariance * pick.transpose();
}

/// The Cramér-Rao bound of (direction, rotation): information of the flow across the epipolar lines by
/// differences, in which the depth of each pixel is unknown, and that of the prior.
Matrix5d bound(const Depth& depth, const RelativeMotion& prior, double sigma) {
  const Camera c = camera();
  const Eigen::Vector3d& t = prior.t_reference_other;
  Matrix5d information = of_direction_and_rotation(prior).inverse();
  for (int v = 2; v < c.height; v += kSpacing) {
    for (int u = 2; u < c.width; u += kSpacing) {
      const Eigen::Vector2d p(u - c.cx, v - c.cy);
      const Eigen::Vector3d point = depth(p.x(), p.y()) * Eigen::Vector3d(p.x() / c.fx, p.y() / c.fy, 1);
      const auto derotated = [&](const Eigen::Vector3d& turn, const Eigen::Vector3d& moved) {
        const Eigen::Vector3d b = rotation_exp(-turn) * (point - moved);
        return Eigen::Vector2d(c.fx * b.x() / b.z() - p.x(), c.fy * b.y() / b.z() - p.y());
      };
      const Eigen::Vector2d D = derotated(Eigen::Vector3d::Zero(), t);
      const Eigen::Vector2d normal = Eigen::Vector2d(-D.y(), D.x()).normalized();
      Vector5d gradient;
      constexpr double kStep = 1e-6;
      for (int i = 0; i < 2; ++i) {
        const Eigen::Vector3d moved = t + kStep * t.norm() * across(t).col(i);
        gradient[i] = normal.dot(derotated(Eigen::Vector3d::Zero(), moved) - D) / kStep;
      }
      for (int i = 0; i < 3; ++i)
        gradient[2 + i] = normal.dot(derotated(kStep * Eigen::Vector3d::Unit(i), t) - D) / kStep;
      information += gradient * gradient.transpose() / (sigma * sigma);
    }
  }
  return information.inverse();
}

/// What many draws of prior and noise give.
struct Statistics {
  double rotation_deg = 0, direction_deg = 0;              // root mean squared errors
  double rotation_bound_deg = 0, direction_bound_deg = 0;  // what they could be
  double rotation_nees = 0, direction_nees = 0;            // of 3 and of 2 degrees of freedom
  double prior_rotation_deg = 0, prior_direction_deg = 0;
  int refined = 0;
};
constexpr int kDraws = 60;

Statistics many_draws(const Depth& depth, const RelativeMotion& truth, const Noise& noise,
                      double inflation = 1) {
  constexpr double rotation_deg = 0.1;
  constexpr double direction_deg = 5;
  Statistics out;
  MotionRefinementOptions options;
  options.inflation = inflation;  // 1: the noise of these scenes reaches no farther than `shared`
  MotionRefiner refiner(options);
  Random random(5);
  for (int draw = 0; draw < kDraws; ++draw) {
    const RelativeMotion prior = drawn_prior(truth, rotation_deg, direction_deg, random);
    const FlowField flow = flow_of(depth, truth, prior.R_reference_other, noise, random);
    const Camera c = camera();
    const RefinedMotion found = refiner.refine({c, prior, flow, prior.R_reference_other});
    out.refined += found.outcome == RefinementOutcome::refined ? 1 : 0;
    const Eigen::Vector3d theta = rotation_error(truth, found.motion);
    const Eigen::Vector2d direction = direction_error(truth, found.motion);
    const Matrix5d stated = of_direction_and_rotation(found.motion);
    out.rotation_nees += theta.dot(stated.bottomRightCorner<3, 3>().inverse() * theta);
    out.direction_nees += direction.dot(stated.topLeftCorner<2, 2>().inverse() * direction);
    out.rotation_deg += theta.squaredNorm();
    out.direction_deg += direction.squaredNorm();
    out.prior_rotation_deg += rotation_error(truth, prior).squaredNorm();
    out.prior_direction_deg += direction_error(truth, prior).squaredNorm();
  }
  RelativeMotion at_truth = truth;
  at_truth.covariance = covariance(truth.t_reference_other, rotation_deg, direction_deg);
  const Matrix5d least = bound(depth, at_truth, noise.sigma);
  out.rotation_bound_deg = std::sqrt(least.bottomRightCorner<3, 3>().trace()) / kDegree;
  out.direction_bound_deg = std::sqrt(least.topLeftCorner<2, 2>().trace()) / kDegree;
  for (double* const squared :
       {&out.rotation_deg, &out.direction_deg, &out.prior_rotation_deg, &out.prior_direction_deg}) {
    *squared = std::sqrt(*squared / kDraws) / kDegree;
  }
  out.rotation_nees /= kDraws;
  out.direction_nees /= kDraws;
  return out;
}

const Eigen::Vector3d kForward(0.01, -0.02, -0.2);
const Eigen::Vector3d kSideways(0.2, 0.01, -0.02);

TEST(MotionRefinement, ItsErrorsAreNearTheCramerRaoBoundAndStatedAsSuch) {
  const auto expect_near_bound = [](const char* what, const Statistics& s) {
    SCOPED_TRACE(what);
    EXPECT_EQ(s.refined, kDraws);
    EXPECT_LT(s.rotation_deg, 1.3 * s.rotation_bound_deg);
    EXPECT_LT(s.direction_deg, 1.3 * s.direction_bound_deg);
    EXPECT_GT(s.rotation_nees, 1.8);
    EXPECT_LT(s.rotation_nees, 5);
    EXPECT_GT(s.direction_nees, 1.2);
    EXPECT_LT(s.direction_nees, 3.5);
  };
  expect_near_bound("wall and ground, forward", many_draws(wall_and_ground, motion(kForward), {}));
  expect_near_bound("wall and ground, sideways", many_draws(wall_and_ground, motion(kSideways), {}));
  expect_near_bound("forest, forward", many_draws(forest, motion(kForward), {}));
  expect_near_bound("forest, sideways", many_draws(forest, motion(kSideways), {}));
  expect_near_bound("forest, backward", many_draws(forest, motion(-kForward), {}));
}

TEST(MotionRefinement, AFifthOfTheFlowMayBeWrong) {
  const Statistics s = many_draws(forest, motion(kForward), {.outliers = 0.2});
  EXPECT_EQ(s.refined, kDraws);
  EXPECT_LT(s.rotation_deg, 2 * s.rotation_bound_deg);
  EXPECT_LT(s.direction_deg, 2.5 * s.direction_bound_deg);
}

TEST(MotionRefinement, ErrorsThatNeighboursShareAreCountedOnce) {
  const Statistics s = many_draws(wall_and_ground, motion(kForward), {.shared = 2});
  EXPECT_EQ(s.refined, kDraws);
  EXPECT_GT(s.rotation_nees, 1.8);
  EXPECT_LT(s.rotation_nees, 5);
  EXPECT_LT(s.direction_nees, 3.5);
}

TEST(MotionRefinement, AnythingThatMovesInAFifthOfTheViewIsLeftOut) {
  const Statistics s = many_draws(forest, motion(kForward), {.mover = 0.2});
  EXPECT_EQ(s.refined, kDraws);
  EXPECT_LT(s.rotation_deg, 2.5 * s.rotation_bound_deg);
  EXPECT_LT(s.direction_deg, 2.5 * s.direction_bound_deg);
}

TEST(MotionRefinement, APriorThatIsOffByADegreeAndItsDirectionByTenIsMended) {
  const RelativeMotion truth = motion(kForward);
  const Eigen::Vector3d direction = truth.t_reference_other.normalized();
  const Camera c = camera();
  Random random(7);
  for (int draw = 0; draw < 20; ++draw) {
    RelativeMotion prior = truth;
    const Eigen::Vector3d turn = 10 * kDegree * direction.cross(random.normal3()).normalized();
    prior.t_reference_other = rotation_exp(turn) * truth.t_reference_other;
    prior.R_reference_other =
        rotation_exp(Eigen::Vector3d(kDegree * random.normal3().normalized())).toRotationMatrix() *
        truth.R_reference_other;
    prior.covariance = covariance(prior.t_reference_other, 0.6, 7);
    const FlowField flow = flow_of(wall_and_ground, truth, prior.R_reference_other, {}, random);
    const RefinedMotion found = MotionRefiner().refine({c, prior, flow, prior.R_reference_other});
    ASSERT_EQ(found.outcome, RefinementOutcome::refined);
    EXPECT_LT(rotation_error(truth, found.motion).norm(), 0.025 * kDegree);
    EXPECT_LT(direction_error(truth, found.motion).norm(), 1 * kDegree);
  }
}

TEST(MotionRefinement, TowardAPlaneYawAndASidewaysStepLookAlikeAndThePriorRules) {
  const RelativeMotion truth = motion({0, 0, -0.2});
  const Statistics s = many_draws(plane, truth, {}, MotionRefinementOptions().inflation);
  EXPECT_LT(s.rotation_deg, 1.1 * s.prior_rotation_deg);
  EXPECT_LT(s.direction_deg, 1.1 * s.prior_direction_deg);
  EXPECT_GT(s.rotation_nees, 1.8);
  EXPECT_LT(s.rotation_nees, 5);
  EXPECT_LT(s.direction_nees, 3.5);
  // Toward a plane at distance Z a turn by alpha and a step of alpha Z sideways have the same flow across the
  // lines. That combination keeps the uncertainty that the prior gives it.
  Random random(3);
  const RelativeMotion prior = drawn_prior(truth, 0.1, 5, random);
  const Camera c = camera();
  const RefinedMotion found = MotionRefiner().refine(
      {c, prior, flow_of(plane, truth, prior.R_reference_other, {}, random), prior.R_reference_other});
  Vector6d weak;
  weak << -8, 0, 0, 0, 1, 0;
  const auto information = [&](const RelativeMotion& m) { return weak.dot(m.covariance.ldlt().solve(weak)); };
  EXPECT_LT(information(found.motion), 2 * information(prior));
}

/// Error of what the images alone show, as ImageMotion::information weighs it.
Vector6d image_error(const RelativeMotion& truth, const ImageMotion& images) {
  RelativeMotion estimate = truth;
  estimate.R_reference_other = images.R_reference_other;
  Vector6d error;
  const Eigen::Matrix3d projector =
      Eigen::Matrix3d::Identity() - images.direction * images.direction.transpose();
  error << projector * truth.t_reference_other.normalized(), rotation_error(truth, estimate);
  return error;
}

TEST(MotionRefinement, TheImagesAloneErrAsTheySayWhateverThePrior) {
  for (const Depth& depth : {Depth(wall_and_ground), Depth(forest)}) {
    const RelativeMotion truth = motion(kForward);
    const Camera c = camera();
    MotionRefinementOptions options;
    options.inflation = 1;
    Random random(12);
    double nees = 0;
    double apart = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      const RelativeMotion prior = drawn_prior(truth, 0.1, 5, random);
      const RelativeMotion other = drawn_prior(truth, 0.008, 0.3, random);  // knows as much as the images
      const FlowField flow = flow_of(depth, truth, prior.R_reference_other, {}, random);
      MotionRefiner refiner(options);
      const RefinedMotion found = refiner.refine({c, prior, flow, prior.R_reference_other});
      const RefinedMotion again = refiner.refine({c, other, flow, prior.R_reference_other});
      ASSERT_EQ(found.outcome, RefinementOutcome::refined);
      ASSERT_EQ(again.outcome, RefinementOutcome::refined);
      const Vector6d error = image_error(truth, found.images);
      nees += error.dot(found.images.information * error) / kDraws;
      const Vector6d difference = error - image_error(truth, again.images);
      apart += difference.dot(found.images.information * difference) / kDraws;
      Vector6d longer = Vector6d::Zero();
      longer.head<3>() = found.images.direction;
      EXPECT_LT((found.images.information * longer).norm(), 1e-6 * found.images.information.norm());
      // Prior and images together are the refined motion.
      const Matrix5d with_prior = of_direction_and_rotation(prior).inverse();
      Eigen::Matrix<double, 6, 5> axes = Eigen::Matrix<double, 6, 5>::Zero();
      axes.topLeftCorner<3, 2>() = across(prior.t_reference_other);
      axes.bottomRightCorner<3, 3>().setIdentity();
      const Matrix5d both = (with_prior + axes.transpose() * found.images.information * axes).inverse();
      const Matrix5d stated = of_direction_and_rotation(found.motion);
      EXPECT_NEAR((both.bottomRightCorner<3, 3>().trace() / stated.bottomRightCorner<3, 3>().trace()), 1,
                  0.1);
      EXPECT_NEAR((both.topLeftCorner<2, 2>().trace() / stated.topLeftCorner<2, 2>().trace()), 1, 0.1);
    }
    EXPECT_GT(nees, 3.5);
    EXPECT_LT(nees, 7);
    EXPECT_LT(apart, 0.25) << "the prior must not be in it";
  }
}

TEST(MotionRefinement, OfWhatLooksAlikeTheImagesAloneSayNothing) {
  Random random(3);
  const RelativeMotion truth = motion({0, 0, -0.2});
  const RelativeMotion prior = drawn_prior(truth, 0.1, 5, random);
  const Camera c = camera();
  const RefinedMotion found = MotionRefiner().refine(
      {c, prior, flow_of(plane, truth, prior.R_reference_other, {}, random), prior.R_reference_other});
  ASSERT_EQ(found.outcome, RefinementOutcome::refined);
  Vector6d weak;
  weak << -8 / 0.2, 0, 0, 0, 1, 0;  // a step sideways and a turn, see above
  EXPECT_LT(weak.normalized().dot(found.images.information * weak.normalized()),
            1 / std::pow(2 * kDegree, 2));
}

TEST(MotionRefinement, AnExactPriorIsReturnedAsItIs) {
  Random random(1);
  const Camera c = camera();
  const RelativeMotion exact = motion(kForward);
  const RelativeMotion other = motion({0.05, 0, -0.2}, {0, 0, 0});
  const FlowField flow = flow_of(forest, other, exact.R_reference_other, {}, random);
  const RefinedMotion found = MotionRefiner().refine({c, exact, flow, exact.R_reference_other});
  EXPECT_EQ(found.outcome, RefinementOutcome::exact_prior);
  EXPECT_EQ(found.motion.R_reference_other, exact.R_reference_other);
  EXPECT_EQ(found.motion.t_reference_other, exact.t_reference_other);
  EXPECT_TRUE(found.motion.covariance.isZero(0));
  EXPECT_TRUE(found.direction_valid);
}

TEST(MotionRefinement, WhatThePriorKnowsExactlyStays) {
  Random random(2);
  const Camera c = camera();
  const RelativeMotion truth = motion(kForward);
  RelativeMotion prior = drawn_prior(truth, 0, 5, random);
  prior.covariance.bottomRightCorner<3, 3>().setZero();
  const FlowField flow = flow_of(forest, truth, prior.R_reference_other, {}, random);
  const RefinedMotion found = MotionRefiner().refine({c, prior, flow, prior.R_reference_other});
  EXPECT_EQ(found.outcome, RefinementOutcome::refined);
  EXPECT_LT(rotation_error(truth, found.motion).norm(), 1e-12);
  EXPECT_LT(direction_error(truth, found.motion).norm(), 0.5 * kDegree);
  EXPECT_LT((found.motion.covariance.bottomRightCorner<3, 3>().norm()), 1e-15);
}

TEST(MotionRefinement, TheLengthOfTheBaselineStaysThePriors) {
  Random random(2);
  const Camera c = camera();
  const RelativeMotion truth = motion(kForward);
  const RelativeMotion prior = drawn_prior(truth, 0.1, 5, random);
  const FlowField flow = flow_of(forest, truth, prior.R_reference_other, {}, random);
  const RefinedMotion found = MotionRefiner().refine({c, prior, flow, prior.R_reference_other});
  ASSERT_EQ(found.outcome, RefinementOutcome::refined);
  EXPECT_NEAR(found.motion.t_reference_other.norm(), prior.t_reference_other.norm(), 1e-9);
  EXPECT_NEAR(found.length_sigma_relative, 0.01, 1e-4);
}

TEST(MotionRefinement, WhereNothingCanBeToldThePriorStaysAndTheOutcomeSaysWhy) {
  Random random(4);
  const Camera c = camera();
  const RelativeMotion truth = motion(kForward);
  const RelativeMotion prior = drawn_prior(truth, 0.1, 5, random);
  const auto expect_prior = [&](const RelativeMotion& given, const FlowField& flow,
                                RefinementOutcome outcome) {
    const RefinedMotion found = MotionRefiner().refine({c, given, flow, given.R_reference_other});
    EXPECT_EQ(to_name(found.outcome), to_name(outcome));
    EXPECT_EQ(found.motion.R_reference_other, given.R_reference_other);
    EXPECT_EQ(found.motion.t_reference_other, given.t_reference_other);
    EXPECT_EQ(found.motion.covariance, given.covariance);
  };
  const auto& R = prior.R_reference_other;
  const FlowField blank{
      cv::Mat(c.size(), CV_32FC2, cv::Scalar::all(std::numeric_limits<double>::quiet_NaN())), {}};
  expect_prior(prior, blank, RefinementOutcome::too_few_pixels);
  expect_prior(prior, {}, RefinementOutcome::too_few_pixels);
  // A lorry that fills the view and drives by.
  const RelativeMotion seen = motion({0.3, 0, -0.1});
  expect_prior(prior, flow_of(plane, seen, R, {}, random), RefinementOutcome::inconsistent);

  // The vehicle hovers and turns: translation of no known direction, and none that could be seen.
  RelativeMotion hover = motion({0.001, 0.002, 0});
  hover.covariance = covariance({0.2, 0, 0}, 0.1, 5);
  expect_prior(hover, flow_of(forest, hover, hover.R_reference_other, {}, random), RefinementOutcome::hover);
  RelativeMotion slow = motion({0, 0.001, -0.003});
  slow.covariance = covariance(slow.t_reference_other, 0.1, 5);
  expect_prior(slow, flow_of(forest, slow, slow.R_reference_other, {}, random), RefinementOutcome::hover);
}

TEST(MotionRefinement, PixelsOfTheGateAreNotUsed) {
  Random random(6);
  const Camera c = camera();
  const RelativeMotion truth = motion(kForward);
  const RelativeMotion prior = drawn_prior(truth, 0.1, 5, random);
  FlowField flow = flow_of(forest, truth, prior.R_reference_other, {}, random);
  cv::Mat gate = cv::Mat::zeros(c.size(), CV_8UC1);
  gate(cv::Rect(0, 0, c.width / 2, c.height)) = 5;
  MotionRefiner refiner;
  const RefinedMotion before = refiner.refine({c, prior, flow, prior.R_reference_other, {}, gate});
  flow.vectors(cv::Rect(0, 0, c.width / 2, c.height)) = cv::Scalar(7, 7);
  const RefinedMotion after = refiner.refine({c, prior, flow, prior.R_reference_other, {}, gate});
  EXPECT_EQ(before.pixels, after.pixels);
  EXPECT_EQ(before.motion.R_reference_other, after.motion.R_reference_other);
  EXPECT_EQ(before.motion.t_reference_other, after.motion.t_reference_other);
}

TEST(MotionRefinement, DerivativesAreThoseOfDifferences) {
  Random random(8);
  const Camera c = camera();
  for (int i = 0; i < 20; ++i) {
    const RelativeMotion m = motion(0.2 * random.normal3(), random.normal3());
    const Eigen::Vector2d p(random.uniform(-300, 300), random.uniform(-200, 200));
    const MotionRefiner::Match match{
        p, {(p.x() + random.uniform(-9, 9)) / c.fx, (p.y() + random.uniform(-9, 9)) / c.fy, 1}, 1, 0};
    const auto residual = [&](const Eigen::Vector3d& dt, const Eigen::Vector3d& dtheta) {
      return across_line(c, m.t_reference_other + dt,
                         rotation_exp(dtheta).toRotationMatrix() * m.R_reference_other, match)
          .residual;
    };
    const AcrossLine line = across_line(c, m.t_reference_other, m.R_reference_other, match);
    constexpr double kStep = 1e-6;
    const Eigen::Vector3d none = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d e = kStep * Eigen::Vector3d::Unit(axis);
      const double by_t = (residual(e, none) - residual(-e, none)) / (2 * kStep);
      const double by_theta = (residual(none, e) - residual(none, -e)) / (2 * kStep);
      EXPECT_NEAR(line.by_translation[axis], by_t, 1e-4 * (1 + std::abs(by_t)));
      EXPECT_NEAR(line.by_rotation[axis], by_theta, 1e-4 * (1 + std::abs(by_theta)));
    }
  }
}

TEST(MotionRefinement, TheSameInputGivesTheSameBits) {
  Random random(9);
  const Camera c = camera();
  const RelativeMotion truth = motion(kForward);
  const RelativeMotion prior = drawn_prior(truth, 0.1, 5, random);
  const FlowField flow = flow_of(forest, truth, prior.R_reference_other, {.outliers = 0.2}, random);
  const FlowField another = flow_of(plane, truth, prior.R_reference_other, {}, random);
  MotionRefiner used;
  (void)used.refine({c, prior, another, prior.R_reference_other});
  const RefinedMotion first = used.refine({c, prior, flow, prior.R_reference_other});
  const RefinedMotion second = MotionRefiner().refine({c, prior, flow, prior.R_reference_other});
  EXPECT_EQ(first.motion.R_reference_other, second.motion.R_reference_other);
  EXPECT_EQ(first.motion.t_reference_other, second.motion.t_reference_other);
  EXPECT_EQ(first.motion.covariance, second.motion.covariance);
}

}  // namespace
}  // namespace pade::depth
