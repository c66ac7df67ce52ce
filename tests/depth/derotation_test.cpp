#include "pade/depth/derotation.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "depth/depth_scene.hpp"

namespace pade::depth {
namespace {

const Camera kTurnedCamera = simulation::analytic_camera(320, 240);

TEST(Derotation, TheDerotatedImageIsWhatAnUnturnedCameraSees) {
  const ScenePair turned(kTurnedCamera, {0.1, 0, 0.1}, {0.02, -0.03, 0.04});
  const ScenePair unturned(kTurnedCamera, {0.1, 0, 0.1}, Eigen::Vector3d::Zero());
  const cv::Mat seen = simulation::render_image(turned.flight.scene, kTurnedCamera, turned.T_world_other);
  const cv::Mat expected =
      simulation::render_image(turned.flight.scene, kTurnedCamera, unturned.T_world_other);
  const cv::Mat derotated = derotate_image(seen, kTurnedCamera, turned.motion);
  const cv::Rect inside(20, 20, kTurnedCamera.width - 40, kTurnedCamera.height - 40);
  cv::Mat difference;
  cv::absdiff(derotated(inside), expected(inside), difference);
  cv::Mat unaided;
  cv::absdiff(seen(inside), expected(inside), unaided);
  EXPECT_LT(cv::mean(difference)[0], 2.0);
  EXPECT_GT(cv::mean(unaided)[0], 5 * cv::mean(difference)[0]);
}

TEST(Derotation, RemovesTheFlowOfAPureRotationExactly) {
  const ScenePair pair(kTurnedCamera, Eigen::Vector3d::Zero(), {0.02, -0.03, 0.04});
  const Derotator exact(kTurnedCamera, pair.motion, Model::exact, Derotation::flow);
  const Derotator first_order(kTurnedCamera, pair.motion, Model::instantaneous, Derotation::flow);
  double worst_first_order = 0;
  for (int v = 0; v < kTurnedCamera.height; v += 7) {
    for (int u = 0; u < kTurnedCamera.width; u += 7) {
      const auto w = simulation::exact_flow_at(pair.flight.scene, kTurnedCamera, pair.T_world_reference,
                                               pair.T_world_other, {u, v});
      ASSERT_TRUE(w);
      const Eigen::Vector2d p(u - kTurnedCamera.cx, v - kTurnedCamera.cy);
      EXPECT_LT(exact(p, w->vector).norm(), 1e-9);
      worst_first_order = std::max(worst_first_order, first_order(p, w->vector).norm());
    }
  }
  EXPECT_GT(worst_first_order, 0.1);  // B omega is first order: it leaves a rest
  EXPECT_LT(worst_first_order, 1.5);
}

TEST(Derotation, MatricesAAndBAreTheDerivativesOfTheProjection) {
  // Eq. 1 with the erratum's sign: a camera moving by (t, w) sees w = -(1/Z) A t - B w.
  const Eigen::Vector2d p(70, -40);
  const double Z = 5;
  const Eigen::Vector3d P(p.x() / kTurnedCamera.fx * Z, p.y() / kTurnedCamera.fy * Z, Z);
  constexpr double kSmall = 1e-6;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
    const auto moved = [&](const Pose& T_first_second) {
      const Eigen::Vector3d Q = T_first_second.inverse() * P;
      return Eigen::Vector2d(kTurnedCamera.fx * Q.x() / Q.z() - p.x(),
                             kTurnedCamera.fy * Q.y() / Q.z() - p.y());
    };
    const Eigen::Vector2d by_t = moved({Eigen::Quaterniond::Identity(), kSmall * unit}) / kSmall;
    const Eigen::Vector2d by_w = moved({rotation_exp(kSmall * unit), Eigen::Vector3d::Zero()}) / kSmall;
    EXPECT_LT((by_t + times_A(kTurnedCamera, p, unit) / Z).norm(), 1e-3);
    EXPECT_LT((by_w + times_B(kTurnedCamera, p, unit)).norm(), 1e-3);
  }
}

}  // namespace
}  // namespace pade::depth
