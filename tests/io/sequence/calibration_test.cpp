#include "pade/io/sequence/calibration.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/sequence/flight_folders.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Camera camera(Distortion model, std::array<double, 8> coefficients) {
  return {752, 480, 458.654, 457.296, 367.215, 248.375, model, coefficients};
}

/// One lens and the words for it in every dialect.
struct Lens {
  const char* name;
  Camera camera;
  const char* ours;
  const char* kalibr;
  std::string numbers;
  int count;
};

const Lens kLenses[] = {
    {"PlumbBob", camera(Distortion::plumb_bob, {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}),
     "plumb_bob", "radtan", "-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05", 4},
    {"PlumbBobWithK3", camera(Distortion::plumb_bob, {0.1, -0.2, 0.001, -0.002, 0.05}), "plumb_bob", "radtan",
     "0.1, -0.2, 0.001, -0.002, 0.05", 5},
    {"RationalPolynomial",
     camera(Distortion::rational_polynomial, {0.3, 0.02, 1e-4, -2e-4, 0.001, 0.6, 0.1, 0.005}),
     "rational_polynomial", "rational_polynomial", "0.3, 0.02, 1e-4, -2e-4, 0.001, 0.6, 0.1, 0.005", 8},
    {"Equidistant", camera(Distortion::equidistant, {-0.0132, 0.0021, -0.0014, 0.0003}), "equidistant",
     "equidistant", "-0.0132, 0.0021, -0.0014, 0.0003", 4},
};

class LensDialects : public testing::TestWithParam<Lens> {
 protected:
  void expect_equal_camera(const std::string& text, const std::string& format) {
    const auto read = parse_calibration(text, "calibration.yaml");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->format, format);
    ASSERT_TRUE(read->camera);
    EXPECT_EQ(*read->camera, GetParam().camera);
    EXPECT_THAT(read->unknown_fields, IsEmpty());
  }
};

TEST_P(LensDialects, OurOwnFileGivesTheCamera) {
  expect_equal_camera(
      fmt::format("width: 752\nheight: 480\nfx: 458.654\nfy: 457.296\ncx: 367.215\ncy: 248.375\n"
                  "distortion_model: {}\ndistortion: [{}]\n",
                  GetParam().ours, GetParam().numbers),
      "camera.yaml");
}

TEST_P(LensDialects, KalibrCamchainGivesTheSameCamera) {
  expect_equal_camera(
      fmt::format("cam0:\n  cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [{}]\n"
                  "  distortion_model: {}\n  intrinsics: [458.654, 457.296, 367.215, 248.375]\n"
                  "  resolution: [752, 480]\n  rostopic: /cam0/image_raw\n"
                  "cam1:\n  camera_model: omni\n",
                  GetParam().numbers, GetParam().kalibr),
      "Kalibr");
}

TEST_P(LensDialects, RosCameraInfoGivesTheSameCamera) {
  expect_equal_camera(
      fmt::format(
          "image_width: 752\nimage_height: 480\ncamera_name: mono\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
          "  data: [458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1]\ndistortion_model: {}\n"
          "distortion_coefficients:\n  rows: 1\n  cols: {}\n  data: [{}]\nrectification_matrix:\n  rows: 3\n"
          "  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nprojection_matrix:\n  rows: 3\n  cols: 4\n"
          "  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]\n",
          GetParam().ours, GetParam().count, GetParam().numbers),
      "ROS camera_info");
}

TEST_P(LensDialects, OpenCvsOwnWriterGivesTheSameCamera) {
  // OpenCV itself writes the file, as its calibration programs do.
  const Camera& c = GetParam().camera;
  cv::FileStorage file("calibration.yml",
                       cv::FileStorage::WRITE | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_YAML);
  file << "calibration_time"
       << "Sun 22 Nov 2026 10:00:00 AM";
  file << "image_width" << c.width << "image_height" << c.height;
  if (c.distortion == Distortion::equidistant) file << "fisheye_model" << 1;
  file << "camera_matrix" << (cv::Mat_<double>(3, 3) << c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
  cv::Mat k(GetParam().count, 1, CV_64F);
  for (int i = 0; i < k.rows; ++i) k.at<double>(i) = c.coefficients[static_cast<std::size_t>(i)];
  file << "distortion_coefficients" << k << "avg_reprojection_error" << 0.2;
  expect_equal_camera(file.releaseAndGetString(), "OpenCV");
}

TEST_P(LensDialects, EurocSensorFileGivesTheSameCamera) {
  const std::string model =
      GetParam().kalibr == std::string("radtan") ? "radial-tangential" : GetParam().ours;
  expect_equal_camera(
      fmt::format("sensor_type: camera\ncomment: left\nT_BS:\n  cols: 4\n  rows: 4\n"
                  "  data: [0, 0, 1, 0.1, -1, 0, 0, 0.2, 0, -1, 0, 0.3, 0, 0, 0, 1]\nrate_hz: 20\n"
                  "resolution: [752, 480]\ncamera_model: pinhole\n"
                  "intrinsics: [458.654, 457.296, 367.215, 248.375]\ndistortion_model: {}\n"
                  "distortion_coefficients: [{}]\n",
                  model, GetParam().numbers),
      "EuRoC");
}

INSTANTIATE_TEST_SUITE_P(All, LensDialects, testing::ValuesIn(kLenses),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST(Calibration, KalibrsImuExtrinsicIsTheInverseOfTheMounting) {
  const Pose T_body_camera{Eigen::Quaterniond(forward_camera_rotation()), {0.1, 0.2, 0.3}};
  const Pose T_cam_imu = T_body_camera.inverse();
  const auto read = parse_calibration(
      fmt::format(
          "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: radtan\n"
          "  intrinsics: [400, 400, 320, 240]\n  resolution: [640, 480]\n  timeshift_cam_imu: -0.0125\n"
          "  T_cam_imu: {}\n",
          test::matrix_list(T_cam_imu)),
      "camchain.yaml");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_TRUE(read->T_body_camera);
  EXPECT_LT((read->T_body_camera->translation - T_body_camera.translation).norm(), 1e-12);
  EXPECT_LT(test::rotation_difference(*read->T_body_camera, T_body_camera), 1e-12);
  EXPECT_EQ(read->time_offset_s, -0.0125);
}

TEST(Calibration, OpenCvsFourteenCoefficientsAreReadWhereThePrismIsFlat) {
  const std::string head =
      "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ 400., 0., 320., 0., 400., 240., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   "
      "rows: 1\n"
      "   cols: 14\n   dt: d\n   data: [ 1., 2., 3., 4., 5., 6., 7., 8., ";
  const auto flat = parse_calibration(head + "0., 0., 0., 0., 0., 0. ]\n", "a.yml");
  ASSERT_TRUE(flat) << flat.error().message;
  EXPECT_EQ(flat->camera->distortion, Distortion::rational_polynomial);
  EXPECT_EQ(flat->camera->coefficients[7], 8);
  EXPECT_EQ(flat->camera->width, 0) << "the file states no image size";
  const auto prism = parse_calibration(head + "0.1, 0., 0., 0., 0., 0. ]\n", "a.yml");
  ASSERT_FALSE(prism);
  EXPECT_THAT(prism.error().message, HasSubstr("found 9 distortion coefficients"));
}

const std::string kGood =
    "width: 640\nheight: 480\nfx: 400\nfy: 401\ncx: 320\ncy: 240\ndistortion_model: plumb_bob\n"
    "distortion: [0, 0, 0, 0, 0]\n";

TEST(CameraYaml, EveryFieldIsRead) {
  const auto read = parse_calibration(kGood + R"(depth_scale: 900
pose_convention: body_to_world
stereo_baseline_m: 0.5
world_up: [0, 0, 2]
T_body_camera: [[0, 0, 1, 0.1], [-1, 0, 0, 0.2], [0, -1, 0, 0.3], [0, 0, 0, 1]]
time_offset_s: 0.004
gnss_lever_arm: [0.1, 0, -0.2]
intensity_range: [100, 4095]
geographic_origin: [48.1, 11.6, 519]
colour: blue
)",
                                      "camera.yaml");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->depth_scale, 900);
  EXPECT_EQ(read->pose_convention, PoseConvention::body_to_world);
  EXPECT_EQ(*read->world_up, Eigen::Vector3d::UnitZ());
  EXPECT_LT((read->T_body_camera->matrix3() - forward_camera_rotation()).norm(), 1e-12);
  EXPECT_EQ(read->T_body_camera->translation, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(read->time_offset_s, 0.004);
  EXPECT_EQ(*read->gnss_lever_arm, Eigen::Vector3d(0.1, 0, -0.2));
  EXPECT_EQ((*read->intensity)[1], 4095);
  EXPECT_EQ(read->origin->latitude_deg, 48.1);
  EXPECT_THAT(read->unknown_fields, ElementsAre("colour")) << "named, not ignored in silence";
}

struct BadField {
  const char* name;
  std::string text;
  std::vector<const char*> message;
};

std::string without(const std::string& line) {
  std::string text = kGood;
  const std::size_t at = text.find(line + ":");
  return text.erase(at, text.find('\n', at) + 1 - at);
}
std::string replaced(const std::string& field, const std::string& value) {
  return without(field) + field + ": " + value + "\n";
}

class BadCameraYaml : public testing::TestWithParam<BadField> {};

TEST_P(BadCameraYaml, IsRefusedByFileFieldAndExpectation) {
  const auto read = parse_calibration(GetParam().text, "camera.yaml");
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("camera.yaml: "));
  for (const char* part : GetParam().message) EXPECT_THAT(read.error().message, HasSubstr(part));
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, BadCameraYaml,
    testing::Values(
        BadField{
            "NoFocalLength", without("fx"), {"field fx is missing", "a positive focal length in pixels"}},
        BadField{"NoHeight", without("height"), {"field height is missing"}},
        BadField{"NoPrincipalPoint", without("cy"), {"field cy is missing"}},
        BadField{"NoModel", without("distortion_model"), {"field distortion_model is missing"}},
        BadField{"NoCoefficients", without("distortion"), {"found 0 distortion coefficients", "4 or 5"}},
        BadField{"NegativeFocalLength",
                 replaced("fy", "-401"),
                 {"line 8", "field fy", "found \"-401\"", "positive"}},
        BadField{"ZeroFocalLength", replaced("fx", "0"), {"field fx", "found \"0\"", "positive"}},
        BadField{"NanFocalLength", replaced("fx", ".nan"), {"field fx", "found \".nan\"", "finite"}},
        BadField{"InfiniteCentre", replaced("cx", ".inf"), {"field cx", "finite"}},
        BadField{"HugeCentre", replaced("cx", "1e999"), {"field cx", "finite"}},
        BadField{"TextAsNumber", replaced("cx", "middle"), {"field cx", "found \"middle\""}},
        BadField{"HalfAPixel", replaced("width", "640.5"), {"field width", "whole number"}},
        BadField{"NegativeSize", replaced("height", "-480"), {"field height", "whole number"}},
        BadField{"UnknownModel",
                 replaced("distortion_model", "fov"),
                 {"found distortion model \"fov\"", "plumb_bob"}},
        BadField{
            "WrongCount", replaced("distortion", "[1, 2, 3]"), {"found 3 distortion coefficients", "4 or 5"}},
        BadField{"NanCoefficient", replaced("distortion", "[0, 0, .nan, 0]"), {"field distortion", "finite"}},
        BadField{"CoefficientsWithoutModel",
                 replaced("distortion_model", "none") + "distortion: [0.1]\n",
                 {"appears twice"}},
        BadField{"ZeroDepthScale", kGood + "depth_scale: 0\n", {"field depth_scale", "positive"}},
        BadField{"OffsetOfYears", kGood + "time_offset_s: 1e9\n", {"field time_offset_s", "at most a day"}},
        BadField{"WordAsUp", kGood + "world_up: upward\n", {"field world_up", "found \"upward\"", "+z"}},
        BadField{"ZeroUp", kGood + "world_up: [0, 0, 0]\n", {"field world_up", "not all zero"}},
        BadField{"PlanarUp", kGood + "world_up: [0, 1]\n", {"field world_up", "found a list of 2 values"}},
        BadField{"UnknownConvention",
                 kGood + "pose_convention: ned\n",
                 {"field pose_convention", "found \"ned\""}},
        BadField{"ScaledRotation",
                 kGood + "T_body_camera: [2,0,0,0, 0,2,0,0, 0,0,2,0, 0,0,0,1]\n",
                 {"field T_body_camera", "a rotation matrix"}},
        BadField{"MirroredRotation",
                 kGood + "T_body_camera: [1,0,0,0, 0,1,0,0, 0,0,-1,0, 0,0,0,1]\n",
                 {"field T_body_camera", "a rotation matrix"}},
        BadField{"TransposedTransform",
                 kGood + "T_body_camera: [1,0,0,0, 0,1,0,0, 0,0,1,0, 1,2,3,1]\n",
                 {"field T_body_camera", "above 0 0 0 1"}},
        BadField{"ShortTransform",
                 kGood + "T_body_camera: [1,0,0,0, 0,1,0,0, 0,0,1,0]\n",
                 {"field T_body_camera", "found a list of 12 values"}},
        BadField{
            "FallingIntensity", kGood + "intensity_range: [200, 100]\n", {"field intensity_range", "rising"}},
        BadField{"PolarOrigin",
                 kGood + "geographic_origin: [95, 0, 0]\n",
                 {"field geographic_origin", "latitude"}},
        BadField{"TwiceTheSame", kGood + "fx: 500\n", {"field fx appears twice"}},
        BadField{"BrokenYaml", kGood + "distortion: [1, 2\n", {"not valid YAML"}},
        BadField{"NoFields", "just text\n", {"expected the fields of a camera calibration"}},
        BadField{"Empty", "", {"found nothing", "expected the fields"}},
        BadField{"AliasLoop", "a: &a [*a, *a]\n", {"nested deeper"}},
        BadField{"AliasBomb",
                 "a: &a [1,1,1,1,1,1,1,1,1,1]\nb: &b [*a,*a,*a,*a,*a,*a,*a,*a,*a,*a]\n"
                 "c: &c [*b,*b,*b,*b,*b,*b,*b,*b,*b,*b]\nd: &d [*c,*c,*c,*c,*c,*c,*c,*c,*c,*c]\n"
                 "e: &e [*d,*d,*d,*d,*d,*d,*d,*d,*d,*d]\nf: [*e,*e,*e,*e,*e,*e,*e,*e,*e,*e]\n",
                 {"more than 100000 values"}},
        BadField{"OtherProjection",
                 "cam0:\n  camera_model: omni\n  intrinsics: [1, 2, 3, 4, 5]\n  distortion_model: radtan\n",
                 {"field camera_model", "found \"omni\"", "expected pinhole"}},
        BadField{"RosWithoutSize",
                 "camera_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\ndistortion_model: "
                 "plumb_bob\n",
                 {"field image_width or width is missing"}},
        BadField{"SkewedMatrix",
                 "camera_matrix: {rows: 3, cols: 3, data: [1, 0.1, 0, 0, 1, 0, 0, 0, 1]}\n",
                 {"3x3 camera matrix"}},
        BadField{"MatrixOfWrongSize",
                 "camera_matrix: {rows: 3, cols: 4, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n",
                 {"3x3 camera matrix"}}),
    [](const auto& kind) { return std::string(kind.param.name); });

TEST(Direction, AnAxisOrThreeNumbersSurviveTheRoundTrip) {
  for (const char* text : {"+x", "-x", "+y", "-y", "+z", "-z"})
    EXPECT_EQ(to_text(*parse_direction(text)), text);
  EXPECT_EQ(parse_direction("z"), Eigen::Vector3d::UnitZ());
  const auto slanted = parse_direction("0 3 4");
  ASSERT_TRUE(slanted);
  EXPECT_LT((*slanted - Eigen::Vector3d(0, 0.6, 0.8)).norm(), 1e-15);
  EXPECT_LT((*parse_direction(to_text(*slanted)) - *slanted).norm(), 1e-15);
  for (const char* text : {"", "+", "up", "zz", "0 0 0", "1 2", "1 2 nan"})
    EXPECT_FALSE(parse_direction(text)) << text;
}

}  // namespace
}  // namespace pade::io
