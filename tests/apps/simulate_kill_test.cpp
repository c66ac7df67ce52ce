// A simulation that is killed at any moment and started again: what was finished is kept, nothing is damaged,
// and in the end the bytes are those of a run that nobody disturbed.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>

namespace pade {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWorld = R"(<?xml version="1.0"?>
<sdf version="1.9" xmlns:pade="https://github.com/pade/pade/sdf"><world name="yard">
  <light type="directional" name="sun"><direction>0.5 0.3 -0.8</direction></light>
  <model name="ground"><static>true</static><link name="l"><visual name="v">
    <geometry><plane><normal>0 0 1</normal><size>80 80</size></plane></geometry>
    <material><diffuse>1 1 1 1</diffuse><pade:pattern>gravel</pade:pattern></material></visual></link></model>
  <model name="wall"><static>true</static><pose>25 0 3 0 0 0</pose><link name="l"><visual name="v">
    <geometry><box><size>1 40 6</size></box></geometry>
    <material><diffuse>1 1 1 1</diffuse><pade:pattern>concrete</pade:pattern></material></visual></link></model>
  <model name="pole"><static>true</static><pose>12 2 2 0 0 0</pose><link name="l"><visual name="v">
    <geometry><cylinder><radius>0.3</radius><length>4</length></cylinder></geometry></visual></link></model>
</world></sdf>)";

constexpr const char* kFlight = R"(waypoints:
  - {position: [0, 0, 1.5]}
  - {position: [8, 0.4, 1.7], yaw_deg: 4}
  - {position: [18, 0, 1.5]}
frames: 60
camera: {width: 640, height: 480, fx: 554, fy: 554, cx: 319.5, cy: 239.5}
)";

std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> files;
  if (!fs::exists(folder)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ostringstream text;
    text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    files[entry.path().lexically_relative(folder).string()] = text.str();
  }
  return files;
}

class KilledSimulation : public testing::Test {
 protected:
  KilledSimulation()
      : folder_(fs::temp_directory_path() / ("pade_killed_" + std::to_string(std::random_device{}()))) {
    fs::create_directories(folder_);
    std::ofstream(folder_ / "yard.sdf") << kWorld;
    std::ofstream(folder_ / "yard.yaml") << kFlight;
  }
  ~KilledSimulation() override { fs::remove_all(folder_); }
  KilledSimulation(const KilledSimulation&) = delete;
  KilledSimulation& operator=(const KilledSimulation&) = delete;

  [[nodiscard]] pid_t start(const fs::path& out) const {
    std::vector<std::string> words = {PADE_PROGRAM,
                                      "simulate",
                                      (folder_ / "yard.sdf").string(),
                                      "--flight",
                                      (folder_ / "yard.yaml").string(),
                                      "--out",
                                      out.string()};
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_t child = -1;
    posix_spawn(&child, PADE_PROGRAM, nullptr, nullptr, arguments.data(), environ);
    return child;
  }
  static int wait_for(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return status;
  }

  fs::path folder_;
};

TEST_F(KilledSimulation, TenTimesAtRandomMomentsGoesOnToTheSameBytes) {
  const auto began = std::chrono::steady_clock::now();
  ASSERT_EQ(wait_for(start(folder_ / "whole")), 0);
  const std::chrono::duration<double> whole_run = std::chrono::steady_clock::now() - began;
  const auto whole = contents(folder_ / "whole");
  ASSERT_EQ(whole.count("simulation.json"), 1U);

  const fs::path out = folder_ / "cut";
  const fs::path unfinished = folder_ / ".cut.unfinished";
  std::mt19937 random(2026);
  std::uniform_real_distribution<double> moment(0.08,
                                                0.26);  // of a whole run; starting up takes a sixth of it
  int killed = 0;
  std::size_t most_finished = 0;
  std::map<std::string, fs::file_time_type> finished;
  for (int attempt = 0; attempt < 10; ++attempt) {
    const pid_t child = start(out);
    std::this_thread::sleep_for(moment(random) * whole_run);
    kill(child, SIGKILL);
    if (!WIFSIGNALED(wait_for(child))) break;  // it was quicker
    ++killed;
    if (fs::exists(out)) break;  // killed between the end and the exit: it must be whole, see below
    for (const auto& [file, when] : finished) {
      ASSERT_TRUE(fs::exists(unfinished / file)) << file << " was finished before";
      EXPECT_EQ(fs::last_write_time(unfinished / file), when) << file << " was made again";
    }
    for (const auto& [file, bytes] : contents(unfinished)) {
      if (fs::path(file).filename().string().starts_with(".")) continue;  // being written when it was killed
      if (!file.starts_with("rgb/")) continue;
      EXPECT_EQ(bytes, whole.at(file)) << file << " is damaged";
      EXPECT_EQ(contents(unfinished).at("depth/" + file.substr(4)), whole.at("depth/" + file.substr(4)));
      finished[file] = fs::last_write_time(unfinished / file);
    }
    most_finished = finished.size();
  }
  EXPECT_GE(killed, 5);
  EXPECT_GT(most_finished, 0U) << "no kill fell into the rendering";
  if (!fs::exists(out)) {
    ASSERT_EQ(wait_for(start(out)), 0);
  }
  EXPECT_EQ(contents(out), whole);
  EXPECT_FALSE(fs::exists(unfinished));
  RecordProperty("killed", killed);
  RecordProperty("finished_frames_at_the_last_kill", static_cast<int>(most_finished));
}

}  // namespace
}  // namespace pade
