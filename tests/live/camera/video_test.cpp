// Video files and streams that another program has made.
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/live/camera/folder_source.hpp"
#include "pade/live/camera/video_clock.hpp"
#include "pade/live/camera/video_source.hpp"

#include "support/temporary_folder.hpp"

extern char** environ;

namespace pade::live {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kWidth = 160, kHeight = 96;
constexpr double kRate = 25;

Camera video_camera() {
  Camera camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = camera.fy = 100;
  camera.cx = 79.5;
  camera.cy = 47.5;
  return camera;
}

bool runs(const std::string& command) { return std::system(command.c_str()) == 0; }

/// Bars of grey, by which a frame tells its number: eight bits, black or white.
void write_raw(const fs::path& file, int frames) {
  std::ofstream out(file, std::ios::binary);
  for (int i = 0; i < frames; ++i) {
    cv::Mat image(kHeight, kWidth, CV_8UC1);
    for (int bit = 0; bit < 8; ++bit)
      image.colRange(bit * kWidth / 8, (bit + 1) * kWidth / 8).setTo((i >> bit & 1) != 0 ? 220 : 30);
    out.write(reinterpret_cast<const char*>(image.data), static_cast<std::streamsize>(image.total()));
  }
}

int number_of(const cv::Mat& image) {
  int number = 0;
  for (int bit = 0; bit < 8; ++bit) {
    const cv::Rect inside(bit * kWidth / 8 + 4, 20, kWidth / 8 - 8, 40);
    if (cv::mean(image(inside))[0] > 125) number |= 1 << bit;
  }
  return number;
}

class VideoTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!runs("ffmpeg -version > /dev/null 2>&1")) GTEST_SKIP() << "ffmpeg is missing";
    const auto opened = open_video((folder_ / "none.mp4").string(), video_camera());
    ASSERT_FALSE(opened);
    if (opened.error().message.find("module for videos") != std::string::npos)
      GTEST_SKIP() << opened.error().message;
  }
  [[nodiscard]] fs::path video(const std::string& name, int frames, const std::string& options) const {
    write_raw(folder_ / "raw", frames);
    const fs::path file = folder_ / name;
    EXPECT_TRUE(runs(
        fmt::format("ffmpeg -loglevel error -y -f rawvideo -pix_fmt gray -s {}x{} -r {} -i '{}' {} 'file:{}'",
                    kWidth, kHeight, kRate, (folder_ / "raw").string(), options, file.string())));
    return file;
  }
  /// Numbers and times, to the end.
  static std::vector<std::pair<int, double>> played(FrameSource& source) {
    std::vector<std::pair<int, double>> frames;
    Time zero;
    while (true) {
      LiveFrame frame;
      const auto outcome = source.next(frame, 50);
      if (outcome == FrameSource::Outcome::ended) return frames;
      if (outcome == FrameSource::Outcome::nothing) continue;
      if (frames.empty()) zero = frame.time;
      frames.emplace_back(number_of(frame.image), seconds_between(zero, frame.time));
      EXPECT_EQ(frame.image.size(), cv::Size(kWidth, kHeight));
      EXPECT_GE(seconds_between(frame.time, now_of_ours()), 0);
    }
  }
  test::TemporaryFolder folder_;
};

TEST_F(VideoTest, EveryFrameOfAFileComesOnceAtItsTime) {
  const std::vector<std::pair<std::string, std::string>> kinds = {{"a.mp4", "-c:v mpeg4 -q:v 2"},
                                                                  {"a.avi", "-c:v mjpeg -q:v 2"},
                                                                  {"a.mkv", "-c:v ffv1"},
                                                                  {"b.mp4", "-c:v mpeg4 -q:v 2 -bf 2"},
                                                                  {"odd: name.mov", "-c:v mjpeg -q:v 2"}};
  for (const auto& [name, options] : kinds) {
    SCOPED_TRACE(name);
    const auto source = open_video(video(name, 12, options).string(), video_camera());
    ASSERT_TRUE(source) << source.error().message;
    const auto frames = played(**source);
    ASSERT_EQ(frames.size(), 12U);
    for (int i = 0; i < 12; ++i) {
      EXPECT_EQ(frames[static_cast<std::size_t>(i)].first, i);
      EXPECT_NEAR(frames[static_cast<std::size_t>(i)].second, i / kRate, 1.1e-3);
    }
  }
}

TEST_F(VideoTest, FramesAtUnevenTimesKeepThem) {
  const auto file =
      video("uneven.mkv", 10, "-c:v ffv1 -vsync passthrough -vf \"select=not(eq(mod(n\\,3)\\,1))\"");
  const auto source = open_video(file.string(), video_camera());
  ASSERT_TRUE(source) << source.error().message;
  const auto frames = played(**source);
  ASSERT_EQ(frames.size(), 7U);
  for (const auto& [number, time] : frames) EXPECT_NEAR(time, number / kRate, 1.1e-3) << number;
}

TEST_F(VideoTest, WhatIsNoVideoOfTheCameraIsRefused) {
  const auto message = [&](const fs::path& file, const Camera& camera = video_camera()) {
    const auto source = open_video(file.string(), camera);
    return source ? std::string("opened") : source.error().message;
  };
  EXPECT_THAT(message(folder_ / "none.mp4"), HasSubstr("none.mp4: No such file"));
  std::ofstream(folder_ / "text.mp4") << std::string(5000, 'x');
  EXPECT_THAT(message(folder_ / "text.mp4"), HasSubstr("expected a video"));
  std::ofstream(folder_ / "empty.mp4").flush();
  EXPECT_THAT(message(folder_ / "empty.mp4"), HasSubstr("expected a video"));
  ASSERT_TRUE(runs(
      fmt::format("ffmpeg -loglevel error -y -f lavfi -i sine=d=1 '{}'", (folder_ / "sound.wav").string())));
  EXPECT_THAT(message(folder_ / "sound.wav"), HasSubstr("found no pictures"));
  Camera other = video_camera();
  other.width = 320;
  EXPECT_THAT(message(video("a.mp4", 3, "-c:v mpeg4"), other),
              HasSubstr("gives 160 x 96, expected the calibration's 320 x 96"));
  other.width = 0;
  EXPECT_THAT(message(folder_ / "a.mp4", other), HasSubstr("expected width and height"));
}

/// Cut off and flipped anywhere: it ends, and what comes before that is in order.
TEST_F(VideoTest, DamagedFilesEnd) {
  const fs::path whole = video("whole.avi", 40, "-c:v mjpeg -q:v 2");
  std::ifstream in(whole, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  std::mt19937 random(5);
  for (int round = 0; round < 12; ++round) {
    std::string damaged = bytes.substr(0, round % 2 == 0 ? bytes.size() : random() % bytes.size());
    for (std::size_t i = 0; i < damaged.size() / 300; ++i)
      damaged[random() % damaged.size()] = static_cast<char>(random());
    std::ofstream(folder_ / "damaged.avi", std::ios::binary) << damaged;
    const auto source = open_video((folder_ / "damaged.avi").string(), video_camera());
    if (!source) continue;
    double last = -1;
    for (const auto& [number, time] : played(**source)) {
      EXPECT_GT(time, last);
      last = time;
    }
  }
}

TEST_F(VideoTest, BecomesAFolderOfImages) {
  const fs::path file = video("flight.avi", 12, "-c:v mjpeg -q:v 2");
  std::ofstream(folder_ / "lens.yaml")
      << "width: 160\nheight: 96\nfx: 100\nfy: 100\ncx: 79.5\ncy: 47.5\ndistortion_model: none\n";
  const auto convert = [&](const std::string& options) {
    return runs(fmt::format("{} convert '{}' '{}' {} > '{}' 2>&1", PADE_PROGRAM, file.string(),
                            (folder_ / "out").string(), options, (folder_ / "said").string()));
  };
  const auto said = [&] {
    std::ifstream in(folder_ / "said");
    return std::string((std::istreambuf_iterator<char>(in)), {});
  };
  const std::string lens = fmt::format("--calibration '{}'", (folder_ / "lens.yaml").string());
  EXPECT_FALSE(convert(""));
  EXPECT_THAT(said(), HasSubstr("expected --calibration FILE"));
  EXPECT_FALSE(convert(lens + " --poses original"));
  EXPECT_THAT(said(), HasSubstr("--poses"));
  EXPECT_FALSE(convert(lens + " --start noon"));
  EXPECT_THAT(said(), HasSubstr("found \"noon\""));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  ASSERT_TRUE(convert(lens + " --start 100.5")) << said();
  EXPECT_THAT(said(), HasSubstr("12 images of 0.44 s"));
  for (int i = 0; i < 12; ++i) {
    const fs::path image = folder_ / "out" / "rgb" / fmt::format("{:.6f}.png", 100.5 + i / kRate);
    const auto read = io::load_image(image, io::Pixels::grey);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(number_of(*read), i);
  }
  EXPECT_FALSE(convert(lens));
  EXPECT_TRUE(convert(lens + " --force")) << said();
  EXPECT_TRUE(fs::exists(folder_ / "out" / "rgb" / "0.000000.png"));
}

/// Sends a file in real time to whoever connects, once.
class Sender {
 public:
  Sender(const fs::path& file, int port) {
    const std::string name = file.string();
    const std::string address = fmt::format("tcp://127.0.0.1:{}?listen=1", port);
    std::vector<std::string> words = {"ffmpeg", "-loglevel", "quiet", "-re",    "-i",   name,
                                      "-c",     "copy",      "-f",    "mpegts", address};
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    EXPECT_EQ(::posix_spawnp(&process_, "ffmpeg", &actions, nullptr, arguments.data(), environ), 0);
    ::posix_spawn_file_actions_destroy(&actions);
  }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;
  ~Sender() {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }

 private:
  pid_t process_ = 0;
};

TEST_F(VideoTest, AStreamComesInItsOwnTimeAndComesBack) {
  constexpr int kPort = 24'751;
  const fs::path file = video("stream.ts", 250, "-c:v mpeg2video -q:v 2 -g 5 -f mpegts");
  const auto source = open_video(fmt::format("tcp://127.0.0.1:{}", kPort), video_camera());
  ASSERT_TRUE(source) << source.error().message;  // nobody sends yet
  LiveFrame frame;
  EXPECT_EQ((*source)->next(frame, 50), FrameSource::Outcome::nothing);
  for (int round = 0; round < 2; ++round) {
    const Sender sender(file, kPort);
    std::vector<std::pair<int, Time>> frames;
    const Time start = now_of_ours();
    while (frames.size() < 20 && seconds_between(start, now_of_ours()) < 30) {
      if ((*source)->next(frame, 50) != FrameSource::Outcome::frame) continue;
      if (!frames.empty() && number_of(frame.image) < frames.back().first)
        frames.clear();  // waited from before
      frames.emplace_back(number_of(frame.image), frame.time);
      EXPECT_GE(seconds_between(frame.time, now_of_ours()), 0);
    }
    ASSERT_EQ(frames.size(), 20U);
    EXPECT_EQ((*source)->remark(), "");
    for (std::size_t i = 1; i < frames.size(); ++i) {
      const int steps = frames[i].first - frames[i - 1].first;
      const double apart = seconds_between(frames[i - 1].second, frames[i].second);
      EXPECT_GT(steps, 0);
      EXPECT_GT(apart, 0);
      // Where a frame is less late than all before it, it is less long after the one before.
      EXPECT_LE(apart, steps / kRate + 1e-3);
    }
  }
  const Time start = now_of_ours();
  while ((*source)->remark().empty() && seconds_between(start, now_of_ours()) < 30)
    (*source)->next(frame, 50);
  EXPECT_NE((*source)->remark(), "");
}

TEST(Video, AddressesAreStreams) {
  EXPECT_TRUE(is_stream("rtsp://192.168.0.10/main"));
  EXPECT_FALSE(is_stream("/home/me/flight.mp4"));
  EXPECT_FALSE(is_stream("a:b.mp4"));
}

/// Delays of 40 ms and an exponential jitter of 15 ms: the stamps are late by the least delay, to within the
/// jitter's share, and evenly spaced.
TEST(VideoClock, TheLeastDelayIsTheClock) {
  for (const double drift : {-5e-5, 0.0, 5e-5}) {
    std::mt19937 random(3);
    std::exponential_distribution<double> jitter(1 / 0.015);
    VideoClock clock;
    int given = 0;
    double worst = 0;
    for (int i = 0; i < 60 * 25; ++i) {
      const double exposure = 1e6 + i / 25.0;
      const double arrived = exposure + 0.04 + jitter(random);
      const auto time = clock.time_of(i / 25.0 * (1 + drift) + 77, Time::from_seconds(arrived));
      if (!time) continue;
      ++given;
      EXPECT_LE(time->seconds(), arrived + 1e-6);
      if (i > 250) worst = std::max(worst, std::abs(time->seconds() - exposure - 0.04));
    }
    EXPECT_GE(given, 60 * 25 - 27);
    EXPECT_LT(worst, 0.006) << drift;
  }
}

TEST(VideoClock, AStampThatJumpsBeginsAnew) {
  VideoClock clock;
  const auto at = [&](double stamp, double arrived) {
    return clock.time_of(stamp, Time::from_seconds(arrived));
  };
  for (int i = 0; i < 50; ++i) at(i / 25.0, 100 + i / 25.0);
  ASSERT_TRUE(at(2, 102));
  EXPECT_FALSE(at(500, 102.04));
  for (int i = 1; i < 30; ++i) at(500 + i / 25.0, 102.04 + i / 25.0);
  const auto time = at(501.2, 103.24);
  ASSERT_TRUE(time);
  EXPECT_NEAR(time->seconds(), 103.24, 1e-3);
}

}  // namespace
}  // namespace pade::live
