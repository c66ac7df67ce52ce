#include "pade/io/sequence/sequence.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "io/sequence/flight_folders.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using test::Flight;
using test::make_flight;
using test::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const Pose kMounting{Eigen::Quaterniond(forward_camera_rotation()) * rotation_exp({0.1, -0.2, 0.05}),
                     {0.12, -0.03, 0.07}};

/// Frames, poses and camera of `sequence` are those of `flight`, undistorted here by OpenCV-free means.
void expect_is(const Sequence& sequence, const Flight& flight) {
  ASSERT_EQ(sequence.size(), flight.size());
  EXPECT_THAT(sequence.skipped(), IsEmpty());
  EXPECT_EQ(sequence.camera(), flight.camera.undistorted());
  const Undistorter undistort(flight.camera);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const auto frame = sequence.frame(i);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->time, flight.times[i]);
    EXPECT_TRUE(test::same_pixels(frame->image, undistort(flight.images[i]))) << i;
    EXPECT_LT((frame->T_world_camera.translation - flight.T_world_camera[i].translation).norm(), 1e-9) << i;
    EXPECT_LT(test::rotation_difference(frame->T_world_camera, flight.T_world_camera[i]), 1e-9) << i;
  }
}

TEST(SequenceLayout, TumFolderGivesItsFrames) {
  const TemporaryFolder folder;
  const Flight flight = make_flight();
  test::write_tum(folder.path(), flight);
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->layout(), "TUM RGB-D");
  expect_is(*sequence, flight);
}

TEST(SequenceLayout, EurocFolderGivesTheSameFrames) {
  const TemporaryFolder folder;
  const Flight flight = make_flight();
  test::write_euroc(folder.path(), flight, kMounting);
  for (const auto& path : {folder.path(), folder / "mav0"}) {
    const auto sequence = Sequence::open(path);
    ASSERT_TRUE(sequence) << sequence.error().message;
    EXPECT_EQ(sequence->layout(), "EuRoC");
    expect_is(*sequence, flight);
    ASSERT_TRUE(sequence->world_up());
    EXPECT_EQ(sequence->world_up()->direction, Eigen::Vector3d::UnitZ());
  }
}

TEST(SequenceLayout, EurocRoomWithViconMarkersGivesTheSameFrames) {
  const TemporaryFolder folder;
  const Flight flight = make_flight();
  const Pose T_body_vicon{rotation_exp({0, 0, 0.4}), {0.1, 0.2, -0.3}};
  test::write_euroc_images(folder / "mav0", flight, kMounting);
  std::string poses =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n";
  for (std::size_t i = 0; i < flight.size(); ++i) {
    poses +=
        test::euroc_row(flight.times[i], flight.T_world_camera[i] * kMounting.inverse() * T_body_vicon, "");
  }
  test::write_text(folder.path() / "mav0" / "vicon0" / "data.csv", poses);
  test::write_text(
      folder.path() / "mav0" / "vicon0" / "sensor.yaml",
      "sensor_type: pose\nT_BS:\n  cols: 4\n  rows: 4\n  data: " + test::matrix_list(T_body_vicon) + "\n");
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  expect_is(*sequence, flight);
}

TEST(SequenceLayout, EurocPositionsWithoutOrientationAreRefused) {
  const TemporaryFolder folder;
  test::write_euroc_images(folder / "mav0", make_flight(), kMounting);
  test::write_text(folder.path() / "mav0" / "leica0" / "data.csv", "#timestamp,x,y,z\n1,0,0,0\n");
  const auto sequence = Sequence::open(folder.path());
  ASSERT_FALSE(sequence);
  EXPECT_THAT(sequence.error().message, HasSubstr("positions without orientation"));
}

TEST(SequenceLayout, KittiFolderAndDataSetTreeGiveTheSameFrames) {
  const TemporaryFolder folder;
  Flight flight = make_flight();
  flight.camera.distortion = Distortion::none;  // KITTI is rectified
  flight.camera.coefficients = {};
  const Eigen::Vector3d t_camera_camera0(-0.06, 0.001, 0.003);
  const auto alone = folder.path() / "alone";
  test::write_kitti(alone, alone / "poses.txt", flight, t_camera_camera0);
  const auto tree = folder.path() / "dataset";
  test::write_kitti(tree / "sequences" / "07", tree / "poses" / "07.txt", flight, t_camera_camera0);
  for (const auto& path : {alone, tree / "sequences" / "07", tree / "sequences" / "07" / ""}) {
    const auto sequence = Sequence::open(path);
    ASSERT_TRUE(sequence) << sequence.error().message;
    EXPECT_EQ(sequence->layout(), "KITTI odometry");
    expect_is(*sequence, flight);
  }
}

TEST(SequenceLayout, ImageListsAndFileNamesAgree) {
  const TemporaryFolder folder;
  const Flight flight = make_flight();
  test::write_tum(folder.path(), flight);
  std::string list = "# timestamp filename\n";
  std::string associations;
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const std::string name = fmt::format("rgb/{}.png", flight.stamp(i));
    list += flight.stamp(i) + " " + name + "\n";
    associations += fmt::format("{0} {1} {0} depth/{0}.png\n", flight.stamp(i), name);
  }
  test::write_text(folder / "associations.txt", associations);
  const auto by_associations = Sequence::open(folder.path());
  ASSERT_TRUE(by_associations) << by_associations.error().message;
  expect_is(*by_associations, flight);
  test::write_text(folder / "rgb.txt", list);
  const auto by_list = Sequence::open(folder.path());
  ASSERT_TRUE(by_list) << by_list.error().message;
  expect_is(*by_list, flight);
}

TEST(SequencePoses, AreChosenByName) {
  const TemporaryFolder folder;
  const Flight flight = make_flight();
  Flight other = flight;
  for (Pose& pose : other.T_world_camera) pose.translation *= 1.05;
  test::write_tum(folder.path(), flight);
  test::write_text(folder / "groundtruth_original.txt", test::pose_file(other));
  test::write_text(folder / "mine.txt", test::pose_file(other));
  SequenceOptions options;
  options.poses = "original";
  const auto original = Sequence::open(folder.path(), options);
  ASSERT_TRUE(original) << original.error().message;
  expect_is(*original, other);
  options.poses = (folder / "mine.txt").string();
  const auto mine = Sequence::open(folder.path(), options);
  ASSERT_TRUE(mine) << mine.error().message;
  expect_is(*mine, other);
}

TEST(SequencePoses, OfTheBodyAreMovedToTheCameraOnlyWhereTheFileSaysSo) {
  const TemporaryFolder folder;
  const Flight flight = make_flight();
  test::write_tum(folder.path(), flight);
  Flight body = flight;
  for (Pose& pose : body.T_world_camera) pose = pose * kMounting.inverse();
  test::write_text(folder / "groundtruth.txt", test::pose_file(body));
  const std::string yaml =
      test::camera_yaml(flight.camera) + "T_body_camera: " + test::matrix_list(kMounting) + "\n";
  test::write_text(folder / "camera.yaml", yaml + "pose_convention: body_to_world\n");
  const auto moved = Sequence::open(folder.path());
  ASSERT_TRUE(moved) << moved.error().message;
  expect_is(*moved, flight);
  test::write_text(folder / "camera.yaml", yaml);
  const auto unmoved = Sequence::open(folder.path());
  ASSERT_TRUE(unmoved);
  expect_is(*unmoved, body);
  EXPECT_THAT(unmoved->notes(), ElementsAre(HasSubstr("T_body_camera is given without pose_convention")));
  test::write_text(folder / "camera.yaml",
                   test::camera_yaml(flight.camera) + "pose_convention: body_to_world\n");
  const auto no_mounting = Sequence::open(folder.path());
  ASSERT_FALSE(no_mounting);
  EXPECT_THAT(no_mounting.error().message, HasSubstr("field T_body_camera is missing"));
}

TEST(SequencePoses, AreInterpolatedAtTheImageTimePlusTheClockOffset) {
  const TemporaryFolder folder;
  const Flight flight = make_flight();
  test::write_tum(folder.path(), flight);
  test::write_text(folder / "camera.yaml", test::camera_yaml(flight.camera) + "time_offset_s: 0.03\n");
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  ASSERT_EQ(sequence->size(), flight.size() - 1) << "the last frame has no pose 0.03 s later";
  for (std::size_t i = 0; i < sequence->size(); ++i) {
    const Pose expected = interpolate(flight.T_world_camera[i], flight.T_world_camera[i + 1], 0.3);
    EXPECT_LT((sequence->pose(i).translation - expected.translation).norm(), 1e-9);
    EXPECT_LT(test::rotation_difference(sequence->pose(i), expected), 1e-9);
  }
}

TEST(SequenceCalibration, AFileOfAnotherToolReplacesTheLens) {
  const TemporaryFolder folder;
  Flight flight = make_flight();
  test::write_tum(folder.path(), flight);
  flight.camera.fx = 77;
  test::write_text(folder / "sensor.yaml", test::euroc_sensor_yaml(flight.camera, Pose{}));
  SequenceOptions options;
  options.calibration = (folder / "sensor.yaml").string();
  const auto sequence = Sequence::open(folder.path(), options);
  ASSERT_TRUE(sequence) << sequence.error().message;
  expect_is(*sequence, flight);
  EXPECT_EQ(sequence->calibration().depth_scale, 1000) << "camera.yaml still says the rest";
}

TEST(SequenceCalibration, UnknownFieldsAreNamed) {
  const TemporaryFolder folder;
  const Flight flight = make_flight();
  test::write_tum(folder.path(), flight);
  test::write_text(folder / "camera.yaml", test::camera_yaml(flight.camera) + "wolrd_up: \"+z\"\n");
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence);
  EXPECT_THAT(sequence->notes(), ElementsAre(HasSubstr("field wolrd_up is unknown")));
}

TEST(SequenceTruth, IsAssociatedByTimeScaledAndNanWhereThereIsNone) {
  const TemporaryFolder folder;
  Flight flight = make_flight();
  flight.camera.coefficients = {};
  test::write_tum(folder.path(), flight);
  std::string list;
  for (std::size_t i = 0; i < flight.size(); ++i) {
    cv::Mat depth(flight.camera.size(), CV_16UC1, cv::Scalar(1500.0 + 100.0 * static_cast<double>(i)));
    depth.at<std::uint16_t>(3, 5) = 0;
    test::write_image(folder.path() / "depth" / fmt::format("{}.png", i), depth);
    const std::int64_t late = i == 2 ? 30'000'000 : 10'000'000;  // nanoseconds; 20 ms are allowed
    list += fmt::format("{} depth/{}.png\n", to_string({flight.times[i].nanoseconds + late}), i);
  }
  test::write_text(folder / "depth.txt", list);
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  ASSERT_TRUE(sequence->has_truth());
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const auto depth = sequence->truth(i);
    if (i == 2) {
      EXPECT_FALSE(depth);
      continue;
    }
    ASSERT_TRUE(depth) << depth.error().message;
    ASSERT_EQ(depth->type(), CV_32FC1);
    EXPECT_FLOAT_EQ(depth->at<float>(10, 10), 1.5F + 0.1F * static_cast<float>(i));
    EXPECT_TRUE(std::isnan(depth->at<float>(3, 5)));
    EXPECT_EQ(cv::countNonZero(*depth == *depth), flight.camera.width * flight.camera.height - 1);
  }
}

TEST(SequenceTruth, IsNaNWhereTheUndistortedPixelSeesNothing) {
  const TemporaryFolder folder;
  Flight flight = make_flight();
  flight.camera.coefficients = {0.25};  // pincushion: the corners of the pinhole image lie outside the sensor
  test::write_tum(folder.path(), flight);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    test::write_image(folder.path() / "depth" / (flight.stamp(i) + ".png"),
                      cv::Mat(flight.camera.size(), CV_16UC1, cv::Scalar(2000)));
  }
  SequenceOptions options;
  options.mask_growth = 0;
  const auto sequence = Sequence::open(folder.path(), options);
  ASSERT_TRUE(sequence) << sequence.error().message;
  const auto depth = sequence->truth(0);
  ASSERT_TRUE(depth);
  EXPECT_EQ(cv::norm((*depth == *depth), sequence->mask(), cv::NORM_INF), 0);
  EXPECT_LT(cv::countNonZero(sequence->mask()), 0.9 * flight.camera.width * flight.camera.height);
}

TEST(SequenceTruth, WithoutDepthScaleIsReportedAsSkipped) {
  const TemporaryFolder folder;
  const Flight flight = make_flight();
  test::write_tum(folder.path(), flight);
  test::write_image(folder.path() / "depth" / (flight.stamp(0) + ".png"), cv::Mat::ones(48, 64, CV_16UC1));
  std::string yaml = test::camera_yaml(flight.camera);
  test::write_text(folder / "camera.yaml", yaml.erase(yaml.find("depth_scale")));
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence);
  EXPECT_FALSE(sequence->has_truth());
  EXPECT_THAT(sequence->skipped(),
              ElementsAre(testing::Field(&Skipped::reason, HasSubstr("depth_scale is missing"))));
}

/// 16-bit frames of a ramp; every second frame also holds a lamp that is far brighter.
Flight make_deep_flight() {
  Flight flight = make_flight();
  flight.camera.coefficients = {};
  for (std::size_t i = 0; i < flight.size(); ++i) {
    cv::Mat image(flight.camera.size(), CV_16UC1);
    for (int v = 0; v < image.rows; ++v) {
      for (int u = 0; u < image.cols; ++u)
        image.at<std::uint16_t>(v, u) = static_cast<std::uint16_t>(8000 + 50 * u);
    }
    image.at<std::uint16_t>(20, 20) = 0;
    if (i % 2 == 1) image(cv::Rect(0, 0, 10, 10)).setTo(20000);
    flight.images[i] = image;
  }
  return flight;
}

TEST(SequenceIntensity, OfDeepImagesIsScaledAlikeInEveryFrame) {
  const TemporaryFolder folder;
  const Flight flight = make_deep_flight();
  test::write_tum(folder.path(), flight);
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->intensity().bits, 16);
  EXPECT_LT(sequence->intensity().low, 8000);
  EXPECT_GT(sequence->intensity().high, 20000);
  const cv::Mat first = sequence->frame(0)->image;
  ASSERT_EQ(first.type(), CV_8UC1);
  const cv::Rect same(12, 12, 52, 36);  // without the lamp
  for (std::size_t i = 1; i < flight.size(); ++i) {
    EXPECT_TRUE(test::same_pixels(sequence->frame(i)->image(same), first(same))) << i;
  }
  EXPECT_EQ(first.at<std::uint8_t>(20, 20), 0) << "0 stays 0: there is no pixel";
  EXPECT_GT(first.at<std::uint8_t>(40, 63), first.at<std::uint8_t>(40, 0) + 40) << "contrast is kept";
}

TEST(SequenceIntensity, RangeOfTheCalibrationIsUsedLiterally) {
  const TemporaryFolder folder;
  const Flight flight = make_deep_flight();
  test::write_tum(folder.path(), flight);
  test::write_text(folder / "camera.yaml",
                   test::camera_yaml(flight.camera) + "intensity_range: [8000, 10550]\n");
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  const cv::Mat image = sequence->frame(0)->image;
  for (int u = 1; u <= 50; ++u)
    EXPECT_EQ(image.at<std::uint8_t>(30, u), 5 * u) << "(50 u) / 10 counts per step";
  EXPECT_EQ(image.at<std::uint8_t>(30, 60), 255);
}

TEST(SequenceIntensity, OfColourImagesIsKept) {
  const TemporaryFolder folder;
  Flight flight = make_flight();
  for (cv::Mat& image : flight.images) cv::applyColorMap(image, image, cv::COLORMAP_JET);
  test::write_tum(folder.path(), flight);
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->frame(0)->image.type(), CV_8UC3);
  expect_is(*sequence, flight);
}

/// Chebyshev distance to the nearest of the invalid pixels, by brute force.
int distance_to_invalid(const cv::Mat& valid, int u, int v) {
  int nearest = 1000;
  for (int y = 0; y < valid.rows; ++y) {
    for (int x = 0; x < valid.cols; ++x) {
      if (valid.at<std::uint8_t>(y, x) == 0)
        nearest = std::min(nearest, std::max(std::abs(x - u), std::abs(y - v)));
    }
  }
  return nearest;
}

TEST(SequenceMask, IsTheRegionThatTheLensSeesGrownByTheRadius) {
  const TemporaryFolder folder;
  Flight flight = make_flight();
  flight.camera.coefficients = {0.25};
  test::write_tum(folder.path(), flight);
  cv::Mat seen = cv::Mat::zeros(flight.camera.size(), CV_8UC1);
  for (int v = 0; v < seen.rows; ++v) {
    for (int u = 0; u < seen.cols; ++u) {
      const auto pixel = flight.camera.project(*flight.camera.undistorted().unproject({u, v}));
      if (pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= seen.cols - 1 &&
          pixel->y() <= seen.rows - 1) {
        seen.at<std::uint8_t>(v, u) = 255;
      }
    }
  }
  SequenceOptions options;
  options.mask_growth = 3;
  const auto sequence = Sequence::open(folder.path(), options);
  ASSERT_TRUE(sequence) << sequence.error().message;
  for (int v = 0; v < seen.rows; ++v) {
    for (int u = 0; u < seen.cols; ++u) {
      EXPECT_EQ(sequence->mask().at<std::uint8_t>(v, u) != 0, distance_to_invalid(seen, u, v) > 3)
          << u << ' ' << v;
    }
  }
}

TEST(SequenceMask, LeavesOutWhatIsBlackInEveryFrameButNotWhatIsBlackInSome) {
  const TemporaryFolder folder;
  Flight flight = make_flight();
  flight.camera.coefficients = {};
  for (std::size_t i = 0; i < flight.size(); ++i) {
    flight.images[i].col(0).setTo(0);                                // one pixel wide, at the border
    flight.images[i](cv::Rect(50, 0, 14, 6)).setTo(0);               // a corner
    flight.images[i].at<std::uint8_t>(30, 30) = 0;                   // a dead pixel
    if (i != 3) flight.images[i](cv::Rect(20, 40, 20, 8)).setTo(0);  // dark, but once seen
  }
  test::write_tum(folder.path(), flight);
  SequenceOptions options;
  options.mask_growth = 2;
  const auto sequence = Sequence::open(folder.path(), options);
  ASSERT_TRUE(sequence) << sequence.error().message;
  cv::Mat expected(flight.camera.size(), CV_8UC1, cv::Scalar(255));
  expected.colRange(0, 3).setTo(0);
  expected(cv::Rect(48, 0, 16, 8)).setTo(0);
  EXPECT_TRUE(test::same_pixels(sequence->mask(), expected));
}

TEST(SequenceMask, OfAFileIsTakenAsItIs) {
  const TemporaryFolder folder;
  Flight flight = make_flight();
  flight.camera.coefficients = {};
  for (cv::Mat& image : flight.images) image.col(0).setTo(0);
  test::write_tum(folder.path(), flight);
  cv::Mat mask(flight.camera.size(), CV_8UC1, cv::Scalar(1));
  mask(cv::Rect(10, 10, 5, 5)).setTo(0);
  test::write_image(folder / "mask.png", mask);
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_TRUE(test::same_pixels(sequence->mask(), cv::Mat(mask * 255)));
  test::write_image(folder / "mask.png", cv::Mat::ones(10, 10, CV_8UC1));
  const auto wrong_size = Sequence::open(folder.path());
  ASSERT_FALSE(wrong_size);
  EXPECT_THAT(wrong_size.error().message,
              HasSubstr("mask.png: the mask has 10 x 10 pixels, expected 64 x 48"));
}

TEST(SequenceWorld, UpIsStatedByOptionThenFileElseGuessedFromTheCameras) {
  const TemporaryFolder folder;
  const Flight flight = make_flight();
  test::write_tum(folder.path(), flight);
  const auto guessed = Sequence::open(folder.path());
  ASSERT_TRUE(guessed);
  ASSERT_TRUE(guessed->world_up());
  EXPECT_FALSE(guessed->world_up()->stated);
  EXPECT_EQ(guessed->world_up()->direction, -Eigen::Vector3d::UnitY()) << "these cameras are nearly upright";
  test::write_text(folder / "camera.yaml", test::camera_yaml(flight.camera) + "world_up: \"+x\"\n");
  const auto stated = Sequence::open(folder.path());
  ASSERT_TRUE(stated);
  EXPECT_TRUE(stated->world_up()->stated);
  EXPECT_EQ(stated->world_up()->direction, Eigen::Vector3d::UnitX());
  SequenceOptions options;
  options.world_up = "-z";
  const auto overruled = Sequence::open(folder.path(), options);
  ASSERT_TRUE(overruled);
  EXPECT_EQ(overruled->world_up()->direction, -Eigen::Vector3d::UnitZ());
  options.world_up = "up";
  EXPECT_FALSE(Sequence::open(folder.path(), options));
}

TEST(SequenceWorld, OriginOnTheEarthComesFromTheGnssFile) {
  const TemporaryFolder folder;
  test::write_tum(folder.path(), make_flight());
  EXPECT_FALSE(Sequence::open(folder.path())->origin());
  test::write_text(folder / "gnss.csv", "# frame=ENU origin=48.1374,11.5755,519.5\nt_s,e,n,u\n");
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence);
  EXPECT_EQ(sequence->origin(), (GeographicOrigin{48.1374, 11.5755, 519.5}));
}

}  // namespace
}  // namespace pade::io
