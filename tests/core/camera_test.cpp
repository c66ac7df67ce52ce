#include "pade/core/camera.hpp"

#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace pade {
namespace {

Camera camera_with(Distortion model, std::array<double, 8> coefficients) {
  return {640, 480, 460.0, 458.0, 325.3, 241.7, model, coefficients};
}

const Camera kCameras[] = {
    camera_with(Distortion::none, {}),
    camera_with(Distortion::plumb_bob, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}),
    camera_with(Distortion::plumb_bob, {0.1, -0.2, 0.001, -0.002, 0.05}),
    camera_with(Distortion::rational_polynomial, {0.3, 0.02, 1e-4, -2e-4, 0.001, 0.6, 0.1, 0.005}),
    camera_with(Distortion::equidistant, {-0.0132, 0.0021, -0.0014, 0.0003}),
};

class CameraModels : public testing::TestWithParam<Camera> {};

TEST_P(CameraModels, UnprojectingInvertsProjecting) {
  const Camera& camera = GetParam();
  int tested = 0;
  for (int v = 0; v < camera.height; v += 17) {
    for (int u = 0; u < camera.width; u += 17) {
      const auto ray = camera.unproject({u, v});
      if (!ray) continue;
      const auto pixel = camera.project(7.3 * *ray);
      ASSERT_TRUE(pixel);
      EXPECT_NEAR(pixel->x(), u, 1e-6);
      EXPECT_NEAR(pixel->y(), v, 1e-6);
      ++tested;
    }
  }
  EXPECT_GT(tested, 900);
}

TEST_P(CameraModels, UndistortionShowsTheIdealPinholeImage) {
  // A smooth function of direction, seen through the lens and undistorted, is that function on the pinhole
  // grid.
  const Camera& camera = GetParam();
  const auto brightness = [](const Eigen::Vector3d& ray) {
    return 100 + 60 * std::sin(5 * ray.x()) * std::cos(4 * ray.y());
  };
  cv::Mat seen(camera.size(), CV_32FC1, cv::Scalar(0));
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      if (const auto ray = camera.unproject({u, v}))
        seen.at<float>(v, u) = static_cast<float>(brightness(*ray));
    }
  }
  const Undistorter undistort(camera);
  const cv::Mat ideal = undistort(seen);
  int checked = 0;
  for (int v = 0; v < camera.height; v += 5) {
    for (int u = 0; u < camera.width; u += 5) {
      const bool valid = undistort.valid().empty() || undistort.valid().at<std::uint8_t>(v, u) != 0;
      const Eigen::Vector3d ray = *camera.undistorted().unproject({u, v});
      const auto source = camera.project(ray);
      const bool inside = source && source->x() >= 0 && source->y() >= 0 && source->x() <= camera.width - 1 &&
                          source->y() <= camera.height - 1;
      EXPECT_EQ(valid, inside) << u << ' ' << v;
      if (!inside || source->x() < 1 || source->y() < 1) continue;
      EXPECT_NEAR(ideal.at<float>(v, u), brightness(ray), 0.05) << u << ' ' << v;
      ++checked;
    }
  }
  EXPECT_GT(checked, 8000);
}

std::string lens_name(const testing::TestParamInfo<Camera>& lens) {
  constexpr const char* kNames[] = {"None", "PlumbBob", "PlumbBobWithK3", "RationalPolynomial",
                                    "Equidistant"};
  return kNames[lens.index];
}
INSTANTIATE_TEST_SUITE_P(All, CameraModels, testing::ValuesIn(kCameras), lens_name);

TEST(Camera, AKnownPlumbBobPointAgreesWithTheFormulaByHand) {
  const Camera camera = camera_with(Distortion::plumb_bob, {-0.3, 0.1, 0.001, -0.002, 0.02});
  const double x = 0.4;
  const double y = -0.3;
  const double r2 = 0.25;
  const double radial = 1 - 0.3 * r2 + 0.1 * r2 * r2 + 0.02 * r2 * r2 * r2;
  const auto pixel = camera.project({x, y, 1});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 460 * (x * radial + 2 * 0.001 * x * y - 0.002 * (r2 + 2 * x * x)) + 325.3, 1e-9);
  EXPECT_NEAR(pixel->y(), 458 * (y * radial + 0.001 * (r2 + 2 * y * y) - 2 * 0.002 * x * y) + 241.7, 1e-9);
}

TEST(Camera, PointsBehindThePinholeHaveNoPixel) {
  EXPECT_FALSE(kCameras[0].project({0.1, 0.1, -1}));
  EXPECT_FALSE(kCameras[0].project({0.1, 0.1, 0}));
  EXPECT_TRUE(kCameras[4].project({1, 0, -0.1}));  // a fisheye sees 90 degrees and more
}

TEST(Camera, BeyondTheMonotonicRangeThereIsNoPixelAndNoRay) {
  const Camera strong = camera_with(Distortion::plumb_bob, {-0.5});  // r (1 - r^2/2) grows up to r = 0.816
  EXPECT_TRUE(strong.project({0.8, 0, 1}));
  EXPECT_FALSE(strong.project({0.9, 0, 1}));
  EXPECT_FALSE(strong.unproject({325.3 + 460 * 0.6, 241.7}));  // its peak is at 0.544
}

}  // namespace
}  // namespace pade
