// The filter on real recordings, by the protocol of docs/navigation.md. One set of constants per class of
// sensor.
#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>

#include "pade/io/navigation/navigation_log.hpp"
#include "pade/paper/navigation_protocol.hpp"

namespace pade::navigation {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180;
const fs::path kData = fs::path(PADE_SOURCE_DIR) / "../shared/data/navigation";

NavigationLog recording(const std::string& folder, const std::string& gnss = "") {
  io::NavigationLogOptions options;
  options.gnss = gnss;
  auto log = io::read_navigation_log(kData / folder, options);
  EXPECT_TRUE(log) << log.error().message;
  return log ? *log : NavigationLog{};
}

NavigatorOptions mav_options(const NavigationLog& log) {
  NavigatorOptions options;
  options.filter.gravity = 9.8064;
  options.gnss_lever_arm = log.gnss.lever_arm.value_or(Vector3d::Zero());
  return options;
}

class MavRecording : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kData)) GTEST_SKIP() << kData << " is not here";
  }
};

TEST_F(MavRecording, SinglePointGnssGivesTheRelativeMotionThatDepthNeeds) {
  const auto log = recording("mav_mh01", "gnss_spp_5hz.csv");
  for (const std::uint64_t seed : {1U, 2U}) {
    NavigationProtocol protocol;
    protocol.seed = seed;
    const auto figures = run_protocol(log, mav_options(log), protocol);
    EXPECT_TRUE(figures.finite);
    EXPECT_GT(figures.short_pairs.pairs, 1200U);
    EXPECT_LT(figures.short_pairs.translation_95, 0.013);
    EXPECT_LT(figures.short_pairs.translation_median, 0.006);
    EXPECT_LT(figures.long_pairs.translation_95, 0.058);
    EXPECT_LT(figures.short_pairs.rotation_95, 0.03 * kDegree);
    EXPECT_LT(figures.velocity_rms, 0.065);
    EXPECT_LT(figures.tilt_rms, 0.30 * kDegree);
    EXPECT_GT(figures.short_pairs.nees_mean, 1.8);
    EXPECT_LT(figures.short_pairs.nees_mean, 5);
  }
}

TEST_F(MavRecording, CarrierPhaseGnssGivesMore) {
  const auto log = recording("mav_mh01", "gnss_rtk_5hz.csv");
  const auto figures = run_protocol(log, mav_options(log), {});
  EXPECT_LT(figures.short_pairs.translation_95, 0.0085);
  EXPECT_GT(figures.short_pairs.nees_mean, 1.8);
  EXPECT_LT(figures.short_pairs.nees_mean, 5);
  EXPECT_GT(figures.short_pairs.valid_where_good, 0.88);
  EXPECT_EQ(figures.health.times_lost, 0U);
}

TEST_F(MavRecording, EveryRecordingIsReadAsItLies) {
  const auto car = recording("car_drive_rtk");
  EXPECT_EQ(car.imu.size(), 54858U) << "rows of imu.csv";
  EXPECT_TRUE(car.gnss.fixes.size() > 2000 && car.gnss.velocities.size() > 2000);
  const auto quad = recording("quad_px4_flow");
  EXPECT_GT(quad.magnetometer.size(), 5000U);
  EXPECT_GT(quad.barometer.size(), 5000U);
  EXPECT_LT(quad.gnss.fixes[100].position.norm(), 100) << "metres about the first fix";
  const auto still = recording("static_vn310_raw");
  EXPECT_NEAR(still.imu.front().specific_force.norm(), 9.8, 0.1);
  EXPECT_NEAR(still.imu.front().time.seconds(), still.gnss.fixes.front().time.seconds(), 1) << "one clock";
  EXPECT_LT(still.gnss.velocities[20].velocity.norm(), 0.2);
}

}  // namespace
}  // namespace pade::navigation
