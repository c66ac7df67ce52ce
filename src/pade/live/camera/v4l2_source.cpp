#include "pade/live/camera/v4l2_source.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <opencv2/imgproc.hpp>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/live/camera/folder_source.hpp"

namespace pade::live {
namespace {

constexpr std::array<std::uint32_t, 3> kFormats = {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};
constexpr std::uint32_t kBuffers = 4;

int ask(int device, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(device, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

/// The device while it is open: buffers shared with the driver, and the stream.
class Device {
 public:
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  ~Device() {
    if (number_ < 0) return;
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    ask(number_, VIDIOC_STREAMOFF, &type);
    for (const auto& [start, length] : buffers_) ::munmap(start, length);
    ::close(number_);
  }

  static Result<std::unique_ptr<Device>> open(const std::string& name, const Camera& camera, double rate) {
    std::unique_ptr<Device> device(new Device);
    device->number_ = ::open(name.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (device->number_ < 0)
      return Error{fmt::format("{}: {}, expected a camera", name, std::strerror(errno))};
    if (const Status status = device->set_format(name, camera); !status) return status.error();
    device->set_rate(rate);
    if (const Status status = device->start(name); !status) return status.error();
    return device;
  }

  /// False if nothing came in time or what came cannot be used; `lost` if the device is gone.
  bool next(LiveFrame& frame, int milliseconds, bool& lost) {
    pollfd asked{number_, POLLIN, 0};
    const int ready = ::poll(&asked, 1, milliseconds);
    if (ready <= 0) return false;
    if ((asked.revents & POLLIN) == 0) {  // an error that lasts: poll() would come back at once, for ever
      ::poll(nullptr, 0, milliseconds);
    }
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (ask(number_, VIDIOC_DQBUF, &buffer) < 0) {
      lost = errno != EAGAIN && errno != EIO;
      return false;
    }
    const bool good = take(buffer, frame);
    lost = ask(number_, VIDIOC_QBUF, &buffer) < 0;
    return good;
  }

  /// Frames so far whose stamps were not of the monotonic clock.
  [[nodiscard]] std::size_t of_other_clock() const { return of_other_clock_; }

 private:
  Device() = default;

  Status set_format(const std::string& name, const Camera& camera) {
    v4l2_capability capability{};
    if (ask(number_, VIDIOC_QUERYCAP, &capability) < 0 ||
        (capability.capabilities & V4L2_CAP_STREAMING) == 0) {
      return Error{fmt::format("{}: found no camera that streams, expected one of V4L2", name)};
    }
    std::string other_size;
    for (const std::uint32_t wanted : kFormats) {
      v4l2_format format{};
      format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      format.fmt.pix.width = static_cast<std::uint32_t>(camera.width);
      format.fmt.pix.height = static_cast<std::uint32_t>(camera.height);
      format.fmt.pix.pixelformat = wanted;
      format.fmt.pix.field = V4L2_FIELD_NONE;
      if (ask(number_, VIDIOC_S_FMT, &format) < 0) {
        if (errno == EBUSY) return Error{fmt::format("{}: is in use by another program", name)};
        continue;
      }
      format_ = format.fmt.pix;
      if (format_.pixelformat != wanted) continue;
      const bool size = format_.width == static_cast<std::uint32_t>(camera.width) &&
                        format_.height == static_cast<std::uint32_t>(camera.height);
      if (size) return {};
      // Cameras have sizes compressed that a bus is too slow for otherwise.
      other_size = fmt::format("{}: gives {} x {}, expected the calibration's {} x {}", name, format_.width,
                               format_.height, camera.width, camera.height);
    }
    if (!other_size.empty()) return Error{other_size};
    return Error{fmt::format("{}: gives none of the formats GREY, YUYV and MJPEG", name)};
  }

  /// Not every device can: the rate is then what it is.
  void set_rate(double rate) const {
    v4l2_streamparm parameters{};
    parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    parameters.parm.capture.timeperframe.numerator = 1000;
    parameters.parm.capture.timeperframe.denominator = static_cast<std::uint32_t>(std::lround(1000 * rate));
    ask(number_, VIDIOC_S_PARM, &parameters);
  }

  Status start(const std::string& name) {
    v4l2_requestbuffers request{};
    request.count = kBuffers;
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    const auto failed = [&] {
      return Error{fmt::format("{}: {}, expected buffers that are shared", name, std::strerror(errno))};
    };
    if (ask(number_, VIDIOC_REQBUFS, &request) < 0) return failed();
    for (std::uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer buffer{};
      buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
      buffer.memory = V4L2_MEMORY_MMAP;
      buffer.index = i;
      if (ask(number_, VIDIOC_QUERYBUF, &buffer) < 0) return failed();
      void* const start =
          ::mmap(nullptr, buffer.length, PROT_READ, MAP_SHARED, number_, static_cast<off_t>(buffer.m.offset));
      if (start == MAP_FAILED) return failed();
      buffers_.emplace_back(start, buffer.length);
      if (ask(number_, VIDIOC_QBUF, &buffer) < 0) return failed();
    }
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (ask(number_, VIDIOC_STREAMON, &type) < 0) return failed();
    return {};
  }

  [[nodiscard]] static cv::Mat decoded(void* start, std::size_t bytes) {
    auto image = io::decode_image({static_cast<const std::uint8_t*>(start), bytes}, io::Pixels::colour);
    return image ? std::move(*image) : cv::Mat();
  }

  [[nodiscard]] bool take(const v4l2_buffer& buffer, LiveFrame& frame) {
    const bool monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || buffer.index >= buffers_.size()) return false;
    frame.time = {static_cast<std::int64_t>(buffer.timestamp.tv_sec) * 1'000'000'000 +
                  static_cast<std::int64_t>(buffer.timestamp.tv_usec) * 1000};
    constexpr double kFarthest = 1;  // s
    if (!monotonic || std::abs(seconds_between(frame.time, now_of_ours())) > kFarthest) {
      ++of_other_clock_;
      return false;
    }
    const int width = static_cast<int>(format_.width);
    const int height = static_cast<int>(format_.height);
    const std::size_t bytes = buffer.bytesused;
    void* const start = buffers_[buffer.index].first;
    if (bytes > buffers_[buffer.index].second) return false;
    if (format_.pixelformat == V4L2_PIX_FMT_MJPEG) {
      frame.image = decoded(start, bytes);
      return frame.image.cols == width && frame.image.rows == height;
    }
    const bool grey = format_.pixelformat == V4L2_PIX_FMT_GREY;
    const std::size_t row = std::max<std::size_t>(format_.bytesperline, format_.width * (grey ? 1U : 2U));
    if (bytes < row * static_cast<std::size_t>(height - 1) + format_.width * (grey ? 1U : 2U)) return false;
    const cv::Mat shared(height, width, grey ? CV_8UC1 : CV_8UC2, start, row);
    if (grey) {
      frame.image = shared.clone();
    } else {
      cv::cvtColor(shared, frame.image, cv::COLOR_YUV2BGR_YUYV);
    }
    return true;
  }

  int number_ = -1;
  std::size_t of_other_clock_ = 0;
  v4l2_pix_format format_{};
  std::vector<std::pair<void*, std::size_t>> buffers_;
};

class V4l2Source : public FrameSource {
 public:
  V4l2Source(std::unique_ptr<Device> device, std::string name, const Camera& camera, double rate)
      : device_(std::move(device)),
        name_(std::move(name)),
        calibrated_(camera),
        rate_(rate),
        ideal_(camera.undistorted()),
        undistort_(camera) {}

  Outcome next(LiveFrame& frame, int milliseconds) override {
    if (!device_ && !reopen(milliseconds)) return Outcome::nothing;
    bool lost = false;
    const std::size_t before = device_->of_other_clock();
    const bool come = device_->next(frame, milliseconds, lost);
    const bool refused = device_->of_other_clock() != before;
    const auto now = std::chrono::steady_clock::now();
    if (come || refused) {
      come_ = now;
      other_clock_ = refused;
    }
    // Cameras on USB that hang come back when they are opened again; one whose stamps are of no use does not
    // hang.
    constexpr auto kPatience = std::chrono::seconds(1);
    const bool hangs = now - std::max(come_, tried_) > kPatience;
    if (lost || hangs) {
      device_.reset();
    }
    if (!come) return Outcome::nothing;
    frame.image = undistort_(frame.image);
    return Outcome::frame;
  }
  [[nodiscard]] const Camera& camera() const override { return ideal_; }
  [[nodiscard]] cv::Mat mask() const override { return undistort_.valid(); }
  [[nodiscard]] std::string remark() const override {
    if (other_clock_) return "its stamps are not of the monotonic clock";
    return device_ ? std::string() : std::string("it cannot be opened");
  }

 private:
  bool reopen(int milliseconds) {
    constexpr auto kPause = std::chrono::milliseconds(500);
    const auto now = std::chrono::steady_clock::now();
    if (now - tried_ < kPause) {
      ::poll(nullptr, 0, milliseconds);
      return false;
    }
    tried_ = now;
    auto device = Device::open(name_, calibrated_, rate_);
    if (device) device_ = std::move(*device);
    return device.ok();
  }

  std::unique_ptr<Device> device_;
  std::string name_;
  Camera calibrated_;
  double rate_;
  Camera ideal_;
  Undistorter undistort_;
  bool other_clock_ = false;
  std::chrono::steady_clock::time_point tried_ = std::chrono::steady_clock::now();  // to open it, last
  std::chrono::steady_clock::time_point come_ = tried_;                             // the last frame
};

}  // namespace

Result<std::unique_ptr<FrameSource>> open_v4l2(const std::string& device, const Camera& camera, double rate) {
  if (camera.width <= 0 || camera.height <= 0) {
    return Error{fmt::format("{}: the calibration states no image size, expected width and height", device)};
  }
  auto opened = Device::open(device, camera, rate);
  if (!opened) return opened.error();
  return std::unique_ptr<FrameSource>(std::make_unique<V4l2Source>(std::move(*opened), device, camera, rate));
}

}  // namespace pade::live
