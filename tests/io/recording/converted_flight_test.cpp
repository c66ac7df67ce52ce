// What `pade convert` carries over from one storage to another, and what it says of the rest.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/flight/flight_names.hpp"

#include "io/recording/own_recording.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using test::OwnRecording;
using test::TemporaryFolder;
using ::testing::Contains;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// Into a file with an ending, else into a folder.
WrittenFlight convert(const Sequence& sequence, const NavigationLog* log, const fs::path& out) {
  if (out.has_extension()) {
    auto writer = create_recording(out, Overwrite::replace);
    EXPECT_TRUE(writer);
    auto written = write_flight(sequence, log, **writer);
    EXPECT_TRUE(written) << written.error().message;
    return written ? *written : WrittenFlight{};
  }
  auto folder = OutputFolder::create(out, Overwrite::refuse, "camera.yaml");
  EXPECT_TRUE(folder);
  auto written = write_flight(sequence, log, *folder);
  EXPECT_TRUE(written) << written.error().message;
  EXPECT_TRUE(folder->commit());
  return written ? *written : WrittenFlight{};
}

/// A flight whose poses are those of base_link, with its IMU turned round on it.
struct TurnedImu {
  Pose T_base_imu{rotation_exp({0.1, 0.05, 3.1}), {0.05, 0.02, -0.01}};
  Pose T_base_camera{Eigen::Quaterniond(forward_camera_rotation()), {0.2, 0, 0.1}};
  test::Flight flight = test::make_flight();

  void write(const fs::path& file) const {
    OwnRecording own(file);
    const auto encoding = own.writer->encoding();
    own.camera("/image", flight, "optical");
    const Time start = flight.times[0];
    const Pose T_base_gps{Eigen::Quaterniond::Identity(), {0, 0, 0.3}};
    own.write("/tf_static", "tf2_msgs/TFMessage", start,
              write_transforms(std::vector<NamedTransform>{{{start, "base_link"}, "optical", T_base_camera},
                                                           {{start, "base_link"}, "imu", T_base_imu},
                                                           {{start, "base_link"}, "antenna", T_base_gps}},
                               encoding));
    for (std::size_t i = 0; i < flight.size(); ++i) {
      const Time time = flight.times[i];
      own.write("/odom", "nav_msgs/Odometry", time,
                write_odometry({time, "map"}, "base_link", flight.T_world_camera[i], encoding));
      own.write("/imu", "sensor_msgs/Imu", time,
                write_imu({time, "imu"}, {0.1, 0.2, 0.3}, {0.5, 1, 9.8}, encoding));
      own.write("/fix", "sensor_msgs/NavSatFix", time,
                write_nav_sat_fix({time, "antenna"}, {47, 8, 400}, Eigen::Matrix3d::Identity(), encoding));
      own.write("/mag", "sensor_msgs/MagneticField", time,
                write_magnetic_field({time, "imu"}, {2e-5, 1e-5, -4e-5}, encoding));
    }
    ASSERT_TRUE(own.writer->finish());
  }
};

TEST(ConvertedFlight, KeepsTheImuWhereItSits) {
  const TemporaryFolder folder;
  const TurnedImu turned;
  turned.write(folder / "turned.mcap");
  const auto original = Sequence::open(folder / "turned.mcap");
  const auto sensors = read_navigation_log(folder / "turned.mcap");
  ASSERT_TRUE(original) << original.error().message;
  ASSERT_TRUE(sensors) << sensors.error().message;
  const Pose T_imu_camera = turned.T_base_imu.inverse() * turned.T_base_camera;
  for (const char* const name : {"copy.bag", "copy.mcap"}) {
    convert(*original, &*sensors, folder / name);
    const auto copy = Sequence::open(folder / name);
    const auto log = read_navigation_log(folder / name);
    ASSERT_TRUE(copy) << copy.error().message;
    ASSERT_TRUE(log) << log.error().message;
    ASSERT_TRUE(copy->T_imu_camera());
    EXPECT_LT((copy->T_imu_camera()->translation - T_imu_camera.translation).norm(), 1e-9);
    EXPECT_LT(test::rotation_difference(*copy->T_imu_camera(), T_imu_camera), 1e-7);
    EXPECT_EQ(copy->pose(2).translation, original->pose(2).translation);
    EXPECT_EQ(log->imu[3].specific_force, sensors->imu[3].specific_force);
    EXPECT_TRUE(log->magnetometer[3].field.isApprox(sensors->magnetometer[3].field));
    ASSERT_TRUE(log->gnss.lever_arm);
    EXPECT_LT((*log->gnss.lever_arm - *sensors->gnss.lever_arm).norm(), 1e-9);
  }
  const WrittenFlight written = convert(*original, &*sensors, folder / "copy");
  EXPECT_THAT(written.notes, Contains(HasSubstr("turned into the axes of the body")));
  EXPECT_THAT(written.left_out, Contains(HasSubstr("the place of the IMU, 0.050 0.020 -0.010 m")));
  const auto log = read_navigation_log(folder / "copy");
  ASSERT_TRUE(log) << log.error().message;
  EXPECT_TRUE(
      log->imu[3].specific_force.isApprox(turned.T_base_imu.rotation * sensors->imu[3].specific_force));
  EXPECT_TRUE(log->imu[3].angular_rate.isApprox(turned.T_base_imu.rotation * sensors->imu[3].angular_rate));
  EXPECT_TRUE(
      log->magnetometer[3].field.isApprox(turned.T_base_imu.rotation * sensors->magnetometer[3].field));
  EXPECT_LT((*log->gnss.lever_arm - Eigen::Vector3d(0, 0, 0.3)).norm(), 1e-9);
}

TEST(ConvertedFlight, TakesTheOffsetOutOfPosesAndSensorsAlike) {
  const TemporaryFolder folder;
  const test::Flight flight = test::make_flight(20);
  const NavigationLog log = test::some_sensors(flight.times[0]);
  const Sequence original = test::opened_flight(
      folder / "flight", flight,
      "pose_convention: body_to_world\nT_body_camera: [0,0,1,0.1, -1,0,0,0.2, 0,-1,0,0.3, "
      "0,0,0,1]\ntime_offset_s: 0.05\n");
  for (const char* const name : {"copy.mcap", "copy"}) {
    const WrittenFlight written = convert(original, &log, folder / name);
    EXPECT_THAT(written.notes, Contains(HasSubstr("0.050000 s between the clocks")));
    const auto copy = read_navigation_log(folder / name);
    ASSERT_TRUE(copy) << copy.error().message;
    const auto expect_earlier = [](Time read, Time original_time) {
      EXPECT_EQ(original_time.nanoseconds - read.nanoseconds, 50'000'000);
    };
    expect_earlier(copy->imu[7].time, log.imu[7].time);
    expect_earlier(copy->gnss.fixes[3].time, log.gnss.fixes[3].time);
    expect_earlier(copy->gnss.velocities[3].time, log.gnss.velocities[3].time);
    expect_earlier(copy->magnetometer[3].time, log.magnetometer[3].time);
    expect_earlier(copy->barometer[3].time, log.barometer[3].time);
    const auto sequence = Sequence::open(folder / name);
    ASSERT_TRUE(sequence) << sequence.error().message;
    EXPECT_FALSE(sequence->calibration().time_offset_s);
    EXPECT_LT((sequence->pose(4).translation - original.pose(4).translation).norm(), 1e-12);
  }
}

TEST(ConvertedFlight, KeepsWhatIsStamped0) {
  const TemporaryFolder folder;
  test::Flight flight = test::make_flight(20);
  const std::int64_t first = flight.times[0].nanoseconds;
  for (Time& time : flight.times) time.nanoseconds -= first;
  const NavigationLog log = test::some_sensors(Time{0});
  const Sequence original = test::opened_flight(folder / "flight", flight);
  ASSERT_EQ(original.size(), flight.size());
  for (const char* const name : {"copy.bag", "copy.mcap", "copy"}) {
    convert(original, &log, folder / name);
    const auto copy = Sequence::open(folder / name);
    ASSERT_TRUE(copy) << copy.error().message;
    ASSERT_EQ(copy->size(), original.size()) << name;
    for (std::size_t i = 0; i < original.size(); ++i) EXPECT_EQ(copy->time(i), original.time(i)) << name;
    const auto sensors = read_navigation_log(folder / name);
    ASSERT_TRUE(sensors) << sensors.error().message;
    const auto expect_times = [&](const auto& read, const auto& written, const char* what) {
      ASSERT_EQ(read.size(), written.size()) << name << " " << what;
      for (std::size_t i = 0; i < written.size(); ++i)
        EXPECT_EQ(read[i].time, written[i].time) << name << " " << what << " " << i;
    };
    EXPECT_EQ(log.imu.front().time, Time{0});
    expect_times(sensors->imu, log.imu, "IMU");
    expect_times(sensors->gnss.fixes, log.gnss.fixes, "positions");
    expect_times(sensors->gnss.velocities, log.gnss.velocities, "velocities");
    expect_times(sensors->magnetometer, log.magnetometer, "magnetometer");
    expect_times(sensors->barometer, log.barometer, "barometer");
  }
}

TEST(ConvertedFlight, OfALiveSessionKeepsMaskAndMotions) {
  const TemporaryFolder folder;
  test::Flight flight = test::make_flight();
  flight.camera.distortion = Distortion::none;
  flight.camera.coefficients = {};
  cv::Mat mask(flight.camera.size(), CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 30, 40, 18)) = 0;
  OwnRecording own(folder / "session.mcap");
  const auto encoding = own.writer->encoding();
  own.write(flight_names::mask, "sensor_msgs/Image", flight.times[0],
            write_image({flight.times[0], "camera"}, mask, encoding));
  own.camera("/camera/image_raw", flight, "camera");
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const Matrix6d covariance = 1e-4 * static_cast<double>(i + 1) * Matrix6d::Identity();
    own.write(
        flight_names::motion, "geometry_msgs/PoseWithCovarianceStamped", flight.times[i],
        write_pose_with_covariance({flight.times[i], "map"}, flight.T_world_camera[i], covariance, encoding));
  }
  ASSERT_TRUE(own.writer->finish());
  const auto session = Sequence::open(folder / "session.mcap");
  ASSERT_TRUE(session) << session.error().message;
  ASSERT_TRUE(test::same_pixels(session->mask(), mask));
  for (const char* const name : {"copy.bag", "copy.mcap"}) {
    convert(*session, nullptr, folder / name);
    const auto copy = Sequence::open(folder / name);
    ASSERT_TRUE(copy) << copy.error().message;
    EXPECT_TRUE(test::same_pixels(copy->mask(), mask));
    for (std::size_t i = 0; i < copy->size(); ++i) {
      EXPECT_EQ(copy->frame(i)->motion_covariance, session->motion_covariance(i));
      EXPECT_EQ(copy->pose(i).rotation.coeffs(), session->pose(i).rotation.coeffs());
    }
  }
  const WrittenFlight written = convert(*session, nullptr, folder / "copy");
  EXPECT_THAT(written.left_out, Contains(HasSubstr("the covariances of the motions")));
  const auto copy = Sequence::open(folder / "copy");
  ASSERT_TRUE(copy) << copy.error().message;
  EXPECT_TRUE(test::same_pixels(copy->mask(), mask));
}

TEST(ConvertedFlight, KeepsAMaskFile) {
  const TemporaryFolder folder;
  const test::Flight flight = test::make_flight();
  cv::Mat mask(flight.camera.size(), CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 0, 64, 9)) = 0;
  test::write_image(folder / "flight/mask.png", mask);
  const Sequence original = test::opened_flight(folder / "flight", flight);
  for (const char* const name : {"copy.mcap", "copy"}) {
    convert(original, nullptr, folder / name);
    const auto copy = Sequence::open(folder / name);
    ASSERT_TRUE(copy) << copy.error().message;
    EXPECT_TRUE(test::same_pixels(copy->mask(), original.mask())) << name;
  }
}

TEST(ConvertedFlight, KeepsVelocitiesThatHaveNoPosition) {
  const TemporaryFolder folder;
  const test::Flight flight = test::make_flight();
  NavigationLog log = test::some_sensors(flight.times[0]);
  for (GnssVelocity& velocity : log.gnss.velocities) velocity.time.nanoseconds += 1000;
  log.gnss.velocities.pop_back();
  convert(test::opened_flight(folder / "flight", flight), &log, folder / "copy");
  const auto copy = read_navigation_log(folder / "copy");
  ASSERT_TRUE(copy) << copy.error().message;
  ASSERT_EQ(copy->gnss.fixes.size(), log.gnss.fixes.size());
  ASSERT_EQ(copy->gnss.velocities.size(), log.gnss.velocities.size());
  for (std::size_t i = 0; i < log.gnss.velocities.size(); ++i) {
    EXPECT_EQ(copy->gnss.velocities[i].time, log.gnss.velocities[i].time);
    EXPECT_EQ(copy->gnss.velocities[i].velocity, log.gnss.velocities[i].velocity);
    EXPECT_TRUE(copy->gnss.velocities[i].covariance.isApprox(log.gnss.velocities[i].covariance));
  }
}

TEST(ConvertedFlight, KeepsTheSensorsThatThereAre) {
  const TemporaryFolder folder;
  const test::Flight flight = test::make_flight();
  NavigationLog log = test::some_sensors(flight.times[0]);
  log.gnss = {};
  const Sequence original = test::opened_flight(folder / "flight", flight);
  convert(original, &log, folder / "vio.mcap");
  EXPECT_THAT(read_navigation_log(folder / "vio.mcap").error().message, HasSubstr("the GNSS is missing"));
  const auto some = read_some_sensors(folder / "vio.mcap", "");
  ASSERT_TRUE(some) << some.error().message;
  EXPECT_EQ(some->log.imu.size(), log.imu.size());
  EXPECT_EQ(some->log.barometer.size(), log.barometer.size());
  EXPECT_THAT(some->topics, Contains(flight_names::imu));
  convert(original, &some->log, folder / "copy");
  EXPECT_TRUE(fs::exists(folder / "copy/imu.csv"));
  EXPECT_FALSE(fs::exists(folder / "copy/gnss.csv"));
}

/// "Any unit" in a table, tesla in a recording.
TEST(ConvertedFlight, TheMagneticFieldIsInTeslaWhateverUnitItCameIn) {
  const TemporaryFolder folder;
  const TurnedImu turned;
  turned.write(folder / "turned.mcap");
  const auto original = Sequence::open(folder / "turned.mcap");
  auto sensors = read_navigation_log(folder / "turned.mcap");
  ASSERT_TRUE(original && sensors);
  const Eigen::Vector3d tesla(2e-5, 1e-5, -4e-5);
  struct Case {
    double scale;
    const char* note;
  };
  for (const Case& unit : {Case{1, "in tesla"}, Case{1e4, ""}, Case{1e6, "in microtesla"},
                           Case{1e7, "in milligauss"}, Case{1e9, "in nanotesla"}, Case{2.5e4, "not known"}}) {
    for (MagneticField& sample : sensors->magnetometer) sample.field = unit.scale * tesla;
    const WrittenFlight written = convert(*original, &*sensors, folder / "unit.mcap");
    const auto back = read_navigation_log(folder / "unit.mcap");
    ASSERT_TRUE(back) << back.error().message;
    ASSERT_FALSE(back->magnetometer.empty());
    if (*unit.note == 0) {
      EXPECT_THAT(written.notes, ::testing::Not(Contains(HasSubstr("magnetic")))) << unit.scale;
    } else {
      EXPECT_THAT(written.notes, Contains(HasSubstr(unit.note))) << unit.scale;
    }
    const double expected = unit.scale == 2.5e4 ? 2.5 : 1;
    EXPECT_NEAR(back->magnetometer[0].field.norm(), expected * 1e4 * tesla.norm(), 1e-6) << unit.scale;
  }
}

TEST(ConvertedFlight, PositionsWithoutAnOriginOnEarthAreSaid) {
  const TemporaryFolder folder;
  const TurnedImu turned;
  turned.write(folder / "turned.mcap");
  const auto original = Sequence::open(folder / "turned.mcap");
  auto sensors = read_navigation_log(folder / "turned.mcap");
  ASSERT_TRUE(original && sensors);
  const auto notes = [&] { return convert(*original, &*sensors, folder / "out.mcap").notes; };
  EXPECT_THAT(notes(), ::testing::Not(Contains(HasSubstr("no origin on Earth"))));
  sensors->gnss.origin.reset();
  EXPECT_THAT(notes(), Contains(HasSubstr("no origin on Earth")));
}

TEST(ConvertedFlight, AFolderKeepsTheGeographicOrigin) {
  const TemporaryFolder folder;
  const Sequence original =
      test::opened_flight(folder / "flight", test::make_flight(), "geographic_origin: [47.25, 8.5, 432.1]\n");
  convert(original, nullptr, folder / "copy");
  const auto copy = Sequence::open(folder / "copy");
  ASSERT_TRUE(copy) << copy.error().message;
  ASSERT_TRUE(copy->calibration().origin);
  EXPECT_EQ(*copy->calibration().origin, *original.calibration().origin);
  EXPECT_EQ(copy->calibration().origin->latitude_deg, 47.25);
}

TEST(ConvertedFlight, ImagesBefore1970AreRefusedByName) {
  const TemporaryFolder folder;
  test::Flight flight = test::make_flight();
  for (std::size_t i = 0; i < flight.size(); ++i)
    flight.times[i] = Time{100'000'000 * static_cast<std::int64_t>(i) - 250'000'000};
  const Sequence original = test::opened_flight(folder / "flight", flight);
  for (const char* const name : {"copy.bag", "copy.mcap"}) {
    auto writer = create_recording(folder / name, Overwrite::replace);
    ASSERT_TRUE(writer);
    const auto written = write_flight(original, nullptr, **writer);
    ASSERT_FALSE(written);
    EXPECT_THAT(written.error().message, HasSubstr("-0.250000.png: the image's time is -0.250000 s"));
  }
  const Sequence known = test::opened_flight(folder / "known", test::make_flight());
  NavigationLog early = test::some_sensors({-1'000'000'000});
  const WrittenFlight written = convert(known, &early, folder / "early.mcap");
  EXPECT_THAT(written.left_out, Contains(HasSubstr("samples whose times are not between 1970 and 2038")));
}

}  // namespace
}  // namespace pade::io
