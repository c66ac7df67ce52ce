// What --force replaces: what the same command wrote, and no flight of somebody's.
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/run_program.hpp"
#include "support/temporary_folder.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using test::kPade;
using test::Outcome;
using test::shell;
using testing::HasSubstr;

/// Every file below a folder.
std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ostringstream bytes;
    bytes << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    files[entry.path().lexically_relative(folder).string()] = bytes.str();
  }
  return files;
}

/// A flight that somebody recorded: it has all that the program looks for in one, and notes of his own.
class ForceOn : public testing::Test {
 protected:
  void SetUp() override {
    fs::copy(PADE_SAMPLE_FLIGHT, flight(), fs::copy_options::recursive);
    std::ofstream(flight() / "README.md") << "Flown on Monday behind the house.\n";
    before_ = files_of(flight());
    ASSERT_GT(before_.size(), 10U);
  }
  [[nodiscard]] fs::path flight() const { return folder_ / "flight"; }
  [[nodiscard]] std::string at(const char* name) const { return (folder_ / name).string(); }
  void expect_refused(const std::string& command) const {
    const Outcome outcome = shell(kPade + " " + command);
    EXPECT_EQ(outcome.code, 1) << command << "\n" << outcome.text;
    EXPECT_THAT(outcome.text, HasSubstr("expected another place")) << command;
    EXPECT_EQ(files_of(flight()), before_) << command;
  }
  test::TemporaryFolder folder_;
  std::map<std::string, std::string> before_;
};

TEST_F(ForceOn, ARecordedFlightLeavesIt) {
  ASSERT_EQ(shell(kPade + " convert " + at("flight") + " " + at("copy")).code, 0);
  for (const std::string& command : {" sample --frames 2 --force -o " + at("flight"),
                                     " convert " + at("copy") + " " + at("flight") + " --force"}) {
    const Outcome outcome = shell(kPade + command);
    EXPECT_EQ(outcome.code, 1) << command << "\n" << outcome.text;
    EXPECT_THAT(outcome.text, testing::AllOf(HasSubstr(at("flight")), HasSubstr("--force replaces only")));
    EXPECT_EQ(files_of(flight()), before_) << command;
  }
}

TEST_F(ForceOn, TheFlightThatIsReadIsRefused) {
  const std::string flight = at("flight");
  expect_refused("convert " + flight + " " + flight + " --force");
  expect_refused("convert " + flight + "/ " + flight + " --force");
  expect_refused("convert " + flight + " " + flight + "/ --force");
  expect_refused("convert " + flight + "/../flight " + flight + " --force");
  expect_refused("convert " + flight + " " + folder_.path().string() + " --force");
  fs::create_directory_symlink(flight, at("link"));
  expect_refused("convert " + at("link") + " " + flight + " --force");
  ASSERT_EQ(shell(kPade + " convert " + flight + " " + at("f.bag")).code, 0);
  const auto size = fs::file_size(at("f.bag"));
  expect_refused("convert " + at("f.bag") + " " + at("f.bag") + " --force");
  EXPECT_EQ(fs::file_size(at("f.bag")), size);
  // Not even what the command itself wrote.
  ASSERT_EQ(shell(kPade + " convert " + flight + " " + at("copy")).code, 0);
  const auto copy = files_of(at("copy"));
  expect_refused("convert " + at("copy") + " " + at("copy") + " --force");
  EXPECT_EQ(files_of(at("copy")), copy);
}

TEST_F(ForceOn, WhatTheCommandWroteReplacesItUnlessSomethingWasAdded) {
  for (const std::string& command :
       {" sample --frames 2 -o " + at("own"), " convert " + at("flight") + " " + at("own")}) {
    ASSERT_EQ(shell(kPade + command).code, 0) << command;
    EXPECT_EQ(shell(kPade + command).code, 1) << command;
    EXPECT_EQ(shell(kPade + command + " --force").code, 0) << command;
    // Also by names that the command itself writes, where there is something to be written.
    for (const char* const added : {"notes.txt", "mask.png", "gnss.csv", "rgb/notes.txt", "rgb/more/1.png"}) {
      const fs::path file = folder_ / "own" / added;
      fs::create_directories(file.parent_path());
      std::ofstream(file) << "Tree at 12 m.\n";
      const Outcome outcome = shell(kPade + command + " --force");
      EXPECT_EQ(outcome.code, 1) << command << " " << added;
      EXPECT_THAT(outcome.text, HasSubstr("found " + std::string(added).substr(0, 8)));
      EXPECT_TRUE(fs::exists(file));
      fs::remove(file);
    }
    fs::remove_all(at("own"));
    fs::create_directory(at("own"));
    EXPECT_EQ(shell(kPade + command + " --force").code, 0) << "an empty folder";
    fs::remove_all(at("own"));
  }
}

}  // namespace
}  // namespace pade
