// Images of a topic as a camera's frames, and those that cannot be used.
#include "pade/live/dds/dds_camera.hpp"

#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/recording/messages/message_writer.hpp"
#include "pade/live/config.hpp"

#include "live/dds/fake_network.hpp"
#include "live/dds/still_clocks.hpp"
#include "live/wall_camera.hpp"

namespace pade::live {
namespace {

using testing::HasSubstr;
using Outcome = FrameSource::Outcome;
constexpr auto kCameraTestCdr = io::MessageEncoding::cdr;

class DdsCameraTest : public testing::Test {
 protected:
  std::unique_ptr<FrameSource> open(const std::string& topic) {
    auto camera = open_dds_camera(network_, shared_, topic, small_camera());
    EXPECT_TRUE(camera.ok());
    return std::move(*camera);
  }
  /// Each is a little later than the one before.
  io::MessageHeader now() {
    moved_ += 10'000'000;
    return {shared_.clock.to_stamp(shared_.clock.now()), "front"};
  }

  FakeNetwork network_;
  std::int64_t moved_ = 0;
  DdsShared shared_{DdsOptions{}, still_clocks(moved_)};
};

TEST_F(DdsCameraTest, GivesTheNewestImageWithItsStampByOurClock) {
  const auto camera = open("/camera/image_raw");
  EXPECT_EQ(network_.topics.types["/camera/image_raw"], "sensor_msgs/Image");
  const cv::Mat image = image_of_wall(textured_wall(), 1);
  const io::MessageHeader header = now();
  network_.topics.give("/camera/image_raw",
                       io::write_image({{header.stamp.nanoseconds - 5'000'000}, "front"},
                                       cv::Mat(64, 96, CV_8UC1, cv::Scalar(1)), kCameraTestCdr));
  network_.topics.give("/camera/image_raw", io::write_image(header, image, kCameraTestCdr));
  LiveFrame frame;
  ASSERT_EQ(camera->next(frame, 1000), Outcome::frame);
  EXPECT_EQ(cv::norm(frame.image, image, cv::NORM_L1), 0);
  EXPECT_EQ(shared_.clock.to_stamp(frame.time).nanoseconds, header.stamp.nanoseconds);
  EXPECT_EQ(shared_.names.now().camera, "front");
  EXPECT_EQ(camera->next(frame, 1), Outcome::nothing);
  EXPECT_EQ(camera->remark(), "nobody publishes it");
}

TEST_F(DdsCameraTest, ReadsPicturesThatAreCompressed) {
  const auto camera = open("/camera/image_raw/compressed");
  EXPECT_EQ(network_.topics.types["/camera/image_raw/compressed"], "sensor_msgs/CompressedImage");
  const cv::Mat image = image_of_wall(textured_wall(), 1);
  const auto file = io::encode_png(image);
  network_.topics.give("/camera/image_raw/compressed",
                       io::write_compressed_image(now(), "mono8; png compressed ",
                                                  std::string(file.begin(), file.end()), kCameraTestCdr));
  LiveFrame frame;
  ASSERT_EQ(camera->next(frame, 1000), Outcome::frame);
  EXPECT_EQ(cv::norm(frame.image, image, cv::NORM_L1), 0);
}

TEST_F(DdsCameraTest, NamesWhatItLeavesOut) {
  const auto camera = open("/camera/image_raw");
  const cv::Mat image(64, 96, CV_8UC1, cv::Scalar(9));
  std::string odd = io::write_image(now(), image, kCameraTestCdr);
  odd.replace(odd.find("mono8"), 5, "mono7");
  std::string cut = io::write_image(now(), image, kCameraTestCdr);
  cut.resize(cut.size() / 2);
  const struct {
    std::string message, named;
  } cases[] = {
      {odd, "found the encoding \"mono7\""},
      {cut, "the message ends within its fields"},
      {"", "the message ends within its fields"},
      {io::write_image(now(), cv::Mat(48, 64, CV_8UC1, cv::Scalar(0)), kCameraTestCdr),
       "found 64 x 48 pixels, expected the calibration's 96 x 64"},
      {io::write_image(now(), cv::Mat(64, 96, CV_16UC1, cv::Scalar(0)), kCameraTestCdr), "found 16 bits"},
      {io::write_image({{5'000'000'000}, "front"}, image, kCameraTestCdr), "not of this machine's clock"},
  };
  LiveFrame frame;
  std::size_t count = 0;
  for (const auto& c : cases) {
    network_.topics.give("/camera/image_raw", c.message);
    EXPECT_EQ(camera->next(frame, 1000), Outcome::nothing) << c.named;
    EXPECT_THAT(camera->remark(), HasSubstr("/camera/image_raw: "));
    EXPECT_THAT(camera->remark(), HasSubstr(c.named));
    EXPECT_THAT(camera->remark(), HasSubstr(fmt::format("{} images left out", ++count)));
  }
  network_.topics.give("/camera/image_raw", io::write_image(now(), image, kCameraTestCdr));
  EXPECT_EQ(camera->next(frame, 1000), Outcome::frame) << "one that is good is taken again";
}

TEST_F(DdsCameraTest, TheLensComesFromItsTopicOrIsSaidToBeMissing) {
  Camera camera = small_camera();
  camera.distortion = Distortion::plumb_bob;
  camera.coefficients[0] = -0.1;
  network_.topics.give("/lens", io::write_camera_info(now(), camera, kCameraTestCdr));
  const auto told = await_camera_info(network_, "/lens", "/camera/image_raw", 5);
  ASSERT_TRUE(told.ok()) << told.error().message;
  EXPECT_EQ(told->fx, camera.fx);
  EXPECT_EQ(told->coefficients[0], -0.1);
  network_.topics.give("/lens", io::write_camera_info(now(), camera, kCameraTestCdr));
  const auto rectified = await_camera_info(network_, "/lens", "/camera/image_rect", 5);
  ASSERT_TRUE(rectified.ok());
  EXPECT_EQ(rectified->distortion, Distortion::none);
  const auto none = await_camera_info(network_, "/lens", "/camera/image_raw", 0);
  ASSERT_FALSE(none.ok());
  EXPECT_THAT(none.error().message, HasSubstr("dds.camera_info: nobody publishes it"));
  camera.fx = 0;
  network_.topics.give("/lens", io::write_camera_info(now(), camera, kCameraTestCdr));
  EXPECT_THAT(await_camera_info(network_, "/lens", "/camera/image_raw", 5).error().message,
              HasSubstr("/lens: found the focal lengths 0"));
}

TEST(DdsConfig, RefusesByNameWhatDoesNotGoTogether) {
  LiveOptions options;
  EXPECT_TRUE(check(options).ok());
  options.dds.poses = "/odometry";
  EXPECT_THAT(check(options).error().message, HasSubstr("dds: found options, but nothing uses them"));
  options.dds.publish = true;
  EXPECT_TRUE(check(options).ok());
  options.link.port = "none";
  EXPECT_THAT(check(options).error().message, HasSubstr("link.port: found none with link.poses: estimate"));
  options.link.poses = PoseMessages::dds;
  EXPECT_TRUE(check(options).ok());
  options.camera.kind = CameraKind::dds;
  EXPECT_TRUE(check(options).ok()) << "/dev/video0 is a name that a topic can have";
  options.camera.path = "image_raw";
  EXPECT_THAT(check(options).error().message, HasSubstr("camera.path: found \"image_raw\""));
}

}  // namespace
}  // namespace pade::live
