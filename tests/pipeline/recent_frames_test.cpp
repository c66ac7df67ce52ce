// Which of the last frames are looked at beside the newest.
#include "pade/pipeline/recent_frames.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade {
namespace {

Frame frame_at(double x) {
  Frame frame;
  frame.T_world_camera.translation.x() = x;
  return frame;
}

std::vector<int> views_of(const std::vector<double>& way, int count = 4, int step = 1) {
  RecentFrames recent;
  for (std::size_t i = 0; i + 1 < way.size(); ++i) recent.push({frame_at(way[i]), {}, {}}, 64);
  return recent.views(frame_at(way.back()), count, 16, step);
}

TEST(Views, DoubleTheirBaselinesOnAStraightWay) {
  std::vector<double> way;
  for (int i = 0; i < 20; ++i) way.push_back(0.1 * i);
  EXPECT_EQ(views_of(way), (std::vector<int>{2, 4, 8, 16}));
}

TEST(Views, AreOfTheLongestBaselineWhereTheCameraTurnsBack) {
  // Out and back again: the frame of sixteen before stands where the newest does.
  std::vector<double> way;
  for (int i = 0; i <= 8; ++i) way.push_back(0.1 * i);
  for (int i = 7; i >= 0; --i) way.push_back(0.1 * i);
  const std::vector<int> views = views_of(way);
  ASSERT_FALSE(views.empty());
  EXPECT_EQ(views.back(), 8);
  double longest = 0;
  for (std::size_t i = 0; i + 1 < way.size(); ++i) longest = std::max(longest, std::abs(way[i] - way.back()));
  EXPECT_DOUBLE_EQ(std::abs(way[way.size() - 1 - 8] - way.back()), longest);
  EXPECT_GE(views.size(), 3U);
}

TEST(Views, AreOfOneChainOfFramesOnly) {
  std::vector<double> way;
  for (int i = 0; i < 20; ++i) way.push_back(0.1 * i);
  for (const int view : views_of(way, 4, 3)) EXPECT_EQ(view % 3, 0);
  EXPECT_EQ(views_of(way, 4, 3).back(), 15);
}

TEST(Views, AreNoneOfACameraThatStands) { EXPECT_TRUE(views_of(std::vector<double>(10, 1.0)).empty()); }

/// A way with steps of any length, ahead in the camera's axes, which turn by `turn` a frame. Each step errs
/// in length by `along` of it and across by `across` of it.
struct Steps {
  RecentFrames recent;
  Frame newest;
  RelativeMotion first;
  Steps(const std::vector<double>& lengths, double along, double across, double turn = 0) {
    Pose pose;
    recent.push({newest, pose, pose}, 64);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      Pose step;
      step.rotation = rotation_exp({0, turn, 0});
      step.translation = step.rotation * Eigen::Vector3d(0, 0, lengths[i]);
      pose = pose * step;
      newest.T_world_camera = pose;
      first = {};
      first.t_reference_other = {0, 0, -lengths[i]};
      const double l2 = lengths[i] * lengths[i];
      first.covariance.diagonal() << across * across * l2, across * across * l2, along * along * l2, 1e-6,
          2e-6, 3e-6;
      if (i + 1 == lengths.size()) break;
      TrackedFrame frame{newest, pose, pose};
      frame.motion = first;
      recent.push(frame, 64);
    }
  }
  [[nodiscard]] Matrix6d covariance() const { return recent.covariance(newest, first, recent.size(), 1); }
};

TEST(CovarianceOfABaseline, OfEqualStepsGrowsAlongWithTheirSquareAndAcrossWithTheirNumber) {
  const Matrix6d of_five = Steps({2, 2, 2, 2, 2}, 0.01, 0.03).covariance();
  EXPECT_NEAR(of_five(2, 2), 25 * 4e-4, 1e-12);
  EXPECT_NEAR(of_five(0, 0), 5 * 36e-4, 1e-12);
  EXPECT_NEAR(of_five(4, 4), 5 * 2e-6, 1e-15);
  const Steps one({2}, 0.01, 0.03);
  EXPECT_EQ(one.covariance(), one.first.covariance);
  const Matrix6d exact = Steps({2, 1, 2}, 0, 0).covariance();
  EXPECT_EQ(exact.diagonal().head(3).norm(), 0);
}

/// What is known to 2 % is known to 2 %, whether the last of the steps was long or short.
TEST(CovarianceOfABaseline, DoesNotDependOnWhichOfItsStepsIsTheLast) {
  const std::vector<double> braking = {0.4, 0.4, 0.2, 0.1, 0.01};
  const std::vector<double> accelerating(braking.rbegin(), braking.rend());
  for (const auto& lengths : {braking, accelerating}) {
    const Matrix6d sigma = Steps(lengths, 0.02, 0.05).covariance();
    EXPECT_NEAR(std::sqrt(sigma(2, 2)), 0.02 * 1.11, 1e-9);
    EXPECT_NEAR(sigma(0, 0), 0.0025 * (0.16 + 0.16 + 0.04 + 0.01 + 0.0001), 1e-9);
  }
}

/// Monte Carlo: one error of all lengths, and each step's own across it.
TEST(CovarianceOfABaseline, IsThatOfTheSumOfStepsThatTurn) {
  const std::vector<double> lengths = {1, 0.5, 2, 0.3, 0.7};
  const double along = 0.03;
  const double across = 0.05;
  const double turn = 0.3;
  const Steps steps(lengths, along, across, turn);
  Random random(1);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  constexpr int kDraws = 40000;
  for (int draw = 0; draw < kDraws; ++draw) {
    Eigen::Vector3d error = Eigen::Vector3d::Zero();
    const double longer = along * random.normal();
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const double older = static_cast<double>(lengths.size() - 1 - i);
      const Eigen::Vector3d own(across * random.normal(), across * random.normal(), longer);
      error += lengths[i] * (rotation_exp({0, -turn * older, 0}) * own);
    }
    scatter += error * error.transpose() / kDraws;
  }
  const Eigen::Matrix3d stated = steps.covariance().topLeftCorner<3, 3>();
  EXPECT_LT((stated - scatter).norm(), 0.03 * scatter.norm());
}

TEST(OverMissed, IsOfAMotionThatIsAllOfThem) {
  const Matrix6d one = Matrix6d::Identity() * 0.01;
  EXPECT_EQ(over_missed(one, 0), one);
  EXPECT_TRUE(over_missed(one, 2).isApprox(9 * one));
}

}  // namespace
}  // namespace pade
