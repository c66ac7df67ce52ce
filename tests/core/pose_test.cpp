#include "pade/core/pose.hpp"

#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace pade {
namespace {

Pose random_pose(std::mt19937& random, double angle = 3.0) {
  std::normal_distribution<double> normal;
  const Eigen::Vector3d axis = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
  const double turn = std::uniform_real_distribution<double>(-angle, angle)(random);
  return {rotation_exp(turn * axis), {normal(random), normal(random), normal(random)}};
}

void expect_near(const Pose& a, const Pose& b, double tolerance) {
  EXPECT_LT((a.translation - b.translation).norm(), tolerance);
  EXPECT_LT(rotation_log(Eigen::Quaterniond(a.rotation.conjugate() * b.rotation)).norm(), tolerance);
}

TEST(Pose, ComposingWithTheInverseGivesIdentity) {
  std::mt19937 random(1);
  for (int i = 0; i < 100; ++i) {
    const Pose pose = random_pose(random);
    expect_near(pose * pose.inverse(), Pose{}, 1e-12);
  }
}

TEST(Pose, ExponentialInvertsTheLogarithmUpToHalfATurn) {
  std::mt19937 random(2);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d phi = rotation_log(random_pose(random, std::numbers::pi).rotation);
    EXPECT_LE(phi.norm(), std::numbers::pi + 1e-12);
    EXPECT_LT((rotation_log(rotation_exp(phi)) - phi).norm(), 1e-9);
  }
  EXPECT_LT((rotation_log(rotation_exp({1e-12, 0, 0})) - Eigen::Vector3d(1e-12, 0, 0)).norm(), 1e-20);
}

TEST(Pose, TheRotationBetweenTwoDirectionsTurnsByTheirAngleAndNoMore) {
  const Eigen::Vector3d from(0.3, -2, 0.7);
  for (const Eigen::Vector3d& to : {Eigen::Vector3d(1, 1, -4), from, Eigen::Vector3d(-3 * from)}) {
    const Eigen::Quaterniond turn = rotation_between(from, to);
    EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-7);
    const double angle = std::atan2(from.cross(to).norm(), from.dot(to));
    EXPECT_NEAR(rotation_log(turn).norm(), angle, 1e-7);
  }
}

TEST(Pose, InterpolationMeetsBothEndsAndMovesAtConstantBodyVelocity) {
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    const Pose a = random_pose(random);
    const Pose b = a * random_pose(random, 1.5);
    expect_near(interpolate(a, b, 0), a, 1e-9);
    expect_near(interpolate(a, b, 1), b, 1e-9);
    const Pose first = interpolate(a, b, 0.25).inverse() * interpolate(a, b, 0.5);
    const Pose second = interpolate(a, b, 0.5).inverse() * interpolate(a, b, 0.75);
    expect_near(first, second, 1e-9);
  }
}

TEST(RelativeMotion, DoesNotDependOnTheWorldFrame) {
  std::mt19937 random(4);
  const Pose a = random_pose(random);
  const Pose b = random_pose(random);
  const Pose world = random_pose(random);
  const RelativeMotion here = relative_motion(a, b, 0.1);
  const RelativeMotion there = relative_motion(world * a, world * b, 0.1);
  EXPECT_LT((here.t_reference_other - there.t_reference_other).norm(), 1e-12);
  EXPECT_LT((here.R_reference_other - there.R_reference_other).norm(), 1e-12);
}

TEST(RelativeMotion, AnEastwardForwardFlightIsPositiveZOfTheCamera) {
  Pose T_world_body;  // ENU world, FLU body facing east
  const Pose T_body_camera{Eigen::Quaterniond(forward_camera_rotation()), {0.1, 0, -0.05}};
  const Pose first = camera_pose(T_world_body, T_body_camera);
  T_world_body.translation.x() += 0.2;
  const RelativeMotion motion = relative_motion(first, camera_pose(T_world_body, T_body_camera), 0.1);
  EXPECT_LT((motion.t_reference_other - Eigen::Vector3d(0, 0, 0.2)).norm(), 1e-12);
}

TEST(RelativeMotion, ALeverArmTurnsYawIntoSidewaysMotionOfTheCamera) {
  const Pose T_body_camera{Eigen::Quaterniond(forward_camera_rotation()), {0.5, 0, 0}};
  const Pose left{rotation_exp({0, 0, 0.02}), Eigen::Vector3d::Zero()};  // yaw to the left about body up
  const RelativeMotion motion =
      relative_motion(camera_pose(Pose{}, T_body_camera), camera_pose(left, T_body_camera), 0.1);
  EXPECT_NEAR(motion.t_reference_other.x(), -0.5 * std::sin(0.02), 1e-12);  // camera x is right
  EXPECT_NEAR(motion.rotation_vector().y(), -0.02, 1e-12);                  // about camera y (down)
}

TEST(RelativeMotion, ReversedHasTheCovarianceThatItsErrorsHave) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const Pose T = random_pose(random, 0.5);
  RelativeMotion motion;
  motion.R_reference_other = T.matrix3();
  motion.t_reference_other = T.translation;
  motion.duration = 0.1;
  const Matrix6d root = 1e-3 * Matrix6d::NullaryExpr([&](auto, auto) { return normal(random); });
  motion.covariance = root * root.transpose();
  const RelativeMotion back = reversed(motion);
  EXPECT_LT((back.t_reference_other - T.inverse().translation).norm(), 1e-12);
  EXPECT_LT((back.R_reference_other - T.inverse().matrix3()).norm(), 1e-12);
  EXPECT_EQ(back.duration, -0.1);
  Matrix6d sampled = Matrix6d::Zero();
  constexpr int kRuns = 20000;
  for (int run = 0; run < kRuns; ++run) {
    using Vector6d = Eigen::Matrix<double, 6, 1>;
    const Vector6d e = root * Vector6d::NullaryExpr([&](auto) { return normal(random); });
    const Pose wrong = Pose{rotation_exp(e.tail<3>()) * T.rotation, T.translation + e.head<3>()}.inverse();
    Vector6d error;
    error << wrong.translation - back.t_reference_other,
        rotation_log(Eigen::Matrix3d(wrong.matrix3() * back.R_reference_other.transpose()));
    sampled += error * error.transpose() / kRuns;
  }
  EXPECT_LT((sampled - back.covariance).norm(), 0.03 * back.covariance.norm());
  EXPECT_LT((reversed(back).covariance - motion.covariance).norm(), 1e-12 * motion.covariance.norm() + 1e-18);
}

}  // namespace
}  // namespace pade
