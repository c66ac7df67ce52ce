#include "pade/depth/prediction.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "pade/depth/derotation.hpp"

#include "depth/depth_scene.hpp"

namespace pade::depth {
namespace {

const Camera kCamera = simulation::analytic_camera(320, 240);
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

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
    const ScenePair pair(kCamera, from, Eigen::Vector3d::Zero());
    const RelativeMotion longer{Eigen::Matrix3d::Identity(), to};
    const cv::Mat predicted = predict_flow(pair.exact.flow.vectors, kCamera, pair.motion, longer);
    ASSERT_TRUE(cv::checkRange(predicted));
    int compared = 0;
    for (int v = 0; v < kCamera.height; ++v) {
      for (int u = 0; u < kCamera.width; ++u) {
        const double z = pair.truth.at<float>(v, u);
        const Eigen::Vector2d p(u - kCamera.cx, v - kCamera.cy);
        const double reach = times_A(kCamera, p, from).norm();
        if (std::isnan(z)) continue;
        const cv::Vec2d truth = projected(kCamera, z, to, v, u);
        // The damping takes (e / |a|)^2 of the parallax, e = 5 px |t|.
        const double damped = std::pow(5 * from.norm() / reach, 2) * cv::norm(truth);
        EXPECT_LT(cv::norm(cv::Vec2d(predicted.at<cv::Vec2f>(v, u)) - truth), 1e-3 + 1.3 * damped)
            << v << ' ' << u;
        compared += damped < 0.5 ? 1 : 0;
      }
    }
    EXPECT_GT(compared, 0.5 * kCamera.size().area());
  }
}

TEST(Prediction, IsFiniteForAnyFlow) {
  Random random(2);
  cv::Mat flow(kCamera.size(), CV_32FC2);
  for (auto& w : cv::Mat_<cv::Vec2f>(flow)) {
    const double scale = std::pow(10.0, random.uniform(-3, 30));
    w = {static_cast<float>(scale * random.normal()), static_cast<float>(scale * random.normal())};
  }
  flow.at<cv::Vec2f>(5, 5) = {kNan, 1};
  flow.at<cv::Vec2f>(5, 6) = {INFINITY, 1};
  for (const double back : {-0.3, 0.0, 0.3}) {
    const RelativeMotion from{Eigen::Matrix3d::Identity(), {0.01, 0, back}};
    for (const double far : {-1.0, 0.0, 2.0}) {
      const RelativeMotion to{Eigen::Matrix3d::Identity(), {0.2, 0.1, far}};
      const cv::Mat predicted = predict_flow(flow, kCamera, from, to);
      EXPECT_TRUE(cv::checkRange(predicted));
      EXPECT_LE(cv::norm(predicted, cv::NORM_INF), kCamera.width);
    }
  }
  const RelativeMotion still{};
  EXPECT_EQ(cv::norm(predict_flow(flow, kCamera, still, still), cv::NORM_INF), 0);
}

TEST(Prediction, FlowOfDepthIsTheFlowOfTheScene) {
  const ScenePair pair(kCamera, {0.1, -0.05, 0.2}, Eigen::Vector3d::Zero());
  const cv::Mat flow = flow_of_depth(pair.truth, kCamera, pair.motion);
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const float z = pair.truth.at<float>(v, u);
      const cv::Vec2d truth =
          std::isnan(z) ? cv::Vec2d(0, 0) : cv::Vec2d(pair.exact.flow.vectors.at<cv::Vec2f>(v, u));
      EXPECT_LT(cv::norm(cv::Vec2d(flow.at<cv::Vec2f>(v, u)) - truth), 1e-3);
    }
  }
}

TEST(Prediction, DepthMovedToAnotherPoseIsWhatThatPoseSees) {
  const ScenePair pair(kCamera, {0.15, -0.1, 0.2}, {0.02, -0.03, 0.01});
  const cv::Mat truth = simulation::exact_depth(pair.flight.scene, kCamera, pair.T_world_other);
  const Pose T_other_reference = pair.T_world_other.inverse() * pair.T_world_reference;
  const cv::Mat moved = reproject_depth(pair.truth, kCamera, T_other_reference);
  int right = 0;
  int known = 0;
  int seen = 0;
  for (int v = 0; v < truth.rows; ++v) {
    for (int u = 0; u < truth.cols; ++u) {
      const float z = truth.at<float>(v, u);
      const float is = moved.at<float>(v, u);
      EXPECT_FALSE(std::isinf(is));
      seen += std::isnan(z) ? 0 : 1;
      if (std::isnan(z) || std::isnan(is)) continue;
      ++known;
      right += std::abs(is / z - 1) < 0.02 ? 1 : 0;
    }
  }
  EXPECT_GT(known, 0.9 * seen);
  EXPECT_GT(right, 0.95 * known);  // the rest is beside edges, and ground that is seen at grazing angle
}

TEST(Prediction, OfTwoSurfacesThatFallTogetherTheNearerIsSeen) {
  // A near stripe moves over the far wall.
  cv::Mat depth(kCamera.size(), CV_32FC1, cv::Scalar(10));
  depth.colRange(100, 110) = 2;
  const Pose T{Eigen::Quaterniond::Identity(), {0.2, 0, 0}};  // points move right: 27.7 px near, 5.5 far
  const cv::Mat moved = reproject_depth(depth, kCamera, T);
  const double shift = kCamera.fx * 0.2 / 2;
  for (int u = 0; u < 10; ++u)
    EXPECT_EQ(moved.at<float>(100, static_cast<int>(std::lround(100 + u + shift))), 2);
  EXPECT_EQ(moved.at<float>(100, 220), 10);
}

TEST(Prediction, AHoleIsFilledWithTheMeanInverseDepthAroundItAndTheKnownStays) {
  cv::Mat depth(80, 100, CV_32FC1, cv::Scalar(6));
  depth(cv::Rect(50, 0, 50, 80)) = 3;
  depth(cv::Rect(40, 30, 20, 10)) = kNan;
  const cv::Mat filled = filled_depth(depth);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      if (!std::isnan(depth.at<float>(v, u))) {
        EXPECT_EQ(filled.at<float>(v, u), depth.at<float>(v, u));
        continue;
      }
      double rho = 0;
      double known = 0;
      for (int dv = -15; dv <= 15; ++dv) {
        for (int du = -15; du <= 15; ++du) {
          if (!cv::Rect({0, 0}, depth.size()).contains({u + du, v + dv})) continue;
          const float z = depth.at<float>(v + dv, u + du);
          if (std::isnan(z)) continue;
          rho += 1.0 / static_cast<double>(z);
          known += 1;
        }
      }
      EXPECT_NEAR(filled.at<float>(v, u), known / rho, 1e-3);
    }
  }
  const cv::Mat nothing(50, 50, CV_32FC1, cv::Scalar(kNan));
  const cv::Mat still_nothing = filled_depth(nothing);
  EXPECT_EQ(cv::countNonZero(still_nothing == still_nothing), 0);
}

}  // namespace
}  // namespace pade::depth
