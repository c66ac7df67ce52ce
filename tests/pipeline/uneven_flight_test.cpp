// Flights that do not go on as they were: the camera stops, hangs or brakes.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pade/pipeline/obstacle_mapper.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade {
namespace {

/// A flight forward in small images with noise.
class ForwardCamera {
 public:
  ForwardCamera()
      : scene_(*simulation::make_analytic_flight("forward", 7, simulation::analytic_camera(160, 120))),
        mapper_(std::move(ObstacleMapper::create(scene_.camera)).value()) {}

  [[nodiscard]] const simulation::AnalyticFlight& scene() const { return scene_; }
  [[nodiscard]] std::size_t size() const { return scene_.T_world_camera.size(); }
  [[nodiscard]] ObstacleMapper& mapper() { return mapper_; }
  [[nodiscard]] cv::Mat image(const Pose& pose) {
    cv::Mat noise(scene_.camera.size(), CV_16SC1);
    random_.fill(noise, cv::RNG::NORMAL, 0, 1);
    cv::Mat image;
    cv::add(simulation::render_image(scene_.scene, scene_.camera, pose), noise, image, {}, CV_8U);
    return image;
  }
  /// The next frame, a tenth of a second after the one before.
  const MapperUpdate& add(const cv::Mat& image, const Pose& pose) {
    time_.nanoseconds += 100000000;
    return mapper_.add(image, time_, pose);
  }
  const MapperUpdate& add(const Pose& pose) { return add(image(pose), pose); }

 private:
  simulation::AnalyticFlight scene_;
  ObstacleMapper mapper_;
  cv::RNG random_{5};
  Time time_;
};

/// Share of the pixels that have a depth, and the median of its relative error.
struct Quality {
  double share = 0, error = 1;
};
Quality quality(const DepthImage& depth, const simulation::AnalyticFlight& f, const Pose& pose) {
  Quality q;
  if (depth.empty()) return q;
  const cv::Mat truth = simulation::exact_depth(f.scene, f.camera, pose);
  std::vector<float> errors;
  for (int v = 0; v < truth.rows; ++v) {
    for (int u = 0; u < truth.cols; ++u) {
      const float error = depth.depth.at<float>(v, u) / truth.at<float>(v, u) - 1;
      if (std::isfinite(error)) errors.push_back(std::abs(error));
    }
  }
  q.share = static_cast<double>(errors.size()) / static_cast<double>(truth.total());
  if (errors.empty()) return q;
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  q.error = static_cast<double>(*middle);
  return q;
}

/// The views of before are still there: what they have measured does not go with the parallax of the last
/// pair.
TEST(UnevenFlight, DepthOutlivesAStandstillAndACreep) {
  for (const double step : {0.0, 0.001}) {
    ForwardCamera f;
    Pose pose;
    Quality before;
    for (std::size_t k = 0; k < f.size(); ++k) {
      pose = f.scene().T_world_camera[k];
      before = quality(f.add(pose).depth, f.scene(), pose);
    }
    ASSERT_GT(before.share, 0.5);
    for (int i = 1; i <= 3; ++i) {
      pose.translation.y() += i % 2 == 0 ? step : -step;
      const MapperUpdate& update = f.add(pose);
      ASSERT_GT(update.views, 1);
      const Quality now = quality(update.depth, f.scene(), pose);
      EXPECT_GT(now.share, 0.85 * before.share) << step << ", frame " << i;
      EXPECT_LT(now.error, 1.3 * before.error) << step << ", frame " << i;
    }
  }
}

/// Each step of a frozen image is shorter than what is taken for a motion; together they are not.
TEST(UnevenFlight, ACameraThatHangsInSlowFlightIsNotBelieved) {
  for (const double turn : {0.0, 0.0004}) {
    const double step = turn > 0 ? 0.0 : 0.002;
    ForwardCamera f;
    Pose pose = f.scene().T_world_camera[0];
    f.add(pose);
    pose = f.scene().T_world_camera[1];
    const cv::Mat frozen = f.image(pose);
    f.add(frozen, pose);
    const std::size_t free = f.mapper().map().counts().free;
    for (int i = 1; i <= 40; ++i) {
      pose.translation.x() += step;
      pose.rotation = (pose.rotation * rotation_exp({0, turn, 0})).normalized();
      const MapperUpdate& update = f.add(frozen, pose);
      EXPECT_EQ(update.outcome == MapperUpdate::Outcome::skipped, i > 2) << i << ": " << update.reason;
    }
    EXPECT_LE(f.mapper().map().counts().free, free + free / 10);
    EXPECT_EQ(f.add(pose).outcome, MapperUpdate::Outcome::mapped);  // it has come back
  }
}

/// A vehicle that stands before a wall, in a simulator without noise, has one image for ever.
TEST(UnevenFlight, ACameraThatStandsDoesNotHang) {
  ForwardCamera f;
  const Pose pose = f.scene().T_world_camera[0];
  const cv::Mat image = f.image(pose);
  for (int i = 0; i < 20; ++i) {
    Pose given = pose;
    given.translation.x() += i % 2 == 0 ? 0.0 : 0.004;
    EXPECT_NE(f.add(image, given).outcome, MapperUpdate::Outcome::skipped) << i;
  }
}

/// Automatic exposure that drifts: the views are compared at one exposure.
TEST(UnevenFlight, ASlowChangeOfExposureCostsNoPrecision) {
  const auto fly = [](double per_frame) {
    ForwardCamera f;
    Quality last;
    double gain = 0.8;
    for (const Pose& pose : f.scene().T_world_camera) {
      cv::Mat image;
      f.image(pose).convertTo(image, CV_8U, gain);
      last = quality(f.add(image, pose).depth, f.scene(), pose);
      gain *= per_frame;
    }
    return last;
  };
  const Quality constant = fly(1);
  const Quality drifting = fly(1.04);
  EXPECT_LT(drifting.error, 1.3 * constant.error);
  EXPECT_GT(drifting.share, 0.9 * constant.share);
}

/// The border of a mask stands still in the image, as a thing infinitely far would; the scene before it does
/// not become free for that.
TEST(UnevenFlight, NothingIsFarAtTheBorderOfAMask) {
  ForwardCamera scene;
  const simulation::AnalyticFlight& f = scene.scene();
  cv::Mat valid(f.camera.size(), CV_8UC1, cv::Scalar(0));
  cv::circle(valid, {80, 60}, 52, 255, -1);
  auto mapper = std::move(ObstacleMapper::create(f.camera, {}, valid)).value();
  Pose pose = f.T_world_camera[0];
  const Eigen::Vector3d aside = pose.rotation * Eigen::Vector3d(0.15, 0, 0);
  Time time;
  for (int i = 0; i < 8; ++i) {
    pose.translation += aside;
    time.nanoseconds += 100000000;
    cv::Mat image = scene.image(pose);
    image.setTo(0, valid == 0);
    const MapperUpdate& update = mapper.add(image, time, pose);
    if (i < 7) continue;
    const cv::Mat truth = simulation::exact_depth(f.scene, f.camera, pose);
    const cv::Mat too_far = (update.depth.bound > truth * 1.2) & (truth > 0);
    cv::Mat inner;
    cv::erode(valid, inner, cv::Mat::ones(21, 21, CV_8UC1));
    EXPECT_EQ(cv::countNonZero(too_far & (inner == 0)), 0);
    EXPECT_GT(cv::countNonZero((update.depth.bound > 0) & inner), cv::countNonZero(inner) / 2);
    EXPECT_EQ(cv::countNonZero((update.depth.bound > 0) & (valid == 0)), 0);
  }
}

}  // namespace
}  // namespace pade
