// Our own filter on an autopilot's messages, against the truth of a simulated flight and against the same
// filter on the measurements themselves.
#include "pade/live/link/filtered_poses.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <GeographicLib/LocalCartesian.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/navigation/geodetic_fixes.hpp"
#include "pade/live/mavlink/codec.hpp"
#include "pade/live/mavlink/sensor_messages.hpp"

#include "navigation/flight.hpp"

namespace pade::live {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr Autopilot kPx4{1, 1, 12, 2};
constexpr int kImuRate = 100;
constexpr double kDuration = 30;

/// An autopilot that sends what its sensors show.
class SensorStream {
 public:
  explicit SensorStream(double later = 0) : later_(later) {
    simulation::ImuModel imu = simulation::ImuModel::industrial();
    log_ = navigation::record({}, kDuration, imu, {}, 5, kImuRate);
  }
  [[nodiscard]] const NavigationLog& log() const { return log_; }

  /// All messages from one moment to another, in the order of their stamps, s.
  void send(FilteredPoses& to, double from, double until) {
    for (std::size_t i = 0; i < log_.imu.size(); ++i) {
      const double t = log_.imu[i].time.seconds();
      if (t < from || t >= until) continue;
      give(to, highres(i));
      for (std::size_t k = 0; k < log_.gnss.fixes.size(); ++k) {
        if (log_.gnss.fixes[k].time == log_.imu[i].time && with_gnss) give(to, fix(k));
      }
    }
  }
  [[nodiscard]] mavlink::HighresImu highres(std::size_t i) const {
    const ImuSample& sample = log_.imu[i];
    const double height = log_.truth[i].T_world_body.translation.z();
    mavlink::HighresImu m;
    m.time_usec = microseconds(sample.time);
    m.xacc = static_cast<float>(sample.specific_force.x());
    m.yacc = static_cast<float>(-sample.specific_force.y());
    m.zacc = static_cast<float>(-sample.specific_force.z());
    m.xgyro = static_cast<float>(sample.angular_rate.x());
    m.ygyro = static_cast<float>(-sample.angular_rate.y());
    m.zgyro = static_cast<float>(-sample.angular_rate.z());
    m.abs_pressure = static_cast<float>(io::pressure_at_height(488 + height));
    m.fields_updated = i % 5 == 0 ? 0x23f : 0x3f;  // 20 Hz of pressure, no magnetometer
    return m;
  }
  [[nodiscard]] mavlink::GpsRawInt fix(std::size_t k) const {
    static const GeographicLib::LocalCartesian earth(47.4, 8.5, 488);
    const Vector3d place = log_.gnss.fixes[k].position;
    const Vector3d velocity = log_.gnss.velocities[k].velocity;
    double latitude = 0, longitude = 0, height = 0;
    earth.Reverse(place.x(), place.y(), place.z(), latitude, longitude, height);
    mavlink::GpsRawInt m;
    m.time_usec = microseconds(log_.gnss.fixes[k].time);
    m.fix_type = 3;
    m.lat = static_cast<std::int32_t>(std::lround(1e7 * latitude));
    m.lon = static_cast<std::int32_t>(std::lround(1e7 * longitude));
    m.alt = static_cast<std::int32_t>(std::lround(1e3 * height));
    m.vel = static_cast<std::uint16_t>(std::lround(100 * velocity.head<2>().norm()));
    const double course = std::atan2(velocity.x(), velocity.y()) * 180 / std::numbers::pi;
    m.cog = static_cast<std::uint16_t>(std::lround(100 * (course < 0 ? course + 360 : course)) % 36000);
    m.h_acc = 1030, m.v_acc = 1650, m.vel_acc = 50;
    return m;
  }
  template <class Message>
  void give(FilteredPoses& to, const Message& message) {
    const mavlink::Packet packet = pack(message, sender_);
    to.add(mavlink::look(packet.span()).frame);
  }
  [[nodiscard]] Time time_of(double t) const { return Time::from_seconds(t + later_); }

  bool with_gnss = true;

 private:
  [[nodiscard]] std::uint64_t microseconds(Time time) const {
    return static_cast<std::uint64_t>(std::llround(1e6 * (time.seconds() + later_)));
  }

  double later_;
  NavigationLog log_;
  mavlink::Sender sender_{1, 1, 0};
};

/// One that listens already.
struct Listening : FilteredPoses {
  Listening() : FilteredPoses(navigation::NavigatorOptions{}) { listen_to(kPx4); }
};

/// How the motion between two poses differs from that between two others.
struct Difference {
  double way = 0;    ///< m
  double climb = 0;  ///< of it, along the body's z axis, m
  double turn = 0;   ///< rad
};
Difference difference(const Pose& a1, const Pose& a2, const Pose& b1, const Pose& b2) {
  const Pose a = a1.inverse() * a2;
  const Pose b = b1.inverse() * b2;
  const Vector3d error = a.translation - b.translation;
  return {error.norm(), std::abs(error.z()), a.rotation.angularDistance(b.rotation)};
}

TEST(FilteredPoses, AreThoseOfTheFlight) {
  SensorStream autopilot;
  Listening poses;
  autopilot.send(poses, 0, kDuration);
  EXPECT_EQ(poses.count(), static_cast<std::size_t>(kDuration * kImuRate));
  EXPECT_EQ(poses.fixes(), static_cast<std::size_t>(kDuration * 5));
  EXPECT_NEAR(poses.imu_rate(), kImuRate, 1);
  EXPECT_EQ(poses.missing(), "");
  EXPECT_EQ(poses.jumps(), 0U);

  // Asked as a mapper asks: each frame soon after it was taken.
  Listening asked;
  std::vector<double> ways, climbs, turns;
  std::optional<Pose> before, truth_before;
  int within = 0, pairs = 0;
  for (int k = 0; k < 10 * kDuration - 5; ++k) {
    const double t = 0.1 * k;
    autopilot.send(asked, t - 0.005, t + 0.095);  // between samples
    if (t < 15) continue;
    const Time time = autopilot.time_of(t);
    const PoseAnswer answer = asked.at(time);
    ASSERT_EQ(answer.kind, PoseAnswer::Kind::valid) << t;
    const auto& truth = autopilot.log().truth[static_cast<std::size_t>(std::lround(t * kImuRate))];
    if (before) {
      const Difference d = difference(*before, answer.T_world_body, *truth_before, truth.T_world_body);
      ways.push_back(std::sqrt(std::max(0.0, d.way * d.way - d.climb * d.climb)));
      climbs.push_back(d.climb);
      turns.push_back(d.turn);
      const auto covariance = asked.motion_covariance(autopilot.time_of(t - 0.1), time, {});
      ASSERT_TRUE(covariance) << t;
      const double sigma = std::sqrt(covariance->diagonal().head<3>().sum());
      within += d.way < 2 * sigma ? 1 : 0;
      ++pairs;
    }
    before = answer.T_world_body;
    truth_before = truth.T_world_body;
  }
  const auto most = [](std::vector<double>& errors) {
    std::sort(errors.begin(), errors.end());
    return errors[errors.size() * 95 / 100];
  };
  EXPECT_LT(most(ways), 0.015) << "95 % of 0.1 s";
  EXPECT_LT(most(climbs), 0.05) << "GPS_RAW_INT has no vertical velocity";
  EXPECT_LT(most(turns), 0.2 * std::numbers::pi / 180);
  EXPECT_GT(within, 0.8 * pairs) << "two sigmas of the covariance";
}

/// Whatever rounding and detours through the globe do: a tenth of what the filter errs by.
TEST(FilteredPoses, AreThoseOfTheMeasurementsThemselves) {
  SensorStream autopilot;
  Listening poses;
  navigation::Navigator reference = std::move(navigation::Navigator::create({})).value();
  for (const ImuSample& sample : autopilot.log().imu) {
    reference.add(sample);
    for (std::size_t k = 0; k < autopilot.log().gnss.fixes.size(); ++k) {
      if (autopilot.log().gnss.fixes[k].time != sample.time) continue;
      reference.add(GnssFix{sample.time, autopilot.log().gnss.fixes[k].position,
                            Vector3d(1.0609, 1.0609, 2.7225).asDiagonal()});
      Vector3d level = autopilot.log().gnss.velocities[k].velocity;
      level.z() = 0;
      reference.add(GnssVelocity{sample.time, level, Vector3d(0.0025, 0.0025, 100).asDiagonal()});
    }
    const auto i = static_cast<std::size_t>(&sample - autopilot.log().imu.data());
    if (i % 5 == 0)
      reference.add(
          BarometricHeight{sample.time, 488 + autopilot.log().truth[i].T_world_body.translation.z(), 0.3});
  }
  autopilot.send(poses, 0, kDuration);
  const Time t1 = autopilot.time_of(kDuration - 1.5), t2 = autopilot.time_of(kDuration - 0.5);
  const Difference d =
      difference(poses.at(t1).T_world_body, poses.at(t2).T_world_body,
                 reference.absolute_pose(t1).T_smooth_body, reference.absolute_pose(t2).T_smooth_body);
  EXPECT_LT(d.way, 0.01);
  EXPECT_LT(d.turn, 0.05 * std::numbers::pi / 180);
}

TEST(FilteredPoses, AreNotYetNeverOrOfAnotherTime) {
  SensorStream autopilot;
  Listening poses;
  EXPECT_EQ(poses.at(autopilot.time_of(1)).kind, PoseAnswer::Kind::never);
  EXPECT_EQ(poses.newest(), Time{});
  autopilot.send(poses, 0, 20);
  EXPECT_EQ(poses.at(autopilot.time_of(20.1)).kind, PoseAnswer::Kind::not_yet);
  EXPECT_EQ(poses.at(autopilot.time_of(19.5)).kind, PoseAnswer::Kind::valid);
  const PoseAnswer old = poses.at(autopilot.time_of(12));
  EXPECT_EQ(old.kind, PoseAnswer::Kind::never);
  EXPECT_THAT(std::string(old.why), HasSubstr("remembers nothing"));
  EXPECT_FALSE(poses.motion_covariance(autopilot.time_of(12), autopilot.time_of(19.5), {}));
  EXPECT_NEAR(seconds_between(poses.newest(), autopilot.time_of(20)), 0.01, 1e-6);
}

TEST(FilteredPoses, TurnClockwiseAsSeenFromAbove) {
  SensorStream autopilot;
  Listening poses;
  autopilot.send(poses, 0, 20);
  const auto heading = [&](double t) {
    const auto& truth = autopilot.log().truth[static_cast<std::size_t>(std::lround(t * kImuRate))];
    const Vector3d forward = truth.T_world_body.rotation * Vector3d::UnitX();
    return std::atan2(forward.y(), forward.x());
  };
  EXPECT_NEAR(poses.turned_since(autopilot.time_of(19)), heading(19) - heading(19.99), 0.01);
  EXPECT_EQ(poses.turned_since(autopilot.time_of(1)), 0) << "nobody knows";
}

TEST(FilteredPoses, BeginAnewWhereTheAutopilotDoes) {
  SensorStream before(1000), after(0);
  Listening poses;
  before.send(poses, 0, 20);
  EXPECT_EQ(poses.jumps(), 0U);
  after.send(poses, 0, 20);
  EXPECT_EQ(poses.jumps(), 1U);
  const PoseAnswer answer = poses.at(after.time_of(19));
  EXPECT_EQ(answer.kind, PoseAnswer::Kind::valid);
  EXPECT_EQ(answer.jumps, 1U);
  Autopilot other = kPx4;
  other.system = 7;
  poses.listen_to(other);
  EXPECT_EQ(poses.jumps(), 2U);
  EXPECT_EQ(poses.at(after.time_of(19)).kind, PoseAnswer::Kind::never);
}

/// At rest and without a magnetometer everything is there but the heading.
TEST(FilteredPoses, OfAVehicleAtRestLackTheHeading) {
  SensorStream autopilot;
  Listening poses;
  autopilot.send(poses, 0, 3.9);  // it stands until 4 s
  EXPECT_EQ(poses.missing(), heading_unknown);
  EXPECT_EQ(poses.newest(), Time{});
  EXPECT_THAT(poses.summary(), HasSubstr("no vertical velocity"));
}

TEST(FilteredPoses, SayWhatIsMissing) {
  SensorStream autopilot;
  Listening poses;
  EXPECT_EQ(poses.missing(), "no IMU message");
  for (std::size_t i = 0; i < 60; i += 20) autopilot.give(poses, autopilot.highres(i));
  EXPECT_THAT(poses.missing(), HasSubstr("slower than 20 Hz"));
  Listening blind;
  autopilot.with_gnss = false;
  autopilot.send(blind, 0, 3);
  EXPECT_EQ(blind.missing(), "no GNSS fix");
  Listening unitless;
  autopilot.give(unitless, mavlink::RawImu{});
  EXPECT_EQ(unitless.missing(), "RAW_IMU has no units");
}

/// What is not stated is said to be assumed, once.
TEST(FilteredPoses, SayWhatTheyAssume) {
  SensorStream autopilot;
  Listening poses;
  autopilot.send(poses, 0, 3);
  ASSERT_EQ(poses.remarks().size(), 1U);
  EXPECT_THAT(poses.remarks().front(), HasSubstr("no vertical velocity"));
}

}  // namespace
}  // namespace pade::live
