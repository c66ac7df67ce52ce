// What a run counts for its hints: depths, and how the camera moved.
#include "pade/offline/run_tally.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace pade {
namespace {

const Camera kTallyCamera{.width = 4, .height = 2, .fx = 100, .fy = 100, .cx = 1.5, .cy = 0.5};
constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

MapperUpdate moved(const Eigen::Vector3d& t, double sigma_t, double sigma_r) {
  MapperUpdate update;
  update.motion.t_reference_other = t;
  update.motion.covariance.diagonal() << Eigen::Vector3d::Constant(sigma_t * sigma_t),
      Eigen::Vector3d::Constant(sigma_r * sigma_r);
  return update;
}

TEST(RunTally, TellsHowFarAndHowSurelyTheCameraMoves) {
  RunTally tally(kTallyCamera, {});
  tally.add(moved({0.003, 0, 0}, 0.001, 0.01));  // a third of a pixel at 1 m
  tally.add(moved({0, 0.3, 0.4}, 0.01, 0.02));
  tally.add(moved({2, 0, 0}, 0.01, 0.03));
  const io::MotionSummary motion = tally.motion_summary();
  EXPECT_EQ(motion.pairs, 3U);
  EXPECT_EQ(motion.still_pairs, 1U);
  EXPECT_NEAR(motion.baseline, 0.5, 1e-12);
  EXPECT_NEAR(motion.rotation_sigma, 0.02 * kDegreesPerRadian, 1e-9);
  EXPECT_NEAR(motion.direction_sigma, 0.01 / 0.5 * kDegreesPerRadian, 1e-9) << "per axis across the motion";
}

TEST(RunTally, DepthsAreBeyondTheRangeOrUncertainOrNeither) {
  mapping::MapOptions map;
  map.range = 20;
  map.hit_max_relative_sigma = 0.25;
  RunTally tally(kTallyCamera, map);
  MapperUpdate update = moved({1, 0, 0}, 0, 0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  update.depth.depth = (cv::Mat_<float>(2, 4) << 1, 10, 21, nan, 10, 30, 10, nan);
  update.depth.variance = (cv::Mat_<float>(2, 4) << 0.01F, 6.2F, 1, nan, 6.3F, 900, nan, nan);
  tally.add(update);
  const auto summary = tally.map_summary(std::move(mapping::OccupancyMap::create(map)).value());
  EXPECT_EQ(summary.depths, 6U);
  EXPECT_EQ(summary.depths_beyond, 2U);
  EXPECT_EQ(summary.depths_uncertain, 2U) << "one with too much sigma, one with none";
}

}  // namespace
}  // namespace pade
