// `pade live` as systemd and people run it: a process, an autopilot on the other end of the line, and
// signals.
#include <algorithm>
#include <csignal>
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
#include <sys/wait.h>
#include <unistd.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/io/image/image_codec.hpp"
#include "pade/io/text.hpp"

#include "apps/run_program.hpp"
#include "live/udp_autopilot.hpp"

namespace pade::live {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

constexpr int kPort = 24'583;

class LiveCommand : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / fmt::format("pade_live_command_{}", std::random_device{}());
    fs::create_directories(folder_ / "flight" / "rgb");
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Past the wall of WallCamera, ten times a second.
  void record(int frames) const {
    constexpr double kRate = 10;
    cv::Mat wall = textured_wall();
    std::ofstream list(folder_ / "flight" / "rgb.txt");
    for (int i = 0; i < frames; ++i) {
      const std::string name = fmt::format("rgb/{:04d}.png", i);
      ASSERT_TRUE(io::save_image((folder_ / "flight" / name).string(), image_of_wall(wall, i / kRate)));
      list << fmt::format("{:.6f} {}\n", 100 + i / kRate, name);
    }
    std::ofstream(folder_ / "flight" / "camera.yaml")
        << "width: 96\nheight: 64\nfx: 60\nfy: 60\ncx: 47.5\ncy: 31.5\ndistortion_model: none\n";
  }
  [[nodiscard]] fs::path config(const std::string& more = {}) const {
    const fs::path file = folder_ / "live.yaml";
    std::ofstream(file) << fmt::format(
        "camera: {{kind: folder, path: {}}}\nlink: {{port: \"udp:{}\"}}\nsession: {{velocity_sigma: 0.02}}\n"
        "mapper: {{map: {{voxel: 0.25}}}}\n{}",
        (folder_ / "flight").string(), kPort, more);
    return file;
  }
  [[nodiscard]] std::string map_line() const {
    return fmt::format("map: {}\n", (folder_ / "map.bt").string());
  }
  [[nodiscard]] std::string said() const {
    const auto text = io::read_file(folder_ / "said");
    return text ? *text : std::string();
  }
  /// Starts the program, its output in the file "said", or where it is told.
  [[nodiscard]] pid_t start(const fs::path& file, int said = -1) const {
    const std::string out = (folder_ / "said").string();
    const std::string yaml = file.string();
    const pid_t child = ::fork();
    if (child != 0) return child;
    if (said < 0) said = ::open(out.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
    ::dup2(said, STDOUT_FILENO);
    ::dup2(said, STDERR_FILENO);
    ::execl(PADE_PROGRAM, "pade", "live", yaml.c_str(), nullptr);
    ::_exit(127);
  }

  fs::path folder_;
};

TEST_F(LiveCommand, SavesItsMapOnSigtermWithinTwoSecondsAndOutlivesItsTerminal) {
  record(200);
  const pid_t session = start(config(map_line()));
  ASSERT_GT(session, 0);
  const UdpAutopilot autopilot(now_of_ours(), kPort);
  const Time begun = now_of_ours();
  while (autopilot.sectors().size() < 10 && seconds_between(begun, now_of_ours()) < 20)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ASSERT_GE(autopilot.sectors().size(), 10U) << said();
  ::kill(session, SIGHUP);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ASSERT_EQ(::waitpid(session, nullptr, WNOHANG), 0) << "ended by a terminal that went away";
  const Time told = now_of_ours();
  ::kill(session, SIGTERM);
  int status = -1;
  ::waitpid(session, &status, 0);
  EXPECT_LT(seconds_between(told, now_of_ours()), 2);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << said();
  EXPECT_THAT(said(), AllOf(HasSubstr("map.bt: "), HasSubstr("voxels occupied"), HasSubstr(" mapped, ")));
  const auto map = io::read_map(folder_ / "map.bt");
  ASSERT_TRUE(map.ok()) << map.error().message;
  EXPECT_GT(map->counts().occupied, 50U);
  EXPECT_THAT(autopilot.texts(), Contains(HasSubstr("obstacle mapping active")));
  EXPECT_THAT(autopilot.texts().back(), HasSubstr("has ended"));
}

/// `pade live vehicle.yaml | head`, and a log that nobody reads any more: both would end or hold up the
/// flight.
TEST_F(LiveCommand, OutlivesWhoeverReadsItsLog) {
  record(200);
  for (const bool closed : {true, false}) {
    int log[2];
    ASSERT_EQ(::pipe2(log, O_CLOEXEC), 0);
    if (closed) {
      ::close(log[0]);
    } else {  // full
      ASSERT_EQ(::fcntl(log[1], F_SETFL, O_NONBLOCK), 0);
      while (::write(log[1], "x", 1) == 1) {
      }
      ASSERT_EQ(::fcntl(log[1], F_SETFL, 0), 0);
    }
    // An earlier recording: so there is something to say at the start.
    std::ofstream(folder_ / "flight.mcap") << "earlier";
    const UdpAutopilot autopilot(now_of_ours(), kPort);
    const std::string more = fmt::format("autosave: 0\nrecord: {}\n", (folder_ / "flight.mcap").string());
    const pid_t session = start(config(map_line() + more), log[1]);
    ::close(log[1]);
    int status = -1;
    bool ended = false;
    const auto wait_for = [&](const auto& condition) {
      constexpr double kPatience = 25;  // s
      const Time begun = now_of_ours();
      while (!ended && !condition() && seconds_between(begun, now_of_ours()) < kPatience) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        ended = ::waitpid(session, &status, WNOHANG) != 0;
      }
    };
    wait_for([&] { return autopilot.sectors().size() >= 3; });
    EXPECT_GE(autopilot.sectors().size(), 3U);
    if (!ended) ::kill(session, SIGTERM);
    wait_for([&] { return fs::exists(folder_ / "map.bt"); });  // all that is left is to say so
    if (!closed) ::close(log[0]);
    wait_for([] { return false; });
    if (!ended) {
      ::kill(session, SIGKILL);
      ::waitpid(session, &status, 0);
    }
    EXPECT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
    EXPECT_TRUE(fs::exists(folder_ / "map.bt"));
    fs::remove(folder_ / "map.bt");
  }
}

/// A map that cannot be written is heard of in flight, and not at its end.
TEST_F(LiveCommand, TellsThePilotOfAMapThatCannotBeSaved) {
  record(200);
  fs::create_directory(folder_ / "map.bt");  // in its way
  const pid_t session = start(config(map_line() + "autosave: 0.1\n"));
  const UdpAutopilot autopilot(now_of_ours(), kPort);
  const Time begun = now_of_ours();
  const auto told = [&] {
    const auto texts = autopilot.texts();
    return std::count(texts.begin(), texts.end(), "PADE: the map cannot be saved");
  };
  while (told() == 0 && seconds_between(begun, now_of_ours()) < 18)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(told(), 1);
  EXPECT_THAT(said(), HasSubstr("the map cannot be saved: "));
  ::kill(session, SIGTERM);
  int status = -1;
  ::waitpid(session, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1) << said();
}

TEST_F(LiveCommand, CheckFindsWhatIsThereAndWhatIsNot) {
  record(100);
  const std::string command = fmt::format("{} live --check {}", test::kPade, config(map_line()).string());
  {
    const UdpAutopilot autopilot(now_of_ours(), kPort);
    const test::Outcome all = test::shell(command);
    EXPECT_EQ(all.code, 0) << all.text;
    EXPECT_THAT(all.text, AllOf(HasSubstr("96 x 64"), HasSubstr("ArduPilot"), HasSubstr("attitudes")));
  }
  const test::Outcome none = test::shell(command);
  EXPECT_EQ(none.code, 1);
  EXPECT_THAT(none.text, AllOf(HasSubstr("no HEARTBEAT"), HasSubstr("something is missing")));
  EXPECT_FALSE(fs::exists(folder_ / "map.bt"));
}

TEST_F(LiveCommand, ShowsItselfOverTheNetworkWhereThatIsAskedFor) {
  record(3);
  const std::string file = config("web: {port: 24583}\nmap: \"\"\n").string();
  const test::Outcome shown = test::shell(fmt::format("{} live --web {}", test::kPade, file));
  if (shown.text.find("without libwebsockets") != std::string::npos) GTEST_SKIP() << shown.text;
  EXPECT_THAT(shown.text,
              AllOf(HasSubstr("page: http://127.0.0.1:24583/; Foxglove"), HasSubstr("web: 0 clients now")));
  EXPECT_THAT(test::shell(fmt::format("{} live {}", test::kPade, file)).text, Not(HasSubstr("24583")));
}

/// As the service, whose configuration is in /etc and whose folder is its own.
TEST_F(LiveCommand, LooksForItsInputsBesideItsConfiguration) {
  record(2);
  fs::create_directory(folder_ / "state");
  std::ofstream(folder_ / "live.yaml") << fmt::format(
      "camera: {{kind: folder, path: flight, calibration: missing.yaml}}\n"
      "link: {{port: \"udp:{}\"}}\nmap: map.bt\n",
      kPort);
  const std::string command =
      fmt::format("cd {} && {} live ../live.yaml", (folder_ / "state").string(), test::kPade);
  EXPECT_THAT(test::shell(command).text, AllOf(HasSubstr("../missing.yaml"), Not(HasSubstr("state"))));
  fs::rename(folder_ / "flight" / "camera.yaml", folder_ / "missing.yaml");
  EXPECT_THAT(test::shell(command).text, HasSubstr("2 frames: "));
}

/// With a recorded flight in place of the camera; an unknown field or a wrong value would be refused before
/// that.
TEST_F(LiveCommand, TheConfigurationToBeginWithIsUnderstood) {
  const fs::path shipped = fs::path(PADE_SOURCE_DIR) / "config" / "live";
  auto text = io::read_file(shipped / "vehicle.yaml");
  ASSERT_TRUE(text) << text.error().message;
  const auto put = [&](const std::string& old, const std::string& now) {
    const std::size_t at = text->find(old);
    ASSERT_NE(at, std::string::npos) << old;
    text->replace(at, old.size(), now);
  };
  record(3);
  put("kind: v4l2", "kind: folder");
  put("/dev/video0", (folder_ / "flight").string());
  put("/dev/ttyAMA0", fmt::format("udp:{}", kPort));
  std::ofstream(folder_ / "vehicle.yaml") << *text;
  fs::copy_file(folder_ / "flight" / "camera.yaml", folder_ / "camera.yaml");
  const test::Outcome out =
      test::shell(fmt::format("cd {} && {} live --for 1 vehicle.yaml", folder_.string(), test::kPade));
  EXPECT_THAT(out.text, HasSubstr("3 frames: "));
  const test::Outcome lens =
      test::shell(fmt::format("{} info {}", test::kPade, (shipped / "camera.yaml").string()));
  EXPECT_EQ(lens.code, 0) << lens.text;
  EXPECT_THAT(lens.text, HasSubstr("looking along (1, 0, 0)"));
}

TEST_F(LiveCommand, TheServiceIsStartedAgainHoweverOftenItFails) {
  const auto unit = io::read_file(fs::path(PADE_SOURCE_DIR) / "config" / "systemd" / "pade-live@.service.in");
  ASSERT_TRUE(unit);
  const auto section = [&](const std::string& name) {
    const std::size_t begin = unit->find(name);
    return unit->substr(begin, unit->find("\n[", begin) - begin);
  };
  EXPECT_THAT(section("[Unit]"), HasSubstr("\nStartLimitIntervalSec=0\n"));
  EXPECT_THAT(section("[Service]"), HasSubstr("\nRestart=on-failure\n"));
}

TEST_F(LiveCommand, RefusesByNameWhatCannotWork) {
  record(3);
  const struct {
    std::string more, named;
  } cases[] = {
      {"map: " + (folder_ / "nowhere" / "map.bt").string() + "\n", "found no folder"},
      {"record: " + (folder_ / "nowhere" / "x.mcap").string() + "\n", "found no folder"},
      {"map: map.las\n", ".bt or .ot"},
      {"autosave: -1\n", "autosave is -1"},
      {"sectors: {own_radius: 10, max_distance: 5}\n", "sectors.own_radius is 10"},
      {"sectors: {max_distance: .nan}\n", "sectors.max_distance"},
      {"mapper: {map: {voxel: 0.001}}\n", "sectors.max_distance: found 20, expected at most 16.4 m"},
      {"mapper_: {}\n", "mapper_"},
      {"web: {address: 0.0.0.0}\n", "web.token: found none"},
      {"web: {port: 99999}\n", "web.port"},
  };
  for (const auto& c : cases) {
    const test::Outcome refused =
        test::shell(fmt::format("{} live {}", test::kPade, config(c.more).string()));
    EXPECT_EQ(refused.code, 1) << c.named;
    EXPECT_THAT(refused.text, AllOf(HasSubstr("pade live: "), HasSubstr(c.named)));
  }
  EXPECT_EQ(test::shell(test::kPade + " live " + (folder_ / "none.yaml").string()).code, 1);
}

}  // namespace
}  // namespace pade::live
