#include "pade/evaluation/map/rigid_alignment.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace pade::evaluation {
namespace {

const Pose kMoved{rotation_exp({0.02, -0.03, 0.4}), {1.5, -2, 0.3}};

std::vector<Pose> straight_flight() {
  std::vector<Pose> poses;
  for (int i = 0; i < 40; ++i) {
    poses.push_back(
        {rotation_exp({0.1 * std::sin(0.3 * i), 0.2, 0.05 * std::cos(0.2 * i)}), {0.2 * i + 5, 1, 2}});
  }
  return poses;
}

std::vector<Pose> moved(const std::vector<Pose>& poses, const Pose& by) {
  std::vector<Pose> result;
  for (const Pose& pose : poses) result.push_back(by * pose);
  return result;
}

TEST(RigidAlignment, FindsTheMotionOfAStraightPath) {
  const std::vector<Pose> truth = straight_flight();
  const RigidAlignment found = align(moved(truth, kMoved), truth);
  EXPECT_LT((found.T_map_world.translation - kMoved.translation).norm(), 1e-10);
  EXPECT_LT(found.T_map_world.rotation.angularDistance(kMoved.rotation), 1e-10);
  EXPECT_NEAR(found.rotation, rotation_log(kMoved.rotation).norm(), 1e-10);
  EXPECT_LT(found.rms_position, 1e-10);
  EXPECT_LT(found.rms_rotation, 1e-7);
}

TEST(RigidAlignment, OfEqualPosesIsTheIdentityToTheBit) {
  const std::vector<Pose> truth = straight_flight();
  const RigidAlignment found = align(truth, truth);
  EXPECT_EQ(found.T_map_world.translation, Eigen::Vector3d::Zero());
  EXPECT_EQ(found.T_map_world.rotation.coeffs(), Eigen::Quaterniond::Identity().coeffs());
  EXPECT_EQ(found.poses, truth.size());
}

TEST(RigidAlignment, HoldsForAHoveringCamera) {
  const std::vector<Pose> truth(5, Pose{rotation_exp({0.3, 0.1, 0}), {1, 2, 3}});
  const RigidAlignment found = align(moved(truth, kMoved), truth);
  EXPECT_LT((found.T_map_world.translation - kMoved.translation).norm(), 1e-10);
  EXPECT_LT(found.T_map_world.rotation.angularDistance(kMoved.rotation), 1e-7);
}

/// What it minimises is not made smaller by any small motion away from it.
TEST(RigidAlignment, IsTheLeastOfItsSum) {
  std::mt19937 engine(3);
  std::normal_distribution<double> noise(0, 1);
  const auto three = [&](double scale) -> Eigen::Vector3d {
    return Eigen::Vector3d(noise(engine), noise(engine), noise(engine)) * scale;
  };
  const std::vector<Pose> truth = straight_flight();
  std::vector<Pose> noisy = moved(truth, kMoved);
  for (Pose& pose : noisy) pose = pose * Pose{rotation_exp(three(0.02)), three(0.1)};
  const auto sum = [&](const Pose& T) {
    double total = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const Pose at = T * truth[i];
      total += (at.translation - noisy[i].translation).squaredNorm();
      total += 0.5 * alignment_lever * alignment_lever * (at.matrix3() - noisy[i].matrix3()).squaredNorm();
    }
    return total;
  };
  const Pose best = align(noisy, truth).T_map_world;
  for (int i = 0; i < 200; ++i) {
    const Pose other = best * Pose{rotation_exp(three(1e-3)), three(1e-2)};
    EXPECT_GE(sum(other), sum(best));
  }
}

TEST(RigidAlignment, OfOneCameraLaysOnePoseOnTheOther) {
  const Pose a{rotation_exp({0.3, 0.1, 0}), {1, 2, 3}};
  const Pose T = registration(kMoved * a, a);
  EXPECT_LT(((T * a).translation - (kMoved * a).translation).norm(), 1e-12);
  EXPECT_EQ(registration(a, a).translation, Eigen::Vector3d::Zero());
}

}  // namespace
}  // namespace pade::evaluation
