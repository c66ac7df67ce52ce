#include "pade/pipeline/obstacle_mapper.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/core/random.hpp"
#include "pade/io/formats/map_files.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

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

/// Median relative error of the depth of the last frame of the flight forward through the same scene.
struct ForwardFlight {
  simulation::AnalyticFlight scene =
      *simulation::make_analytic_flight("forward", 7, simulation::analytic_camera(320, 240));
  std::vector<cv::Mat> images;
  cv::Mat truth;
  ForwardFlight() {
    for (const Pose& pose : scene.T_world_camera)
      images.push_back(simulation::render_image(scene.scene, scene.camera, pose));
    truth = simulation::exact_depth(scene.scene, scene.camera, scene.T_world_camera.back());
  }
  [[nodiscard]] double error(const DepthImage& depth) const {
    std::vector<float> errors;
    for (int v = 0; v < truth.rows; ++v) {
      for (int u = 0; u < truth.cols; ++u) {
        const float error = depth.depth.at<float>(v, u) / truth.at<float>(v, u) - 1;
        if (std::isfinite(error)) errors.push_back(std::abs(error));
      }
    }
    EXPECT_GT(errors.size(), truth.total() / 6);
    if (errors.empty()) return 1;
    const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
    std::nth_element(errors.begin(), middle, errors.end());
    return static_cast<double>(*middle);
  }
};
const ForwardFlight& forward() {
  static const ForwardFlight rendered;
  return rendered;
}

/// Motions that are off by 0.1 degree of rotation and 5 degrees of direction, as poses with the covariance
/// that says so.
struct NoisyPoses {
  std::vector<Pose> poses;
  Matrix6d covariance = Matrix6d::Zero();
  explicit NoisyPoses(std::uint64_t seed) {
    constexpr double kDegree = std::numbers::pi / 180;
    const auto& exact = forward().scene.T_world_camera;
    Random random(seed);
    poses.push_back(exact[0]);
    for (std::size_t k = 1; k < exact.size(); ++k) {
      Pose motion = exact[k - 1].inverse() * exact[k];
      const double length = motion.translation.norm();
      const double across = 5 * kDegree * length;
      const double turn = 0.1 * kDegree;
      motion.rotation = rotation_exp(turn * random.normal3()) * motion.rotation;
      motion.translation += across * random.normal3();
      motion.translation *= length / motion.translation.norm();
      poses.push_back(poses.back() * motion);
      covariance.setZero();
      covariance.diagonal() << across * across, across * across, across * across, turn * turn, turn * turn,
          turn * turn;
    }
  }
};

double error_with(const ObstacleMapperOptions& options, const NoisyPoses& noisy) {
  const ForwardFlight& f = forward();
  auto m = std::move(ObstacleMapper::create(f.scene.camera, options)).value();
  const MapperUpdate* update = nullptr;
  for (std::size_t k = 0; k < f.images.size(); ++k)
    update = &m.add(f.images[k], f.scene.times[k], noisy.poses[k], noisy.covariance);
  return f.error(update->depth);
}

TEST(ObstacleMapper, ImagesMendPosesThatAreOff) {
  double refined = 0;
  double as_given = 0;
  ObstacleMapperOptions off;
  off.refinement.on = false;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const NoisyPoses noisy(seed);
    refined += error_with({}, noisy);
    as_given += error_with(off, noisy);
  }
  RecordProperty("median_error",
                 std::to_string(refined / 4) + " refined, " + std::to_string(as_given / 4) + " as given");
  EXPECT_LT(refined, 0.5 * as_given);
  EXPECT_GT(as_given / 4, 0.03) << "the flight shows nothing";
}

/// Error of the last depth image after one common scale, with steps whose lengths err by 20 % (uniform).
double error_but_for_scale(const ObstacleMapperOptions& options, std::uint64_t seed) {
  const ForwardFlight& f = forward();
  auto m = std::move(ObstacleMapper::create(f.scene.camera, options)).value();
  Random random(seed);
  constexpr double kTurn = 0.001;  // degrees: as good as exact
  constexpr double kSpread = 0.2;
  const MapperUpdate* update = nullptr;
  Pose noisy = f.scene.T_world_camera[0];
  for (std::size_t k = 0; k < f.images.size(); ++k) {
    Matrix6d covariance = Matrix6d::Zero();
    if (k > 0) {
      Pose step = f.scene.T_world_camera[k - 1].inverse() * f.scene.T_world_camera[k];
      const double sigma = kSpread / std::numbers::sqrt3 * step.translation.norm();
      step.translation *= 1 + random.uniform(-kSpread, kSpread);
      noisy = noisy * step;
      covariance(2, 2) = sigma * sigma;
      covariance.bottomRightCorner<3, 3>() =
          std::pow(kTurn * std::numbers::pi / 180, 2) * Eigen::Matrix3d::Identity();
    }
    update = &m.add(f.images[k], f.scene.times[k], noisy, covariance);
  }
  EXPECT_EQ(update->aligned, options.alignment.on);
  std::vector<float> ratios;
  for (int v = 0; v < f.truth.rows; ++v) {
    for (int u = 0; u < f.truth.cols; ++u) {
      const float ratio = update->depth.depth.at<float>(v, u) / f.truth.at<float>(v, u);
      if (std::isfinite(ratio)) ratios.push_back(ratio);
    }
  }
  std::sort(ratios.begin(), ratios.end());
  const float scale = ratios[ratios.size() / 2];
  for (float& ratio : ratios) ratio = std::abs(ratio / scale - 1);
  const auto most = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() * 4 / 5);
  std::nth_element(ratios.begin(), most, ratios.end());
  return static_cast<double>(*most);
}

TEST(ObstacleMapper, StepsOfUncertainLengthAreMadeToFitEachOther) {
  double fitted = 0;
  double as_given = 0;
  ObstacleMapperOptions off;
  off.alignment.on = false;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    fitted += error_but_for_scale({}, seed);
    as_given += error_but_for_scale(off, seed);
  }
  RecordProperty("error",
                 std::to_string(fitted / 4) + " fitted, " + std::to_string(as_given / 4) + " as given");
  EXPECT_LT(fitted, 0.5 * as_given);
}

TEST(ObstacleMapper, ExactPosesAreLeftAsTheyAreToTheLastBit) {
  const ForwardFlight& f = forward();
  auto m = std::move(ObstacleMapper::create(f.scene.camera)).value();
  for (std::size_t k = 0; k < f.images.size(); ++k) {
    const Pose& given = f.scene.T_world_camera[k];
    const MapperUpdate& update = m.add(f.images[k], f.scene.times[k], given);
    EXPECT_EQ(m.T_world_camera().translation, given.translation);
    EXPECT_EQ(m.T_world_camera().rotation.coeffs(), given.rotation.coeffs());
    if (k == 0) continue;
    EXPECT_EQ(update.refinement.outcome, depth::RefinementOutcome::exact_prior);
    EXPECT_EQ(update.reference.T_world_camera.translation, given.translation);
    const RelativeMotion motion =
        relative_motion(given, f.scene.T_world_camera[k - static_cast<std::size_t>(update.step)], -0.1);
    EXPECT_EQ(update.motion.t_reference_other, motion.t_reference_other);
    EXPECT_EQ(update.motion.R_reference_other, motion.R_reference_other);
    EXPECT_TRUE(update.motion.covariance.isZero(0));
  }
}

/// Frames to the farthest partner of the last frame of the flight, and the error of its depth.
std::pair<int, double> last_frame(const ObstacleMapperOptions& options) {
  const ForwardFlight& f = forward();
  auto m = std::move(ObstacleMapper::create(f.scene.camera, options)).value();
  const MapperUpdate* update = nullptr;
  for (std::size_t k = 0; k < f.images.size(); ++k)
    update = &m.add(f.images[k], f.scene.times[k], f.scene.T_world_camera[k]);
  return {update->step, f.error(update->depth)};
}

TEST(ObstacleMapper, ASecondLongerBaselineIsMorePrecise) {
  ObstacleMapperOptions options;
  options.views.count = 0;
  const auto [step, two] = last_frame(options);
  options.longest_step = 1;
  const auto [one_step, one] = last_frame(options);
  EXPECT_GT(step, 1);
  EXPECT_LE(step, ObstacleMapperOptions().longest_step);
  EXPECT_EQ(one_step, 1);
  EXPECT_LT(two, 0.7 * one);
}

TEST(ObstacleMapper, TheFramesBeforeMakeItMorePreciseStill) {
  ObstacleMapperOptions two_view;
  two_view.views.count = 0;
  EXPECT_LT(last_frame({}).second, 0.8 * last_frame(two_view).second);
}

/// Without a baseline there are no views, and what was found before is not taken for what is seen now.
TEST(ObstacleMapper, HoverMeasuresNothingAndTheFlightGoesOn) {
  const ForwardFlight& f = forward();
  auto m = std::move(ObstacleMapper::create(f.scene.camera)).value();
  std::size_t k = 0;
  for (; k < 3; ++k) m.add(f.images[k], f.scene.times[k], f.scene.T_world_camera[k]);
  Time time = f.scene.times[2];
  for (int i = 0; i < 20; ++i) {
    time.nanoseconds += 10000000;
    const MapperUpdate& update = m.add(f.images[2], time, f.scene.T_world_camera[2]);
    ASSERT_EQ(update.outcome, MapperUpdate::Outcome::mapped);
    if (i < 17) continue;  // all frames that are kept are from one place
    EXPECT_EQ(cv::countNonZero(update.depth.state == static_cast<int>(DepthState::measured)), 0);
  }
}

/// Images that stay the same while the pose moves would look like a world without end: they are not used.
TEST(ObstacleMapper, ACameraThatHangsIsNotBelieved) {
  const ForwardFlight& f = forward();
  auto m = std::move(ObstacleMapper::create(f.scene.camera)).value();
  for (std::size_t k = 0; k < 3; ++k) m.add(f.images[k], f.scene.times[k], f.scene.T_world_camera[k]);
  for (std::size_t k = 3; k < 5; ++k) {
    const MapperUpdate& hung = m.add(f.images[2], f.scene.times[k], f.scene.T_world_camera[k]);
    EXPECT_EQ(hung.outcome, MapperUpdate::Outcome::skipped);
    EXPECT_NE(hung.reason.find("hangs"), std::string::npos);
  }
  EXPECT_EQ(m.health().skipped, 2U);
  EXPECT_EQ(m.add(f.images[5], f.scene.times[5], f.scene.T_world_camera[5]).outcome,
            MapperUpdate::Outcome::mapped);
}

TEST(ObstacleMapper, OnePairIsWhatThePaperKnows) {
  const ForwardFlight& f = forward();
  const ObstacleMapperOptions options = one_pair();
  auto m = std::move(ObstacleMapper::create(f.scene.camera, options)).value();
  const NoisyPoses noisy(1);
  for (std::size_t k = 0; k < 4; ++k) {
    const MapperUpdate& update = m.add(f.images[k], f.scene.times[k], noisy.poses[k], noisy.covariance);
    if (k == 0) continue;
    EXPECT_EQ(update.step, 1);
    EXPECT_EQ(update.refinement.outcome, depth::RefinementOutcome::off);
    EXPECT_EQ(m.T_world_camera().translation, noisy.poses[k].translation);
  }
}

TEST(ObstacleMapper, TheSameUncertainFlightGivesTheSameBits) {
  const ForwardFlight& f = forward();
  const NoisyPoses noisy(3);
  auto a = std::move(ObstacleMapper::create(f.scene.camera)).value();
  auto b = std::move(ObstacleMapper::create(f.scene.camera)).value();
  const auto bits = [](const cv::Mat& plane) {
    return std::string(plane.ptr<char>(), plane.total() * plane.elemSize());
  };
  for (std::size_t k = 0; k < f.images.size(); ++k) {
    const MapperUpdate& one = a.add(f.images[k], f.scene.times[k], noisy.poses[k], noisy.covariance);
    const MapperUpdate& other = b.add(f.images[k], f.scene.times[k], noisy.poses[k], noisy.covariance);
    EXPECT_EQ(a.T_world_camera().translation, b.T_world_camera().translation);
    if (k == 0) continue;
    EXPECT_EQ(one.refinement.outcome, depth::RefinementOutcome::refined);
    EXPECT_EQ(one.motion.t_reference_other, other.motion.t_reference_other);
    for (const auto plane : {&DepthImage::depth, &DepthImage::variance, &DepthImage::own_variance,
                             &DepthImage::bound, &DepthImage::state})
      EXPECT_EQ(bits(one.depth.*plane), bits(other.depth.*plane)) << k;
  }
  EXPECT_EQ(io::bytes_of(io::encode_map(a.map(), io::MapFormat::ot)),
            io::bytes_of(io::encode_map(b.map(), io::MapFormat::ot)));
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
  EXPECT_EQ(io::bytes_of(io::encode_map(a.map(), io::MapFormat::ot)),
            io::bytes_of(io::encode_map(b.map(), io::MapFormat::ot)));
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
  const double nan = std::nan("");
  for (const auto& [name, spoil] :
       std::vector<std::pair<std::string, std::function<void(ObstacleMapperOptions&)>>>{
           {"longest_step", [](auto& o) { o.longest_step = -2; }},
           {"prior_level", [](auto& o) { o.prior_level = -7; }},
           {"largest_parallax", [&](auto& o) { o.largest_parallax = nan; }},
           {"refinement.pixels", [](auto& o) { o.refinement.pixels = -5; }},
           {"edges.radius", [](auto& o) { o.edges.radius = 1000000; }},
           {"edges.nearness", [&](auto& o) { o.edges.nearness = nan; }},
           {"views.count", [](auto& o) { o.views.count = 99; }},
           {"views.frames", [](auto& o) { o.views.frames = 0; }},
           {"views.flow.alpha", [&](auto& o) { o.views.flow.alpha = nan; }},
           {"views.flow.largest_scale", [](auto& o) { o.views.flow.largest_scale = 0.5; }},
           {"views.depth.sigma_scale", [](auto& o) { o.views.depth.sigma_scale = 0; }},
           {"bound_sigmas", [&](auto& o) { o.depth.bound_sigmas = nan; }},
           {"flow_sigma_scale", [](auto& o) { o.depth.flow_sigma_scale = -1; }},
           {"flow_relative_sigma", [](auto& o) { o.depth.flow_relative_sigma = -1; }}}) {
    options = {};
    spoil(options);
    EXPECT_THAT(refusal(options), HasSubstr(name));
  }
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
