#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/sequence/calibration.hpp"

#include "io/sequence/flight_folders.hpp"

namespace pade::io {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const Camera kLens{640, 480, 400.5, 401.5, 320.25, 240.75, Distortion::plumb_bob, {-0.3, 0.1, 0.001, -0.002}};

Camera without_size(Camera camera) {
  camera.width = camera.height = 0;
  return camera;
}

/// A whole file, and the camera that is in it.
struct Written {
  const char* name;
  const char* format;
  std::string text;
  Camera camera = kLens;
  int index = 0;
};

const std::string kMatrixRows = "[400.5, 0.0, 320.25, 0.0, 401.5, 240.75, 0.0, 0.0, 1.0]";
const std::string kOpenCvMatrix =
    "!!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 400.5, 0., 320.25, 0., 401.5, 240.75, 0., "
    "0., 1. ]\n";
const std::string kOpenCvLens =
    "!!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ -0.3, 0.1, 0.001, -0.002, 0. ]\n";

std::string xml_matrix(const std::string& name, int rows, int columns, const std::string& data) {
  return fmt::format(
      "<{0} type_id=\"opencv-matrix\">\n  <rows>{1}</rows>\n  <cols>{2}</cols>\n  <dt>d</dt>\n"
      "  <data>\n    {3}</data></{0}>\n",
      name, rows, columns, data);
}

std::string listed(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += fmt::format("- {}\n", value);
  return text;
}

class Dialects : public testing::TestWithParam<Written> {};

TEST_P(Dialects, GiveTheCamera) {
  const auto read = parse_calibration(GetParam().text, "file.yaml", GetParam().index);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->format, GetParam().format);
  ASSERT_TRUE(read->camera);
  EXPECT_EQ(*read->camera, GetParam().camera);
}

TEST_P(Dialects, RefuseANumberThatTheyHaveNoCameraOf) {
  for (const int number : {4, 99}) {
    const auto read = parse_calibration(GetParam().text, "file.yaml", number);
    ASSERT_FALSE(read) << number;
    EXPECT_THAT(read.error().message, testing::HasSubstr("file.yaml")) << number;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Of, Dialects,
    testing::Values(
        Written{"Ros1Echo", "ROS camera_info",
                "header: \n  seq: 4\n  stamp: \n    secs: 16\n    nsecs: 1\n  frame_id: \"c\"\nheight: "
                "480\nwidth: "
                "640\ndistortion_model: \"plumb_bob\"\nD: [-0.3, 0.1, 0.001, -0.002, 0.0]\nK: " +
                    kMatrixRows +
                    "\nR: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\nP: [400.5, 0.0, 320.25, 0.0, 0.0, "
                    "401.5, "
                    "240.75, 0.0, 0.0, 0.0, 1.0, 0.0]\nbinning_x: 0\nbinning_y: 0\nroi: \n  x_offset: 0\n  "
                    "height: "
                    "0\n  width: 0\n  do_rectify: False\n---\nheader: \n  seq: 5\n"},
        Written{
            "RosIni", "ROS camera_info (INI)",
            "# oST version 5.0 "
            "parameters\n\n\n[image]\n\nwidth\n640\n\nheight\n480\n\n[narrow_stereo]\n\ncamera "
            "matrix\n400.5 0.0 320.25\n0.0 401.5 240.75\n0.0 0.0 1.0\n\ndistortion\n-0.3 0.1 0.001 -0.002 "
            "0.0\n\nrectification\n1 0 0\n0 1 0\n0 0 1\n\nprojection\n390 0 310 0\n0 390 230 0\n0 0 1 0\n"},
        Written{"Ros2Echo", "ROS camera_info",
                "header:\n  frame_id: c\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\nd:\n" +
                    listed({-0.3, 0.1, 0.001, -0.002, 0}) + "k:\n" +
                    listed({400.5, 0, 320.25, 0, 401.5, 240.75, 0, 0, 1}) + "r:\n" +
                    listed({1, 0, 0, 0, 1, 0, 0, 0, 1}) + "p:\n" +
                    listed({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}) +
                    "binning_x: 0\nroi:\n  x_offset: 0\n---\n"},
        Written{
            "RosWithoutCoefficients", "ROS camera_info",
            "image_width: 640\nimage_height: 480\ncamera_name: front\ncamera_matrix:\n  rows: 3\n  cols: 3\n "
            " data: " +
                kMatrixRows +
                "\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 0\n  data: []\n",
            kLens.undistorted()},
        Written{"RosWithZerosForPrismAndTilt",
                "ROS camera_info",
                "image_width: 640\nimage_height: 480\ncamera_matrix:\n  data: " + kMatrixRows +
                    "\ndistortion_model: rational_polynomial\ndistortion_coefficients:\n  data: [0.4, -2.5, "
                    "0.1, 0.2, "
                    "1.5, 0.3, -2.3, 1.4, 0, 0, 0, 0, 0, 0]\n",
                {640,
                 480,
                 400.5,
                 401.5,
                 320.25,
                 240.75,
                 Distortion::rational_polynomial,
                 {0.4, -2.5, 0.1, 0.2, 1.5, 0.3, -2.3, 1.4}}},
        Written{"OpenCvSampleName", "OpenCV",
                "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: " + kOpenCvMatrix +
                    "dist_coeff: " + kOpenCvLens},
        Written{
            "OpenCvXml", "OpenCV",
            "<?xml version=\"1.0\"?>\n<opencv_storage>\n<calibration_Time>\"Sun Nov 29\"</calibration_Time>\n"
            "<!-- a comment -->\n<image_width>640</image_width>\n<image_height>480</image_height>\n" +
                xml_matrix("camera_matrix", 3, 3, "400.5 0. 320.25\n    0. 401.5 240.75 0. 0. 1.") +
                xml_matrix("distortion_coefficients", 5, 1, "-3.0e-01 1.0e-01\n 1.0e-03 -2.0e-03 0.") +
                "<per_view_reprojection_errors/>\n</opencv_storage>\n"},
        Written{"OpenCvXmlOfOldTutorials", "OpenCV",
                "<opencv_storage>\n<image_Width>640</image_Width><image_Height>480</image_Height>\n" +
                    xml_matrix("Camera_Matrix", 3, 3, "400.5 0 320.25 0 401.5 240.75 0 0 1") +
                    xml_matrix("Distortion_Coefficients", 5, 1, "-0.3 0.1 0.001 -0.002 0") +
                    xml_matrix("Extrinsic_Parameters", 1, 6, "1 2 3 4 5 6") + "</opencv_storage>\n"},
        Written{"OpenCvXmlOfAPair", "OpenCV",
                "<?xml version=\"1.0\"?>\n<opencv_storage>\n" + xml_matrix("M1", 3, 3, "1 0 1 0 1 1 0 0 1") +
                    xml_matrix("D1", 1, 4, "0 0 0 0") +
                    xml_matrix("M2", 3, 3, "400.5 0 320.25 0 401.5 240.75 0 0 1") +
                    xml_matrix("D2", 1, 4, "-0.3 0.1 0.001 -0.002") + "</opencv_storage>\n",
                without_size(kLens), 1},
        Written{"OpenCvCamelCase", "OpenCV",
                "%YAML:1.0\n---\ncameraMatrix: " + kOpenCvMatrix + "distCoeffs: " + kOpenCvLens,
                without_size(kLens)},
        Written{"OpenCvTutorialInPython", "OpenCV",
                "mtx:\n- [400.5, 0.0, 320.25]\n- [0.0, 401.5, 240.75]\n- [0.0, 0.0, 1.0]\ndist:\n- [-0.3, "
                "0.1, 0.001, "
                "-0.002, 0.0]\n",
                without_size(kLens)},
        Written{"OpenCvRoundingInTheMatrix", "OpenCV",
                "camera_matrix: [400.5, 1.0e-14, 320.25, 0, 401.5, 240.75, 0, 0, 1]\ndist_coeffs: [-0.3, "
                "0.1, 0.001, "
                "-0.002]\n",
                without_size(kLens)},
        Written{"OpenCvSecondOfAPair", "OpenCV",
                "%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1., 0., "
                "1., 0., 1., "
                "1., 0., 0., 1. ]\nD1: !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n   data: [ 0., 0., "
                "0., 0. "
                "]\nM2: " +
                    kOpenCvMatrix + "D2: " + kOpenCvLens,
                without_size(kLens), 1},
        Written{"EurocWithAYamlHeader", "EuRoC",
                "%YAML:1.0\n# General\ncamera_id: left_cam\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0, 0, 1, "
                "0.1, -1, 0, "
                "0, 0.2, 0, -1, 0, 0.3, 0, 0, 0, 1]\nrate_hz: 20\nresolution: [640, 480]\ncamera_model: "
                "pinhole\nintrinsics: [400.5, 401.5, 320.25, 240.75]\ndistortion_model: "
                "radial-tangential\ndistortion_coefficients: [-0.3, 0.1, 0.001, -0.002]\n"},
        Written{
            "OrbSlam2", "ORB-SLAM",
            "%YAML:1.0\n\nCamera.fx: 400.5\nCamera.fy: 401.5\nCamera.cx: 320.25\nCamera.cy: "
            "240.75\nCamera.k1: "
            "-0.3\nCamera.k2: 0.1\nCamera.p1: 0.001\nCamera.p2: -0.002\nCamera.width: 640\nCamera.height: "
            "480\nCamera.fps: 20.0\nCamera.RGB: 1\nORBextractor.nFeatures: 1000\nViewer.PointSize:2\n"},
        Written{
            "OrbSlam3SecondCamera",
            "ORB-SLAM",
            "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"KannalaBrandt8\"\nCamera1.fx: 1\nCamera1.fy: "
            "1\nCamera1.cx: 1\nCamera1.cy: 1\nCamera1.k1: 0.1\nCamera1.k2: 0.1\nCamera1.k3: 0.1\nCamera1.k4: "
            "0.1\nCamera2.fx: 400.5\nCamera2.fy: 401.5\nCamera2.cx: 320.25\nCamera2.cy: 240.75\nCamera2.k1: "
            "0.01\nCamera2.k2: -0.02\nCamera2.k3: 0.03\nCamera2.k4: -0.04\nCamera.width: 640\nCamera.height: "
            "480\n",
            {640, 480, 400.5, 401.5, 320.25, 240.75, Distortion::equidistant, {0.01, -0.02, 0.03, -0.04}},
            1},
        Written{"VinsPinhole", "VINS",
                "%YAML:1.0\n---\nmodel_type: PINHOLE\ncamera_name: camera\nimage_width: 640\nimage_height: "
                "480\ndistortion_parameters:\n   k1: -0.3\n   k2: 0.1\n   p1: 0.001\n   p2: "
                "-0.002\nprojection_parameters:\n   fx: 400.5\n   fy: 401.5\n   cx: 320.25\n   cy: 240.75\n"},
        Written{
            "VinsKannalaBrandt",
            "VINS",
            "%YAML:1.0\n---\nmodel_type: KANNALA_BRANDT\ncamera_name: camera\nimage_width: "
            "640\nimage_height: "
            "480\nprojection_parameters:\n   k2: 0.01\n   k3: -0.02\n   k4: 0.03\n   k5: -0.04\n   mu: "
            "400.5\n   mv: "
            "401.5\n   u0: 320.25\n   v0: 240.75\n",
            {640, 480, 400.5, 401.5, 320.25, 240.75, Distortion::equidistant, {0.01, -0.02, 0.03, -0.04}}},
        Written{"KittiRaw", "KITTI raw",
                "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.95e-02\nS_01: 7.0e+02 5.0e+02\nK_01: 1 0 1 "
                "0 1 1 0 0 "
                "1\nD_01: -0.3 0.1 0 0 0\nR_01: 1 0 0 0 1 0 0 0 1\nS_rect_01: 6.4e+02 4.8e+02\nP_rect_01: "
                "400.5 0 "
                "320.25 -387.5 0 401.5 240.75 0 0 0 1 0\n",
                kLens.undistorted(), 1},
        Written{"KittiOdometry", "KITTI",
                "P0: 1 0 1 0 0 1 1 0 0 0 1 0\nP1: 400.5 0 320.25 -387.5 0 401.5 240.75 0 0 0 1 0\n",
                without_size(kLens.undistorted()), 1},
        // COLMAP's first pixel has its centre at (0.5, 0.5).
        Written{"ColmapOpenCv", "COLMAP",
                "# Camera list\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n1 OPENCV 640 480 400.5 401.5 "
                "320.75 241.25 "
                "-0.3 0.1 0.001 -0.002\n"},
        Written{"ColmapSecond",
                "COLMAP",
                "1 PINHOLE 10 10 1 1 5 5\n2 SIMPLE_RADIAL 640 480 400 320.5 240.5 0.02\n",
                {640, 480, 400, 400, 320, 240, Distortion::plumb_bob, {0.02}},
                1}),
    [](const auto& instance) { return std::string(instance.param.name); });

struct Refused {
  const char* name;
  std::string text;
  const char* message;
  int index = 0;
};

class RefusedCalibrations : public testing::TestWithParam<Refused> {};

TEST_P(RefusedCalibrations, NameTheReason) {
  const auto read = parse_calibration(GetParam().text, "file.yaml", GetParam().index);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr(GetParam().message));
  EXPECT_THAT(read.error().message, HasSubstr("file.yaml: "));
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, RefusedCalibrations,
    testing::Values(
        Refused{"LensOfAnotherName",
                "width: 1\nheight: 1\nfx: 1\nfy: 1\ncx: 1\ncy: 1\ndistortion_model: none\nlens: wide\n",
                "field lens: looks like a lens"},
        Refused{"MountingOfAnotherName",
                "width: 1\nheight: 1\nfx: 1\nfy: 1\ncx: 1\ncy: 1\ndistortion_model: none\nT_cam_body: [1]\n",
                "line 8: field T_cam_body: looks like"},
        Refused{"NestedCamera", "camera:\n  fx: 1\n", "field camera: looks like"},
        Refused{"ChainWithoutTheFirst", "cam1:\n  camera_model: pinhole\n",
                "found cam1, expected cam0: choose one with --camera"},
        Refused{"RealSkew", "camera_matrix: [400, 2, 320, 0, 400, 240, 0, 0, 1]\n", "found a skew of 2"},
        Refused{"Binned",
                "width: 640\nheight: 480\ndistortion_model: plumb_bob\nD: []\nK: [400, 0, 320, 0, 400, 240, "
                "0, 0, "
                "1]\nbinning_x: 2\n",
                "binning_x"},
        Refused{"OmnidirectionalVins",
                "model_type: MEI\nimage_width: 640\nimage_height: 480\nprojection_parameters: {gamma1: 1}\n",
                "field model_type: found \"MEI\""},
        Refused{"ColmapFov", "1 FOV 640 480 1 1 1 1 1\n", "found camera model \"FOV\""},
        Refused{"NoSuchColmapCamera", "1 PINHOLE 640 480 1 1 1 1\n", "found 1 cameras", 3},
        Refused{"EmptyXml", "<?xml version=\"1.0\"?>\n<opencv_storage></opencv_storage>\n", "without fields"},
        Refused{"OtherXml", "<?xml version=\"1.0\"?>\n<calibration><f>3000</f></calibration>\n",
                "line 2: found XML of <calibration>, expected <opencv_storage>"},
        Refused{"XmlCutShort", "<opencv_storage>\n<camera_matrix><rows>3</rows>\n",
                "line 3: found the end of the file"},
        Refused{"XmlFieldTwice", "<opencv_storage>\n<a>1</a>\n<a>2</a></opencv_storage>\n",
                "line 3: field a appears twice"},
        Refused{"XmlLensOfAnotherName",
                "<opencv_storage>\n" + xml_matrix("Intrinsics", 3, 3, "400 0 320 0 400 240 0 0 1") +
                    "</opencv_storage>\n",
                "line 2: field Intrinsics: looks like a lens"},
        Refused{"XmlMatrixOfWords",
                "<opencv_storage>\n" + xml_matrix("camera_matrix", 3, 3, "a b c d e f g h i") +
                    "</opencv_storage>\n",
                "field camera_matrix: found \"a\""},
        Refused{"XmlMatrixWithNan",
                "<opencv_storage>\n" + xml_matrix("camera_matrix", 3, 3, "400 0 .Nan 0 400 240 0 0 1") +
                    "</opencv_storage>\n",
                "field camera_matrix: found \".Nan\""},
        Refused{"MatrixOfAnotherSize", "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [400, 0, 320]\n",
                "line 4: field camera_matrix: found a list of 3 values"},
        Refused{"VinsWithTheLensElsewhere",
                "%YAML:1.0\nimu: 1\ncam0_calib: \"cam0_mei.yaml\"\nestimate_extrinsic: 0\n",
                "line 3: field cam0_calib: the lens is in another file, \"cam0_mei.yaml\""},
        Refused{"ReportOfKalibr", "Calibration results\n===\nCamera-system parameters:\ncam0 (/image):\n",
                "expected the camchain.yaml"},
        Refused{"Binary", std::string("\1\0\0\0\0\0\0\0", 8), "colmap model_converter"},
        Refused{"NoYaml", "width: 640\nA message was lost!!!\n\ttotal: 1\n", "not valid YAML"},
        Refused{"IniWithoutAMatrix",
                "[image]\n\nwidth\n640\n\nheight\n480\n\n[camera]\n\ndistortion\n0 0 0 0 0\n",
                "section [camera] expected width and height"},
        Refused{
            "RosIniWithoutAModel",
            "[image]\n\nwidth\n640\n\nheight\n480\n\n[camera]\n\ncamera matrix\n400 0 320\n0 400 240\n0 0 "
            "1\n\ndistortion\n-0.01 0.02 0.003 -0.001\n",
            "fisheye or plumb_bob"},
        Refused{"ThinPrism",
                "image_width: 640\nimage_height: 480\ncamera_matrix:\n  data: [1, 0, 1, 0, 1, 1, 0, 0, "
                "1]\ndistortion_model: rational_polynomial\ndistortion_coefficients:\n  data: [1, 1, 1, 1, "
                "1, 1, 1, 1, "
                "0.1, 0, 0, 0]\n",
                "thin prism"}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(KalibrChain, AnyCameraGetsItsMountingThroughTheChain) {
  const Pose T_cam0_imu{rotation_exp({0.1, -0.2, 0.3}), {0.1, 0.2, 0.3}};
  const Pose T_cam1_cam0{rotation_exp({0.01, 0.02, -0.03}), {-0.11, 0.001, 0.002}};
  const auto camera = [](const std::string& extrinsics, int fx) {
    return fmt::format(
        "  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: radtan\n  "
        "intrinsics: [{0}, {0}, 320, 240]\n  resolution: [640, 480]\n{1}",
        fx, extrinsics);
  };
  for (const bool inverse : {false, true}) {
    const std::string imu = inverse ? "  T_imu_cam: " + test::matrix_list(T_cam0_imu.inverse()) + "\n"
                                    : "  T_cam_imu: " + test::matrix_list(T_cam0_imu) + "\n";
    const std::string text = "cam0:\n" + camera(imu, 400) + "cam1:\n" +
                             camera("  T_cn_cnm1: " + test::matrix_list(T_cam1_cam0) + "\n", 500);
    const auto read = parse_calibration(text, "camchain.yaml", 1);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->camera->fx, 500);
    ASSERT_TRUE(read->T_body_camera);
    const Pose expected = (T_cam1_cam0 * T_cam0_imu).inverse();
    EXPECT_LT((read->T_body_camera->translation - expected.translation).norm(), 1e-12);
    EXPECT_LT(test::rotation_difference(*read->T_body_camera, expected), 1e-12);
  }
}

TEST(Mountings, OfRtabMapIsThatOfTheCameraOnTheBase) {
  const auto read = parse_calibration(
      "image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\ncamera_matrix: {data: [400, 0, 320, "
      "0, 400, "
      "240, 0, 0, 1]}\ndistortion_coefficients: {data: [0, 0, 0, 0, 0]}\nlocal_transform: {rows: 3, cols: 4, "
      "data: [0, "
      "0, 1, 0.1, -1, 0, 0, 0.2, 0, -1, 0, 0.3]}\n",
      "calib.yaml");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_TRUE(read->T_body_camera);
  EXPECT_LT((read->T_body_camera->translation - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-12);
  EXPECT_LT((read->T_body_camera->rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(),
            1e-9)
      << "it looks ahead";
}

TEST(Mountings, OfOrbSlamAndVinsAreThoseOfTheCameraInTheBody) {
  const Pose T_body_camera{Eigen::Quaterniond(forward_camera_rotation()), {0.1, 0.2, 0.3}};
  const auto orb = parse_calibration("Camera.fx: 1\nCamera.fy: 1\nCamera.cx: 1\nCamera.cy: 1\nTbc: " +
                                         test::matrix_list(T_body_camera) + "\n",
                                     "orb.yaml");
  ASSERT_TRUE(orb) << orb.error().message;
  EXPECT_LT((orb->T_body_camera->matrix3() - T_body_camera.matrix3()).norm(), 1e-12);
  const auto vins = parse_calibration(
      "model_type: PINHOLE\nprojection_parameters: {fx: 1, fy: 1, cx: 1, cy: 1}\nbody_T_cam0: " +
          test::matrix_list(T_body_camera) + "\ntd: 0.005\n",
      "vins.yaml");
  ASSERT_TRUE(vins) << vins.error().message;
  EXPECT_EQ(vins->T_body_camera->translation, T_body_camera.translation);
  EXPECT_EQ(vins->time_offset_s, 0.005);
}

}  // namespace
}  // namespace pade::io
