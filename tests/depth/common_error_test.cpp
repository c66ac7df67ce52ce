#include "pade/depth/multi_view/common_error.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pade/core/lie.hpp"
#include "pade/core/random.hpp"

namespace pade::depth {
namespace {

Camera pinhole() {
  Camera camera{};
  camera.width = 640;
  camera.height = 480;
  camera.fx = 500;
  camera.fy = 480;
  camera.cx = 320;
  camera.cy = 240;
  return camera;
}

RelativeMotion view(const Eigen::Vector3d& t, const Vector6d& sigmas, double correlation) {
  RelativeMotion motion;
  motion.t_reference_other = t;
  motion.R_reference_other = rotation_exp({0.02, -0.01, 0.015});
  motion.covariance = sigmas.array().square().matrix().asDiagonal();
  motion.covariance(0, 4) = motion.covariance(4, 0) = correlation * sigmas[0] * sigmas[4];
  return motion;
}

/// Where a camera with this motion sees the point of the reference's pixel at inverse depth rho, in pixels.
Eigen::Vector2d seen(const Camera& camera, const Eigen::Matrix3d& R, const Eigen::Vector3d& t, double u,
                     double v, double rho) {
  const Eigen::Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
  const Eigen::Vector3d p = R.transpose() * (ray - rho * t);
  return {camera.fx * p.x() / p.z() + camera.cx, camera.fy * p.y() / p.z() + camera.cy};
}

/// Monte-Carlo: a camera that moves by a little else than what is assumed; the inverse depth with which the
/// assumed motion comes nearest to what it sees.
TEST(CommonError, IsTheVarianceOfInverseDepthReadWithAnotherMotion) {
  const Camera camera = pinhole();
  Vector6d sigmas;
  sigmas << 0.02, 0.015, 0.01, 1e-3, 2e-3, 1.5e-3;
  for (const Eigen::Vector3d& t : {Eigen::Vector3d(0.5, 0.1, 0.05), Eigen::Vector3d(0.05, -0.02, -0.6)}) {
    for (const auto& [u, v] : {std::pair(500, 150), std::pair(100, 400), std::pair(330, 60)}) {
      const RelativeMotion assumed = view(t, sigmas, 0.6);
      constexpr double kRho = 0.12;
      const Matrix6d root = assumed.covariance.llt().matrixL();
      Random random(3);
      double squares = 0;
      constexpr int kDraws = 4000;
      for (int i = 0; i < kDraws; ++i) {
        Vector6d e;
        for (int j = 0; j < 6; ++j) e[j] = random.normal();
        e = root * e;
        const Eigen::Matrix3d R = rotation_exp(e.tail<3>()) * assumed.R_reference_other;
        const Eigen::Vector2d found = seen(camera, R, assumed.t_reference_other + e.head<3>(), u, v, kRho);
        constexpr double kStep = 1e-5;
        double rho = kRho;
        for (int step = 0; step < 3; ++step) {  // Gauss-Newton
          const Eigen::Vector2d here =
              seen(camera, assumed.R_reference_other, assumed.t_reference_other, u, v, rho);
          const Eigen::Vector2d slope =
              (seen(camera, assumed.R_reference_other, assumed.t_reference_other, u, v, rho + kStep) - here) /
              kStep;
          rho += slope.dot(found - here) / slope.squaredNorm();
        }
        squares += (rho - kRho) * (rho - kRho);
      }
      const CommonError common(camera, {assumed}, 1e6);
      EXPECT_NEAR(std::sqrt(static_cast<double>(common(u, v, static_cast<float>(kRho)))) /
                      std::sqrt(squares / kDraws),
                  1, 0.12)
          << t.transpose() << " at " << u << ", " << v;
    }
  }
}

TEST(CommonError, TheLongestBaselineThatAPointCanUseDecides) {
  Vector6d sigmas = Vector6d::Zero();
  sigmas[4] = 1e-3;  // rotation about y: as an error of depth it falls with the baseline
  const RelativeMotion near = view({0.1, 0, 0}, sigmas, 0);
  const RelativeMotion far = view({0.8, 0, 0}, sigmas, 0);
  const Camera camera = pinhole();
  const CommonError both(camera, {near, far}, 40);
  const CommonError shorter(camera, {near}, 40);
  const CommonError longer(camera, {far}, 40);
  EXPECT_EQ(both(400, 200, 0.09F), longer(400, 200, 0.09F));   // 36 px over 0.8 m
  EXPECT_EQ(both(400, 200, 0.12F), shorter(400, 200, 0.12F));  // 48 px
  EXPECT_GT(shorter(400, 200, 0.09F), 50 * longer(400, 200, 0.09F));
}

TEST(CommonError, ExactMotionsHaveNone) {
  EXPECT_TRUE(CommonError().is_exact());
  const CommonError exact(pinhole(), {view({0.5, 0, 0}, Vector6d::Zero(), 0)}, 40);
  EXPECT_TRUE(exact.is_exact());
  EXPECT_EQ(exact(10, 10, 0.1F), 0);
}

}  // namespace
}  // namespace pade::depth
