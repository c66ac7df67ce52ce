#include "pade/paper/motion_noise.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace pade::evaluation {
namespace {

RelativeMotion some_motion() {
  RelativeMotion motion;
  motion.t_reference_other = {0.05, 0, 0.2};
  motion.R_reference_other = rotation_exp({0.01, -0.02, 0}).toRotationMatrix();
  return motion;
}

/// Moments of one number over many draws.
struct Moments {
  double sum = 0, sum2 = 0, least = 1e9, most = -1e9;
  int n = 0;
  void add(double x) {
    sum += x;
    sum2 += x * x;
    least = std::min(least, x);
    most = std::max(most, x);
    ++n;
  }
  [[nodiscard]] double mean() const { return sum / n; }
  [[nodiscard]] double deviation() const { return std::sqrt(sum2 / n - mean() * mean()); }
};

TEST(MotionNoise, MultiplicativeIsUniformPerComponentAndLeavesZeroAlone) {
  const MotionNoise noise{NoiseModel::multiplicative, 0.2};
  Moments t_x, t_z, w_y;
  for (std::uint64_t seed = 0; seed < 20000; ++seed) {
    const RelativeMotion noisy = with_noise(some_motion(), noise, Measured::motion, seed);
    t_x.add(noisy.t_reference_other.x() / 0.05 - 1);
    t_z.add(noisy.t_reference_other.z() / 0.2 - 1);
    w_y.add(noisy.rotation_vector().y() / -0.02 - 1);
    ASSERT_EQ(noisy.t_reference_other.y(), 0);
    ASSERT_NEAR(noisy.rotation_vector().z(), 0, 1e-12);
  }
  for (const Moments& m : {t_x, t_z, w_y}) {
    EXPECT_NEAR(m.mean(), 0, 0.004);
    EXPECT_NEAR(m.deviation(), 0.2 / std::sqrt(3), 0.003);
    EXPECT_GE(m.least, -0.2 - 1e-9);
    EXPECT_LE(m.most, 0.2 + 1e-9);
    EXPECT_LT(m.least, -0.199);
    EXPECT_GT(m.most, 0.199);
  }
}

TEST(MotionNoise, AdditiveIsNormalWithTheStatedDeviations) {
  const MotionNoise noise{NoiseModel::additive, 0.1};
  Moments t_y, w_z;
  for (std::uint64_t seed = 0; seed < 20000; ++seed) {
    const RelativeMotion noisy = with_noise(some_motion(), noise, Measured::motion, seed);
    t_y.add(noisy.t_reference_other.y());
    w_z.add(noisy.rotation_vector().z());
  }
  EXPECT_NEAR(t_y.mean(), 0, 0.0006);
  EXPECT_NEAR(t_y.deviation(), 0.02, 0.0006);
  EXPECT_NEAR(w_z.deviation(), 0.1 * std::numbers::pi / 180, 0.00006);
  EXPECT_GT(t_y.most, 0.06);  // more than three sigma: not uniform
}

TEST(MotionNoise, NoLevelIsNoNoise) {
  const RelativeMotion same = with_noise(some_motion(), {NoiseModel::additive, 0}, Measured::motion, 3);
  EXPECT_EQ(same.t_reference_other, some_motion().t_reference_other);
  EXPECT_EQ(same.R_reference_other, some_motion().R_reference_other);
}

TEST(MotionNoise, TimeToCollisionGetsTheSameSpeedAndRotationAsPade) {
  for (const NoiseModel model : {NoiseModel::multiplicative, NoiseModel::additive}) {
    const MotionNoise noise{model, 0.2};
    const RelativeMotion pade = with_noise(some_motion(), noise, Measured::motion, 7);
    const RelativeMotion ttc = with_noise(some_motion(), noise, Measured::forward_speed, 7);
    const RelativeMotion speed = with_noise(some_motion(), noise, Measured::speed_alone, 7);
    EXPECT_EQ(ttc.t_reference_other.z(), pade.t_reference_other.z());
    EXPECT_EQ(ttc.R_reference_other, pade.R_reference_other);
    EXPECT_EQ(ttc.t_reference_other.x(), 0.05);
    EXPECT_NE(pade.t_reference_other.x(), 0.05);
    EXPECT_EQ(speed.t_reference_other.z(), pade.t_reference_other.z());
    EXPECT_EQ(speed.R_reference_other, some_motion().R_reference_other);
  }
}

TEST(MotionNoise, SeedsGiveDifferentDraws) {
  const MotionNoise noise{NoiseModel::additive, 0.2};
  EXPECT_NE(with_noise(some_motion(), noise, Measured::motion, 1).t_reference_other,
            with_noise(some_motion(), noise, Measured::motion, 2).t_reference_other);
}

}  // namespace
}  // namespace pade::evaluation
