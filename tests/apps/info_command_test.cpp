// `pade info` as a user meets it.
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/run_program.hpp"
#include "support/temporary_folder.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using test::kPade;
using test::Outcome;
using test::shell;
using testing::HasSubstr;

class InfoOfFlights : public testing::Test {
 protected:
  void copy(const std::string& name) const {
    fs::copy(PADE_SAMPLE_FLIGHT, folder_ / name, fs::copy_options::recursive);
  }
  [[nodiscard]] Outcome info(const std::string& what) const {
    return shell(kPade + " info '" + (folder_ / what).string() + "'");
  }
  test::TemporaryFolder folder_;
};

TEST_F(InfoOfFlights, NamesThoseThatAreBroken) {
  for (const char* name : {"a", "b", "c", "d"}) copy(name);
  fs::remove(folder_ / "b" / "groundtruth.txt");
  fs::remove_all(folder_ / "c" / "rgb");  // what rgb.txt lists
  fs::remove(folder_ / "c" / "rgb.txt");
  for (const auto& entry : fs::directory_iterator(folder_ / "d" / "depth"))
    fs::resize_file(entry.path(), 200);
  fs::create_directories(folder_ / "notes");
  const Outcome table = info("");
  EXPECT_EQ(table.code, 0) << table.text;
  EXPECT_THAT(table.text, testing::ContainsRegex("b +cannot be used: .*groundtruth.txt"));
  EXPECT_THAT(table.text, testing::ContainsRegex("c +cannot be used: "));
  EXPECT_THAT(table.text, testing::ContainsRegex("d +cannot be used: .*depth/"));
  EXPECT_THAT(table.text, testing::Not(HasSubstr("notes")));
  const Outcome outcome = shell(kPade + " info --json " + folder_.path().string());
  const auto json = nlohmann::json::parse(outcome.text);
  ASSERT_EQ(json.at("sequences").size(), 4U) << outcome.text;
  for (const auto& row : json.at("sequences")) {
    const bool good = row.at("folder").get<std::string>().ends_with("/a");
    EXPECT_EQ(row.contains("error"), !good) << row;
    EXPECT_EQ(row.at("scene").is_null(), !good) << row;
  }
}

TEST_F(InfoOfFlights, IsJsonWhateverTheirNames) {
  copy("fl\xffght");
  const Outcome outcome = shell(kPade + " info --json '" + (folder_ / "fl\xffght").string() + "'");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_THAT(nlohmann::json::parse(outcome.text).at("folder").get<std::string>(), HasSubstr("fl\uFFFDght"));
}

TEST_F(InfoOfFlights, RefusesOptionsThatWouldDoNothing) {
  copy("a");
  const auto refused = [&](const std::string& what, const std::string& option) {
    const Outcome outcome = shell(kPade + " info " + (folder_ / what).string() + " " + option);
    EXPECT_EQ(outcome.code, 1) << what << " " << option;
    EXPECT_THAT(outcome.text, testing::AllOf(HasSubstr(option.substr(0, option.find(' '))),
                                             HasSubstr("it would do nothing")))
        << what << " " << option;
  };
  refused("a", "--at 1 2 3");
  refused("", "--step 2");
  refused("", "--at 1 2 3");
  for (const char* option : {"--step 2", "--at 1 2 3", "--poses original"}) refused("a/camera.yaml", option);
}

}  // namespace
}  // namespace pade
