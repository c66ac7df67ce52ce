// Inputs as strangers have them, run as a person runs them; what is right is said for each. They lie beside
// the project and are not part of it: without them there is nothing to test.
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/run_program.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using test::kPade;
using test::Outcome;
using test::shell;
using testing::HasSubstr;
using testing::Not;

const fs::path kCases = fs::path(PADE_SOURCE_DIR) / "../shared/data/cases";

struct Case {
  const char* name;
  const char* folder;
  std::string command;  ///< behind "pade"; OUT stands for a folder that is thrown away, $PADE for the program
  int code;
  std::vector<const char*> says;
  std::vector<const char*> never = {};
};

std::string simulated(const std::string& world, const std::string& out = "OUT") {
  return "simulate " + world + " --flight flight.yaml --preview -o " + out;
}

const Case kAll[] = {
    {"ChainWithoutTheFirstCamera",
     "C1_calibration_without_lens",
     "map flight --calibration kalibr_only_cam1.yaml -o OUT",
     1,
     {"found cam1, expected cam0", "--camera"}},
    {"ChainWithTheCameraChosen",
     "C1_calibration_without_lens",
     "info kalibr_only_cam1.yaml --camera 1",
     0,
     {"554.26"}},
    {"KittiRawCalibration",
     "C1_calibration_without_lens",
     "info kitti_calib_cam_to_cam.txt",
     0,
     {"KITTI raw", "640 x 480"}},
    {"NoLensAtAll",
     "C1_calibration_without_lens",
     "map flight --calibration empty_camera_yaml.yaml -o OUT",
     1,
     {"found no camera"}},
    {"OpenCvLens", "C2_opencv_dist_coeff", "info camera.yml", 0, {"plumb_bob -0.3 0.1"}},
    {"OpenCvLensFromPython", "C2_opencv_dist_coeff", "info camera_pyyaml.yaml", 0, {"plumb_bob -0.3 0.1"}},
    {"Ros1Echo", "C4_camera_info_echo", "info ros1_echo.yaml", 0, {"ROS camera_info", "640 x 480"}},
    {"Ros2Echo", "C4_camera_info_echo", "info ros2_echo.yaml", 0, {"ROS camera_info", "640 x 480"}},
    {"YamlHeader", "C6_yaml_header_on_euroc", "info kimera_left.yaml", 0, {"EuRoC", "mounting"}},
    {"NoCoefficients", "C7_small_things", "info ros_no_coeffs.yaml", 0, {"none 0"}},
    {"FourteenCoefficients", "C7_small_things", "info ros_rational14.yaml", 0, {"rational_polynomial 0.4"}},
    {"RoundingAsSkew", "C7_small_things", "info opencv_skew.yml", 0, {"plumb_bob"}},
    {"Kitti",
     "F1_flow_benchmark_layouts",
     "flow evaluate kitti/training --flow dis-ultrafast",
     0,
     {"000000"}},
    {"Middlebury",
     "F1_flow_benchmark_layouts",
     "flow evaluate middlebury/other-data --flow dis-ultrafast",
     0,
     {"Court"}},
    {"MiddleburyOfEight",
     "F1_flow_benchmark_layouts",
     "flow evaluate mid8 --flow dis-ultrafast",
     0,
     {"Court"}},
    {"Bitmaps", "F1_flow_benchmark_layouts", "flow evaluate bmp --flow dis-ultrafast", 0, {"x"}},
    {"ColumnsByPrefix",
     "N1_imu_columns_by_prefix",
     "navigate imu_temp_first_only -o OUT",
     0,
     {"against truth"},
     {"ERROR"}},
    {"DegreesPerSecond", "N3_imu_deg_per_s_gentle", "navigate imu_degs -o OUT", 0, {"ERROR", "deg/s"}},
    {"ClocksApart", "N4_clocks_without_overlap", "navigate gnss_epoch -o OUT", 1, {"no overlap"}},
    {"ClockSetBack",
     "N4_clocks_without_overlap",
     "navigate imu_clock_reset -o OUT",
     1,
     {"imu.csv:", "stamps go back"}},
    {"ArduPilotColumns",
     "N6_names_of_columns",
     "navigate ardupilot_imu_s -o OUT",
     0,
     {"navigating"},
     {"ERROR"}},
    {"OtherColumns", "N6_names_of_columns", "navigate imu_wx -o OUT", 0, {"navigating"}, {"ERROR"}},
    {"Semicolons", "N6_names_of_columns", "navigate imu_semicolon -o OUT", 0, {"navigating"}, {"ERROR"}},
    {"UtmCoordinates",
     "S1_utm_poses",
     "map utm --no-report -o OUT",
     0,
     {"local origin 482913 4649777 124"},
     {"ERROR", " 0 occupied"}},
    {"DepthFirst",
     "S2_associations_depth_first",
     "info flight",
     0,
     {"depth images come first", "true depth"}},
    {"OpenGlAxes", "S4_wrong_poses_in_map", "map opengl --no-report -o OUT", 0, {"Warning", "pade info"}},
    {"MillimetresMapped",
     "S4_wrong_poses_in_map",
     "map mm --no-report -o OUT",
     0,
     {"ERROR", "millimetres", "pade info"}},
    {"Millimetres", "S4_wrong_poses_in_map", "info mm", 0, {"look like millimetres"}},
    {"ScalarFirst", "S5_quaternion_wxyz_and_turned_images", "info wxyz", 0, {"w x y z"}},
    {"TurnedImages", "S5_quaternion_wxyz_and_turned_images", "info turned", 0, {"turned by 180"}},
    {"DownLooking", "S6_nadir_up", "info flight", 0, {"+z (guessed from east-north-up"}},
    {"BlanksInNames", "S7_list_with_spaces", "info flight", 0, {"6 of 6 frames usable"}},
    {"DaeStandsLikeTheStl",
     "W1_dae_z_up",
     simulated("stl.world", "OUT_stl") + " && $PADE " + simulated("dae.world", "OUT_dae") +
         " && cmp OUT_stl/depth/0.500000.png OUT_dae/depth/0.500000.png && cmp OUT_stl/depth/0.600000.png "
         "OUT_dae/depth/0.600000.png && echo the same depth",
     0,
     {"the same depth"},
     {"warning"}},
    {"NamedGrey",
     "W2_material_without_diffuse",
     simulated("script_only.world"),
     0,
     {"Gazebo/Grey is drawn in its plain colour"}},
    {"NamedOrange",
     "W2_material_without_diffuse",
     simulated("script_orange_box.world"),
     0,
     {"Gazebo/Orange is drawn in its plain colour"}},
    {"IncludeInAnIncludedModel", "W3_nested_include", simulated("w.world"), 0, {}, {"warning", "callback"}},
    {"StateIsApplied",
     "W4_world_state",
     simulated("state_moved.world") + " && $PADE info OUT",
     0,
     {"on 3 % of the pixels, 6.9"},
     {"pade simulate: warning"}},
    {"PartOfAMesh", "W5_submesh", simulated("left.world"), 0, {}, {"warning"}},
    {"ImageWhereGazeboLooks",
     "W6_dae_texture_folder",
     simulated("w.world") + " --colour",
     0,
     {},
     {"warning"}},
    {"Polyline", "W8_schema_strictness", simulated("polyline.world"), 0, {}, {"warning"}},
    {"ScriptWithoutUri",
     "W8_schema_strictness",
     simulated("script_without_uri.world"),
     0,
     {"Gazebo/Red is drawn in its plain colour"}},
    {"VisualTwice", "W8_schema_strictness", simulated("duplicate_visual.world"), 0, {"is there twice"}},
};

class StrangersCases : public testing::TestWithParam<Case> {};

TEST_P(StrangersCases, AreReadRightOrNamed) {
  if (!fs::exists(kCases)) GTEST_SKIP() << kCases << " is not here";
  const fs::path work = fs::temp_directory_path() / ("pade_cases_" + std::to_string(std::random_device{}()));
  fs::create_directories(work);
  std::string command = GetParam().command;
  for (auto at = command.find("OUT"); at != std::string::npos; at = command.find("OUT"))
    command.replace(at, 3, (work / "out").string());
  const Outcome outcome =
      shell("PADE=" + kPade + "; cd " + (kCases / GetParam().folder).string() + " && $PADE " + command);
  fs::remove_all(work);
  EXPECT_EQ(outcome.code, GetParam().code) << outcome.text;
  for (const char* part : GetParam().says) EXPECT_THAT(outcome.text, HasSubstr(part));
  for (const char* part : GetParam().never) EXPECT_THAT(outcome.text, Not(HasSubstr(part)));
}

INSTANTIATE_TEST_SUITE_P(Of, StrangersCases, testing::ValuesIn(kAll),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace pade
