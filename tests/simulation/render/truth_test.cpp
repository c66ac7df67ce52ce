#include "pade/simulation/render/truth.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include <gtest/gtest.h>

namespace pade::simulation {
namespace {

Camera paper_camera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 554.26;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

Camera with_lens(Distortion distortion) {
  Camera camera = paper_camera();
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 90;
  camera.cx = 80.3;
  camera.cy = 58.8;
  camera.distortion = distortion;
  camera.coefficients = {};
  if (distortion == Distortion::plumb_bob) camera.coefficients = {-0.2, 0.05, 0.001, -0.0005, 0};
  if (distortion == Distortion::rational_polynomial) {
    camera.coefficients = {0.1, 0.02, 0.0003, 0.0002, 0.01, 0.3, 0.05, 0.01};
  }
  if (distortion == Distortion::equidistant) camera.coefficients = {0.02, -0.01, 0.002, 0};
  return camera;
}

Pose looking_east(const Eigen::Vector3d& position, const Eigen::Vector3d& turn = Eigen::Vector3d::Zero()) {
  return {Eigen::Quaterniond(forward_camera_rotation()) * rotation_exp(turn), position};
}

Scene scene_of(const std::vector<std::pair<Shape, Pose>>& shapes) {
  World world;
  for (const auto& [shape, pose] : shapes) world.visuals.push_back({"shape", pose, shape, {}, true});
  auto scene = Scene::build(std::move(world));
  EXPECT_TRUE(scene.ok());
  return std::move(scene).value();
}

/// A wall at x = 7 m, a ball and a leaning pole before it, floor at z = 0.
Scene furnished() {
  return scene_of({{Rectangle{{-1, 0.2, 0.1}, {200, 200}}, {Eigen::Quaterniond::Identity(), {7, 0, 0}}},
                   {Ellipsoid{{0.8, 0.8, 0.8}}, {Eigen::Quaterniond::Identity(), {4, 1.1, 1.2}}},
                   {Cylinder{0.15, 3}, {rotation_exp({0.3, 0.2, 0}), {3.5, -1, 1.5}}},
                   {Rectangle{{0, 0, 1}, {100, 100}}, {}}});
}

/// Largest relative error of the depth image against a closed form that gives Z or NaN.
template <class Oracle>
double worst_error(const Scene& scene, const Camera& camera, const Pose& T_world_camera,
                   const Oracle& oracle) {
  const cv::Mat depth = exact_depth(scene, RayGrid(camera), T_world_camera);
  double worst = 0;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const auto ray = camera.unproject({u, v});
      const double truth = ray ? oracle(T_world_camera.rotation * *ray) : std::nan("");
      const double found = static_cast<double>(depth.at<float>(v, u));
      EXPECT_EQ(std::isnan(truth), std::isnan(found)) << u << ' ' << v;
      if (!std::isnan(truth)) worst = std::max(worst, std::abs(found / truth - 1));
    }
  }
  return worst;
}

TEST(ExactDepth, OfAPlaneIsItsClosedForm) {
  const Eigen::Vector3d normal = Eigen::Vector3d(-1, 0.3, 0.2).normalized();
  const Eigen::Vector3d on_plane(60, 3, 1);
  const Scene scene =
      scene_of({{Rectangle{normal, {2000, 2000}}, {Eigen::Quaterniond::Identity(), on_plane}}});
  const Pose pose = looking_east({12, -7, 3}, {0.05, -0.2, 0.1});
  EXPECT_LT(worst_error(scene, paper_camera(), pose,
                        [&](const Eigen::Vector3d& d) {
                          return normal.dot(on_plane - pose.translation) / normal.dot(d);
                        }),
            1e-5);
}

TEST(ExactDepth, OfASphereIsItsClosedForm) {
  const Eigen::Vector3d centre(15, 2, 4);
  constexpr double kRadius = 2.5;
  const Scene scene =
      scene_of({{Ellipsoid{Eigen::Vector3d::Constant(kRadius)}, {Eigen::Quaterniond::Identity(), centre}}});
  const Pose pose = looking_east({3, 1, 3}, {0.02, 0.1, 0.3});
  const cv::Mat depth = exact_depth(scene, RayGrid(paper_camera()), pose);
  int hits = 0;
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const Eigen::Vector3d d = pose.rotation * *paper_camera().unproject({u, v});
      const Eigen::Vector3d to = centre - pose.translation;
      const double b = to.dot(d);
      const double discriminant = b * b - d.squaredNorm() * (to.squaredNorm() - kRadius * kRadius);
      const auto found = static_cast<double>(depth.at<float>(v, u));
      if (std::isnan(found)) {
        EXPECT_LT(discriminant, 1e-3 * b * b);  // rays that graze may fall on either side
        continue;
      }
      ++hits;
      if (discriminant < 1e-5 * b * b) continue;
      EXPECT_NEAR(found / ((b - std::sqrt(discriminant)) / d.squaredNorm()), 1, 1e-5);
    }
  }
  EXPECT_GT(hits, 20000);
}

class EveryLens : public testing::TestWithParam<Distortion> {};

TEST_P(EveryLens, SeesAPlaneAtItsDepth) {
  const Eigen::Vector3d normal(-1, 0, 0);
  const Scene scene =
      scene_of({{Rectangle{normal, {4000, 4000}}, {Eigen::Quaterniond::Identity(), {9, 0, 0}}}});
  const Pose pose = looking_east({1, 0, 2}, {0, 0.1, 0});
  EXPECT_LT(worst_error(scene, with_lens(GetParam()), pose,
                        [&](const Eigen::Vector3d& d) { return d.x() > 0 ? 8 / d.x() : std::nan(""); }),
            1e-5);
}

TEST_P(EveryLens, FlowIsTheMotionOfTheSurfacePoint) {
  const Scene scene = furnished();
  const RayGrid grid(with_lens(GetParam()));
  const Camera& camera = grid.camera();
  const Pose first = looking_east({0, 0, 1.3});
  const Pose second = looking_east({0.2, 0.05, 1.35}, {0.01, 0.03, -0.02});
  const cv::Mat depth = exact_depth(scene, grid, first);
  const ExactFlow flow = exact_flow(scene, grid, depth, first, second);
  int compared = 0;
  for (int v = 0; v < camera.height; v += 7) {
    for (int u = 0; u < camera.width; u += 5) {
      const auto ray = camera.unproject({u, v});
      if (!ray) continue;
      // One exact ray per pixel, independent of the packets and of the depth image.
      const double z = scene.distance(first.translation, first.rotation * *ray);
      if (std::isnan(z)) continue;
      const auto pixel = camera.project(second.inverse() * (first * Eigen::Vector3d(z * *ray)));
      const auto& w = flow.flow.at<cv::Vec2f>(v, u);
      ASSERT_EQ(pixel.has_value(), !std::isnan(w[0]));
      if (!pixel) continue;
      EXPECT_NEAR(static_cast<double>(w[0]), pixel->x() - u, 1e-4);
      EXPECT_NEAR(static_cast<double>(w[1]), pixel->y() - v, 1e-4);
      ++compared;
    }
  }
  EXPECT_GT(compared, 100);
}

TEST_P(EveryLens, VisibleMeansThatTheSecondFrameHasTheSameDepthThere) {
  const Scene scene = furnished();
  const RayGrid grid(with_lens(GetParam()));
  const Pose first = looking_east({0, 0, 1.3});
  const Pose second = looking_east({0.1, 0.4, 1.3}, {0, 0.05, 0});
  const cv::Mat depth = exact_depth(scene, grid, first);
  const ExactFlow flow = exact_flow(scene, grid, depth, first, second);
  int hidden = 0;
  for (int v = 0; v < grid.camera().height; ++v) {
    for (int u = 0; u < grid.camera().width; ++u) {
      const auto& w = flow.flow.at<cv::Vec2f>(v, u);
      if (std::isnan(w[0])) continue;
      const Eigen::Vector2d there(u + static_cast<double>(w[0]), v + static_cast<double>(w[1]));
      if ((there.array() < 0).any() || there.x() > grid.camera().width - 1 ||
          there.y() > grid.camera().height - 1) {
        EXPECT_EQ(flow.visible.at<std::uint8_t>(v, u), 0);
        continue;
      }
      const auto ray1 = grid.camera().unproject({u, v});
      const auto ray2 = grid.camera().unproject(there);
      const Eigen::Vector3d point =
          second.inverse() * (first * Eigen::Vector3d(static_cast<double>(depth.at<float>(v, u)) * *ray1));
      const double seen = scene.distance(second.translation, second.rotation * *ray2);
      const double ratio = seen / point.z();
      if (ratio < 0.999) {
        EXPECT_EQ(flow.visible.at<std::uint8_t>(v, u), 0);
        ++hidden;
      } else if (ratio > 0.99999) {
        EXPECT_EQ(flow.visible.at<std::uint8_t>(v, u), 255);
      }
    }
  }
  EXPECT_GT(hidden, 20);
}

std::string lens_name(const testing::TestParamInfo<Distortion>& lens) {
  constexpr std::array names = {"Pinhole", "PlumbBob", "RationalPolynomial", "Equidistant"};
  return names[static_cast<std::size_t>(lens.param)];
}

INSTANTIATE_TEST_SUITE_P(Lenses, EveryLens,
                         testing::Values(Distortion::none, Distortion::plumb_bob,
                                         Distortion::rational_polynomial, Distortion::equidistant),
                         lens_name);

TEST(ExactDepth, IsTheSameForAnyNumberOfThreads) {
  const Scene scene = furnished();
  const RayGrid grid(paper_camera());
  const Pose pose = looking_east({0, 0, 1.3});
  const cv::Mat one = exact_depth(scene, grid, pose, 1);
  const cv::Mat three = exact_depth(scene, grid, pose, 3);
  EXPECT_EQ(std::memcmp(one.data, three.data, one.total() * one.elemSize()), 0);
}

TEST(Scene, RefusesImpossibleShapes) {
  for (const Shape& shape : {Shape(Box{{1, 0, 1}}), Shape(Ellipsoid{{1, -1, 1}}),
                             Shape(Cylinder{std::nan(""), 1}), Shape(Rectangle{{0, 0, 0}, {1, 1}})}) {
    World world;
    world.visuals.push_back({"broken", {}, shape, {}, true});
    const auto scene = Scene::build(world);
    ASSERT_FALSE(scene.ok());
    EXPECT_NE(scene.error().message.find("broken"), std::string::npos);
  }
}

TEST(Scene, KnowsWhatACameraWouldBeInside) {
  const Scene scene = furnished();
  EXPECT_TRUE(scene.inside_of({4, 1.1, 1.3}).has_value());
  EXPECT_FALSE(scene.inside_of({0, 0, 1.3}).has_value());
}

}  // namespace
}  // namespace pade::simulation
