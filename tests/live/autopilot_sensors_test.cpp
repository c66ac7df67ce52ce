// Units, frames and clocks of what autopilots send, against values worked out by hand; and a real flight
// written as messages and read back.
#include "pade/live/autopilot_sensors.hpp"

#include <cmath>
#include <filesystem>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/navigation/navigation_log.hpp"
#include "pade/live/mavlink/codec.hpp"
#include "pade/live/mavlink/sensor_messages.hpp"

namespace pade::live {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr Autopilot kPx4{1, 1, 12, 2};
constexpr Autopilot kArduPilot{1, 1, 3, 2};

/// A gatherer that is given messages.
class Stream {
 public:
  explicit Stream(const Autopilot& autopilot) : gatherer_(autopilot, {}) {}
  template <class Message>
  void add(const Message& message, std::uint8_t component = 1) {
    sender_.component = component;
    const mavlink::Packet packet = pack(message, sender_);
    gatherer_.add(mavlink::look(packet.span()).frame);
  }
  [[nodiscard]] Result<NavigationLog> log() const { return gatherer_.log("flight.tlog"); }

 private:
  mavlink::Sender sender_{1, 1, 0};
  SensorGatherer gatherer_;
};

mavlink::HighresImu highres(std::uint64_t microseconds) {
  mavlink::HighresImu m;
  m.time_usec = microseconds;
  m.xacc = 1, m.yacc = 2, m.zacc = -9;
  m.xgyro = 0.1F, m.ygyro = 0.2F, m.zgyro = 0.3F;
  m.xmag = 0.2F, m.ymag = 0.01F, m.zmag = 0.4F;
  m.abs_pressure = 1013.25F;
  m.fields_updated = 0x3ff;
  return m;
}

mavlink::GpsRawInt fix(std::uint64_t microseconds) {
  mavlink::GpsRawInt m;
  m.time_usec = microseconds;
  m.fix_type = 3;
  m.lat = 473'977'418;
  m.lon = 85'455'938;
  m.alt = 488'000;
  m.vel = 500;
  m.cog = 9000;  // east
  m.h_acc = 700, m.v_acc = 1100, m.vel_acc = 200;
  return m;
}

void fill(Stream& stream) {
  for (std::uint64_t i = 0; i < 100; ++i) stream.add(highres(1'000'000 + 10'000 * i));
  stream.add(fix(1'200'000));
}

TEST(AutopilotSensors, HighresImuIsTurnedIntoForwardLeftUp) {
  Stream stream(kPx4);
  fill(stream);
  const auto log = stream.log();
  ASSERT_TRUE(log) << log.error().message;
  ASSERT_EQ(log->imu.size(), 100U);
  EXPECT_EQ(log->imu[1].time, (Time{1'010'000'000}));
  EXPECT_TRUE(log->imu[0].specific_force.isApprox(Vector3d(1, -2, 9), 1e-6));
  EXPECT_TRUE(log->imu[0].angular_rate.isApprox(Vector3d(0.1, -0.2, -0.3), 1e-6));
  ASSERT_EQ(log->magnetometer.size(), 100U);
  EXPECT_TRUE(log->magnetometer[0].field.isApprox(Vector3d(0.2, -0.01, -0.4), 1e-6));
  ASSERT_EQ(log->barometer.size(), 100U);
  EXPECT_NEAR(log->barometer[0].height, 0, 0.01);
}

TEST(AutopilotSensors, OnlyWhatIsNewCounts) {
  Stream stream(kPx4);
  fill(stream);
  stream.add(highres(1'990'000));  // the last once more
  auto old_field = highres(2'000'000);
  old_field.fields_updated = 0x3f;  // no magnetometer, no pressure
  stream.add(old_field);
  auto second = highres(2'010'000);
  second.id = 1;  // the second IMU of the vehicle
  stream.add(second);
  stream.add(highres(2'020'000), 154);  // of the gimbal
  stream.add(fix(1'200'000));
  const auto log = stream.log();
  ASSERT_TRUE(log);
  EXPECT_EQ(log->imu.size(), 101U);
  EXPECT_EQ(log->magnetometer.size(), 100U);
  EXPECT_EQ(log->barometer.size(), 100U);
  EXPECT_EQ(log->gnss.fixes.size(), 1U);
}

TEST(AutopilotSensors, PositionsAreEastNorthUpOfTheFirstFix) {
  Stream stream(kPx4);
  fill(stream);
  auto north = fix(1'400'000);
  north.lat += 9000;  // 0.0009 degrees: 100 m of the meridian
  north.alt += 2500;
  north.cog = 0;
  stream.add(north);
  const auto log = stream.log();
  ASSERT_TRUE(log);
  ASSERT_EQ(log->gnss.fixes.size(), 2U);
  EXPECT_TRUE(log->gnss.fixes[0].position.isZero(1e-9));
  EXPECT_NEAR(log->gnss.fixes[1].position.x(), 0, 0.01);
  EXPECT_NEAR(log->gnss.fixes[1].position.y(), 0.0009 * 111'176, 0.05);
  EXPECT_NEAR(log->gnss.fixes[1].position.z(), 2.5, 0.01);
  EXPECT_NEAR(log->gnss.fixes[0].covariance(0, 0), 0.49, 1e-9);
  EXPECT_NEAR(log->gnss.fixes[0].covariance(2, 2), 1.21, 1e-9);
  ASSERT_EQ(log->gnss.velocities.size(), 2U);
  EXPECT_TRUE(log->gnss.velocities[0].velocity.isApprox(Vector3d(5, 0, 0), 1e-9));
  EXPECT_TRUE(log->gnss.velocities[1].velocity.isApprox(Vector3d(0, 5, 0), 1e-9));
  EXPECT_GT(log->gnss.velocities[0].covariance(2, 2), 25);  // vertical: not measured
  ASSERT_TRUE(log->gnss.origin);
  EXPECT_NEAR(log->gnss.origin->latitude, 47.3977418, 1e-9);
}

TEST(AutopilotSensors, RawImuIsMilliGOfArduPilotAndNothingOfOthers) {
  mavlink::RawImu raw;
  raw.xacc = 100, raw.yacc = 200, raw.zacc = -1000;
  raw.xgyro = 500, raw.ygyro = 250, raw.zgyro = -250;
  raw.xmag = 200, raw.ymag = 10, raw.zmag = 400;
  Stream ardupilot(kArduPilot), px4(kPx4);
  for (std::uint64_t i = 0; i < 50; ++i) {
    raw.time_usec = 20'000 * i;
    ardupilot.add(raw);
    px4.add(raw);
  }
  mavlink::ScaledPressure pressure;
  pressure.time_boot_ms = 300;
  pressure.press_abs = 898.74F;  // the standard atmosphere at 1000 m
  ardupilot.add(pressure);
  ardupilot.add(fix(500'000));
  px4.add(fix(500'000));
  const auto log = ardupilot.log();
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_TRUE(log->imu[0].specific_force.isApprox(9.80665 * Vector3d(0.1, -0.2, 1), 1e-9));
  EXPECT_TRUE(log->imu[0].angular_rate.isApprox(Vector3d(0.5, -0.25, 0.25), 1e-9));
  EXPECT_TRUE(log->magnetometer[0].field.isApprox(Vector3d(0.2, -0.01, -0.4), 1e-9));
  ASSERT_EQ(log->barometer.size(), 1U);
  EXPECT_NEAR(log->barometer[0].height, 1000, 1);
  EXPECT_EQ(log->barometer[0].time, (Time{300'000'000}));
  const auto none = px4.log();
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("the IMU is missing: found 50 RAW_IMU of PX4"));
}

/// On a link without end: what was taken is not kept; the better message counts while it comes, and no
/// longer.
TEST(AutopilotSensors, WhatIsTakenIsTheNewOfTheBestSourceThatStillComes) {
  SensorGatherer gatherer(kArduPilot, {});
  mavlink::Sender sender{1, 1, 0};
  const auto add = [&](const auto& message) {
    const mavlink::Packet packet = pack(message, sender);
    gatherer.add(mavlink::look(packet.span()).frame);
  };
  mavlink::RawImu raw;
  raw.xacc = 100;
  std::size_t taken = 0;
  for (std::uint64_t us = 0; us < 5'000'000; us += 20'000) {
    raw.time_usec = us;
    add(raw);
    add(raw);                               // once more
    if (us == 2'000'000) add(highres(us));  // somebody else has asked for one
    const NewSamples samples = gatherer.take();
    taken += samples.imu.size();
    for (const ImuSample& sample : samples.imu)
      EXPECT_EQ(sample.time.nanoseconds, 1000 * static_cast<std::int64_t>(us));
  }
  EXPECT_LE(taken, 250U);
  EXPECT_GE(taken, 199U) << "all but those of the second after it";
}

TEST(AutopilotSensors, StampsSince1970BecomeThoseSinceTheStart) {
  constexpr std::uint64_t kStart = 1'700'000'000'000'000;
  Stream stream(kPx4);
  stream.add(fix(kStart + 100'000));  // nobody knows yet when that was
  stream.add(mavlink::SystemTime{kStart + 5'000'000, 5000});
  for (std::uint64_t i = 0; i < 50; ++i) stream.add(highres(kStart + 6'000'000 + 10'000 * i));
  stream.add(fix(6'100'000));
  const auto log = stream.log();
  ASSERT_TRUE(log);
  EXPECT_EQ(log->imu[0].time, (Time{6'000'000'000}));
  ASSERT_EQ(log->gnss.fixes.size(), 1U);
  EXPECT_EQ(log->gnss.fixes[0].time, (Time{6'100'000'000}));
}

TEST(AutopilotSensors, TheSensorThatIsMissingIsNamed) {
  Stream empty(kPx4), no_fix(kPx4), slow(kPx4);
  EXPECT_THAT(empty.log().error().message, HasSubstr("flight.tlog: the IMU is missing"));
  for (std::uint64_t i = 0; i < 50; ++i) no_fix.add(highres(10'000 * i));
  auto bad = fix(100'000);
  bad.fix_type = 2;
  no_fix.add(bad);
  EXPECT_THAT(no_fix.log().error().message, HasSubstr("the GNSS is missing"));
  EXPECT_THAT(no_fix.log().error().message, HasSubstr("1 without"));
  for (std::uint64_t i = 0; i < 50; ++i) slow.add(highres(250'000 * i));
  slow.add(fix(100'000));
  EXPECT_THAT(slow.log().error().message, HasSubstr("50 samples at 4 Hz"));
}

TEST(AutopilotSensors, ARealFlightComesBackToTheLastDigitOfTheMessages) {
  const fs::path folder = fs::path(PADE_SOURCE_DIR) / "../shared/data/navigation/quad_px4_flow";
  if (!fs::exists(folder)) GTEST_SKIP() << "the recording is not there: " << folder;
  const auto flown = io::read_navigation_log(folder);
  ASSERT_TRUE(flown) << flown.error().message;
  const std::int64_t start = flown->imu.front().time.nanoseconds;
  const auto boot = [&](Time time) { return static_cast<std::uint64_t>((time.nanoseconds - start) / 1000); };
  Stream stream(kPx4);
  for (const ImuSample& sample : flown->imu) {
    mavlink::HighresImu m;
    m.time_usec = boot(sample.time);
    m.fields_updated = 0x3f;
    m.xacc = static_cast<float>(sample.specific_force.x());
    m.yacc = -static_cast<float>(sample.specific_force.y());
    m.zacc = -static_cast<float>(sample.specific_force.z());
    m.xgyro = static_cast<float>(sample.angular_rate.x());
    m.ygyro = -static_cast<float>(sample.angular_rate.y());
    m.zgyro = -static_cast<float>(sample.angular_rate.z());
    stream.add(m);
  }
  ASSERT_TRUE(flown->gnss.origin);
  stream.add(fix(boot(flown->gnss.fixes.front().time)));
  const auto back = stream.log();
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_EQ(back->imu.size(), flown->imu.size());
  for (std::size_t i = 0; i < flown->imu.size(); ++i) {
    const ImuSample& a = flown->imu[i];
    const ImuSample& b = back->imu[i];
    ASSERT_LE(std::abs(b.time.nanoseconds + start - a.time.nanoseconds), 1000);
    ASSERT_LE((a.specific_force - b.specific_force).norm(), 1e-6 * (1 + a.specific_force.norm()));
    ASSERT_LE((a.angular_rate - b.angular_rate).norm(), 1e-6 * (1 + a.angular_rate.norm()));
  }
}

}  // namespace
}  // namespace pade::live
