// `pade evaluate --world` as a user meets it: a flight through a yard of a ground, a wall and a pole.
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

constexpr const char* kWorld = R"(<?xml version="1.0"?>
<sdf version="1.9" xmlns:pade="https://github.com/pade/pade/sdf"><world name="yard">
  <light type="directional" name="sun"><direction>0.5 0.3 -0.8</direction></light>
  <model name="ground"><static>true</static><link name="l"><visual name="v">
    <geometry><plane><normal>0 0 1</normal><size>80 80</size></plane></geometry>
    <material><diffuse>1 1 1 1</diffuse><pade:pattern>gravel</pade:pattern></material></visual></link></model>
  <model name="wall"><static>true</static><pose>8.25 0 3 0 0 0</pose><link name="l"><visual name="v">
    <geometry><box><size>0.4 20 6</size></box></geometry>
    <material><diffuse>1 1 1 1</diffuse><pade:pattern>gravel</pade:pattern></material></visual></link></model>
  <model name="pole"><static>true</static><pose>5 1.2 2 0 0 0</pose><link name="l"><visual name="v">
    <geometry><cylinder><radius>0.2</radius><length>4</length></cylinder></geometry>
    <material><diffuse>1 1 1 1</diffuse><pade:pattern>bark</pade:pattern></material></visual></link></model>
</world></sdf>)";

constexpr const char* kFlight = R"(waypoints:
  - {position: [-4, 0, 1.2]}
  - {position: [2, 0.2, 1.25]}
  - {position: [8, 0, 1.2]}
frames: 12
first_frame_s: 1
camera: {width: 160, height: 120, fx: 138, fy: 138, cx: 79.5, cy: 59.5}
)";

class EvaluateMap : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const char* name) const { return (folder_.path() / name).string(); }
  void SetUp() override {
    std::ofstream(at("yard.sdf")) << kWorld;
    std::ofstream(at("yard.yaml")) << kFlight;
    const Outcome made =
        shell(kPade + " simulate " + at("yard.sdf") + " --flight " + at("yard.yaml") + " --preview -o " +
              at("flight") + " && " + kPade + " map " + at("flight") + " --no-report -o " + at("run"));
    ASSERT_EQ(made.code, 0) << made.text;
  }
  [[nodiscard]] Outcome evaluate(const std::string& more) const {
    return shell(kPade + " evaluate " + at("run") + " --world " + at("yard.sdf") + " " + more);
  }
  test::TemporaryFolder folder_;
};

TEST_F(EvaluateMap, MeasuresARunAgainstItsWorld) {
  const Outcome outcome = evaluate("--json --replay --reference " + at("run"));
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const auto json = nlohmann::json::parse(outcome.text);
  EXPECT_EQ(json.at("frames"), 12);
  EXPECT_EQ(json.at("frames_with_pose"), 12);
  EXPECT_EQ(json.at("alignment").at("rotation_deg"), 0);
  EXPECT_EQ(json.at("alignment").at("rms_position_m"), 0);
  EXPECT_EQ(json.at("reference").at("occupied_share"), 1);
  // With exact depth every seen voxel is known, nearly all are occupied, and no phantom is left.
  const auto& ceiling = json.at("octomap_with_exact_depth");
  EXPECT_LT(ceiling.at("surface").at("unknown").get<double>(), 0.05) << outcome.text;
  EXPECT_GT(ceiling.at("surface").at("occupied_or_neighbour").get<double>(), 0.95) << outcome.text;
  EXPECT_EQ(ceiling.at("phantoms").at(0).at("voxels"), 0);
  const auto& map = json.at("map");
  EXPECT_GT(map.at("surface").at("voxels").get<int>(), 500);
  const auto& surface = map.at("surface");
  EXPECT_NEAR(surface.at("occupied").get<double>() + surface.at("free").get<double>() +
                  surface.at("unknown").get<double>(),
              1, 1e-9);
  const auto& replayed = json.at("replayed");
  EXPECT_EQ(replayed.at("frames"), 6) << "the first five are not asked, and the last has no direction";
  // The wall's face is at 8.05 m; the sphere of 0.35 m stops before it.
  EXPECT_NEAR(replayed.at("reach").at("true_p10_m").get<double>(), 8.05 - 0.35 - 0.2, 1.5);
}

TEST_F(EvaluateMap, TheDepthOfARunWithPosesOfTheFilterIsComputedAnew) {
  const std::string run = at("fi\xffter");  // and printed as JSON, whatever the name
  const auto evaluated = [&](const std::string& more) {
    const Outcome outcome = shell(kPade + " evaluate --json '" + run + "' " + more + " 2>/dev/null");
    EXPECT_EQ(outcome.code, 0) << outcome.text;
    return nlohmann::json::parse(outcome.text);
  };
  ASSERT_EQ(shell(kPade + " map " + at("flight") + " --poses from-imu-gnss --save depth --no-report -o '" +
                  run + "'")
                .code,
            0);
  const auto stored = nlohmann::json::parse(std::ifstream(run + "/evaluation.json"));
  for (const std::string& more : {std::string(), "--sequence " + at("flight")}) {
    const auto anew = evaluated(more);
    EXPECT_TRUE(anew.at("computed_anew").get<bool>()) << more;
    EXPECT_EQ(anew.at("frames"), stored.at("frames"));
    EXPECT_EQ(anew.at("ranges").back().at("pixels"), stored.at("ranges").back().at("pixels"));
  }
  // Where that cannot be, it is said.
  fs::rename(at("flight"), at("moved"));
  EXPECT_FALSE(evaluated("").at("computed_anew").get<bool>());
  const Outcome said = shell(kPade + " evaluate '" + run + "'");
  EXPECT_EQ(said.code, 0);
  EXPECT_THAT(said.text, HasSubstr("not computed anew"));
  EXPECT_TRUE(evaluated("--sequence " + at("moved")).at("computed_anew").get<bool>());
  // Runs with other limits have no mean.
  fs::rename(at("moved"), at("flight"));
  ASSERT_EQ(shell(kPade + " map " + at("flight") + " --range 6 --no-report -o " + at("near")).code, 0);
  const Outcome mixed = shell(kPade + " evaluate " + at("run") + " " + at("near"));
  EXPECT_EQ(mixed.code, 0);
  EXPECT_THAT(mixed.text, testing::AllOf(HasSubstr("no mean over the runs"), HasSubstr("6, 20 m"),
                                         testing::Not(HasSubstr("\nmean over runs\n"))));
  EXPECT_THAT(shell(kPade + " evaluate " + at("run") + " " + at("run")).text,
              HasSubstr("\nmean over runs\n"));
}

TEST_F(EvaluateMap, RefusesWhatItCannotCompare) {
  const Outcome csv = evaluate("--csv " + at("out.csv"));
  EXPECT_EQ(csv.code, 1);
  EXPECT_THAT(csv.text, HasSubstr("--csv: found it with --world"));

  const Outcome no_world = shell(kPade + " evaluate " + at("run") + " --world " + at("none.sdf"));
  EXPECT_EQ(no_world.code, 1);
  EXPECT_THAT(no_world.text, HasSubstr("none.sdf"));
  fs::rename(at("run") + "/map.ot", at("map.ot"));
  const Outcome no_map = evaluate("");
  EXPECT_EQ(no_map.code, 1);
  EXPECT_THAT(no_map.text, HasSubstr("map.ot: found no such file"));
  fs::rename(at("flight") + "/groundtruth.txt", at("groundtruth.txt"));
  const Outcome no_truth = evaluate("");
  EXPECT_EQ(no_truth.code, 1);
  EXPECT_THAT(no_truth.text, HasSubstr("true poses"));
  const Outcome no_option = shell(kPade + " evaluate " + at("run") + " --replay");
  EXPECT_NE(no_option.code, 0);
  EXPECT_THAT(no_option.text, HasSubstr("--world"));
}

}  // namespace
}  // namespace pade
