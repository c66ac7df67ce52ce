// What the program says and leaves behind when something is wrong: each refusal is one clear line, exit code
// 1, and nothing half-written.
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/run_program.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using test::kPade;
using test::Outcome;
using test::shell;
using testing::AllOf;
using testing::HasSubstr;

/// The sample flight that ctest has made once for all tests (five frames), and a folder for what each test
/// does to a copy of it.
const fs::path kSample = PADE_SAMPLE_FLIGHT;

class BadInput : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    ASSERT_TRUE(fs::exists(kSample)) << "run through ctest, or make it: pade sample --frames 5 --out "
                                     << kSample;
    base_ = fs::temp_directory_path() / ("pade_bad_input_" + std::to_string(std::random_device{}()));
    fs::create_directories(base_);
  }
  static void TearDownTestSuite() { fs::remove_all(base_); }

  void SetUp() override {
    work_ = base_ / testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::create_directories(work_);
    fs::copy(kSample, flight(), fs::copy_options::recursive);
  }

  [[nodiscard]] fs::path flight() const { return work_ / "flight"; }
  [[nodiscard]] fs::path out() const { return work_ / "run"; }
  [[nodiscard]] Outcome map(const std::string& options = {}) const {
    return shell(kPade + " map " + flight().string() + " --no-report --flow dis-ultrafast --out " +
                 out().string() + " " + options);
  }
  void edit(const std::string& file, const std::string& from, const std::string& to) const {
    std::ifstream in(flight() / file);
    std::string text((std::istreambuf_iterator<char>(in)), {});
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    std::ofstream(flight() / file) << text.replace(at, from.size(), to);
  }
  void expect_refused(const Outcome& outcome, const std::string& named) const {
    EXPECT_EQ(outcome.code, 1) << outcome.text;
    EXPECT_THAT(outcome.text, AllOf(HasSubstr("pade "), HasSubstr(named)));
    int left = 0;
    for (const auto& entry : fs::directory_iterator(work_)) left += entry.path() != flight() ? 1 : 0;
    EXPECT_EQ(left, 0) << "something was left behind";
  }

  static inline fs::path base_;
  fs::path work_;
};

TEST_F(BadInput, AMissingFolder) {
  fs::remove_all(flight());
  expect_refused(map(), "flight");
}

TEST_F(BadInput, NoImages) {
  fs::remove_all(flight() / "rgb");
  fs::create_directory(flight() / "rgb");
  expect_refused(map(), "rgb");
}

TEST_F(BadInput, OneBadImageOfEachKindIsSkippedNamedAndCounted) {
  for (const char* kind : {"truncated", "empty", "odd size"}) {
    fs::remove_all(flight());
    fs::copy(kSample, flight(), fs::copy_options::recursive);
    const fs::path image = flight() / "rgb" / "0.200000.png";
    if (kind == std::string("truncated")) fs::resize_file(image, fs::file_size(image) / 2);
    if (kind == std::string("empty")) fs::resize_file(image, 0);
    if (kind == std::string("odd size")) {
      std::ofstream pgm(image,
                        std::ios::binary);  // a 2 x 2 PGM under the name of a PNG: OpenCV goes by content
      pgm << "P5\n2 2\n255\nabcd";
    }
    const Outcome outcome = map("--force");
    EXPECT_EQ(outcome.code, 0) << kind << outcome.text;
    EXPECT_THAT(outcome.text, AllOf(HasSubstr("4 of 5 frames used"), HasSubstr("0.200000.png"))) << kind;
    EXPECT_EQ(map("--force --strict").code, 1) << kind;
  }
}

TEST_F(BadInput, OnePoseRowWithNanOrZeroQuaternionIsSkippedAndAllOfThemAreRefused) {
  std::ifstream in(flight() / "groundtruth.txt");
  std::string good;
  std::string all_bad;
  int row = 0;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("#")) continue;
    const std::string stamp = line.substr(0, line.find(' '));
    good += row == 1 ? stamp + " nan 0 1 0 0 0 1\n" : row == 3 ? stamp + " 0 0 1 0 0 0 0\n" : line + "\n";
    all_bad += stamp + " 0 0 1 0 0 0 0\n";
    ++row;
  }
  std::ofstream(flight() / "groundtruth.txt") << good;
  const Outcome outcome = map();
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_THAT(outcome.text, AllOf(HasSubstr("groundtruth.txt"), HasSubstr("skipped")));
  fs::remove_all(out());
  std::ofstream(flight() / "groundtruth.txt") << all_bad;
  expect_refused(map(), "groundtruth.txt");
}

TEST_F(BadInput, PosesThatDoNotCoverTheFrames) {
  std::ofstream(flight() / "groundtruth.txt") << "900.0 0 0 0 0 0 0 1\n901.0 1 0 0 0 0 0 1\n";
  expect_refused(map(), "outside the poses");
}

TEST_F(BadInput, UnusableCalibrations) {
  edit("camera.yaml", "fx: ", "fx: -");
  expect_refused(map(), "fx");
  edit("camera.yaml", "fx: -", "fx: ");
  edit("camera.yaml", "plumb_bob", "liquid_lens");
  expect_refused(map(), "liquid_lens");
  fs::remove(flight() / "camera.yaml");
  expect_refused(map(), "camera.yaml");
}

TEST_F(BadInput, AnExistingOutputIsKeptUnlessForced) {
  ASSERT_EQ(map().code, 0);
  std::ofstream(out() / "note.txt") << "mine";
  const Outcome again = map();
  EXPECT_EQ(again.code, 1);
  EXPECT_THAT(again.text, HasSubstr("run"));
  EXPECT_TRUE(fs::exists(out() / "note.txt"));
  EXPECT_EQ(map("--force").code, 0);
  EXPECT_FALSE(fs::exists(out() / "note.txt"));
}

TEST_F(BadInput, AnOutputThatCannotBeWritten) {
  const Outcome outcome = shell(kPade + " map " + flight().string() + " --out /proc/nowhere/run");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.text, HasSubstr("/proc/nowhere"));
}

TEST_F(BadInput, AFullDiskLeavesNothing) {
  expect_refused(shell("ulimit -f 40; " + kPade + " map " + flight().string() + " --out " + out().string()),
                 "run");
}

TEST_F(BadInput, CtrlCLeavesNothing) {
  const Outcome outcome = shell("timeout --foreground -s INT 0.7 " + kPade + " map " + flight().string() +
                                " --flow opencv-pyrlk --out " + out().string() + "; echo code $?");
  EXPECT_THAT(outcome.text, testing::AnyOf(HasSubstr("code 124"), HasSubstr("code 130")));
  EXPECT_FALSE(fs::exists(out()));
  int left = 0;
  for (const auto& entry : fs::directory_iterator(work_)) left += entry.path() != flight() ? 1 : 0;
  EXPECT_EQ(left, 0);
}

TEST_F(BadInput, AValueThatNoOptionHas) {
  EXPECT_NE(map("--flow horn-schunck").code, 0);
  EXPECT_NE(map("--window 0").code, 0);
  EXPECT_NE(map("--range -3").code, 0);
  EXPECT_EQ(map("--save depth,colour").code, 1);
  std::ofstream(work_ / "options.yaml") << "mapper:\n  stepp: 2\n";
  EXPECT_THAT(map("--config " + (work_ / "options.yaml").string()).text, HasSubstr("stepp"));
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(BadInput, EvaluateAndInfoOfWhatIsNoRun) {
  for (const std::string command : {"evaluate", "info"}) {
    const Outcome missing = shell(kPade + " " + command + " " + (work_ / "nowhere").string());
    EXPECT_EQ(missing.code, 1) << missing.text;
    EXPECT_THAT(missing.text, HasSubstr("nowhere"));
  }
  ASSERT_EQ(map().code, 0);
  EXPECT_EQ(shell(kPade + " evaluate " + out().string()).code, 0);
  EXPECT_EQ(shell(kPade + " info " + out().string()).code, 0);
  EXPECT_EQ(shell(kPade + " info " + flight().string()).code, 0);
  EXPECT_EQ(shell(kPade + " info " + (out() / "map.bt").string()).code, 0);
  std::ofstream(out() / "run.json") << "{ not json";
  EXPECT_EQ(shell(kPade + " evaluate " + out().string()).code, 1);
}

TEST_F(BadInput, TopicsOfWhatHasNone) {
  expect_refused(map("--topics /image"), "is no recording of ROS");
  for (const char* const of : {"flight", "log.ulg"}) {
    std::ofstream(base_ / "log.ulg") << "ULog";
    const fs::path path = std::string_view(of) == "flight" ? flight() : base_ / of;
    for (const std::string& command :
         {" info " + path.string(), " navigate " + path.string() + " -o " + out().string()})
      expect_refused(shell(kPade + command + " --topics /image"), "expected");
  }
}

TEST_F(BadInput, AConfigurationWhoseNumbersMakeNoSense) {
  const std::string config = (flight() / "config.yaml").string();
  for (const auto& [text, named] : {std::pair{"cloud: {spacing: 0}", "cloud.spacing"},
                                    std::pair{"mapper: {depth: {parallax_gate: .nan}}", "parallax_gate"}}) {
    std::ofstream(config) << text << '\n';
    expect_refused(map("--config " + config), named);
  }
}

}  // namespace
}  // namespace pade
