// What `pade info` says of a folder.
#include "pade/checks/sequence_check.hpp"

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/checks/scene_hardness.hpp"
#include "pade/io/image/image_codec.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

#include "support/temporary_folder.hpp"

namespace pade::evaluation {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;

const Camera& small_camera() {
  static const Camera camera = simulation::analytic_camera(240, 180);
  return camera;
}

/// A flight in the TUM layout without its poses, and where the camera truly is.
std::vector<io::StampedPose> write_images(const fs::path& folder, int frames, double way, bool with_depth) {
  const auto flight = simulation::make_analytic_flight("forward", 2, small_camera());
  EXPECT_TRUE(flight.ok());
  const Camera& c = small_camera();
  fs::create_directories(folder / "rgb");
  if (with_depth) fs::create_directories(folder / "depth");
  std::vector<io::StampedPose> poses;
  for (int i = 0; i < frames; ++i) {
    Pose step;
    step.rotation = rotation_exp({0.01 * way * i, 0.02 * way * i, -0.01 * way * i});
    step.translation = way * i * Eigen::Vector3d(0.1, 0.03, 0.16);
    const Pose pose = flight->T_world_camera.front() * step;
    poses.push_back({Time{100'000'000LL * (i + 1)}, pose});
    const std::string name = to_string(poses.back().time) + ".png";
    EXPECT_TRUE(
        io::save_image((folder / "rgb" / name).string(), simulation::render_image(flight->scene, c, pose)));
    if (!with_depth) continue;
    cv::Mat depth = simulation::exact_depth(flight->scene, c, pose);
    cv::patchNaNs(depth);
    depth.convertTo(depth, CV_16U, 1000);
    EXPECT_TRUE(io::save_image((folder / "depth" / name).string(), depth));
  }
  std::ofstream(folder / "camera.yaml")
      << "width: " << c.width << "\nheight: " << c.height << "\nfx: " << c.fx << "\nfy: " << c.fy
      << "\ncx: " << c.cx << "\ncy: " << c.cy
      << "\ndistortion_model: none\ndepth_scale: 1000\nworld_up: \"+z\"\n";
  return poses;
}

/// However far the flight is from 0 0 0, and so with whatever local origin.
TEST(SequenceCheck, RecognisesInvertedPosesWhereverTheFlightIs) {
  for (const bool with_depth : {true, false}) {
    const test::TemporaryFolder folder;
    const auto truth = write_images(folder.path(), 4, 1, with_depth);
    for (const Eigen::Vector3d& place :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1500, -300, 20), Eigen::Vector3d(468000, 5250000, 430)}) {
      for (const bool inverted : {false, true}) {
        std::vector<io::StampedPose> rows = truth;
        for (io::StampedPose& row : rows) {
          row.pose.translation += place;
          if (inverted) row.pose = row.pose.inverse();
        }
        std::ofstream(folder / "groundtruth.txt") << io::format_trajectory(rows);
        const auto sequence = io::Sequence::open(folder.path());
        ASSERT_TRUE(sequence) << sequence.error().message;
        EXPECT_EQ(sequence->local_origin().isZero(0), place.norm() < 1000);
        const auto check = check_sequence(*sequence);
        ASSERT_TRUE(check) << check.error().message;
        EXPECT_EQ(name_of(check->poses.best), inverted ? "inverted" : "as given")
            << place.transpose() << check->poses.sentence;
        EXPECT_EQ(check->poses.verdict, inverted ? PoseCheck::Verdict::wrong : PoseCheck::Verdict::good)
            << place.transpose() << check->poses.sentence;
      }
    }
  }
}

TEST(SequenceCheck, SaysHowMuchTrueDepthCannotBeUsed) {
  const test::TemporaryFolder folder;
  const auto poses = write_images(folder.path(), 6, 1, true);
  std::ofstream(folder / "groundtruth.txt") << io::format_trajectory(poses);
  const auto damage = [&](std::size_t i) {
    EXPECT_TRUE(io::save_image((folder.path() / "depth" / (to_string(poses[i].time) + ".png")).string(),
                               cv::Mat(90, 120, CV_16UC1, cv::Scalar(1000))));
  };
  for (const std::size_t i : {1, 3}) damage(i);
  const auto sequence = io::Sequence::open(folder.path());
  ASSERT_TRUE(sequence) << sequence.error().message;
  const auto check = check_sequence(*sequence);
  ASSERT_TRUE(check) << check.error().message;
  EXPECT_THAT(check->warnings, Contains(testing::AllOf(HasSubstr("2 of 5 depth images"),
                                                       HasSubstr("120 x 90 pixels, expected 240 x 180"))));
  for (const std::size_t i : {0, 2, 4, 5}) damage(i);
  const auto hardness = scene_hardness(*io::Sequence::open(folder.path()));
  ASSERT_FALSE(hardness);
  EXPECT_THAT(hardness.error().message, HasSubstr("120 x 90 pixels"));
}

TEST(SequenceCheck, AdvisesAStepThatThereIs) {
  for (const int frames : {2, 3, 6}) {
    const test::TemporaryFolder folder;
    const auto poses = write_images(folder.path(), frames, 1e-4, false);
    std::ofstream(folder / "groundtruth.txt") << io::format_trajectory(poses);
    const auto sequence = io::Sequence::open(folder.path());
    ASSERT_TRUE(sequence) << sequence.error().message;
    const auto check = check_sequence(*sequence);
    ASSERT_TRUE(check) << check.error().message;
    ASSERT_THAT(check->warnings, Contains(HasSubstr("the parallax is only")));
    for (const std::string& warning : check->warnings) {
      const std::size_t at = warning.find("--step ");
      EXPECT_EQ(at == std::string::npos, frames == 2 || warning.find("parallax") == std::string::npos);
      if (at == std::string::npos) continue;
      EXPECT_TRUE(check_sequence(*sequence, std::stoi(warning.substr(at + 7)))) << warning;
    }
  }
}

}  // namespace
}  // namespace pade::evaluation
