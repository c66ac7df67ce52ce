#include "pade/pipeline/obstacle_mapper.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/map_files.hpp"
#include "pade/simulation/analytic_flights.hpp"
#include "pade/simulation/analytic_render.hpp"

namespace pade {
namespace {

using testing::HasSubstr;

/// A short flight at a quarter of the paper's resolution, rendered once.
struct Flight {
  simulation::AnalyticFlight scene =
      *simulation::make_analytic_flight("turning", 5, simulation::analytic_camera(320, 240));
  std::vector<cv::Mat> images;
  Flight() {
    for (const Pose& pose : scene.T_world_camera) {
      images.push_back(simulation::render_image(scene.scene, scene.camera, pose));
    }
  }
};
const Flight& flight() {
  static const Flight rendered;
  return rendered;
}

ObstacleMapper mapper(const ObstacleMapperOptions& options = {}) {
  return std::move(ObstacleMapper::create(flight().scene.camera, options)).value();
}

const MapperUpdate& add(ObstacleMapper& mapper, std::size_t k) {
  return mapper.add(flight().images[k], flight().scene.times[k], flight().scene.T_world_camera[k]);
}

/// Median relative error of the depth against the scene at the time of the depth image.
double median_error(const DepthImage& depth) {
  const Flight& f = flight();
  std::size_t k = 0;
  while (f.scene.times[k] != depth.time) ++k;
  const cv::Mat truth = simulation::exact_depth(f.scene.scene, f.scene.camera, f.scene.T_world_camera[k]);
  const DepthImage full = at_full_size(depth, truth.size());
  std::vector<float> errors;
  for (int v = 0; v < truth.rows; ++v) {
    for (int u = 0; u < truth.cols; ++u) {
      const float error = full.depth.at<float>(v, u) / truth.at<float>(v, u) - 1;
      if (std::isfinite(error)) errors.push_back(std::abs(error));
    }
  }
  EXPECT_GT(errors.size(), truth.total() / 3);
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2),
                   errors.end());
  return static_cast<double>(errors[errors.size() / 2]);
}

TEST(ObstacleMapper, TheFirstFrameWaitsAndEachLaterOneGivesDepthAtItsOwnTime) {
  ObstacleMapper m = mapper();
  EXPECT_EQ(add(m, 0).outcome, MapperUpdate::Outcome::waiting);
  for (std::size_t k = 1; k < 4; ++k) {
    const MapperUpdate& update = add(m, k);
    ASSERT_EQ(update.outcome, MapperUpdate::Outcome::mapped);
    EXPECT_EQ(update.depth.time, flight().scene.times[k]);
    EXPECT_LT(median_error(update.depth), 0.05);
    EXPECT_FALSE(update.change.became_occupied.empty() && update.change.became_free.empty());
    EXPECT_GT(update.seconds[static_cast<std::size_t>(Stage::total)],
              update.seconds[static_cast<std::size_t>(Stage::flow)]);
  }
  EXPECT_EQ(m.health().mapped, 3U);
  EXPECT_GT(m.map().counts().occupied, 100U);
}

TEST(ObstacleMapper, ThePapersOrderGivesDepthOnTheOlderFrame) {
  ObstacleMapperOptions options;
  options.order = Order::first;
  options.step = 2;
  ObstacleMapper m = mapper(options);
  add(m, 0);
  add(m, 1);
  const MapperUpdate& update = add(m, 2);
  ASSERT_EQ(update.outcome, MapperUpdate::Outcome::mapped);
  EXPECT_EQ(update.depth.time, flight().scene.times[0]);
  EXPECT_GT(update.motion.t_reference_other.z(), 0.3);  // the other frame lies ahead, two steps
  EXPECT_LT(median_error(update.depth), 0.05);
}

TEST(ObstacleMapper, EveryCombinationOfOptionsGivesSensibleDepth) {
  for (const auto model : {depth::Model::exact, depth::Model::instantaneous}) {
    for (const auto reading : {depth::Reading::least_squares, depth::Reading::samelson}) {
      for (const auto derotation : {depth::Derotation::image, depth::Derotation::flow}) {
        for (const auto method : {depth::Method::pade, depth::Method::ttc}) {
          for (const int window : {1, 4}) {
            ObstacleMapperOptions options;
            options.depth.model = model;
            options.depth.reading = reading;
            options.depth.method = method;
            options.depth.window = window;
            options.derotation = derotation;
            ObstacleMapper m = mapper(options);
            add(m, 0);
            EXPECT_LT(median_error(add(m, 1).depth), 0.12)
                << to_name(model) << ' ' << to_name(reading) << ' ' << to_name(derotation) << ' '
                << to_name(method) << ' ' << window;
          }
        }
      }
    }
  }
}

TEST(ObstacleMapper, ABadFrameIsSkippedAndTheFlightGoesOn) {
  const Flight& f = flight();
  ObstacleMapper m = mapper();
  add(m, 0);
  const auto expect_skipped = [&](const cv::Mat& image, Time time, const Pose& pose, const char* reason) {
    const MapperUpdate& update = m.add(image, time, pose);
    EXPECT_EQ(update.outcome, MapperUpdate::Outcome::skipped);
    EXPECT_THAT(update.reason, HasSubstr(reason));
  };
  const Pose& pose = f.scene.T_world_camera[1];
  const Time time = f.scene.times[1];
  expect_skipped({}, time, pose, "image is 0 x 0");
  expect_skipped(f.images[1].rowRange(0, 100), time, pose, "image is 320 x 100");
  expect_skipped(cv::Mat(f.images[1].size(), CV_16UC1), time, pose, "8-bit");
  Pose broken = pose;
  broken.translation.x() = std::numeric_limits<double>::quiet_NaN();
  expect_skipped(f.images[1], time, broken, "not finite");
  broken = pose;
  broken.rotation.coeffs().setZero();
  expect_skipped(f.images[1], time, broken, "unit norm");
  expect_skipped(f.images[1], f.scene.times[0], pose, "not after");

  EXPECT_EQ(add(m, 1).outcome, MapperUpdate::Outcome::mapped);
  EXPECT_EQ(m.health().skipped, 6U);
  EXPECT_EQ(m.health().frames, 8U);
}

TEST(ObstacleMapper, TheSameFlightGivesTheSameBits) {
  ObstacleMapper a = mapper();
  ObstacleMapper b = mapper();
  for (std::size_t k = 0; k < 3; ++k) {
    const DepthImage& depth = add(a, k).depth;
    const DepthImage& again = add(b, k).depth;
    if (k == 0) continue;
    EXPECT_EQ(cv::norm(depth.state, again.state, cv::NORM_INF), 0);
    cv::Mat x = depth.depth.clone();
    cv::Mat y = again.depth.clone();
    cv::patchNaNs(x);
    cv::patchNaNs(y);
    EXPECT_EQ(cv::norm(x, y, cv::NORM_INF), 0);
  }
  EXPECT_EQ(io::encode_map(a.map(), io::MapFormat::ot), io::encode_map(b.map(), io::MapFormat::ot));
}

TEST(ObstacleMapper, RefusesWhatMakesNoSenseByName) {
  const Camera camera = flight().scene.camera;
  const auto refusal = [&](const ObstacleMapperOptions& options, const cv::Mat& valid = {}) {
    const auto m = ObstacleMapper::create(camera, options, valid);
    return m ? std::string() : m.error().message;
  };
  ObstacleMapperOptions options;
  options.flow = "horn-schunck";
  EXPECT_THAT(refusal(options), HasSubstr("horn-schunck"));
  options = {};
  options.step = 0;
  EXPECT_THAT(refusal(options), HasSubstr("step"));
  options = {};
  options.depth.window = 0;
  EXPECT_THAT(refusal(options), HasSubstr("window"));
  options = {};
  options.depth.range = -1;
  EXPECT_THAT(refusal(options), HasSubstr("range"));
  options = {};
  options.map.voxel = 0;
  EXPECT_THAT(refusal(options), HasSubstr("voxel"));
  EXPECT_THAT(refusal({}, cv::Mat::ones(3, 3, CV_8UC1)), HasSubstr("mask"));
  Camera distorted = camera;
  distorted.distortion = Distortion::equidistant;
  EXPECT_FALSE(ObstacleMapper::create(distorted));
}

}  // namespace
}  // namespace pade
