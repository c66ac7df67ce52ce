#include "pade/simulation/analytic/analytic_render.hpp"

#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pade/simulation/analytic/analytic_flights.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const Camera kSmall = analytic_camera(160, 120);

struct Lens {
  const char* name;
  Camera camera;
};

const Lens kLenses[] = {
    {"pinhole", kSmall},
    {"plumb_bob", {160, 120, 115, 114, 81.3, 60.4, Distortion::plumb_bob, {-0.28, 0.074, 2e-4, 2e-5}}},
    {"equidistant", {160, 120, 70, 70, 80.2, 59.1, Distortion::equidistant, {-0.013, 0.002, -0.001, 3e-4}}},
};

class ExactFlowOf : public testing::TestWithParam<std::string> {};

TEST_P(ExactFlowOf, LandsWhereThePoseAndDepthSay) {
  const AnalyticFlight flight = *make_analytic_flight(GetParam(), 4, kSmall);
  for (const Lens& lens : kLenses) {
    const Pose& from = flight.T_world_camera[1];
    for (const std::size_t k : {0U, 3U}) {
      const Pose& to = flight.T_world_camera[k];
      const Pose T_to_from = to.inverse() * from;
      int checked = 0;
      for (int v = 3; v < 120; v += 7) {
        for (int u = 2; u < 160; u += 7) {
          const auto ray = lens.camera.unproject({u, v});
          const auto flow = exact_flow_at(flight.scene, lens.camera, from, to, Vector2d(u, v));
          if (!ray || !flow) continue;
          const auto hit = flight.scene.cast(from.translation, from.rotation * *ray);
          const Vector3d point = hit ? T_to_from * Vector3d(hit->t * *ray) : T_to_from.rotation * *ray;
          const auto image = lens.camera.project(point);
          ASSERT_TRUE(image) << lens.name;
          EXPECT_LT((*image - Vector2d(u, v) - flow->vector).norm(), 1e-9) << lens.name;
          ++checked;
        }
      }
      EXPECT_GT(checked, 300) << lens.name;
    }
  }
}

TEST_P(ExactFlowOf, LeadsBackWhereThePointIsVisible) {
  const AnalyticFlight flight = *make_analytic_flight(GetParam(), 2, kSmall);
  const Pose& a = flight.T_world_camera[0];
  const Pose& b = flight.T_world_camera[1];
  int visible = 0;
  for (int v = 1; v < 119; v += 3) {
    for (int u = 1; u < 159; u += 3) {
      const auto there = exact_flow_at(flight.scene, kSmall, a, b, Vector2d(u, v));
      if (!there || !there->visible) continue;
      const auto back = exact_flow_at(flight.scene, kSmall, b, a, Vector2d(u, v) + there->vector);
      ASSERT_TRUE(back);
      EXPECT_LT((there->vector + back->vector).norm(), 1e-5);
      EXPECT_TRUE(back->visible);
      ++visible;
    }
  }
  EXPECT_GT(visible, 1500);
}

TEST_P(ExactFlowOf, WarpsTheNextImageOntoThisOneUpToNoise) {
  const AnalyticFlight flight = *make_analytic_flight(GetParam(), 2, analytic_camera(320, 240));
  const Camera& camera = flight.camera;
  AnalyticRenderOptions options;
  options.threads = 2;
  const cv::Mat first = render_image(flight.scene, camera, flight.T_world_camera[0], options);
  const cv::Mat second = render_image(flight.scene, camera, flight.T_world_camera[1], options);
  const ExactFlowField field =
      exact_flow(flight.scene, camera, flight.T_world_camera[0], flight.T_world_camera[1], 2);

  cv::Mat map(camera.size(), CV_32FC2);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      map.at<cv::Vec2f>(v, u) =
          field.flow.vectors.at<cv::Vec2f>(v, u) + cv::Vec2f(static_cast<float>(u), static_cast<float>(v));
    }
  }
  cv::Mat warped;
  cv::remap(second, warped, map, {}, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  // Away from edges of surfaces, where pixels mix two of them.
  cv::Mat labels = exact_labels(flight.scene, camera, flight.T_world_camera[0], 2);
  cv::Mat low, high;
  cv::erode(labels, low, cv::Mat(), {-1, -1}, 3);
  cv::dilate(labels, high, cv::Mat(), {-1, -1}, 3);
  cv::Mat visible;
  cv::erode(field.visible, visible, cv::Mat(), {-1, -1}, 3);
  const cv::Mat interior = (low == high) & visible;
  ASSERT_GT(cv::countNonZero(interior), camera.width * camera.height / 2);

  const double rms = cv::norm(first, warped, cv::NORM_L2, interior) / std::sqrt(cv::countNonZero(interior));
  // Rounding of both images gives 0.4; the rest is cubic interpolation, most of it at the panes of the
  // courtyard.
  EXPECT_LT(rms, 2);
  if (GetParam() != "hover") {
    const double unwarped =
        cv::norm(first, second, cv::NORM_L2, interior) / std::sqrt(cv::countNonZero(interior));
    EXPECT_GT(unwarped, 5 * rms);  // the images do differ
  }
}

INSTANTIATE_TEST_SUITE_P(Flights, ExactFlowOf,
                         testing::Values("forward", "sideways", "upward", "turning", "hover", "courtyard"),
                         [](const auto& flight) { return flight.param; });

TEST(ExactFlow, HidesPointsThatPassBehindAnother) {
  AnalyticScene scene;
  scene.add("wall", HalfSpace{{10, 0, 0}, -Vector3d::UnitX()});
  scene.add("ball", Sphere{{5, 0, 0}, 0.5});
  const Pose from{Eigen::Quaterniond(forward_camera_rotation()), {0, 2, 0}};
  const Pose to{from.rotation, {0, -2, 0}};
  // The wall at (10, 0, 0) is seen from neither... from the left it is beside the ball, from the axis it is
  // behind it.
  const auto project = [&](const Pose& pose, const Vector3d& point) {
    return *kSmall.project(pose.inverse() * point);
  };
  const Pose axis{from.rotation, {0, 0, 0}};
  const auto hidden = exact_flow_at(scene, kSmall, from, axis, project(from, {10, 0, 0}));
  const auto seen = exact_flow_at(scene, kSmall, from, to, project(from, {10, 0, 0}));
  ASSERT_TRUE(hidden && seen);
  EXPECT_FALSE(hidden->visible);
  EXPECT_TRUE(seen->visible);
}

TEST(Rendering, IsTheSameForAnyNumberOfThreads) {
  const AnalyticFlight flight = *make_analytic_flight("courtyard", 2, kSmall);
  AnalyticRenderOptions options;
  options.noise_sigma = 2;
  options.noise_seed = 5;
  const cv::Mat one = render_image(flight.scene, kSmall, flight.T_world_camera[1], options);
  for (const int threads : {2, 3, 7}) {
    options.threads = threads;
    const cv::Mat many = render_image(flight.scene, kSmall, flight.T_world_camera[1], options);
    EXPECT_EQ(cv::norm(one, many, cv::NORM_L1), 0);
  }
}

TEST(Rendering, NoiseHasTheStandardDeviationThatWasAskedForAndDiffersBetweenSeeds) {
  const AnalyticFlight flight = *make_analytic_flight("forward", 1);
  const Pose& pose = flight.T_world_camera[0];
  AnalyticRenderOptions options;
  options.threads = 2;
  const cv::Mat clean = render_image(flight.scene, flight.camera, pose, options);
  options.noise_sigma = 3;
  options.noise_seed = 1;
  const cv::Mat a = render_image(flight.scene, flight.camera, pose, options);
  options.noise_seed = 2;
  const cv::Mat b = render_image(flight.scene, flight.camera, pose, options);
  const double n = std::sqrt(static_cast<double>(clean.total()));
  EXPECT_NEAR(cv::norm(a, clean) / n, 3.0, 0.1);
  EXPECT_NEAR(cv::norm(a, b) / n, 3.0 * std::sqrt(2.0), 0.1);
}

TEST(Rendering, SeesTheSkyOnlyWhereThereIsNoDepthAndBlankSurfacesWithoutTexture) {
  const AnalyticFlight flight = *make_analytic_flight("forward", 1);
  const Pose& pose = flight.T_world_camera[0];
  const cv::Mat labels = exact_labels(flight.scene, flight.camera, pose, 2);
  const cv::Mat depth = exact_depth(flight.scene, flight.camera, pose, 2);
  EXPECT_EQ(cv::countNonZero((depth > 0) != (labels > 0)), 0);
  EXPECT_GT(cv::countNonZero(labels == 0), 20000);

  const cv::Mat image = render_image(flight.scene, flight.camera, pose);
  const cv::Mat textured = textured_mask(flight.scene, labels);
  cv::Mat blank;
  cv::erode((labels > 0) & (textured == 0), blank, cv::Mat(), {-1, -1}, 2);
  ASSERT_GT(cv::countNonZero(blank), 5000);
  double low = 0;
  double high = 0;
  cv::minMaxLoc(image, &low, &high, nullptr, nullptr, blank);
  EXPECT_EQ(low, high);
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation, textured);
  EXPECT_GT(deviation[0], 10);
}

TEST(Rendering, GivesDepthAlongTheOpticalAxis) {
  AnalyticScene scene;
  scene.add("wall", HalfSpace{{10, 0, 0}, -Vector3d::UnitX()});
  const Pose pose{Eigen::Quaterniond(forward_camera_rotation()), Vector3d(2, 3, 4)};
  const cv::Mat depth = exact_depth(scene, kSmall, pose);
  for (int v = 0; v < 120; v += 13) {
    for (int u = 0; u < 160; u += 13) EXPECT_FLOAT_EQ(depth.at<float>(v, u), 8.0F);
  }
}

TEST(AnalyticFlights, StayInFreeSpaceAndRefuseUnknownNames) {
  for (const std::string& name : analytic_flight_names()) {
    const AnalyticFlight flight = *make_analytic_flight(name, name == "courtyard" ? 50 : 12, kSmall);
    for (const Pose& pose : flight.T_world_camera) {
      EXPECT_TRUE(pose.is_finite());
      EXPECT_GT(flight.scene.signed_distance(pose.translation), 0.3) << name;
    }
  }
  const auto unknown = make_analytic_flight("backward", 3);
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("courtyard"), std::string::npos);
}

}  // namespace
}  // namespace pade::simulation
