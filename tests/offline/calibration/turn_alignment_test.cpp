// Clock and mounting from turns, on turns that are known: a body swings at random, a camera on it sees how
// far from image to image, with noise.
#include "pade/offline/calibration/turn_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/core/pose.hpp"
#include "pade/core/random.hpp"
#include "pade/offline/calibration/clock_calibration.hpp"
#include "pade/offline/calibration/gyro_track.hpp"

namespace pade {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::HasSubstr;

constexpr double kDegree = 0.017453292519943295;

/// Sums of sines of many periods, one set an axis: smooth, and never the same twice.
class Swinging {
 public:
  Swinging(std::uint64_t seed, const Vector3d& amplitude) {
    Random random(seed);
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < 12; ++i) {
        parts_.push_back({axis, amplitude[axis] / std::sqrt(6.0) * random.normal(),
                          0.3 + 7 * random.uniform(), 6.283185307 * random.uniform()});
      }
    }
  }
  [[nodiscard]] Vector3d rate(double t) const {
    Vector3d rate = Vector3d::Zero();
    for (const Part& part : parts_) rate[part.axis] += part.size * std::sin(part.frequency * t + part.phase);
    return rate;
  }
  /// R_1_2 by fine steps.
  [[nodiscard]] Quaterniond turn(double from, double to) const {
    const int steps = std::max(10, static_cast<int>((to - from) / 0.001));
    Quaterniond R = Quaterniond::Identity();
    const double step = (to - from) / steps;
    for (int i = 0; i < steps; ++i) R = R * rotation_exp(Vector3d(step * rate(from + (i + 0.5) * step)));
    return R;
  }

 private:
  struct Part {
    int axis;
    double size, frequency, phase;
  };
  std::vector<Part> parts_;
};

struct Made {
  Vector3d amplitude{0.25, 0.25, 0.4};  // rad/s
  double imu_span = 40, imu_rate = 200, gyro_sigma = 0.01;
  double first_image = 8, image_rate = 20;  // s after the first sample
  int images = 300;
  double turn_sigma = 3e-4;  // rad
  double offset = 0, drift = 0;
  Quaterniond R_body_camera = Quaterniond(forward_camera_rotation());
  Vector3d bias{0.01, -0.02, 0.005};
  double wrong = 0;  // share of pairs whose turn is far off
};

struct Recorded {
  std::vector<ImageTurn> turns;
  std::vector<ImuSample> imu;
};

/// The IMU's clock begins at 50 s.
Recorded recorded(const Made& made, const Swinging& body, std::uint64_t seed) {
  Random random(seed + 1000);
  Recorded out;
  const auto noise = [&](double sigma) {
    return Vector3d(sigma * random.normal(), sigma * random.normal(), sigma * random.normal());
  };
  constexpr double kBegin = 50;
  for (int i = 0; i < made.imu_span * made.imu_rate; ++i) {
    const double t = i / made.imu_rate;
    out.imu.push_back(
        {Time::from_seconds(kBegin + t), body.rate(t) + made.bias + noise(made.gyro_sigma), {0, 0, 9.8}});
  }
  const double middle = made.first_image + 0.5 * made.images / made.image_rate;
  const auto stamp = [&](double t) {  // t_imu = t_image + offset + drift (t_image - middle)
    return Time{Time::from_seconds(kBegin + t - made.drift * (t - middle)).nanoseconds -
                Time::from_seconds(made.offset).nanoseconds};
  };
  for (int i = 0; i + 1 < made.images; ++i) {
    const double from = made.first_image + i / made.image_rate;
    const double to = from + 1 / made.image_rate;
    ImageTurn turn;
    turn.from = stamp(from);
    turn.to = stamp(to);
    turn.R_from_to = made.R_body_camera.conjugate() * body.turn(from, to) * made.R_body_camera *
                     rotation_exp(noise(random.uniform() < made.wrong ? 0.05 : made.turn_sigma));
    turn.covariance = made.turn_sigma * made.turn_sigma * Eigen::Matrix3d::Identity();
    out.turns.push_back(turn);
  }
  return out;
}

Result<TurnAlignment> aligned(const Made& made, std::uint64_t seed) {
  const Swinging body(seed, made.amplitude);
  const Recorded log = recorded(made, body, seed);
  return align_turns(log.turns, GyroTrack(log.imu));
}

std::string refusal(const Result<TurnAlignment>& result) {
  return result ? "accepted" : result.error().message;
}

TEST(GyroTrack, TurnsAsItsRatesDo) {
  const Swinging body(3, {0.5, 0.4, 0.6});
  std::vector<ImuSample> samples;
  for (int i = 0; i < 2000; ++i)
    samples.push_back({Time::from_seconds(i * 0.005), body.rate(i * 0.005), Vector3d::Zero()});
  samples.erase(samples.begin() + 1000, samples.begin() + 1100);  // 5 s to 5.5 s
  const GyroTrack track(samples);
  const auto turn = track.between(Time::from_seconds(1.0021), Time::from_seconds(3.4567));
  ASSERT_TRUE(turn);
  EXPECT_LT(turn->R_1_2.angularDistance(body.turn(1.0021, 3.4567)), 2e-4);
  EXPECT_LT((turn->rate_2 - body.rate(3.4567)).norm(), 1e-3);
  EXPECT_FALSE(track.between(Time::from_seconds(4.9), Time::from_seconds(5.6))) << "a gap";
  EXPECT_TRUE(track.between(Time::from_seconds(5.6), Time::from_seconds(5.7)));
  EXPECT_FALSE(track.between(Time::from_seconds(9.9), Time::from_seconds(10.1))) << "beyond the end";
}

TEST(TurnAlignment, FindsAnyOffsetAndAnyMounting) {
  std::uint64_t seed = 11;
  for (const double offset : {0.0, -3.0, 0.4321, 1000.0, -1.7e9}) {
    Random random(seed);
    Made made;
    made.offset = offset;
    made.R_body_camera =
        Quaterniond(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
    made.wrong = 0.15;
    const auto found = aligned(made, ++seed);
    ASSERT_TRUE(found) << found.error().message;
    const double error = found->offset - offset;
    EXPECT_LT(std::abs(error), 5 * found->offset_sigma + 1e-6) << offset;
    EXPECT_LT(found->offset_sigma, 1e-3) << offset;
    EXPECT_LT(found->R_body_camera.angularDistance(made.R_body_camera), 0.3 * kDegree);
    EXPECT_LT(found->mounting_sigma().maxCoeff(), 0.2 * kDegree);
    EXPECT_LE(found->searched_from, offset);
    EXPECT_GE(found->searched_to, offset);
    EXPECT_LT((found->gyro_bias - made.bias).norm(), 0.003);
  }
}

TEST(TurnAlignment, SigmasAreHonest) {
  double offset_nees = 0, mounting_nees = 0;
  constexpr int kRuns = 30;
  for (int run = 0; run < kRuns; ++run) {
    Made made;
    made.offset = 0.1 * run - 2;
    made.imu_span = 26;
    made.first_image = 6;
    made.images = 240;
    const auto found = aligned(made, 500 + static_cast<std::uint64_t>(run));
    ASSERT_TRUE(found) << run << ": " << found.error().message;
    offset_nees += std::pow((found->offset - made.offset) / found->offset_sigma, 2) / kRuns;
    const Vector3d off = rotation_log(Quaterniond(made.R_body_camera.conjugate() * found->R_body_camera));
    mounting_nees += off.dot(found->mounting_covariance.inverse() * off) / kRuns;
  }
  std::printf("NEES of offset %.2f (1), of mounting %.2f (3), %d runs\n", offset_nees, mounting_nees, kRuns);
  // Chi-square of 30 and 90 over their number: beyond 0.4 to 2.0 and 0.6 to 1.5 once in a thousand.
  EXPECT_GT(offset_nees, 0.4);
  EXPECT_LT(offset_nees, 2.0);
  EXPECT_GT(mounting_nees, 3 * 0.6);
  EXPECT_LT(mounting_nees, 3 * 1.5);
}

TEST(TurnAlignment, SaysWhichAxisNothingTells) {
  Made made;
  made.amplitude = {0, 0, 0.5};  // yaw alone
  made.offset = 2.5;
  const auto found = aligned(made, 21);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(std::abs(found->offset - 2.5), 5 * found->offset_sigma);
  const Vector3d sigma = found->mounting_sigma() / kDegree;
  EXPECT_LT(sigma.x(), 1);
  EXPECT_LT(sigma.y(), 1);
  EXPECT_GT(sigma.z(), 20);
  EXPECT_THAT(untold_axes(*found), testing::ElementsAre(HasSubstr("about the body's z (up) is not told")));
}

TEST(TurnAlignment, SeesClocksDrift) {
  Made made;
  made.imu_span = 130;
  made.images = 2000;
  made.drift = 6e-5;
  made.offset = 12;
  const auto found = aligned(made, 31);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(std::abs(found->offset - 12), 5 * found->offset_sigma);
  EXPECT_LT(std::abs(found->drift - 6e-5), 5 * found->drift_sigma);
  EXPECT_LT(found->drift_sigma, 2e-5);
}

TEST(TurnAlignment, RefusesWhatTellsNothing) {
  Made still;
  still.amplitude.setConstant(1e-4);
  EXPECT_THAT(refusal(aligned(still, 41)), HasSubstr("too little rotation"));

  Made of_one;
  const Recorded one = recorded(of_one, Swinging(51, of_one.amplitude), 51);
  const Recorded other = recorded(of_one, Swinging(52, of_one.amplitude), 52);
  EXPECT_THAT(refusal(align_turns(one.turns, GyroTrack(other.imu))), HasSubstr("not of one flight"));

  EXPECT_THAT(refusal(align_turns({}, GyroTrack(one.imu))), HasSubstr("found 0 pairs of images"));
  EXPECT_THAT(refusal(align_turns(one.turns, GyroTrack({}))), HasSubstr("no two samples of a gyroscope"));
  const std::vector<ImuSample> second(one.imu.begin(), one.imu.begin() + 200);
  EXPECT_THAT(refusal(align_turns(one.turns, GyroTrack(second))), HasSubstr("an IMU over 1.0 s"));
}

TEST(TurnAlignment, RefusesTurnsThatRepeat) {
  Made made;
  made.gyro_sigma = 0.002;
  Recorded log;
  for (int i = 0; i < 8000; ++i) {
    const double t = i * 0.005;
    log.imu.push_back(
        {Time::from_seconds(t), {0.4 * std::sin(2 * t), 0.3 * std::cos(2 * t), 0}, Vector3d::Zero()});
  }
  for (int i = 0; i < 200; ++i) {
    const double from = 10 + 0.05 * i;
    const auto body = GyroTrack(log.imu).between(Time::from_seconds(from), Time::from_seconds(from + 0.05));
    ASSERT_TRUE(body);
    log.turns.push_back({Time::from_seconds(from), Time::from_seconds(from + 0.05), body->R_1_2,
                         1e-8 * Eigen::Matrix3d::Identity()});
  }
  EXPECT_THAT(refusal(align_turns(log.turns, GyroTrack(log.imu))), HasSubstr("fit nearly alike"));
}

}  // namespace
}  // namespace pade
