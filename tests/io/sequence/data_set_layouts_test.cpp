// The same flight in the folders of TartanAir and ICL-NUIM, as the data sets are unpacked.
#include <cmath>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/sequence/depth_file.hpp"
#include "pade/io/sequence/sequence.hpp"

#include "io/sequence/flight_folders.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

using test::Flight;
using test::TemporaryFolder;
using testing::Contains;
using testing::HasSubstr;

/// A flight with the lens of a data set, whose frames are `step` nanoseconds apart from `first` on.
Flight flight_of(const Camera& camera, std::int64_t step, int first) {
  Flight flight = test::make_flight();
  flight.camera = camera;
  for (std::size_t i = 0; i < flight.size(); ++i) {
    flight.times[i] = Time{(first + static_cast<std::int64_t>(i)) * step};
    cv::Mat image(camera.size(), CV_8UC1);
    cv::RNG(i + 1).fill(image, cv::RNG::UNIFORM, 30, 250);
    flight.images[i] = image;
  }
  return flight;
}

/// Depth that differs in every pixel, with a hole.
cv::Mat some_depth(const Camera& camera) {
  cv::Mat depth(camera.size(), CV_32FC1);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u)
      depth.at<float>(v, u) = 1 + 0.01F * static_cast<float>(u) + 0.005F * static_cast<float>(v);
  }
  depth.at<float>(3, 5) = 0;
  return depth;
}

void write_npy(const std::filesystem::path& file, const cv::Mat& depth, const char* type = "<f4",
               std::size_t each = sizeof(float)) {
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}, {}), }}", type,
                                   depth.rows, depth.cols);
  while ((10 + header.size() + 1) % 64 != 0) header += ' ';
  header += '\n';
  std::string bytes =
      std::string("\x93NUMPY\x01", 7) + '\0' + static_cast<char>(header.size()) + '\0' + header;
  bytes.append(reinterpret_cast<const char*>(depth.data), depth.total() * each);
  test::write_text(file, bytes);
}

void expect_is(const Sequence& sequence, const Flight& flight) {
  ASSERT_EQ(sequence.size(), flight.size());
  EXPECT_EQ(sequence.camera(), flight.camera);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const auto frame = sequence.frame(i);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->time, flight.times[i]);
    EXPECT_TRUE(test::same_pixels(frame->image, flight.images[i])) << i;
    EXPECT_LT((frame->T_world_camera.translation - flight.T_world_camera[i].translation).norm(), 1e-9) << i;
    EXPECT_LT(test::rotation_difference(frame->T_world_camera, flight.T_world_camera[i]), 1e-9) << i;
  }
}

void expect_depth(const Sequence& sequence, const cv::Mat& depth, double tolerance) {
  const auto truth = sequence.truth(0);
  ASSERT_TRUE(truth) << truth.error().message;
  EXPECT_TRUE(std::isnan(truth->at<float>(3, 5)));
  EXPECT_NEAR(truth->at<float>(20, 30), depth.at<float>(20, 30), tolerance);
  EXPECT_NEAR(truth->at<float>(400, 600), depth.at<float>(400, 600), tolerance);
}

/// Rows of a camera whose axes are forward, right, down, in the same world.
std::string forward_right_down(const Flight& flight) {
  std::string rows;
  for (const Pose& pose : flight.T_world_camera) {
    Eigen::Matrix3d forward_right_down;  // columns: the axes of the new camera in the old one
    forward_right_down << 0, 1, 0, 0, 0, 1, 1, 0, 0;
    const Eigen::Quaterniond q(Eigen::Matrix3d(pose.matrix3() * forward_right_down));
    const Eigen::Vector3d& t = pose.translation;
    rows += fmt::format("{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n", t.x(), t.y(), t.z(),
                        q.x(), q.y(), q.z(), q.w());
  }
  return rows;
}

TEST(TartanAirFolder, GivesFramesPosesAndDepth) {
  const TemporaryFolder folder;
  const Camera camera{640, 480, 320, 320, 320, 240, Distortion::none, {}};
  const Flight flight = flight_of(camera, 100'000'000, 0);
  const cv::Mat depth = some_depth(camera);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    test::write_image(folder / "image_left" / fmt::format("{:06}_left.png", i), flight.images[i]);
    write_npy(folder / "depth_left" / fmt::format("{:06}_left_depth.npy", i), depth);
  }
  test::write_text(folder / "pose_left.txt", forward_right_down(flight));
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->layout(), "TartanAir");
  expect_is(*sequence, flight);
  expect_depth(*sequence, depth, 1e-6);
  ASSERT_TRUE(sequence->world_up());
  EXPECT_EQ(sequence->world_up()->direction, Eigen::Vector3d(0, 0, -1)) << "the world is north, east, down";
  EXPECT_THAT(sequence->notes(), Contains(HasSubstr("no times")));
}

TEST(TartanAirFolder, OfTheSecondVersionHasDepthInTheBytesOfAnImage) {
  const TemporaryFolder folder;
  const Camera camera{640, 640, 320, 320, 320, 320, Distortion::none, {}};
  Flight flight = flight_of(camera, 100'000'000, 0);
  const cv::Mat depth = some_depth(camera);
  const cv::Mat bytes(camera.size(), CV_8UC4, depth.data);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    test::write_image(folder / "image_lcam_front" / fmt::format("{:06}_lcam_front.png", i), flight.images[i]);
    test::write_image(folder / "depth_lcam_front" / fmt::format("{:06}_lcam_front_depth.png", i), bytes);
  }
  test::write_text(folder / "pose_lcam_front.txt", forward_right_down(flight));
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  expect_is(*sequence, flight);
  expect_depth(*sequence, depth, 1e-6);
}

TEST(TartanAirFolder, OfTheSecondVersionHasTwelveCameras) {
  for (const char* name : {"lcam_back", "rcam_top"}) {
    const TemporaryFolder folder;
    const Flight flight = flight_of({640, 640, 320, 320, 320, 320, Distortion::none, {}}, 100'000'000, 0);
    for (std::size_t i = 0; i < flight.size(); ++i) {
      test::write_image(folder / fmt::format("image_{}", name) / fmt::format("{:06}_{}.png", i, name),
                        flight.images[i]);
    }
    test::write_text(folder / fmt::format("pose_{}.txt", name), forward_right_down(flight));
    const auto sequence = Sequence::open(folder.path());
    ASSERT_TRUE(sequence) << sequence.error().message;
    expect_is(*sequence, flight);
  }
}

TEST(TartanAirFolder, WithoutPosesSaysWhichRowsItExpects) {
  const TemporaryFolder folder;
  const Flight flight = flight_of({640, 480, 320, 320, 320, 240, Distortion::none, {}}, 100'000'000, 0);
  for (std::size_t i = 0; i < flight.size(); ++i)
    test::write_image(folder / "image_left" / fmt::format("{:06}_left.png", i), flight.images[i]);
  test::write_text(folder / "pose_left.txt", "");
  const auto sequence = Sequence::open(folder.path());
  ASSERT_FALSE(sequence);
  EXPECT_THAT(sequence.error().message, HasSubstr("row i for image i"));
}

TEST(TartanAirFolder, MayStartLater) {
  const TemporaryFolder folder;
  Flight flight = flight_of({640, 480, 320, 320, 320, 240, Distortion::none, {}}, 100'000'000, 0);
  for (std::size_t i = 2; i < flight.size(); ++i)
    test::write_image(folder / "image_left" / fmt::format("{:06}_left.png", i), flight.images[i]);
  test::write_text(folder / "pose_left.txt", forward_right_down(flight));
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  ASSERT_EQ(sequence->size(), 4U);
  EXPECT_LT((sequence->pose(0).translation - flight.T_world_camera[2].translation).norm(), 1e-9)
      << "row 2 is image 2";
}

TEST(IclNuimFolder, IsTurnedRightHanded) {
  const TemporaryFolder folder;
  const Camera camera{640, 480, 481.2, 480, 319.5, 239.5, Distortion::none, {}};
  Flight flight = flight_of(camera, 0, 0);
  const cv::Mat depth = some_depth(camera);
  cv::Mat counts;
  depth.convertTo(counts, CV_16U, 5000);
  // A point of the scene by its coordinates x right, y up, z forward, in camera and world alike.
  const Eigen::DiagonalMatrix<double, 3> turn(1, -1, 1);
  std::string rows;
  std::string associations = "0 depth/0.png 0 rgb/0.png\n";
  for (std::size_t i = 0; i < flight.size(); ++i) {
    flight.times[i] = Time::from_seconds((static_cast<double>(i) + 1) / 30);
    const Pose& pose = flight.T_world_camera[i];
    const Eigen::Quaterniond q(Eigen::Matrix3d(turn * pose.matrix3() * turn));
    const Eigen::Vector3d t = turn * pose.translation;
    rows += fmt::format("{} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n", i + 1, t.x(), t.y(),
                        t.z(), q.x(), q.y(), q.z(), q.w());
    test::write_image(folder / "rgb" / fmt::format("{}.png", i + 1), flight.images[i]);
    test::write_image(folder / "depth" / fmt::format("{}.png", i + 1), counts);
    associations += fmt::format("{0} depth/{0}.png {0} rgb/{0}.png\n", i + 1);
  }
  test::write_image(folder / "rgb" / "0.png", flight.images[0]);  // the first image has no pose
  test::write_text(folder / "associations.txt", associations);
  test::write_text(folder / "livingRoom2.gt.freiburg", rows);
  const auto sequence = Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  EXPECT_EQ(sequence->layout(), "ICL-NUIM");
  EXPECT_EQ(sequence->frames_without_pose(), 1U);
  expect_is(*sequence, flight);
  expect_depth(*sequence, depth, 2e-4);
  ASSERT_TRUE(sequence->world_up());
  EXPECT_EQ(sequence->world_up()->direction, Eigen::Vector3d(0, -1, 0));
}

TEST(DepthFile, ReadsFloatsOfAnySize) {
  const TemporaryFolder folder;
  const std::vector<double> doubles = {2.5, 1e4, 0.25, 3, 4, 5};
  std::vector<Eigen::half> halves;
  for (const double value : doubles) halves.emplace_back(static_cast<float>(value));
  const auto write = [&](const char* name, const char* type, const void* values, std::size_t size) {
    const cv::Mat bytes(2, 3, CV_32FC1, const_cast<void*>(values));
    write_npy(folder / name, bytes, type, size);
    return read_depth_file(folder / name);
  };
  const auto wide = write("wide.npy", "<f8", doubles.data(), sizeof(double));
  const auto narrow = write("narrow.npy", "<f2", halves.data(), sizeof(Eigen::half));
  for (const auto* read : {&wide, &narrow}) {
    ASSERT_TRUE(*read) << read->error().message;
    for (int i = 0; i < 6; ++i)
      EXPECT_EQ((*read)->at<float>(i / 3, i % 3), static_cast<float>(doubles[static_cast<std::size_t>(i)]));
  }
}

TEST(DepthFile, RefusesArraysThatAreNoDepth) {
  const TemporaryFolder folder;
  const cv::Mat depth(4, 6, CV_32FC1, cv::Scalar(2));
  const auto message = [&](const char* name) {
    const auto read = read_depth_file(folder / name);
    return read ? std::string() : read.error().message;
  };
  write_npy(folder / "good.npy", depth);
  EXPECT_EQ(message("good.npy"), "");
  write_npy(folder / "big-endian.npy", depth, ">f4");
  EXPECT_THAT(message("big-endian.npy"), HasSubstr("expected a .npy array of rows x columns"));
  write_npy(folder / "integers.npy", depth, "<i4");
  EXPECT_THAT(message("integers.npy"), HasSubstr("expected a .npy array of rows x columns"));
  test::write_text(folder / "text.npy", "not an array");
  EXPECT_THAT(message("text.npy"), HasSubstr("text.npy: expected a .npy array"));
  std::string bytes = test::read_bytes(folder / "good.npy");
  for (const std::size_t size : {bytes.size() - 1, std::size_t{70}, std::size_t{12}, std::size_t{9}}) {
    test::write_text(folder / "cut.npy", bytes.substr(0, size));
    EXPECT_NE(message("cut.npy"), "") << size;
  }
  EXPECT_THAT(message("none.npy"), HasSubstr("none.npy"));
}

TEST(CameraNumber, IsThatOfTheCalibrationThatHasTheLastWord) {
  const TemporaryFolder folder;
  const Flight flight = test::make_flight();
  test::write_tum(folder.path(), flight);
  const auto chain = [&](int cameras) {
    std::string text;
    for (int i = 0; i < cameras; ++i) {
      text += fmt::format(
          "cam{}:\n  camera_model: pinhole\n  intrinsics: [{}, {}, 31, 23]\n  distortion_model: none\n"
          "  distortion_coeffs: []\n  resolution: [64, 48]\n",
          i, 60 + i, 60 + i);
    }
    return text;
  };
  const auto opened = [&](int camera, const std::string& calibration = {}) {
    SequenceOptions options;
    options.camera = camera;
    options.calibration = calibration;
    const auto sequence = Sequence::open(folder.path(), options);
    return sequence ? fmt::format("{}", sequence->camera().fx) : sequence.error().message;
  };
  const fs::path own = folder.path() / "camera.yaml";
  const std::string other = (folder.path() / "camchain.yaml").string();
  test::write_text(other, chain(5));
  // Our own camera.yaml has one camera.
  EXPECT_EQ(opened(0), "60");
  EXPECT_THAT(opened(1), testing::AllOf(HasSubstr(own.string()), HasSubstr("number 1")));
  EXPECT_EQ(opened(4, other), "64") << "camera.yaml is read too, and has no such number";
  // So may a chain be the flight's own.
  test::write_text(own, chain(3));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(opened(i), fmt::format("{}", 60 + i));
  EXPECT_THAT(opened(7), testing::AllOf(HasSubstr(own.string()), HasSubstr("cam7")));
  EXPECT_EQ(opened(4, other), "64");
}

TEST(CameraNumber, IsRefusedWhereALayoutKnowsItsOnlyCamera) {
  const TemporaryFolder folder;
  const Flight flight = test::make_flight();
  test::write_euroc(folder.path(), flight, {});
  SequenceOptions options;
  ASSERT_TRUE(Sequence::open(folder.path(), options));
  options.camera = 1;
  const auto sequence = Sequence::open(folder.path(), options);
  ASSERT_FALSE(sequence);
  EXPECT_THAT(sequence.error().message, HasSubstr("camera 1"));
}

}  // namespace
}  // namespace pade::io
