// A camera of the kernel that is none: the calls that would reach the driver end here, in this program, which
// has them under their own names. A timer stands for the device, so that waiting for frames is real.
#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstring>
#include <deque>
#include <string>
#include <vector>

#include <dlfcn.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/live/camera/folder_source.hpp"
#include "pade/live/camera/v4l2_source.hpp"

namespace {

constexpr const char* kName = "/dev/video-of-the-tests";
constexpr std::uint32_t kWidth = 64, kHeight = 48;
constexpr std::size_t kLength = 64UL * 48 * 2;

/// The device, and what goes wrong with it.
struct FakeDevice {
  int number = -1;
  std::uint32_t format = V4L2_PIX_FMT_GREY;  ///< the only one that it has
  std::uint32_t small_format = 0;            ///< another one, of half the size
  int opened = 0;                            ///< so often
  std::uint32_t width = kWidth;
  bool present = true, stalled = false, faulty = false, short_of_bytes = false, without_stamps = false;
  bool without_bytes = false, with_garbage = false;  ///< MJPEG of a camera on a busy bus
  bool broken = false;                               ///< errs for ever, until it is opened again
  bool hung = false;                                 ///< gives nothing, until it is opened again
  bool of_other_clock = false;
  std::vector<std::vector<std::uint8_t>> buffers;
  std::deque<std::uint32_t> queued;
  std::int64_t frames = 0;

  void fill(std::vector<std::uint8_t>& buffer, std::uint32_t& used) const {
    used = kWidth * kHeight;
    if (format == V4L2_PIX_FMT_GREY)
      std::fill(buffer.begin(), buffer.end(), static_cast<std::uint8_t>(frames));
    if (format == V4L2_PIX_FMT_YUYV) {
      used = 2 * kWidth * kHeight;
      for (std::size_t i = 0; i < used; ++i) buffer[i] = i % 2 == 0 ? 200 : 128;
    }
    if (format == V4L2_PIX_FMT_MJPEG) {
      const auto jpeg = pade::io::encode_jpeg(cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(10, 20, 200)));
      std::copy(jpeg.begin(), jpeg.end(), buffer.begin());
      used = static_cast<std::uint32_t>(jpeg.size());
    }
    if (short_of_bytes) used /= 2;
    if (without_bytes) used = 0;
    if (with_garbage) std::fill_n(buffer.begin() + 2, used - 2, std::uint8_t{0xA5});
  }
  int dequeue(v4l2_buffer& buffer) {
    if (!present) return errno = ENODEV, -1;
    if (broken) return errno = EIO, -1;
    std::uint64_t ticks = 0;
    if (::read(number, &ticks, sizeof(ticks)) < 0 || stalled || hung || queued.empty())
      return errno = EAGAIN, -1;
    buffer.index = queued.front();
    queued.pop_front();
    ++frames;
    fill(buffers[buffer.index], buffer.bytesused);
    buffer.flags = without_stamps ? V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN
                                  : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    if (faulty) buffer.flags |= V4L2_BUF_FLAG_ERROR;
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    buffer.timestamp = {now.tv_sec + (of_other_clock ? 1'000'000 : 0), now.tv_nsec / 1000};
    return 0;
  }
  int control(unsigned long request, void* argument) {
    if (!present) return errno = ENODEV, -1;
    switch (request) {
      case VIDIOC_QUERYCAP:
        static_cast<v4l2_capability*>(argument)->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
        return 0;
      case VIDIOC_S_FMT: {
        auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
        const bool small = small_format != 0 && pix.pixelformat == small_format;
        pix.pixelformat = small ? small_format : format;
        pix.width = small ? width / 2 : width;
        pix.bytesperline = 0;
        return 0;
      }
      case VIDIOC_REQBUFS: {
        auto& wanted = *static_cast<v4l2_requestbuffers*>(argument);
        wanted.count = std::min(wanted.count, 3U);
        buffers.assign(wanted.count, std::vector<std::uint8_t>(kLength));
        queued.clear();
        return 0;
      }
      case VIDIOC_QUERYBUF: {
        auto& buffer = *static_cast<v4l2_buffer*>(argument);
        buffer.length = kLength;
        buffer.m.offset = buffer.index * 4096;
        return 0;
      }
      case VIDIOC_QBUF:
        queued.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_DQBUF:
        return dequeue(*static_cast<v4l2_buffer*>(argument));
      default:
        return 0;
    }
  }
};

FakeDevice& device() {
  static FakeDevice the_device;
  return the_device;
}

template <class Function>
Function real(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  if (std::strcmp(path, kName) == 0) {
    if (!device().present) return errno = ENOENT, -1;
    device().broken = device().hung = false;
    ++device().opened;
    device().number = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK);
    const itimerspec each{{0, 10'000'000}, {0, 10'000'000}};
    ::timerfd_settime(device().number, 0, &each, nullptr);
    return device().number;
  }
  va_list rest;
  va_start(rest, flags);
  const int mode = (flags & O_CREAT) != 0 ? va_arg(rest, int) : 0;
  va_end(rest);
  return real<int (*)(const char*, int, ...)>("open")(path, flags, mode);
}

int ioctl(int number, unsigned long request, ...) noexcept {
  va_list rest;
  va_start(rest, request);
  void* const argument = va_arg(rest, void*);
  va_end(rest);
  if (number == device().number) return device().control(request, argument);
  return real<int (*)(int, unsigned long, ...)>("ioctl")(number, request, argument);
}

void* mmap(void* start, std::size_t length, int protection, int flags, int number, off_t offset) noexcept {
  if (number >= 0 && number == device().number) {
    return device().buffers[static_cast<std::size_t>(offset / 4096)].data();
  }
  return real<void* (*)(void*, std::size_t, int, int, int, off_t)>("mmap")(start, length, protection, flags,
                                                                           number, offset);
}

int munmap(void* start, std::size_t length) noexcept {
  for (const auto& buffer : device().buffers) {
    if (start == buffer.data()) return 0;
  }
  return real<int (*)(void*, std::size_t)>("munmap")(start, length);
}
}

namespace pade::live {
namespace {

using ::testing::HasSubstr;
using Outcome = FrameSource::Outcome;

Camera camera_of_the_tests() {
  Camera camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = camera.fy = 50;
  camera.cx = 31.5;
  camera.cy = 23.5;
  return camera;
}

class V4l2 : public testing::Test {
 protected:
  void SetUp() override { device() = FakeDevice(); }
  static Result<std::unique_ptr<FrameSource>> opened() { return open_v4l2(kName, camera_of_the_tests(), 30); }
  /// The next frame, asked for as long as `rounds` times 20 ms.
  static bool frame_within(FrameSource& source, LiveFrame& frame, int rounds) {
    for (int i = 0; i < rounds; ++i) {
      if (source.next(frame, 20) == Outcome::frame) return true;
    }
    return false;
  }
};

TEST_F(V4l2, DeliversFramesWithTheTimesOfTheDriver) {
  const auto source = opened();
  ASSERT_TRUE(source) << source.error().message;
  Time last{};
  for (int i = 1; i <= 20; ++i) {
    LiveFrame frame;
    ASSERT_TRUE(frame_within(**source, frame, 50));
    ASSERT_EQ(frame.image.type(), CV_8UC1);
    EXPECT_EQ(frame.image.at<std::uint8_t>(5, 5), i);  // no buffer is lost on the way round
    EXPECT_GT(frame.time, last);
    EXPECT_LE(frame.time, now_of_ours());
    EXPECT_LT(seconds_between(frame.time, now_of_ours()), 1);
    last = frame.time;
  }
}

TEST_F(V4l2, ReadsYuyvAndMjpeg) {
  for (const std::uint32_t format : {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG}) {
    device() = FakeDevice();
    device().format = format;
    const auto source = opened();
    ASSERT_TRUE(source) << source.error().message;
    LiveFrame frame;
    ASSERT_TRUE(frame_within(**source, frame, 50));
    ASSERT_EQ(frame.image.type(), CV_8UC3);
    const auto pixel = frame.image.at<cv::Vec3b>(10, 10);
    if (format == V4L2_PIX_FMT_YUYV) {
      EXPECT_NEAR(pixel[0], 214, 4);  // luma 200 of 16 to 235, no colour
      EXPECT_NEAR(pixel[2], 214, 4);
    } else {
      EXPECT_NEAR(pixel[0], 10, 6);
      EXPECT_NEAR(pixel[2], 200, 6);
    }
  }
}

TEST_F(V4l2, AStallNeverHoldsUpAndFramesThatAreFaultyAreLeftOut) {
  const auto source = opened();
  ASSERT_TRUE(source);
  LiveFrame frame;
  ASSERT_TRUE(frame_within(**source, frame, 50));
  for (bool FakeDevice::*const fault : {&FakeDevice::stalled, &FakeDevice::faulty,
                                        &FakeDevice::short_of_bytes, &FakeDevice::without_stamps}) {
    device().*fault = true;
    const Time start = now_of_ours();
    EXPECT_FALSE(frame_within(**source, frame, 5));
    EXPECT_LT(seconds_between(start, now_of_ours()), 1);
    device().*fault = false;
    EXPECT_TRUE(frame_within(**source, frame, 50));
  }
}

TEST_F(V4l2, ImagesThatCannotBeDecodedAreLeftOut) {
  device().format = V4L2_PIX_FMT_MJPEG;
  const auto source = opened();
  ASSERT_TRUE(source);
  LiveFrame frame;
  ASSERT_TRUE(frame_within(**source, frame, 50));
  for (bool FakeDevice::*const fault : {&FakeDevice::without_bytes, &FakeDevice::with_garbage}) {
    device().*fault = true;
    EXPECT_FALSE(frame_within(**source, frame, 5));
    device().*fault = false;
    EXPECT_TRUE(frame_within(**source, frame, 50));
  }
}

TEST_F(V4l2, IsOpenedAgainWhereItErrsOrHangs) {
  for (bool FakeDevice::*const fault : {&FakeDevice::broken, &FakeDevice::hung}) {
    device() = FakeDevice();
    const auto source = opened();
    ASSERT_TRUE(source);
    LiveFrame frame;
    ASSERT_TRUE(frame_within(**source, frame, 50));
    device().*fault = true;
    const Time start = now_of_ours();
    while (!frame_within(**source, frame, 1) && seconds_between(start, now_of_ours()) < 5) {
    }
    EXPECT_LT(seconds_between(start, now_of_ours()), 3);
  }
}

/// Whether the driver says so or the stamp itself. Opening it again and again would not help.
TEST_F(V4l2, StampsOfAnotherClockAreRefusedByName) {
  for (bool FakeDevice::*const fault : {&FakeDevice::of_other_clock, &FakeDevice::without_stamps}) {
    device() = FakeDevice();
    const auto source = opened();
    ASSERT_TRUE(source);
    device().*fault = true;
    LiveFrame frame;
    EXPECT_FALSE(frame_within(**source, frame, 10));
    EXPECT_THAT((*source)->remark(), HasSubstr("not of the monotonic clock"));
    Time start = now_of_ours();
    while (seconds_between(start, now_of_ours()) < 1.2) EXPECT_FALSE(frame_within(**source, frame, 1));
    EXPECT_EQ(device().opened, 1);
    // Where it hangs at last, it is opened again.
    device().hung = true;
    start = now_of_ours();
    while (device().opened == 1 && seconds_between(start, now_of_ours()) < 10)
      EXPECT_FALSE(frame_within(**source, frame, 1));
    EXPECT_EQ(device().opened, 2);
    device().*fault = false;
    EXPECT_TRUE(frame_within(**source, frame, 50));
    EXPECT_EQ((*source)->remark(), "");
  }
}

/// Many cameras on USB have their largest sizes in MJPEG alone.
TEST_F(V4l2, ASizeThatOnlyAnotherFormatHasIsFound) {
  for (const std::uint32_t small : {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_YUYV}) {
    device() = FakeDevice();
    device().format = V4L2_PIX_FMT_MJPEG;
    device().small_format = small;
    const auto source = opened();
    ASSERT_TRUE(source) << source.error().message;
    LiveFrame frame;
    EXPECT_TRUE(frame_within(**source, frame, 50));
  }
  device().width = 32;
  EXPECT_THAT(opened().error().message, HasSubstr("gives 32 x 48, expected the calibration's 64 x 48"));
}

TEST_F(V4l2, IsOpenedAgainAfterItWasPulledOut) {
  const auto source = opened();
  ASSERT_TRUE(source);
  LiveFrame frame;
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(frame_within(**source, frame, 50));
    device().present = false;
    EXPECT_FALSE(frame_within(**source, frame, 10));
    device().present = true;
    const Time start = now_of_ours();
    EXPECT_TRUE(frame_within(**source, frame, 150));
    EXPECT_LT(seconds_between(start, now_of_ours()), 2);
  }
}

TEST_F(V4l2, WhatDoesNotFitIsRefused) {
  device().width = 320;
  EXPECT_THAT(opened().error().message, HasSubstr("gives 320 x 48, expected the calibration's 64 x 48"));
  device() = FakeDevice();
  device().format = V4L2_PIX_FMT_H264;
  EXPECT_THAT(opened().error().message, HasSubstr("none of the formats GREY, YUYV and MJPEG"));
  device() = FakeDevice();
  device().present = false;
  EXPECT_THAT(opened().error().message, HasSubstr("expected a camera"));
  EXPECT_THAT(open_v4l2(kName, Camera{}, 30).error().message, HasSubstr("states no image size"));
}

}  // namespace
}  // namespace pade::live
