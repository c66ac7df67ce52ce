#include "pade/depth/prediction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "pade/depth/derotation.hpp"

#include "depth/depth_scene.hpp"

namespace pade::depth {
namespace {

const Camera kForetoldCamera = simulation::analytic_camera(320, 240);
constexpr float kNoFlow = std::numeric_limits<float>::quiet_NaN();

/// Derotated flow by projection, in double precision: the reference's pixel p at depth Z as a camera at t
/// with the reference's orientation sees it.
cv::Vec2d projected(const Camera& camera, double z, const Eigen::Vector3d& t, int v, int u) {
  const Eigen::Vector3d point =
      z * Eigen::Vector3d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1) - t;
  return {camera.fx * point.x() / point.z() + camera.cx - u,
          camera.fy * point.y() / point.z() + camera.cy - v};
}

TEST(Prediction, OfTheExactFlowOfOnePairIsTheFlowOfTheOther) {
  const std::pair<Eigen::Vector3d, Eigen::Vector3d> motions[] = {
      {{0, 0, -0.2}, {0, 0, -0.8}},
      {{0, 0, 0.2}, {0.1, 0.02, 0.6}},
      {{0.2, 0, 0}, {0.8, 0.05, 0}},
      {{0.1, -0.05, -0.15}, {0.3, -0.2, -0.5}},
  };
  for (const auto& [from, to] : motions) {
    const ScenePair pair(kForetoldCamera, from, Eigen::Vector3d::Zero());
    const RelativeMotion longer{Eigen::Matrix3d::Identity(), to};
    const cv::Mat predicted = predict_flow(pair.exact.flow.vectors, kForetoldCamera, pair.motion, longer);
    ASSERT_TRUE(cv::checkRange(predicted));
    int compared = 0;
    double worst = 0;
    for (int v = 0; v < kForetoldCamera.height; ++v) {
      for (int u = 0; u < kForetoldCamera.width; ++u) {
        const double z = pair.truth.at<float>(v, u);
        const Eigen::Vector2d p(u - kForetoldCamera.cx, v - kForetoldCamera.cy);
        const double reach = times_A(kForetoldCamera, p, from).norm();
        if (std::isnan(z)) continue;
        const cv::Vec2d truth = projected(kForetoldCamera, z, to, v, u);
        // The damping takes (e / |a|)^2 of the parallax, e = 5 px |t|.
        const double damped = std::pow(5 * from.norm() / reach, 2) * cv::norm(truth);
        const double error = cv::norm(cv::Vec2d(predicted.at<cv::Vec2f>(v, u)) - truth);
        worst = std::max(worst, error - 1.3 * damped);
        compared += damped < 0.5 ? 1 : 0;
      }
    }
    EXPECT_LT(worst, 1e-3) << from.transpose();
    EXPECT_GT(compared, 0.5 * kForetoldCamera.size().area());
  }
}

TEST(Prediction, IsFiniteForAnyFlow) {
  Random random(2);
  cv::Mat flow(kForetoldCamera.size(), CV_32FC2);
  for (auto& w : cv::Mat_<cv::Vec2f>(flow)) {
    const double scale = std::pow(10.0, random.uniform(-3, 30));
    w = {static_cast<float>(scale * random.normal()), static_cast<float>(scale * random.normal())};
  }
  flow.at<cv::Vec2f>(5, 5) = {kNoFlow, 1};
  flow.at<cv::Vec2f>(5, 6) = {INFINITY, 1};
  for (const double back : {-0.3, 0.0, 0.3}) {
    const RelativeMotion from{Eigen::Matrix3d::Identity(), {0.01, 0, back}};
    for (const double far : {-1.0, 0.0, 2.0}) {
      const RelativeMotion to{Eigen::Matrix3d::Identity(), {0.2, 0.1, far}};
      const cv::Mat predicted = predict_flow(flow, kForetoldCamera, from, to);
      EXPECT_TRUE(cv::checkRange(predicted));
      EXPECT_LE(cv::norm(predicted, cv::NORM_INF), kForetoldCamera.width);
    }
  }
  const RelativeMotion still{};
  EXPECT_EQ(cv::norm(predict_flow(flow, kForetoldCamera, still, still), cv::NORM_INF), 0);
}

TEST(Prediction, DepthOfAnotherFrameForetellsTheFlowOfTheScene) {
  // The depth of the frame before, and the pair of the frame now with it.
  const ScenePair pair(kForetoldCamera, {0.15, -0.1, -0.2}, {0.02, -0.03, 0.01});
  const cv::Mat before = simulation::exact_depth(pair.flight.scene, kForetoldCamera, pair.T_world_other);
  const cv::Mat flow = foretell_flow(before, kForetoldCamera,
                                     pair.T_world_reference.inverse() * pair.T_world_other, pair.motion);
  ASSERT_EQ(flow.size(), kForetoldCamera.size());
  ASSERT_TRUE(cv::checkRange(flow));
  int known = 0;
  int right = 0;
  for (int v = 8; v < kForetoldCamera.height - 8; ++v) {
    for (int u = 8; u < kForetoldCamera.width - 8; ++u) {
      const double z = pair.truth.at<float>(v, u);
      if (std::isnan(z)) continue;
      const cv::Vec2d truth = projected(kForetoldCamera, z, pair.motion.t_reference_other, v, u);
      ++known;
      right += cv::norm(cv::Vec2d(flow.at<cv::Vec2f>(v, u)) - truth) < 0.1 * cv::norm(truth) + 0.1 ? 1 : 0;
    }
  }
  EXPECT_GT(right, 0.9 * known);  // the rest is at edges and at the border of what was seen
}

TEST(Prediction, OfTwoSurfacesThatFallTogetherTheNearerForetellsTheFlow) {
  cv::Mat depth(kForetoldCamera.size(), CV_32FC1, cv::Scalar(10));
  depth.colRange(100, 120) = 2;
  // The stripe moves to the right by f 0.2 / 2 = 27.7 px, over a wall that moves by 5.5 px.
  const Pose T{Eigen::Quaterniond::Identity(), {0.2, 0, 0}};
  const RelativeMotion motion{Eigen::Matrix3d::Identity(), {0.2, 0, 0}};
  const cv::Mat flow = foretell_flow(depth, kForetoldCamera, T, motion);
  const double near = -kForetoldCamera.fx * 0.2 / 2;
  for (int u = 134; u < 144; ++u) EXPECT_NEAR(flow.at<cv::Vec2f>(100, u)[0], near, 1e-3) << u;
  EXPECT_NEAR(flow.at<cv::Vec2f>(100, 220)[0], near / 5, 1e-3);
}

TEST(Prediction, HolesAreFilledFromAroundThemAndWhereNothingIsKnownThereIsNoFlow) {
  const Camera odd = simulation::analytic_camera(322, 241);
  const RelativeMotion motion{Eigen::Matrix3d::Identity(), {0.2, 0, 0}};
  const Pose same{Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()};
  cv::Mat depth(odd.size(), CV_32FC1, cv::Scalar(5));
  depth(cv::Rect(100, 100, 12, 12)) = kNoFlow;
  const cv::Mat flow = foretell_flow(depth, odd, same, motion);
  ASSERT_EQ(flow.size(), odd.size());
  for (const auto& w : cv::Mat_<cv::Vec2f>(flow)) {
    EXPECT_NEAR(w[0], -odd.fx * 0.2 / 5, 1e-3);
    EXPECT_EQ(w[1], 0);
  }
  depth.setTo(kNoFlow);
  EXPECT_EQ(cv::norm(foretell_flow(depth, odd, same, motion), cv::NORM_INF), 0);
}

TEST(Prediction, IsFiniteForAnyDepth) {
  Random random(6);
  cv::Mat depth(kForetoldCamera.size(), CV_32FC1);
  for (auto& z : cv::Mat_<float>(depth)) z = static_cast<float>(std::pow(10.0, random.uniform(-30, 30)));
  depth.at<float>(2, 2) = INFINITY;
  depth.at<float>(6, 6) = -1;
  for (const double forward : {-0.5, 0.0, 0.5}) {
    const RelativeMotion motion{Eigen::Matrix3d::Identity(), {0.1, 0, forward}};
    const Pose T{rotation_exp({0.1, 0.2, -0.3}), {0.1, 0, forward}};
    const cv::Mat flow = foretell_flow(depth, kForetoldCamera, T, motion);
    EXPECT_TRUE(cv::checkRange(flow));
    EXPECT_LE(cv::norm(flow, cv::NORM_INF), kForetoldCamera.width);
  }
}

}  // namespace
}  // namespace pade::depth
