// Motions are judged in the axes that they are of, wherever the camera sits and however late its stamps are.
#include "pade/report/navigation_report.hpp"

#include <cmath>
#include <random>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace pade {
namespace {

constexpr std::int64_t kStep = 10'000'000;  // ns between two states of the truth
constexpr int kStates = 3000;
constexpr double kOffset = 0.05;  // s, five states

/// Where a body on a winding way is.
Pose body_at(double t) {
  const Eigen::Vector3d place(4 * std::sin(0.5 * t), 3 * std::cos(0.3 * t) + 0.8 * t, 2 + std::sin(0.9 * t));
  return {rotation_exp({0.2 * std::sin(t), 0.3 * std::cos(0.7 * t), 0.6 * t}), place};
}

NavigationLog known_flight() {
  NavigationLog log;
  for (int i = 0; i < kStates; ++i) {
    const Time time{i * kStep};
    log.truth.push_back({time, body_at(time.seconds()), {}});
  }
  return log;
}

struct Mounted {
  const char* name;
  Pose T_body_camera;
  double offset;  // t_imu = t_image + offset
};

std::vector<Mounted> mountings() {
  Eigen::Matrix3d forward;
  forward << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Pose level{Eigen::Quaterniond(forward), Eigen::Vector3d::Zero()};
  const Pose slanted{rotation_exp({0.4, -1.1, 0.7}), {0.3, -0.2, 0.15}};
  return {{"the body itself", {}, 0},
          {"forward", level, 0},
          {"slanted, off the body", slanted, 0},
          {"slanted, off the body, late", slanted, kOffset}};
}

NavigationRunOptions options_of(const Mounted& mounted) {
  NavigationRunOptions options;
  options.T_body_camera = mounted.T_body_camera;
  options.navigator.camera_time_offset = mounted.offset;
  return options;
}

/// The run of an estimator that knows `spread` of its errors, in the axes of the camera, and makes them
/// `size` times as large as that.
NavigationRun run_of(const Mounted& mounted, double size) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  Matrix6d spread = Matrix6d::Identity();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) spread(i, j) = 0.3 * normal(random);
  }
  Eigen::Matrix<double, 6, 1> sigmas;  // far from a ball: axes that are mixed up are seen
  sigmas << 0.1, 0.02, 0.005, 0.01, 0.002, 0.0005;
  spread = sigmas.asDiagonal() * spread;
  NavigationRun run;
  for (int i = 20; i + 30 < kStates; i += 2) {
    const Time stamps[2] = {Time{i * kStep}, Time{(i + 20) * kStep}};
    Pose camera[2];
    for (int k = 0; k < 2; ++k) {
      const Pose body = body_at(stamps[k].seconds() + mounted.offset);
      camera[k].rotation = body.rotation * mounted.T_body_camera.rotation;
      camera[k].translation = body.translation + body.rotation * mounted.T_body_camera.translation;
    }
    Eigen::Matrix<double, 6, 1> error;
    for (double& e : error) e = size * normal(random);
    error = spread * error;
    FrameMotion m{stamps[0], stamps[1], {}};
    RelativeMotion& motion = m.pose.motion;
    const Eigen::Quaterniond back = camera[0].rotation.conjugate();
    motion.t_reference_other = back * (camera[1].translation - camera[0].translation) + error.head<3>();
    motion.R_reference_other = (rotation_exp(error.tail<3>()) * back * camera[1].rotation).toRotationMatrix();
    motion.covariance = spread * spread.transpose();
    run.motions.push_back(m);
    NavigationFrame frame;
    frame.time = stamps[0];
    frame.pose.T_world_body = body_at(stamps[0].seconds() + mounted.offset);
    run.frames.push_back(frame);
  }
  return run;
}

TEST(NavigationScore, IsThatOfAnHonestEstimatorWhereverTheCameraSits) {
  const NavigationLog log = known_flight();
  for (const Mounted& mounted : mountings()) {
    const auto score = score_motions(log, options_of(mounted), run_of(mounted, 1));
    ASSERT_TRUE(score) << mounted.name;
    EXPECT_GT(score->pairs, 1400U) << mounted.name;
    // Means of χ² over some 1500 pairs: 5 standard deviations are 0.32 for 3 degrees, 0.45 for 6.
    EXPECT_NEAR(score->nees_mean, 3, 0.32) << mounted.name;
    EXPECT_NEAR(score->rotation_nees_mean, 3, 0.32) << mounted.name;
    EXPECT_NEAR(score->pose_nees_mean, 6, 0.45) << mounted.name;
  }
}

TEST(NavigationScore, FindsNoErrorInTheTruth) {
  const NavigationLog log = known_flight();
  for (const Mounted& mounted : mountings()) {
    const auto score = score_motions(log, options_of(mounted), run_of(mounted, 0));
    ASSERT_TRUE(score) << mounted.name;
    EXPECT_LT(score->translation_95, 1e-9) << mounted.name;
    EXPECT_LT(score->rotation_95, 1e-7) << mounted.name;
  }
}

std::string figure_of(const std::string& page, const std::string& title) {
  const std::size_t at = page.find("<figcaption>" + title);
  return at == std::string::npos ? std::string() : page.substr(at, page.find("</figure>", at) - at);
}

std::set<std::string> all_of(const std::string& text, const char* expression) {
  const std::regex pattern(expression);
  std::set<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), pattern), end; it != end; ++it)
    found.insert((*it)[1].str());
  return found;
}

TEST(NavigationReport, DrawsTheTruthOfTheCameraAtItsStamps) {
  const NavigationLog log = known_flight();
  for (const Mounted& mounted : mountings()) {
    const std::string page =
        navigation_report("a flight", log, options_of(mounted), run_of(mounted, 0), std::nullopt);
    // Every error of the truth is 0: all dots are at one height.
    const std::string errors = figure_of(page, "Baseline between neighbouring frames");
    EXPECT_EQ(all_of(errors, "<circle cx=\"[^\"]+\" cy=\"([^\"]+)\"").size(), 1U) << mounted.name;
    // The poses are the true ones: both paths are one.
    const std::string path = figure_of(page, "Path");
    EXPECT_EQ(all_of(path, "stroke-width=\"1.4\" d=\"([^\"]+)\"").size(), 1U) << mounted.name;
  }
}

}  // namespace
}  // namespace pade
