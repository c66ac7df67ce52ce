#include "pade/live/dds/dds_camera.hpp"

#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>

#include "pade/io/recording/messages/image_messages.hpp"
#include "pade/io/recording/messages/messages.hpp"
#include "pade/live/camera/folder_source.hpp"

namespace pade::live {
namespace {

constexpr auto kCameraCdr = io::MessageEncoding::cdr;

/// An image with its stamp.
struct StampedPixels {
  io::MessageHeader header;
  cv::Mat pixels;
};

class DdsCamera : public FrameSource {
 public:
  DdsCamera(std::unique_ptr<TopicReader> reader, DdsShared& shared, std::string topic, const Camera& camera)
      : reader_(std::move(reader)),
        shared_(shared),
        topic_(std::move(topic)),
        compressed_(topic_.ends_with("/compressed")),
        lens_(camera),
        ideal_(camera.undistorted()),
        undistort_(camera) {}

  Outcome next(LiveFrame& frame, int milliseconds) override {
    const Outcome outcome = await(frame, milliseconds);
    // Who asks the network why nothing comes need not do so each time.
    constexpr double kPause = 0.5;  // s
    const Time now = now_of_ours();
    if (seconds_between(said_, now) > kPause) {
      said_ = now;
      shared_.no_image.set(remark());
    }
    return outcome;
  }

  [[nodiscard]] const Camera& camera() const override { return ideal_; }
  [[nodiscard]] cv::Mat mask() const override { return undistort_.valid(); }
  [[nodiscard]] std::string remark() const override {
    std::string text = problem_.empty() ? reader_->remark() : fmt::format("{}: {}", topic_, problem_);
    if (refused_ > 0) text += fmt::format("{}{} images left out", text.empty() ? "" : "; ", refused_);
    return text;
  }
  [[nodiscard]] double behind() const override { return shared_.clock.behind(); }

 private:
  Outcome await(LiveFrame& frame, int milliseconds) {
    reader_->wait(milliseconds);
    // Of several that wait the newest counts: the mapper would drop the others.
    std::string message;
    bool come = false;
    while (reader_->take(message)) come = true;
    if (!come) return Outcome::nothing;
    auto image = decoded(message);
    if (!image) return refuse(image.error().message);
    const auto time = shared_.clock.to_ours(image->header.stamp);
    if (!time)
      return refuse(
          "its stamps are not of this machine's clock (dds.clock: played is for a recording; clocks of two "
          "machines have to be synchronised)");
    if (*time <= last_ && seconds_between(*time, last_) < 1)
      return refuse(
          fmt::format("the stamp {} is not later than the one before", to_string(image->header.stamp)));
    last_ = *time;
    shared_.names.set_camera(image->header.frame);
    frame = {undistort_(image->pixels), *time};
    problem_.clear();
    return Outcome::frame;
  }

  Outcome refuse(std::string why) {
    problem_ = std::move(why);
    ++refused_;
    return Outcome::nothing;
  }

  [[nodiscard]] Result<StampedPixels> decoded(const std::string& message) const {
    StampedPixels image;
    if (compressed_) {
      const auto read = io::read_compressed_image(message, kCameraCdr);
      if (!read) return read.error();
      auto pixels = io::pixels_of(*read);
      if (!pixels) return pixels.error();
      image = {read->header, std::move(*pixels)};
    } else {
      const auto read = io::read_image_message(message, kCameraCdr);
      if (!read) return read.error();
      auto pixels = io::pixels_of(*read);
      if (!pixels) return pixels.error();
      image = {read->header, std::move(*pixels)};
    }
    if (image.pixels.depth() != CV_8U)
      return Error{fmt::format("found {} bits for a colour, expected 8", 8 * image.pixels.elemSize1())};
    if (image.pixels.cols != lens_.width || image.pixels.rows != lens_.height)
      return Error{fmt::format("found {} x {} pixels, expected the calibration's {} x {}", image.pixels.cols,
                               image.pixels.rows, lens_.width, lens_.height)};
    return image;
  }

  std::unique_ptr<TopicReader> reader_;
  DdsShared& shared_;
  std::string topic_;
  bool compressed_;
  Camera lens_, ideal_;
  Undistorter undistort_;
  Time last_, said_;
  std::string problem_;
  std::size_t refused_ = 0;
};

}  // namespace

Result<Camera> await_camera_info(DdsNetwork& network, const std::string& topic, const std::string& images,
                                 double patience) {
  auto reader = network.reader(topic, "sensor_msgs/CameraInfo", 1);
  if (!reader) return reader.error();
  const Time begun = now_of_ours();
  std::string message;
  while (!(*reader)->take(message)) {
    constexpr int kRound = 50;  // ms
    if (seconds_between(begun, now_of_ours()) > patience) {
      std::string why = (*reader)->remark();
      if (why.empty()) why = fmt::format("{} is published, but nothing came", topic);
      return Error{fmt::format(
          "dds.camera_info: {} ({:.0f} s), expected sensor_msgs/CameraInfo, or the file camera.calibration",
          why, patience)};
    }
    (*reader)->wait(kRound);
  }
  const auto info = io::read_camera_info(message, kCameraCdr);
  if (!info) return Error{fmt::format("{}: {}", topic, info.error().message)};
  auto camera = io::camera_of(*info, io::is_rectified(images));
  if (!camera) return Error{fmt::format("{}: {}", topic, camera.error().message)};
  return camera;
}

Result<std::unique_ptr<FrameSource>> open_dds_camera(DdsNetwork& network, DdsShared& shared,
                                                     const std::string& topic, const Camera& camera) {
  if (camera.width <= 0 || camera.height <= 0)
    return Error{fmt::format("{}: the calibration states no image size, expected width and height", topic)};
  constexpr int kKept = 5;
  const bool compressed = topic.ends_with("/compressed");
  auto reader =
      network.reader(topic, compressed ? "sensor_msgs/CompressedImage" : "sensor_msgs/Image", kKept);
  if (!reader) return reader.error();
  return std::unique_ptr<FrameSource>(std::make_unique<DdsCamera>(std::move(*reader), shared, topic, camera));
}

}  // namespace pade::live
