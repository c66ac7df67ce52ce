// What drivers write that is not what it seems: sensors, images and transforms of recordings of ROS.
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/flight/recorded_frames.hpp"
#include "pade/io/recording/flight/recorded_images.hpp"

#include "io/recording/own_recording.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::int64_t kStart = 1'500'000'000'000'000'000;
constexpr auto kEncoding = MessageEncoding::cdr;

/// Sensors of two seconds, of which a test replaces some.
struct SensorMessages {
  std::string imu_frame = "imu", fix_frame = "gps", velocity_frame = "gps", field_frame = "imu";
  std::string velocity_topic = "/gps/vel";
  Vector3d rate{0.1, 0.2, 0.3}, force{0.5, 0, 9.8}, field{2e-5, 1e-5, -4e-5};
  double silent = 0;  // the first value of the covariances of the IMU
  Eigen::Matrix3d position = Vector3d(4, 4, 9).asDiagonal();
  Vector3d velocity{1, 2, 0.5}, velocity_variance{0.04, 0.04, 0.09};

  void write(const std::filesystem::path& file, const std::vector<NamedTransform>& mounting = {}) const {
    test::OwnRecording own(file);
    for (const NamedTransform& one : mounting)
      own.write("/tf_static", "tf2_msgs/TFMessage", {kStart},
                write_transform(one.header, one.child, one.pose, kEncoding));
    for (int i = 0; i < 200; ++i) {
      const Time time{kStart + 10'000'000LL * i};
      own.write("/imu", "sensor_msgs/Imu", time, imu(time));
      if (i % 10 != 0) continue;
      const Vector3d place(47.5 + 1e-6 * i, 8.25, 430);
      own.write("/fix", "sensor_msgs/NavSatFix", time,
                write_nav_sat_fix({time, fix_frame}, place, position, kEncoding));
      own.write(velocity_topic, "geometry_msgs/TwistWithCovarianceStamped", time,
                write_velocity({time, velocity_frame}, velocity, velocity_variance.asDiagonal(), kEncoding));
      own.write("/mag", "sensor_msgs/MagneticField", time,
                write_magnetic_field({time, field_frame}, field, kEncoding));
    }
    EXPECT_TRUE(own.writer->finish());
  }

 private:
  [[nodiscard]] std::string imu(Time time) const {
    MessageWriter out(kEncoding);
    std::array<double, 9> covariance{};
    covariance[0] = silent;
    out.header({time, imu_frame});
    out.quaternion(Eigen::Quaterniond::Identity());
    out.numbers(covariance);
    out.vector(rate);
    out.numbers(covariance);
    out.vector(force);
    out.numbers(covariance);
    return out.take();
  }
};

NavigationLog read_back(const SensorMessages& messages, const std::vector<NamedTransform>& mounting = {}) {
  const test::TemporaryFolder folder;
  messages.write(folder / "sensors.mcap", mounting);
  auto log = read_navigation_log(folder / "sensors.mcap");
  EXPECT_TRUE(log) << log.error().message;
  return log ? std::move(*log) : NavigationLog{};
}

std::string refusal_of(const SensorMessages& messages) {
  const test::TemporaryFolder folder;
  messages.write(folder / "sensors.mcap");
  const auto log = read_navigation_log(folder / "sensors.mcap");
  EXPECT_FALSE(log);
  return log ? "" : log.error().message;
}

Vector3d sigmas_of(const NavigationLog& log) {
  return log.gnss.velocities.at(3).covariance.diagonal().cwiseSqrt();
}

TEST(RecordedVelocities, AVerticalPartThatNobodyMeasuresIsLeftOpen) {
  SensorMessages messages;
  EXPECT_TRUE(sigmas_of(read_back(messages)).isApprox(Vector3d(0.2, 0.2, 0.3)));
  messages.velocity_variance.setZero();
  EXPECT_TRUE(sigmas_of(read_back(messages)).isApprox(Vector3d(0.15, 0.15, 0.25)));
  EXPECT_THAT(read_back(messages).remarks, Contains(HasSubstr("20 of 20 velocities state no accuracy")));
  messages.velocity.z() = 0;  // mavros' raw/gps_vel
  const NavigationLog level = read_back(messages);
  EXPECT_TRUE(sigmas_of(level).isApprox(Vector3d(0.15, 0.15, 10)));
  EXPECT_EQ(measured_axes(level.gnss.velocities[3]), Vector3d(1, 1, 0));
  EXPECT_THAT(level.remarks, Contains(HasSubstr("has no vertical velocity, which is left open")));
  messages.velocity.z() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(sigmas_of(read_back(messages)).isApprox(Vector3d(0.15, 0.15, 10)));
  // What is stated of the others stays.
  messages.velocity.z() = 0.5;
  messages.velocity_variance = {0.04, 0.09, 0};
  EXPECT_TRUE(sigmas_of(read_back(messages)).isApprox(Vector3d(0.2, 0.3, 10)));
}

TEST(RecordedVelocities, ThoseOfTheVehicleAreNotTheReceivers) {
  SensorMessages messages;
  for (const char* const frame : {"base_link", "imu", "body"}) {
    messages.fix_frame = messages.velocity_frame = frame;
    for (const char* const topic : {"/cmd_vel", "/prefix/velocity", "/fixed_wing/twist"}) {
      messages.velocity_topic = topic;
      const NavigationLog log = read_back(messages);
      EXPECT_TRUE(log.gnss.velocities.empty()) << topic << " in " << frame;
      EXPECT_THAT(log.remarks, Contains(HasSubstr("found no velocities of the GNSS")));
    }
  }
  messages.fix_frame = messages.velocity_frame = "antenna";
  messages.velocity_topic = "/velocity";
  EXPECT_EQ(read_back(messages).gnss.velocities.size(), 20U);
  EXPECT_THAT(read_back(messages).remarks, Contains(HasSubstr("/velocity: taken as the velocities")));
  messages.velocity_frame = "elsewhere";
  EXPECT_TRUE(read_back(messages).gnss.velocities.empty());
  messages.velocity_topic = "/ublox/fix_velocity";
  EXPECT_EQ(read_back(messages).gnss.velocities.size(), 20U);
}

TEST(RecordedField, IsTurnedFromItsFrameIntoTheIMUs) {
  SensorMessages messages;
  const Vector3d gauss = 1e4 * messages.field;
  EXPECT_TRUE(read_back(messages).magnetometer[0].field.isApprox(gauss));
  messages.field_frame = "compass";
  const NavigationLog unknown = read_back(messages);
  EXPECT_TRUE(unknown.magnetometer[0].field.isApprox(gauss));
  EXPECT_THAT(unknown.remarks,
              Contains(HasSubstr("/mag: is of the frame \"compass\", and no transform says")));
  const Pose T_base_imu{rotation_exp({0.1, -0.2, 3}), {0.1, 0, 0}};
  const Pose T_base_compass{rotation_exp({0, 0.3, -1.5}), {0, 0, 0.2}};
  const NavigationLog turned = read_back(messages, {{{{kStart}, "base_link"}, "imu", T_base_imu},
                                                    {{{kStart}, "base_link"}, "compass", T_base_compass}});
  const Vector3d expected = T_base_imu.rotation.inverse() * (T_base_compass.rotation * gauss);
  EXPECT_TRUE(turned.magnetometer[0].field.isApprox(expected));
  EXPECT_THAT(turned.remarks, Not(Contains(HasSubstr("compass"))));
}

TEST(RecordedFixes, KeepTheWholeOfACovariance) {
  SensorMessages messages;
  messages.position << 0.25, 0.3, 0.1, 0.3, 4, -0.2, 0.1, -0.2, 9;
  EXPECT_TRUE(read_back(messages).gnss.fixes[2].covariance.isApprox(messages.position));
  messages.position << 0.25, 2, 0, 2, 4, 0, 0, 0, 9;  // none
  EXPECT_TRUE(read_back(messages).gnss.fixes[2].covariance.isApprox(
      Eigen::Matrix3d(Vector3d(0.25, 4, 9).asDiagonal())));
  messages.position << 0.25, 0, 0, 0, 4, 0, 0, 0, 0;
  const NavigationLog log = read_back(messages);
  EXPECT_TRUE(log.gnss.fixes[2].covariance.isApprox(Eigen::Matrix3d(Vector3d(0.25, 4, 6.25).asDiagonal())));
  EXPECT_THAT(log.remarks, Contains(HasSubstr("20 of 20 positions state no accuracy of the height")));
}

TEST(RecordedImu, InAnotherUnitOrWithoutMeasurementIsRefusedByName) {
  SensorMessages messages;
  messages.force = {0.05, 0, 1};
  EXPECT_THAT(refusal_of(messages), HasSubstr("/imu: the specific force is 1.001 (median norm)"));
  EXPECT_THAT(refusal_of(messages), HasSubstr("this is in g"));
  messages.force = {0.5, 0, 9.8};
  messages.silent = -1;
  EXPECT_EQ(read_back(messages).imu.size(), 200U);  // values are there, whatever the covariance says
  messages.rate.setZero();
  EXPECT_THAT(refusal_of(messages), HasSubstr("/imu measures no angular rate"));
}

/// A flight as a recording with its camera on one topic, and poses of it.
void write_flight_messages(test::OwnRecording& own, const test::Flight& flight) {
  for (std::size_t i = 0; i < flight.size(); ++i)
    own.write("/odom", "nav_msgs/Odometry", flight.times[i],
              write_odometry({flight.times[i], "map"}, "camera", flight.T_world_camera[i], kEncoding));
}

void write_compressed(test::OwnRecording& own, const std::string& topic, Time time, const std::string& format,
                      const cv::Mat& image) {
  const auto png = encode_png(image);
  own.write(topic, "sensor_msgs/CompressedImage", time,
            write_compressed_image({time, "camera"}, format, std::string(png.begin(), png.end()), kEncoding));
}

TEST(RecordedImages, AMosaicWithinAPictureIsColours) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight();
  for (const std::string format : {"bayer_rggb8; png compressed ", "bayer_rggb8; png compressed bayer_rggb8",
                                   "bayer_rggb8; png compressed bgr8", "mono8; png compressed "}) {
    test::OwnRecording own(folder / "bayer.mcap");
    write_flight_messages(own, flight);
    const bool converted = format.ends_with("bgr8");
    for (std::size_t i = 0; i < flight.size(); ++i) {
      own.write("/camera_info", "sensor_msgs/CameraInfo", flight.times[i],
                write_camera_info({flight.times[i], "camera"}, flight.camera, kEncoding));
      cv::Mat image = flight.images[i];
      if (converted) cv::cvtColor(image, image, cv::COLOR_BayerBG2BGR);
      write_compressed(own, "/image/compressed", flight.times[i], format, image);
    }
    ASSERT_TRUE(own.writer->finish());
    const auto sequence = Sequence::open(folder / "bayer.mcap");
    ASSERT_TRUE(sequence) << sequence.error().message;
    const auto encoded = sequence->encoded_image(0);
    ASSERT_TRUE(encoded);
    const cv::Mat pixels = *decode_image(image_bytes(encoded->bytes), Pixels::stored);
    ImageMessage raw;
    raw.height = static_cast<std::uint32_t>(flight.camera.height);
    raw.width = raw.step = static_cast<std::uint32_t>(flight.camera.width);
    raw.encoding = format.starts_with("bayer") ? "bayer_rggb8" : "mono8";
    raw.data = {flight.images[0].ptr<char>(), flight.images[0].total()};
    EXPECT_TRUE(test::same_pixels(pixels, *pixels_of(raw))) << format;
    EXPECT_EQ(sequence->frame(0)->image.channels(), format.starts_with("bayer") ? 3 : 1) << format;
  }
}

TEST(RecordedImages, TheLongerOfAPictureAndItsCompressionIsTaken) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight(8);
  test::OwnRecording own(folder / "few.mcap");
  write_flight_messages(own, flight);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    own.write("/camera_info", "sensor_msgs/CameraInfo", flight.times[i],
              write_camera_info({flight.times[i], "camera"}, flight.camera, kEncoding));
    write_compressed(own, "/image/compressed", flight.times[i], "mono8; png compressed ", flight.images[i]);
    if (i < 3)
      own.write("/image", "sensor_msgs/Image", flight.times[i],
                write_image({flight.times[i], "camera"}, flight.images[i], kEncoding));
  }
  ASSERT_TRUE(own.writer->finish());
  const auto sequence = Sequence::open(folder / "few.mcap");
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->size(), 8U);
  EXPECT_THAT(sequence->notes(), Contains(HasSubstr("/image: has 3 images, /image/compressed has 8")));
}

TEST(RecordedImages, AFewWithoutAStampAreLeftOut) {
  const test::TemporaryFolder folder;
  const test::Flight flight = test::make_flight(8);
  test::OwnRecording own(folder / "stamps.mcap");
  write_flight_messages(own, flight);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    own.write("/camera_info", "sensor_msgs/CameraInfo", flight.times[i],
              write_camera_info({flight.times[i], "camera"}, flight.camera, kEncoding));
    const Time recorded{flight.times[i].nanoseconds + 40'000'000};
    own.write("/image", "sensor_msgs/Image", recorded,
              write_image({i == 2 ? Time{} : flight.times[i], "camera"}, flight.images[i], kEncoding));
  }
  ASSERT_TRUE(own.writer->finish());
  const auto sequence = Sequence::open(folder / "stamps.mcap");
  ASSERT_TRUE(sequence) << sequence.error().message;
  ASSERT_EQ(sequence->size(), 7U);
  EXPECT_EQ(sequence->time(2), flight.times[3]);
  EXPECT_THAT(sequence->notes(),
              Contains(HasSubstr("1 of 8 messages have no stamp in their header and are left")));
}

/// Images of `frame` with a calibration on a topic of its own.
Result<Sequence> with_calibration_of(const test::TemporaryFolder& folder, const std::string& image_topic,
                                     const std::string& info_topic, const std::string& info_frame,
                                     const SequenceOptions& options = {}) {
  const test::Flight flight = test::make_flight();
  test::OwnRecording own(folder / "info.mcap");
  write_flight_messages(own, flight);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    own.write(info_topic, "sensor_msgs/CameraInfo", flight.times[i],
              write_camera_info({flight.times[i], info_frame}, flight.camera, kEncoding));
    own.write(image_topic, "sensor_msgs/Image", flight.times[i],
              write_image({flight.times[i], "camera"}, flight.images[i], kEncoding));
  }
  EXPECT_TRUE(own.writer->finish());
  return Sequence::open(folder / "info.mcap", options);
}

TEST(RecordedCalibration, OfAnotherCameraIsRefused) {
  const test::TemporaryFolder folder;
  const char* const depth = "/camera/depth/camera_info";
  const auto refused = with_calibration_of(folder, "/camera/color/image_raw", depth, "depth_optical");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message,
              HasSubstr("the only calibration, /camera/depth/camera_info, is that of \"depth_optical\""));
  SequenceOptions options;
  options.topics = depth;
  EXPECT_TRUE(with_calibration_of(folder, "/camera/color/image_raw", depth, "depth_optical", options));
  const auto same = with_calibration_of(folder, "/camera/color/image_raw", depth, "camera");
  ASSERT_TRUE(same) << same.error().message;
  EXPECT_THAT(same->notes(),
              Contains(HasSubstr("camera_info: taken as the calibration of /camera/color/image_raw")));
  // Beside the images it is theirs, whatever it calls its frame.
  EXPECT_TRUE(with_calibration_of(folder, "/camera/color/image_raw", "/camera/color/camera_info", "other"));
}

TEST(RecordedCalibration, OnlyAWordOfTheNameMeansRectified) {
  const test::TemporaryFolder folder;
  for (const char* const topic : {"/directed/image_raw", "/direct/image", "/left/image_corrected"}) {
    const auto sequence = with_calibration_of(folder, topic, "/camera_info", "camera");
    ASSERT_TRUE(sequence) << sequence.error().message;
    EXPECT_EQ(sequence->raw_camera().distortion, Distortion::plumb_bob) << topic;
  }
  for (const char* const topic : {"/left/image_rect_color", "/left/image_rect", "/rectified/image"}) {
    const auto sequence = with_calibration_of(folder, topic, "/camera_info", "camera");
    ASSERT_TRUE(sequence) << sequence.error().message;
    EXPECT_EQ(sequence->raw_camera().distortion, Distortion::none) << topic;
    EXPECT_THAT(sequence->notes(), Contains(HasSubstr("taken as rectified by its name")));
  }
}

TEST(RecordedTransforms, TheParentThatIsNamedMostIsBelieved) {
  const test::TemporaryFolder folder;
  test::OwnRecording own(folder / "tf.mcap");
  const Pose T{Eigen::Quaterniond::Identity(), {1, 2, 3}};
  const auto add = [&](int i, const char* parent) {
    const Time time{kStart + 1'000'000LL * i};
    own.write("/tf", "tf2_msgs/TFMessage", time, write_transform({time, parent}, "base", T, kEncoding));
  };
  add(0, "stray");
  for (int i = 1; i < 12; ++i) add(i, "odom");
  ASSERT_TRUE(own.writer->finish());
  const auto recording = Recording::open(folder / "tf.mcap");
  ASSERT_TRUE(recording);
  ReadReport report;
  const auto frames = RecordedFrames::read(*recording, report);
  ASSERT_TRUE(frames);
  EXPECT_EQ(frames->root("base"), "odom");
  ASSERT_EQ(report.skipped.size(), 1U);
  EXPECT_THAT(report.skipped[0].reason,
              HasSubstr("1 transforms from \"stray\" are not used: 11 from \"odom\""));
}

TEST(RosbagFolders, ThatAreNoRecordingSayWhatToDo) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "plain/flight_0.mcap", "x");
  test::write_text(folder / "packed/metadata.yaml", "rosbag2_bagfile_information:\n");
  test::write_text(folder / "packed/flight_0.mcap.zstd", "x");
  for (const auto& read : {Sequence::open(folder / "plain").error().message,
                           read_navigation_log(folder / "plain").error().message})
    EXPECT_THAT(read, HasSubstr("no metadata.yaml: name the file itself (.mcap, .db3 or .bag)"));
  for (const auto& read : {Sequence::open(folder / "packed").error().message,
                           read_navigation_log(folder / "packed").error().message})
    EXPECT_THAT(read, HasSubstr("compressed as a whole (.zstd)"));
}

TEST(UnusedOptions, OfRecordingsAndFoldersAreRefused) {
  const test::TemporaryFolder folder;
  SensorMessages().write(folder / "sensors.mcap");
  NavigationLogOptions options;
  options.gnss = "nothere.csv";
  EXPECT_THAT(read_navigation_log(folder / "sensors.mcap", options).error().message,
              HasSubstr("expected no GNSS file"));
  options = {};
  options.topics = "/imu";
  EXPECT_THAT(read_navigation_log(folder.path(), options).error().message,
              HasSubstr("is no recording of ROS"));
  test::write_tum(folder / "flight", test::make_flight());
  SequenceOptions of_sequence;
  of_sequence.topics = "/image";
  EXPECT_THAT(Sequence::open(folder / "flight", of_sequence).error().message,
              HasSubstr("is no recording of ROS"));
}

}  // namespace
}  // namespace pade::io
