// What the mapper makes of its inputs before any stage sees them: covariances of motions, and masks.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pade/pipeline/obstacle_mapper.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade {
namespace {

/// A turning flight at a quarter of the paper's resolution.
struct TurningFlight {
  simulation::AnalyticFlight scene =
      *simulation::make_analytic_flight("turning", 5, simulation::analytic_camera(320, 240));
  std::vector<cv::Mat> images;
  TurningFlight() {
    for (const Pose& pose : scene.T_world_camera)
      images.push_back(simulation::render_image(scene.scene, scene.camera, pose));
  }
};
const TurningFlight& turning() {
  static const TurningFlight rendered;
  return rendered;
}

TEST(MapperInputs, ThePairsCovarianceGrowsWithTheSquareOfItsStepsAndLivesInTheReference) {
  const TurningFlight& f = turning();
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = 1e-3 * std::sin(3.0 * i + 1);
  const Matrix6d covariance = root * root.transpose();
  for (const Order order : {Order::newest, Order::first}) {
    for (const int step : {1, 2, 3}) {
      ObstacleMapperOptions options = one_pair();
      options.order = order;
      options.step = step;
      auto mapper = std::move(ObstacleMapper::create(f.scene.camera, options)).value();
      const MapperUpdate* update = nullptr;
      for (std::size_t k = 0; k <= static_cast<std::size_t>(step); ++k)
        update = &mapper.add(f.images[k], f.scene.times[k], f.scene.T_world_camera[k], covariance);
      ASSERT_EQ(update->outcome, MapperUpdate::Outcome::mapped);
      RelativeMotion older = relative_motion(
          f.scene.T_world_camera[0], f.scene.T_world_camera[static_cast<std::size_t>(step)], 0.1 * step);
      older.covariance = step * step * covariance;
      const RelativeMotion expected = order == Order::newest ? reversed(older) : older;
      EXPECT_LT((update->motion.t_reference_other - expected.t_reference_other).norm(), 1e-9);
      EXPECT_LT((update->motion.covariance - expected.covariance).norm(), 1e-6 * expected.covariance.norm())
          << "order " << to_name(order) << ", step " << step;
    }
  }
}

TEST(MapperInputs, AlongTheMotionErrorsOfSeveralFramesAddUpAndAcrossTheyAverage) {
  const TurningFlight& f = turning();
  ObstacleMapperOptions options;  // depth from many views
  options.refinement.on = false;
  constexpr double kVariance = 1e-4;
  Matrix6d covariance = Matrix6d::Zero();
  covariance.topLeftCorner<3, 3>() = kVariance * Eigen::Matrix3d::Identity();
  auto mapper = std::move(ObstacleMapper::create(f.scene.camera, options)).value();
  int longest = 0;
  for (std::size_t k = 0; k < f.images.size(); ++k) {
    const MapperUpdate& update =
        mapper.add(f.images[k], f.scene.times[k], f.scene.T_world_camera[k], covariance);
    if (update.outcome != MapperUpdate::Outcome::mapped) continue;
    const double n = update.step;
    longest = std::max(longest, update.step);
    Eigen::Vector3d directions = Eigen::Vector3d::Zero();
    for (std::size_t i = k; i + static_cast<std::size_t>(update.step) > k; --i) {
      directions +=
          (f.scene.T_world_camera[i].translation - f.scene.T_world_camera[i - 1].translation).normalized();
    }
    const Eigen::Matrix3d of_translation = update.motion.covariance.topLeftCorner<3, 3>();
    EXPECT_NEAR(of_translation.trace() / kVariance, directions.squaredNorm() + 2 * n, 1e-6);
  }
  EXPECT_GT(longest, 1);
}

TEST(MapperInputs, TheOriginOfTheWorldDoesNotMatter) {
  const TurningFlight& f = turning();
  ObstacleMapperOptions pairs;
  pairs.views.count = 0;
  for (const ObstacleMapperOptions& options : {ObstacleMapperOptions(), pairs}) {
    auto here = std::move(ObstacleMapper::create(f.scene.camera, options)).value();
    auto there = std::move(ObstacleMapper::create(f.scene.camera, options)).value();
    for (std::size_t k = 0; k < f.images.size(); ++k) {
      Pose moved = f.scene.T_world_camera[k];
      moved.translation += Eigen::Vector3d(38.5, -81.25, 12.75);
      const MapperUpdate& a = here.add(f.images[k], f.scene.times[k], f.scene.T_world_camera[k]);
      const MapperUpdate& b = there.add(f.images[k], f.scene.times[k], moved);
      ASSERT_EQ(a.outcome, b.outcome);
      if (a.outcome != MapperUpdate::Outcome::mapped) continue;
      EXPECT_EQ(a.step, b.step) << "frame " << k;
      EXPECT_LT((a.motion.t_reference_other - b.motion.t_reference_other).norm(), 1e-9);
      const int measured = cv::countNonZero(a.depth.state == static_cast<int>(DepthState::measured));
      EXPECT_GT(measured, 10000);
      EXPECT_LT(cv::countNonZero(a.depth.state != b.depth.state), measured / 200);
    }
  }
}

TEST(MapperInputs, ManyViewsAreSmoothOnAScaleOfPixels) {
  const TurningFlight& f = turning();
  const cv::Mat truth = simulation::exact_depth(f.scene.scene, f.scene.camera, f.scene.T_world_camera.back());
  auto mapper = std::move(ObstacleMapper::create(f.scene.camera, {})).value();
  const MapperUpdate* update = nullptr;
  cv::RNG random(3);
  for (std::size_t k = 0; k < f.images.size(); ++k) {
    cv::Mat noise(f.images[k].size(), CV_16SC1);
    random.fill(noise, cv::RNG::NORMAL, 0, 6);
    cv::Mat image;
    cv::add(f.images[k], noise, image, {}, CV_8U);
    update = &mapper.add(image, f.scene.times[k], f.scene.T_world_camera[k]);
  }
  ASSERT_GT(update->views, 1);
  std::vector<double> errors;
  for (int v = 0; v < truth.rows; ++v) {
    for (int u = 0; u < truth.cols; ++u) {
      const double z = update->depth.depth.at<float>(v, u);
      if (std::isfinite(z) && truth.at<float>(v, u) > 0)
        errors.push_back(std::abs(z / truth.at<float>(v, u) - 1));
    }
  }
  std::sort(errors.begin(), errors.end());
  ASSERT_FALSE(errors.empty());
  EXPECT_GT(errors.size(), 0.43 * static_cast<double>(truth.total()));  // much of its texture is fainter
  EXPECT_LT(errors[errors.size() / 2], 0.0225) << "in noise of 6 grey levels";
}

/// What a propeller guard or a landing gear in the picture does: it stays where it is while the scene moves.
void put_in_the_way(cv::Mat& image, const cv::Mat& valid, std::uint64_t seed) {
  cv::RNG random(seed);
  cv::Mat gear(image.size(), CV_8UC1);
  random.fill(gear, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(gear, gear, {}, 1.5);
  cv::normalize(gear, gear, 0, 255, cv::NORM_MINMAX);
  gear.copyTo(image, valid == 0);
}

struct MaskedRun {
  cv::Mat state, depth;
  Pose last;
  RelativeMotion refined;
  depth::RefinementOutcome outcome;
};

MaskedRun fly_behind(const cv::Mat& valid, const std::string& flow, std::uint64_t seed) {
  const TurningFlight& f = turning();
  ObstacleMapperOptions options;
  options.flow = flow;
  options.longest_step = 1;
  options.views.count = 0;
  Matrix6d covariance = Matrix6d::Zero();  // 1 cm and half a degree
  covariance.diagonal() << 1e-4, 1e-4, 1e-4, 7.6e-5, 7.6e-5, 7.6e-5;
  auto mapper = std::move(ObstacleMapper::create(f.scene.camera, options, valid)).value();
  const MapperUpdate* update = nullptr;
  for (std::size_t k = 0; k < f.images.size(); ++k) {
    cv::Mat image = f.images[k].clone();
    put_in_the_way(image, valid, seed);
    update = &mapper.add(image, f.scene.times[k], f.scene.T_world_camera[k], covariance);
  }
  return {update->depth.state.clone(), update->depth.depth.clone(), mapper.T_world_camera(), update->motion,
          update->refinement.outcome};
}

TEST(MapperInputs, WhatIsMaskedIsOutOfViewAndTeachesNothing) {
  cv::Mat valid(240, 320, CV_8UC1, cv::Scalar(255));
  valid(cv::Rect(0, 110, 320, 130)) = 0;  // more than half of the image
  cv::Mat far_from_mask;
  cv::erode(valid, far_from_mask, cv::Mat::ones(33, 33, CV_8UC1), {-1, -1}, 1, cv::BORDER_CONSTANT,
            cv::Scalar(255));
  // dis-fast knows no mask: what it finds there is kept from the other stages by the mapper.
  for (const char* flow : {"clg-fast-half", "dis-fast"}) {
    const MaskedRun one = fly_behind(valid, flow, 1);
    const MaskedRun other = fly_behind(valid, flow, 2);
    EXPECT_EQ(one.outcome, depth::RefinementOutcome::refined) << flow;
    EXPECT_LT((one.last.translation - turning().scene.T_world_camera.back().translation).norm(), 0.05)
        << flow;
    EXPECT_LT(rotation_log(Eigen::Quaterniond(one.last.rotation.conjugate() * other.last.rotation)).norm(),
              1.5e-3)
        << flow;
    EXPECT_LT((one.last.translation - other.last.translation).norm(), 0.01) << flow;
    const auto out_of_view = static_cast<double>(DepthState::out_of_view);
    EXPECT_EQ(cv::countNonZero((one.state != out_of_view) & (valid == 0)), 0) << flow;
    // What the mask hides spreads by the windows of a flow that does not know it.
    if (std::string_view(flow) == "dis-fast") continue;
    int compared = 0;
    int different = 0;
    for (int v = 0; v < valid.rows; ++v) {
      for (int u = 0; u < valid.cols; ++u) {
        if (far_from_mask.at<std::uint8_t>(v, u) == 0) continue;
        const float a = one.depth.at<float>(v, u);
        const float b = other.depth.at<float>(v, u);
        if (!std::isfinite(a) || !std::isfinite(b)) continue;
        ++compared;
        if (std::abs(a - b) > 0.02F * a) ++different;
      }
    }
    EXPECT_GT(compared, 5000) << flow;
    EXPECT_LT(different, 0.02 * compared) << flow;
  }
}

}  // namespace
}  // namespace pade
