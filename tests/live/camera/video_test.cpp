// Video files and streams that another program has made.
#include <chrono>
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
#include "pade/live/camera/video_source.hpp"

#include "support/temporary_folder.hpp"

extern char** environ;

namespace pade::live {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kWidth = 160, kHeight = 96;
constexpr double kRate = 25;

Camera video_camera(int width = kWidth, int height = kHeight) {
  Camera camera;
  camera.width = width;
  camera.height = height;
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
  /// Options in, file out.
  void make(const std::string& options, const fs::path& file) const {
    const std::string command = fmt::format("ffmpeg -loglevel error -y {} '{}'", options, file.string());
    ASSERT_TRUE(runs(command)) << command;
  }
  [[nodiscard]] static std::string refusal(const fs::path& file) {
    const auto source = open_video(file.string(), video_camera());
    return source ? std::string("opened") : source.error().message;
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

/// White pictures, whose rows are no multiple of what swscale writes at once.
TEST_F(VideoTest, EveryColumnOfAFrameIsWritten) {
  for (const int width : {100, 98, 102, 854, 1366}) {
    for (const std::string codec :
         {"mpeg4 -pix_fmt yuv420p", "mjpeg -pix_fmt yuvj422p", "ffv1 -pix_fmt gray"}) {
      SCOPED_TRACE(fmt::format("{} {}", width, codec));
      const fs::path file = folder_ / "white.mkv";
      make(fmt::format("-f lavfi -i color=white:s={}x66:r=25:d=0.12 -c:v {}", width, codec), file);
      const auto source = open_video(file.string(), video_camera(width, 66));
      ASSERT_TRUE(source) << source.error().message;
      LiveFrame frame;
      ASSERT_EQ((*source)->next(frame, 500), FrameSource::Outcome::frame);
      double least = 0;
      cv::minMaxLoc(frame.image.reshape(1), &least);
      EXPECT_GT(least, 240);
    }
  }
}

/// The oracle is ffmpeg, which turns pictures as players do.
TEST_F(VideoTest, PicturesThatAreToBeTurnedAre) {
  make("-f lavfi -i testsrc=s=160x96:r=25:d=0.12 -c:v mpeg4 -q:v 1", folder_ / "plain.mp4");
  for (const int angle : {0, 90, 180, 270}) {
    SCOPED_TRACE(angle);
    const fs::path file = folder_ / "turned.mp4";
    make(fmt::format("-i '{}' -c copy -metadata:s:v:0 rotate={}", (folder_ / "plain.mp4").string(), angle),
         file);
    make(fmt::format("-i '{}' -frames:v 1", file.string()), folder_ / "oracle.png");
    const auto oracle = io::load_image((folder_ / "oracle.png").string(), io::Pixels::colour);
    ASSERT_TRUE(oracle) << oracle.error().message;
    const bool upended = angle % 180 != 0;
    ASSERT_EQ(oracle->size(), upended ? cv::Size(kHeight, kWidth) : cv::Size(kWidth, kHeight));
    const auto source = open_video(file.string(), video_camera(oracle->cols, oracle->rows));
    ASSERT_TRUE(source) << source.error().message;
    LiveFrame frame;
    ASSERT_EQ((*source)->next(frame, 500), FrameSource::Outcome::frame);
    EXPECT_LT(cv::norm(frame.image, *oracle, cv::NORM_L1) / static_cast<double>(3 * oracle->total()), 3);
  }
  // By 45 degrees: the numbers of the matrix have 16 bits behind the point.
  const auto words = [](const std::vector<std::uint32_t>& numbers) {
    std::string bytes;
    for (const std::uint32_t number : numbers)
      for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>(number >> shift & 0xFFU);
    return bytes;
  };
  std::ifstream in(folder_ / "turned.mp4", std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const auto at = bytes.find(words({0, 0x00010000, 0, 0xFFFF0000, 0}));
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 20, words({0xB505, 0xB505, 0, 0xFFFF4AFB, 0xB505}));
  std::ofstream(folder_ / "aslant.mp4", std::ios::binary) << bytes;
  EXPECT_THAT(refusal(folder_ / "aslant.mp4"), HasSubstr("turned by 45 degrees, expected a multiple of 90"));
}

TEST_F(VideoTest, StampsAreNotMadeUp) {
  const fs::path file = video("flight.mjpeg", 10, "-c:v mjpeg -q:v 2");
  EXPECT_THAT(refusal(file),
              testing::AllOf(HasSubstr("has no stamps"), HasSubstr("ffmpeg -framerate RATE -i IN")));
  // What the message advises.
  make(fmt::format("-framerate 10 -i '{}' -c copy", file.string()), folder_ / "flight.mkv");
  const auto source = open_video((folder_ / "flight.mkv").string(), video_camera());
  ASSERT_TRUE(source) << source.error().message;
  const auto frames = played(**source);
  ASSERT_EQ(frames.size(), 10U);
  for (const auto& [number, time] : frames) EXPECT_NEAR(time, 0.1 * number, 1.1e-3) << number;
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
  const std::vector<std::string> others = {"groundtruth.txt", "mask.png", "imu.csv", "rgb/notes.txt"};
  for (const std::string& other : others) {
    std::ofstream(folder_ / "out" / other) << "somebody's\n";
    EXPECT_FALSE(convert(lens + " --force")) << other;
    EXPECT_THAT(said(), HasSubstr(other));
    EXPECT_TRUE(fs::remove(folder_ / "out" / other)) << other;
  }
  EXPECT_TRUE(convert(lens + " --force")) << said();
  EXPECT_TRUE(fs::exists(folder_ / "out" / "rgb" / "0.000000.png"));
}

/// Sends a file at so many times its pace to whoever connects, once.
class Sender {
 public:
  Sender(const fs::path& file, int port, const std::string& format = "mpegts",
         const std::string& pace = "1") {
    const std::string name = file.string();
    const std::string address = fmt::format("tcp://127.0.0.1:{}?listen=1", port);
    std::vector<std::string> words = {"ffmpeg", "-loglevel", "quiet", "-readrate", pace,   "-i",
                                      name,     "-c",        "copy",  "-f",        format, address};
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

/// Of a format that has no stamps; FFmpeg would make them up at 25 Hz, and it is 10 Hz.
TEST_F(VideoTest, AStreamWithoutStampsHasTheTimesOfItsArrival) {
  constexpr int kPort = 24'753;
  const fs::path file = video("stream.avi", 100, "-c:v mjpeg -q:v 2");
  const auto source = open_video(fmt::format("tcp://127.0.0.1:{}", kPort), video_camera());
  ASSERT_TRUE(source) << source.error().message;
  const Sender sender(file, kPort, "mpjpeg", "0.4");
  std::vector<std::pair<int, Time>> frames;
  const Time start = now_of_ours();
  LiveFrame frame;
  while (frames.size() < 15 && seconds_between(start, now_of_ours()) < 30)
    if ((*source)->next(frame, 50) == FrameSource::Outcome::frame)
      frames.emplace_back(number_of(frame.image), frame.time);
  ASSERT_EQ(frames.size(), 15U) << (*source)->remark();
  const int steps = frames.back().first - frames.front().first;
  EXPECT_NEAR(seconds_between(frames.front().second, frames.back().second), 0.1 * steps, 0.2);
}

TEST_F(VideoTest, AStreamSaysWhyNoFrameComes) {
  constexpr int kPort = 24'755;
  if (!runs("ffmpeg -hide_banner -encoders 2> /dev/null | grep -q libx264")) GTEST_SKIP() << "no libx264";
  // H.264 alone, without a container, says no times.
  const fs::path file = video("stream.mkv", 250, "-c:v libx264 -g 5 -bf 0 -pix_fmt yuv420p");
  const auto source = open_video(fmt::format("tcp://127.0.0.1:{}", kPort), video_camera());
  ASSERT_TRUE(source) << source.error().message;
  const Sender sender(file, kPort, "h264");
  const Time start = now_of_ours();
  LiveFrame frame;
  std::string remark;
  while (remark.find("damaged or have no stamp") == std::string::npos &&
         seconds_between(start, now_of_ours()) < 15) {
    EXPECT_EQ((*source)->next(frame, 50), FrameSource::Outcome::nothing);
    remark = (*source)->remark();
  }
  EXPECT_EQ(remark, "its frames are damaged or have no stamp");
}

/// Nobody sends: the running session says it, as --check does.
TEST_F(VideoTest, ARunningSessionSaysWhyNoFrameComes) {
  std::ofstream(folder_ / "lens.yaml")
      << "width: 160\nheight: 96\nfx: 100\nfy: 100\ncx: 79.5\ncy: 47.5\ndistortion_model: none\n";
  std::ofstream(folder_ / "live.yaml") << fmt::format(
      "camera: {{kind: video, path: \"tcp://127.0.0.1:24757\", calibration: {}}}\n"
      "link: {{port: \"udp:24758\"}}\n",
      (folder_ / "lens.yaml").string());
  const fs::path said = folder_ / "said";
  runs(fmt::format("{} live '{}' --for 1.5 > '{}' 2>&1", PADE_PROGRAM, (folder_ / "live.yaml").string(),
                   said.string()));
  std::ifstream in(said);
  EXPECT_THAT(std::string((std::istreambuf_iterator<char>(in)), {}), HasSubstr("camera: Connection refused"));
}

TEST(Video, AddressesAreStreams) {
  EXPECT_TRUE(is_stream("rtsp://192.168.0.10/main"));
  EXPECT_FALSE(is_stream("/home/me/flight.mp4"));
  EXPECT_FALSE(is_stream("a:b.mp4"));
}

}  // namespace
}  // namespace pade::live
