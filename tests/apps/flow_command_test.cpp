// `pade flow` and `pade flow evaluate` as a user meets them.
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pade/io/image/image_codec.hpp"

#include "apps/run_program.hpp"
#include "support/temporary_folder.hpp"

namespace pade {
namespace {

using test::kPade;
using test::Outcome;
using test::shell;
using testing::HasSubstr;

TEST(FlowCommand, ComparesMethodsOnASequenceWhoseFlowFollowsFromDepthAndPoses) {
  const std::string flight = PADE_SAMPLE_FLIGHT;
  const Outcome outcome = shell(kPade + " flow evaluate " + flight +
                                " --flow clg-fast,dis-ultrafast --confidence forward_backward --json");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const auto json = nlohmann::json::parse(outcome.text);
  const auto& methods = json.at("folders").at(flight);
  const auto& mean = methods.at("clg-fast").at("mean");
  EXPECT_EQ(methods.at("clg-fast").at("pairs").size(), 4U);
  EXPECT_EQ(mean.at("coverage"), 1);
  EXPECT_LT(mean.at("r3").get<double>(), 0.1);
  EXPECT_LT(mean.at("aee_px").get<double>(),
            methods.at("dis-ultrafast").at("mean").at("aee_px").get<double>());
  const auto& confidence = mean.at("confidence");
  const auto remaining = confidence.at("aee_px_without_least_sure_percent").get<std::vector<double>>();
  const auto best = confidence.at("aee_px_without_worst_percent").get<std::vector<double>>();
  ASSERT_EQ(remaining.size(), 20U);
  EXPECT_NEAR(remaining.front(), mean.at("aee_px").get<double>(), 1e-4);
  EXPECT_LT(remaining[6], 0.8 * remaining.front()) << "30 % left out";
  for (std::size_t i = 0; i < best.size(); ++i) EXPECT_LE(best[i], remaining[i] + 1e-9) << i;
}

TEST(FlowCommand, SaysThatAMethodHasNoSigmaRatherThanThatItIsPerfect) {
  const std::string flight = PADE_SAMPLE_FLIGHT;
  const std::string command =
      kPade + " flow evaluate " + flight + " --pairs 2 --flow clg-fast,opencv-pyrlk --confidence local";
  const Outcome outcome = shell(command + " --json");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const auto json = nlohmann::json::parse(outcome.text);
  for (const auto& [method, figures] : json.at("folders").at(flight).items()) {
    std::vector<nlohmann::json> rows = {figures.at("mean")};
    for (const auto& pair : figures.at("pairs")) rows.push_back(pair);
    for (const auto& row : rows) {
      const auto& confidence = row.at("confidence");
      EXPECT_EQ(confidence.is_null(), method == "opencv-pyrlk") << method;
      if (confidence.is_null()) continue;
      EXPECT_GT(confidence.at("aee_of_surest_70_percent").get<double>(), 0) << method;
    }
  }
  const Outcome table = shell(command + " --mean");
  EXPECT_THAT(table.text, testing::ContainsRegex("opencv-pyrlk[^\n]* - +- +- +- +- *\n"));
}

TEST(FlowCommand, RefusesAPictureThatCannotBeWrittenBeforeItWritesAnything) {
  const test::TemporaryFolder folder;
  const std::string image = (folder.path() / "one.png").string();
  ASSERT_TRUE(io::save_image(image, cv::Mat(48, 64, CV_8UC1, cv::Scalar(9))));
  const std::string out = (folder.path() / "out.flo").string();
  const std::string command = kPade + " flow " + image + " " + image + " --flow clg-fast --out " + out;
  for (const char* name : {"x.xyz", "x", ".png.txt"}) {
    const Outcome outcome = shell(command + " --picture " + (folder.path() / name).string());
    EXPECT_EQ(outcome.code, 1) << name;
    EXPECT_THAT(outcome.text, testing::AllOf(HasSubstr("--picture"), HasSubstr(name)));
    EXPECT_FALSE(std::filesystem::exists(out)) << name;
  }
  EXPECT_THAT(shell(command + " --full-scale 3").text, HasSubstr("--full-scale: found it without --picture"));
  EXPECT_EQ(shell(command + " --full-scale 3 --picture " + (folder.path() / "x.png").string()).code, 0);
}

TEST(FlowCommand, NamesThePackageThatAnImageOfAnotherFormatNeeds) {
#ifdef PADE_SANITIZED
  GTEST_SKIP() << "sanitized programs look into their own run path first";
#endif
  const test::TemporaryFolder folder;
  const std::string image = (folder.path() / "one.bmp").string();
  std::ofstream(image) << "BM, and no more";
  std::ofstream(folder.path() / "libpade_image_formats.so").flush();  // found first, and no module
  const Outcome outcome =
      shell("LD_LIBRARY_PATH=" + folder.path().string() + " " + kPade + " flow " + image + " " + image);
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.text,
              testing::AllOf(HasSubstr("one.bmp: "), HasSubstr("BMP"), HasSubstr("pade-image-formats"),
                             HasSubstr("libopencv-imgcodecs-dev")));
}

TEST(FlowCommand, SaysWhatAFolderToEvaluateMustHold) {
  const test::TemporaryFolder folder;
  const Outcome outcome = shell(kPade + " flow evaluate " + folder.path().string() + " --flow clg-fast");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.text, HasSubstr("no folder with two images and a true flow"));
  EXPECT_THAT(outcome.text, HasSubstr("nor a sequence with true depth"));
}

TEST(FlowCommand, RefusesImagesInWhichTheMethodFindsNothing) {
  const test::TemporaryFolder folder;
  const std::string image = (folder.path() / "one.png").string();
  const std::string out = (folder.path() / "out.flo").string();
  ASSERT_TRUE(io::save_image(image, cv::Mat(1, 1, CV_8UC1, cv::Scalar(9))));
  const Outcome dis = shell(kPade + " flow " + image + " " + image + " --flow dis-medium --out " + out);
  EXPECT_EQ(dis.code, 1);
  EXPECT_THAT(dis.text, HasSubstr("images of 1 x 1 pixels"));
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_EQ(shell(kPade + " flow " + image + " " + image + " --flow clg-fast --out " + out).code, 0);
}

}  // namespace
}  // namespace pade
