// The pose check recognises every wrong convention, in an analytic scene and in recordings.
#include "pade/checks/pose_check.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <tuple>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pade/checks/sequence_check.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/report/report.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade::evaluation {
namespace {

// The rows of a pose file whose author followed `convention`, for cameras that are truly at `poses`.
Pose row_in(PoseConvention convention, const Pose& T_world_camera) {
  const auto about = [&](const Eigen::Matrix3d& R_optical_author) {
    return Pose{T_world_camera.rotation * Eigen::Quaterniond(R_optical_author), T_world_camera.translation};
  };
  Eigen::Matrix3d R;
  switch (convention) {
    case PoseConvention::inverted:
      return T_world_camera.inverse();
    case PoseConvention::gl_axes:  // the author's axes in ours: x right, y up, z backward
      R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
      return about(R);
    case PoseConvention::frd_axes:  // x forward (our z), y right (our x), z down (our y)
      R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
      return about(R);
    case PoseConvention::flu_axes:  // x forward, y left, z up
      R << 0, -1, 0, 0, 0, -1, 1, 0, 0;
      return about(R);
    case PoseConvention::scalar_first: {  // w x y z, read as x y z w
      const Eigen::Quaterniond& q = T_world_camera.rotation;
      return Pose{Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), T_world_camera.translation};
    }
    case PoseConvention::images_turned:
      R << -1, 0, 0, 0, -1, 0, 0, 0, 1;
      return about(R);
    case PoseConvention::millimetres:
      return Pose{T_world_camera.rotation, 1000 * T_world_camera.translation};
    case PoseConvention::left_handed: {
      const Eigen::DiagonalMatrix<double, 3> turn(1, -1, 1);
      return Pose{Eigen::Quaterniond(Eigen::Matrix3d(turn * T_world_camera.matrix3() * turn)),
                  turn * T_world_camera.translation};
    }
    default:
      return T_world_camera;
  }
}

// Rows in opposite order are a mistake of the file as a whole, the others of each row.
void put_rows(PoseConvention convention, const Pose& first, const Pose& second, PoseCheckPair& pair) {
  const bool swapped = convention == PoseConvention::inverse_relative;
  pair.first_pose = row_in(convention, swapped ? second : first);
  pair.second_pose = row_in(convention, swapped ? first : second);
}

std::string label(PoseConvention convention) {
  std::string name(name_of(convention));
  name.erase(std::remove(name.begin(), name.end(), ' '), name.end());
  return name;
}

// A free motion: forward, sideways, up and turning, from a start that is not the world's origin.
std::vector<Pose> free_motion(int frames) {
  std::vector<Pose> poses;
  for (int i = 0; i < frames; ++i) {
    Pose pose;
    pose.rotation = rotation_exp({0.01 * i, 0.3 + 0.02 * i, -0.01 * i});
    pose.translation = {0.1 * i, 0.03 * i, 0.16 * i};
    poses.push_back(pose);
  }
  return poses;
}

struct Case {
  PoseConvention convention;
  bool with_depth;
};
std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const PoseConvention convention : pose_conventions) {
    if (convention == PoseConvention::row_before || convention == PoseConvention::row_after) continue;
    for (const bool with_depth : {true, false}) cases.push_back({convention, with_depth});
  }
  return cases;
}

class PoseCheckOfAnAnalyticScene : public testing::TestWithParam<Case> {};

TEST_P(PoseCheckOfAnAnalyticScene, NamesTheConvention) {
  const Camera camera = simulation::analytic_camera(240, 180);
  const auto flight = simulation::make_analytic_flight("forward", 2, camera);
  ASSERT_TRUE(flight.ok());
  const Pose start = flight->T_world_camera.front();
  const std::vector<Pose> motion = free_motion(3);
  std::vector<Pose> poses;
  for (const Pose& step : motion) poses.push_back(start * (motion.front().inverse() * step));
  std::vector<PoseCheckPair> pairs;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    PoseCheckPair pair;
    pair.first = simulation::render_image(flight->scene, camera, poses[i]);
    pair.second = simulation::render_image(flight->scene, camera, poses[i + 1]);
    if (GetParam().with_depth) pair.depth = simulation::exact_depth(flight->scene, camera, poses[i]);
    put_rows(GetParam().convention, poses[i], poses[i + 1], pair);
    pairs.push_back(std::move(pair));
  }
  const PoseCheck check = check_poses(pairs, camera);
  EXPECT_EQ(check.photometric, GetParam().with_depth);
  EXPECT_EQ(name_of(check.best), name_of(GetParam().convention));
  const auto expected = GetParam().convention == PoseConvention::as_given ? PoseCheck::Verdict::good
                                                                          : PoseCheck::Verdict::wrong;
  EXPECT_EQ(check.verdict, expected) << check.sentence;
}

INSTANTIATE_TEST_SUITE_P(PosesThatAre, PoseCheckOfAnAnalyticScene, testing::ValuesIn(all_cases()),
                         [](const auto& instance) {
                           return label(instance.param.convention) +
                                  (instance.param.with_depth ? "WithDepth" : "ByTracks");
                         });

/// Rows that run one frame late or early, in a flight that speeds up and turns: in steady motion nothing
/// tells.
TEST(PoseCheckOfShiftedRows, NamesTheShift) {
  const Camera camera = simulation::analytic_camera(240, 180);
  const auto flight = simulation::make_analytic_flight("forward", 2, camera);
  ASSERT_TRUE(flight.ok());
  const Pose start = flight->T_world_camera.front();
  std::vector<Pose> poses;
  for (int i = 0; i < 7; ++i) {
    const double way = 0.02 * i * i;
    poses.push_back(start *
                    Pose{rotation_exp({0, 0.004 * i * i, 0}), {i % 2 == 0 ? 0.0 : 0.12, 0.02 * i, way}});
  }
  for (const int shift : {1, -1, 0}) {
    const auto row = [&](int i) { return poses[static_cast<std::size_t>(std::clamp(i + shift, 0, 6))]; };
    std::vector<PoseCheckPair> pairs;
    for (int i = 2; i <= 4; ++i) {
      PoseCheckPair pair;
      pair.first = simulation::render_image(flight->scene, camera, poses[static_cast<std::size_t>(i)]);
      pair.second = simulation::render_image(flight->scene, camera, poses[static_cast<std::size_t>(i - 1)]);
      pair.depth = simulation::exact_depth(flight->scene, camera, poses[static_cast<std::size_t>(i)]);
      pair.first_pose = row(i);
      pair.second_pose = row(i - 1);
      pair.rows_before = {row(i - 1), row(i - 2)};
      pair.rows_after = {row(i + 1), row(i)};
      pairs.push_back(std::move(pair));
    }
    const PoseCheck check = check_poses(pairs, camera);
    const auto expected = shift == 1    ? PoseConvention::row_before
                          : shift == -1 ? PoseConvention::row_after
                                        : PoseConvention::as_given;
    EXPECT_EQ(name_of(check.best), name_of(expected)) << check.sentence;
  }
}

TEST(PoseCheckOfHover, CannotTell) {
  const Camera camera = simulation::analytic_camera(160, 120);
  const auto flight = simulation::make_analytic_flight("hover", 2, camera);
  ASSERT_TRUE(flight.ok());
  const Pose pose = flight->T_world_camera.front();
  const cv::Mat image = simulation::render_image(flight->scene, camera, pose);
  const std::vector<PoseCheckPair> pairs = {
      {image, image, pose, pose, simulation::exact_depth(flight->scene, camera, pose), {}, {}}};
  EXPECT_EQ(check_poses(pairs, camera).verdict, PoseCheck::Verdict::unclear);
}

TEST(PoseCheckOfBlankImages, CannotTell) {
  const Camera camera = simulation::analytic_camera(160, 120);
  const cv::Mat blank(120, 160, CV_8UC1, cv::Scalar(128));
  const std::vector<Pose> poses = free_motion(2);
  const std::vector<PoseCheckPair> pairs = {{blank, blank, poses[0], poses[1], {}, {}, {}}};
  const PoseCheck check = check_poses(pairs, camera);
  EXPECT_EQ(check.verdict, PoseCheck::Verdict::unclear);
  EXPECT_EQ(check.pairs, 0);
  EXPECT_EQ(check_poses({}, camera).verdict, PoseCheck::Verdict::unclear);
}

struct Recording {
  const char* name;
  const char* folder;
  std::size_t step;
};
class PoseCheckOfARecording : public testing::TestWithParam<std::tuple<Recording, PoseConvention>> {};

TEST_P(PoseCheckOfARecording, NamesTheConvention) {
  const auto& [recording, convention] = GetParam();
  const std::filesystem::path folder =
      std::filesystem::path(PADE_SOURCE_DIR) / "../shared/data/sequences" / recording.folder;
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const auto sequence = io::Sequence::open(folder);
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  std::vector<PoseCheckPair> pairs;
  for (const std::size_t i : evenly_spread(sequence->size() - recording.step, 6)) {
    PoseCheckPair pair;
    for (const bool is_first : {true, false}) {
      const cv::Mat image = sequence->frame(is_first ? i : i + recording.step).value().image;
      cv::Mat& grey = is_first ? pair.first : pair.second;
      if (image.channels() == 3)
        cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
      else
        grey = image;
    }
    if (sequence->has_truth()) pair.depth = sequence->truth(i).value();
    put_rows(convention, sequence->pose(i), sequence->pose(i + recording.step), pair);
    pairs.push_back(std::move(pair));
  }
  const PoseCheck check = check_poses(pairs, sequence->camera());
  EXPECT_EQ(name_of(check.best), name_of(convention)) << check.sentence;
  EXPECT_EQ(check.verdict,
            convention == PoseConvention::as_given ? PoseCheck::Verdict::good : PoseCheck::Verdict::wrong)
      << check.sentence;
}

INSTANTIATE_TEST_SUITE_P(
    Of, PoseCheckOfARecording,
    testing::Combine(testing::Values(Recording{"kitti01", "kitti01_ramp_forward", 1},
                                     Recording{"redkitchen", "redkitchen_sideways", 2},
                                     Recording{"hospital", "tartan_hospital", 1},
                                     Recording{"crazyflie", "mononav_crazyflie_forward_nodepth", 2}),
                     testing::Values(PoseConvention::as_given, PoseConvention::inverted,
                                     PoseConvention::inverse_relative, PoseConvention::gl_axes,
                                     PoseConvention::frd_axes, PoseConvention::flu_axes)),
    [](const auto& instance) {
      return std::string(std::get<0>(instance.param).name) + "_" + label(std::get<1>(instance.param));
    });

class SequenceCheckOfARecording : public testing::TestWithParam<Recording> {};

TEST_P(SequenceCheckOfARecording, FindsItSane) {
  const std::filesystem::path folder =
      std::filesystem::path(PADE_SOURCE_DIR) / "../shared/data/sequences" / GetParam().folder;
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const auto sequence = io::Sequence::open(folder);
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  const auto check = check_sequence(*sequence, static_cast<int>(GetParam().step), 6);
  ASSERT_TRUE(check.ok()) << check.error().message;
  EXPECT_EQ(check->poses.verdict, PoseCheck::Verdict::good) << check->poses.sentence;
  EXPECT_GT(check->parallax.value_or(check->parallax_at_5_metres), 1);
  EXPECT_LT(check->gap.most, 1.5 * check->gap.median);
  EXPECT_EQ(check->truth_depth.has_value(), sequence->has_truth());
}

INSTANTIATE_TEST_SUITE_P(Of, SequenceCheckOfARecording,
                         testing::Values(Recording{"kitti01", "kitti01_ramp_forward", 1},
                                         Recording{"redkitchen", "redkitchen_sideways", 2},
                                         Recording{"hospital", "tartan_hospital", 1},
                                         Recording{"crazyflie", "mononav_crazyflie_forward_nodepth", 2}),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace pade::evaluation
