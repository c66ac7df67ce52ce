#include "pade/depth/image/footing.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade::depth {
namespace {

using Eigen::Vector3d;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kHeight = 1.5;  // of the camera over the ground, m
const Vector3d kUp(0, -1, 0);

Camera small_camera() {
  Camera camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 140;
  camera.cx = 79.5;
  camera.cy = 59.5;
  return camera;
}

/// Ground with texture up to a wall or the horizon, of which every pixel has its true depth as bound; all
/// above it is blank and has none.
struct View {
  Camera camera = small_camera();
  DepthImage image;
  cv::Mat truth;  // depth of the wall; infinity where there is sky
};

/// @param wall  how far ahead a blank wall stands, level; infinity = sky. @param up  camera axes
View looking(double wall, const Vector3d& up = kUp) {
  View view;
  const cv::Size size(view.camera.width, view.camera.height);
  view.image.depth = cv::Mat(size, CV_32FC1, cv::Scalar(kNan));
  view.image.bound = view.image.depth.clone();
  view.image.state = cv::Mat(size, CV_8UC1, cv::Scalar(static_cast<int>(DepthState::no_texture)));
  view.truth = cv::Mat(size, CV_32FC1, cv::Scalar(wall));
  const Vector3d ahead = (Vector3d::UnitZ() - up.z() * up).normalized();
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const Vector3d ray((u - view.camera.cx) / view.camera.fx, (v - view.camera.cy) / view.camera.fy, 1);
      const double down = -up.dot(ray);
      const double ground = down > 0 ? kHeight / down : std::numeric_limits<double>::infinity();
      constexpr double kHorizon = 200;
      const double of_wall = wall / ray.dot(ahead);
      view.truth.at<float>(v, u) = static_cast<float>(of_wall);
      if (ground > std::min(of_wall, kHorizon)) continue;
      view.image.bound.at<float>(v, u) = static_cast<float>(ground);
      view.image.state.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(DepthState::measured);
    }
  }
  return view;
}

bool is_blank(const View& view, int v, int u) {
  return view.image.state.at<std::uint8_t>(v, u) == static_cast<std::uint8_t>(DepthState::no_texture);
}

/// Up in the axes of a camera that is banked and pitched.
Vector3d banked(double bank, double pitch) {
  return Eigen::AngleAxisd(bank, Vector3d::UnitZ()) * (Eigen::AngleAxisd(pitch, Vector3d::UnitX()) * kUp);
}

const FootingOptions kFar{true, 1000};

/// However the camera is turned, a blank wall is never taken for farther than it is, and for not much nearer.
TEST(Footing, ABlankWallIsAsFarAsTheGroundBeforeIt) {
  for (const double wall : {5.0, 9.0}) {
    for (const auto& [bank, pitch] :
         {std::pair{0.0, 0.0}, {0.2, 0.0}, {-0.35, 0.0}, {0.0, 0.2}, {0.0, 0.35}, {0.2, 0.2}}) {
      const Vector3d up = banked(bank, pitch);
      View view = looking(wall, up);
      bound_by_footing(view.image, view.camera, up, kFar);
      int bounded = 0;
      int blank = 0;
      for (int v = 0; v < view.camera.height; ++v) {
        for (int u = 0; u < view.camera.width; ++u) {
          if (!is_blank(view, v, u)) continue;
          ++blank;
          const float bound = view.image.bound.at<float>(v, u);
          if (!(bound > 0)) continue;
          ++bounded;
          const float truth = view.truth.at<float>(v, u);
          ASSERT_LE(bound, truth * 1.001F)
              << v << ' ' << u << " banked by " << bank << ", pitched by " << pitch;
          ASSERT_GE(bound, truth * 0.7F)
              << v << ' ' << u << " banked by " << bank << ", pitched by " << pitch;
        }
      }
      EXPECT_GT(bounded, blank * 0.8) << "banked by " << bank << ", pitched by " << pitch;
    }
  }
}

/// The sky is free as far as the ground goes, but only up to the headroom above the camera.
TEST(Footing, TheSkyIsFreeUpToTheHeadroom) {
  View view = looking(std::numeric_limits<double>::infinity());
  const FootingOptions options{true, 1.5};
  bound_by_footing(view.image, view.camera, kUp, options);
  for (int v = 0; v < view.camera.height / 2; ++v) {
    const float bound = view.image.bound.at<float>(v, 80);
    const double climb = (view.camera.cy - v) / view.camera.fy;
    ASSERT_GT(bound, 0) << v;
    ASSERT_LE(bound * climb, options.headroom + 1e-4) << v;
    ASSERT_GE(bound, std::min(options.headroom / climb, 20.0) - 1e-3) << v;
  }
}

/// What stands in front of the sky with texture of its own carries nothing that is farther.
TEST(Footing, AbovePostsItIsAsNearAsThey) {
  View view = looking(std::numeric_limits<double>::infinity());
  const cv::Rect post(60, 40, 12, 60);
  view.image.state(post) = static_cast<std::uint8_t>(DepthState::measured);
  view.image.bound(post) = 2.0F;
  bound_by_footing(view.image, view.camera, kUp, kFar);
  for (int u = post.x; u < post.x + post.width; ++u) EXPECT_FLOAT_EQ(view.image.bound.at<float>(20, u), 2);
  EXPECT_GT(view.image.bound.at<float>(20, post.x - 1), 20);
}

/// A patch is one surface: a column whose foot says nothing is as far as those beside it, the nearer of the
/// two.
TEST(Footing, AGapIsFilledFromBothSides) {
  View view = looking(6);
  for (int u = 70; u < 80; ++u) {
    for (int v = 60; v < view.camera.height; ++v) view.image.bound.at<float>(v, u) = kNan;
  }
  bound_by_footing(view.image, view.camera, kUp, kFar);
  EXPECT_NEAR(view.image.bound.at<float>(30, 75), view.image.bound.at<float>(30, 60), 0.1);
}

/// Close before a blank wall the ground is out of view, and what else has texture is noise or a stone at one
/// side.
TEST(Footing, AFewColumnsDoNotSpeakForAWholeImage) {
  View view = looking(1.5);  // no ground in view
  const auto textured = static_cast<int>(DepthState::measured);
  const cv::Rect stone(40, 100, 20, 20);
  view.image.state(stone) = textured;
  view.image.bound(stone) = 9.0F;
  bound_by_footing(view.image, view.camera, kUp, kFar);
  for (int v = 0; v < view.camera.height; ++v) {
    for (int u = 0; u < view.camera.width; ++u) {
      if (u >= stone.x - 16 && u < stone.x + stone.width + 16) continue;
      ASSERT_FALSE(view.image.bound.at<float>(v, u) > 0) << v << ' ' << u;
    }
  }
}

TEST(Footing, SpecksOfNoiseCarryNothing) {
  View view = looking(1.5);
  Random random(1);
  for (int v = 0; v < view.camera.height; ++v) {
    for (int u = 0; u < view.camera.width; ++u) {
      if (random.uniform() > 0.1) continue;
      view.image.state.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(DepthState::low_parallax);
      view.image.bound.at<float>(v, u) = 9.0F;
    }
  }
  const cv::Mat before = view.image.bound.clone();
  bound_by_footing(view.image, view.camera, kUp, kFar);
  const int bounded = cv::countNonZero(before > 0);
  EXPECT_LT(cv::countNonZero(view.image.bound > 0) - bounded, 0.02 * static_cast<double>(before.total()));
}

TEST(Footing, WhereTheFootIsOutOfViewNothingIsKnown) {
  View view = looking(6);
  view.image.state = static_cast<std::uint8_t>(DepthState::no_texture);  // also the ground
  view.image.bound = kNan;
  bound_by_footing(view.image, view.camera, kUp, kFar);
  EXPECT_EQ(cv::countNonZero(view.image.bound == view.image.bound), 0);
}

TEST(Footing, ACameraThatLooksDownKnowsNoFooting) {
  View view = looking(6);
  const cv::Mat before = view.image.bound.clone();
  bound_by_footing(view.image, view.camera, banked(0, 1.2), kFar);
  bound_by_footing(view.image, view.camera, banked(0.9, 0), kFar);
  EXPECT_EQ(cv::countNonZero((view.image.bound == view.image.bound) != (before == before)), 0);
}

TEST(Footing, ABoundOfItsOwnStaysWhereItIsGreater) {
  View view = looking(6);
  view.image.bound.at<float>(20, 80) = 9;
  view.image.bound.at<float>(20, 81) = 1;
  bound_by_footing(view.image, view.camera, kUp, kFar);
  EXPECT_FLOAT_EQ(view.image.bound.at<float>(20, 80), 9);
  EXPECT_NEAR(view.image.bound.at<float>(20, 81), view.image.bound.at<float>(20, 82), 0.05);
}

}  // namespace
}  // namespace pade::depth
