#include "pade/offline/map_sequence.hpp"

#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/run/run_reader.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_render.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A small flight on the disk in the TUM layout, and a place for runs; removed with the test.
class MapSequence : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / ("pade_map_sequence_" + std::to_string(std::random_device{}()));
    fs::create_directories(sequence() / "rgb");
    fs::create_directories(sequence() / "depth");
    const auto flight =
        *simulation::make_analytic_flight("forward", 6, simulation::analytic_camera(160, 120));
    std::vector<io::StampedPose> poses;
    for (std::size_t k = 0; k < flight.times.size(); ++k) {
      const std::string name = to_string(flight.times[k]) + ".png";
      const Pose& pose = flight.T_world_camera[k];
      EXPECT_TRUE(io::save_image(sequence() / "rgb" / name,
                                 simulation::render_image(flight.scene, flight.camera, pose)));
      cv::Mat depth = simulation::exact_depth(flight.scene, flight.camera, pose);
      cv::patchNaNs(depth);
      depth.convertTo(depth, CV_16U, 1000);
      EXPECT_TRUE(io::save_image(sequence() / "depth" / name, depth));
      poses.push_back({flight.times[k], pose});
    }
    std::ofstream(sequence() / "groundtruth.txt") << io::format_trajectory(poses);
    const Camera& c = flight.camera;
    std::ofstream(sequence() / "camera.yaml")
        << "width: " << c.width << "\nheight: " << c.height << "\nfx: " << c.fx << "\nfy: " << c.fy
        << "\ncx: " << c.cx << "\ncy: " << c.cy
        << "\ndistortion_model: none\ndepth_scale: 1000\nworld_up: \"+z\"\n";
  }
  void TearDown() override { fs::remove_all(root_); }

  [[nodiscard]] fs::path sequence() const { return root_ / "flight"; }

  Result<MapResult> map(const std::string& run, const MapSequenceOptions& options = {}, int threads = 1,
                        const std::function<bool(const MapProgress&)>& progress = {}) const {
    const auto opened = io::Sequence::open(sequence(), options.sequence);
    if (!opened) return opened.error();
    io::RunWriterOptions output;
    output.image_size = opened->camera().size();
    output.range_limit = options.mapper.depth.range;
    output.save = *io::ImageStacks::parse("depth,sigma,state,flow");
    auto writer = io::RunWriter::create(root_ / run, output);
    if (!writer) return writer.error();
    return map_sequence(*opened, options, *writer, threads, progress);
  }

  /// Content of every file of a run but timing.json and the report, which shows the timing.
  [[nodiscard]] std::map<std::string, std::string> content(const std::string& run) const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(root_ / run)) {
      const std::string name = entry.path().lexically_relative(root_ / run);
      if (!entry.is_regular_file() || name == "timing.json" || name == "report.html") continue;
      files[name] = content_of(entry.path());
    }
    return files;
  }
  static std::string content_of(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
  }

  fs::path root_;
};

TEST_F(MapSequence, WritesEverythingThatTheDesignPromises) {
  const auto result = map("run");
  ASSERT_TRUE(result) << result.error().message;
  for (const char* name :
       {"run.json", "cloud.ply", "map.bt", "map.ot", "map.json", "trajectory.txt", "timing.json",
        "evaluation.json", "evaluation.csv", "report.html", "depth/0.100000.png", "sigma/0.500000.png",
        "state/0.300000.png", "flow/0.200000.png"}) {
    EXPECT_TRUE(fs::is_regular_file(root_ / "run" / name)) << name;
  }
  EXPECT_EQ(result->info.health.frames_used, 6);
  EXPECT_EQ(result->info.health.depth_images, 5);
  ASSERT_TRUE(result->accuracy);
  EXPECT_GT(result->accuracy->all.coverage, 0.5);
  EXPECT_LT(result->accuracy->all.relative_median, 0.2);
  EXPECT_GT(result->timing.peak_memory, 1000000U);
  ASSERT_TRUE(io::read_run(root_ / "run"));
}

TEST_F(MapSequence, AGoodRunHasNoHintsAndItsCountsAddUp) {
  const auto result = map("run");
  ASSERT_TRUE(result) << result.error().message;
  const io::RunInfo& info = result->info;
  for (const Hint& hint : info.hints) ADD_FAILURE() << hint.id << ": " << hint.message;
  EXPECT_EQ(info.map->depths, info.state_pixels[static_cast<std::size_t>(DepthState::measured)]);
  EXPECT_LE(info.map->depths_beyond + info.map->depths_uncertain, info.map->depths);
  EXPECT_GT(info.map->hits, 0U);
  EXPECT_EQ(info.motion.pairs, 5U);
  EXPECT_EQ(info.motion.still_pairs, 0U);
  const Eigen::Vector3d step = io::Sequence::open(sequence())->pose(1).translation -
                               io::Sequence::open(sequence())->pose(0).translation;
  // The farthest view of a frame is the first one: 1, 2, 3, 4, 5 steps.
  EXPECT_NEAR(info.motion.baseline, 3 * step.norm(), 0.3 * step.norm());
  EXPECT_EQ(info.motion.rotation_sigma, 0) << "exact poses";
  EXPECT_EQ(info.masked_share, 0);
}

TEST_F(MapSequence, AnEmptyMapIsSaidEverywhere) {
  MapSequenceOptions options;
  options.mapper.map.hit_max_relative_sigma = 0;
  const auto result = map("run", options);
  ASSERT_TRUE(result) << result.error().message;
  const auto run = io::read_run(root_ / "run");
  ASSERT_TRUE(run) << run.error().message;
  ASSERT_FALSE(run->info.hints.empty());
  EXPECT_EQ(run->info.hints, result->info.hints);
  EXPECT_EQ(run->info.hints[0].id, "empty-map");
  EXPECT_EQ(run->info.map->depths_uncertain + run->info.map->depths_beyond, run->info.map->depths);
  const std::string report = content_of(root_ / "run" / "report.html");
  EXPECT_THAT(report, HasSubstr("The map is empty"));
}

TEST_F(MapSequence, TwiceAndWithTwoThreadsGivesTheSameBytes) {
  ASSERT_TRUE(map("one"));
  ASSERT_TRUE(map("again"));
  ASSERT_TRUE(map("two", {}, 2));
  const auto one = content("one");
  EXPECT_GT(one.size(), 25U);
  EXPECT_EQ(one, content("again"));
  EXPECT_EQ(one, content("two"));
}

TEST_F(MapSequence, AnInterruptedRunLeavesNothing) {
  const auto result = map("run", {}, 1, [](const MapProgress& now) { return now.done < 3; });
  EXPECT_FALSE(result);
  int left = 0;
  for (const auto& entry : fs::directory_iterator(root_)) left += entry.path() != sequence() ? 1 : 0;
  EXPECT_EQ(left, 0);
}

TEST_F(MapSequence, OneDamagedImageIsSkippedAndNamedAndMostOfThemAreRefused) {
  const auto damage = [&](const std::string& name) { fs::resize_file(sequence() / "rgb" / name, 300); };
  damage("0.200000.png");
  const auto result = map("run");
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->info.health.frames_used, 5);
  ASSERT_EQ(result->info.health.skipped.size(), 1U);
  EXPECT_THAT(result->info.health.skipped[0].file, HasSubstr("0.200000.png"));

  MapSequenceOptions strict;
  strict.sequence.strict = true;
  EXPECT_FALSE(map("strict", strict));
  for (const char* name : {"0.000000.png", "0.300000.png", "0.400000.png"}) damage(name);
  EXPECT_FALSE(map("refused"));
  EXPECT_FALSE(fs::exists(root_ / "refused"));
}

TEST_F(MapSequence, TrueDepthThatCannotBeUsedIsNamedAndCounted) {
  const auto file = [&](int i) { return sequence() / "depth" / fmt::format("0.{}00000.png", i); };
  const auto damage = [&](int i) { fs::resize_file(file(i), 300); };
  const auto shrink = [&](int i) {
    EXPECT_TRUE(io::save_image(file(i).string(), cv::Mat(60, 80, CV_16UC1, cv::Scalar(900))));
  };
  MapSequenceOptions strict;
  strict.sequence.strict = true;
  ASSERT_TRUE(map("good", strict));
  damage(1);
  shrink(3);
  for (const int threads : {1, 2}) {
    const auto result = map(fmt::format("run{}", threads), {}, threads);
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(result->info.health.frames_used, 6) << "the images are good";
    EXPECT_EQ(result->info.health.depth_images, 5);
    ASSERT_EQ(result->info.health.skipped.size(), 2U);
    EXPECT_EQ(result->info.health.skipped[0].file, "depth/0.100000.png");
    EXPECT_EQ(result->info.health.skipped[1].file, "depth/0.300000.png");
    EXPECT_THAT(result->info.health.skipped[1].reason, HasSubstr("80 x 60 pixels, expected 160 x 120"));
    EXPECT_THAT(result->info.health.warnings, testing::Contains(HasSubstr("2 of 6 frames")));
    ASSERT_TRUE(result->accuracy);
    EXPECT_EQ(result->accuracy->frames, 3) << "frames 2, 4 and 5";
  }
  const auto refused = map("strict", strict);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("depth/0.100000.png"));
  for (const int i : {0, 2, 4, 5}) shrink(i);
  const auto none = map("none");
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_FALSE(none->accuracy);
  EXPECT_EQ(none->info.health.skipped.size(), 6U);
  const std::string page = content_of(root_ / "none" / "report.html");
  EXPECT_THAT(page, HasSubstr("80 x 60 pixels"));
  EXPECT_THAT(page, HasSubstr("or none that can be used"));
}

TEST_F(MapSequence, AnExistingRunIsNotTouched) {
  ASSERT_TRUE(map("run"));
  const auto before = content("run");
  const auto result = map("run");
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("run"));
  EXPECT_EQ(content("run"), before);
}

TEST_F(MapSequence, AFlightInMapCoordinatesGivesTheSameMapAroundARecordedOrigin) {
  MapSequenceOptions options;
  options.report = false;
  options.sequence.origin = "flight";
  const auto zero = map("zero", options);
  ASSERT_TRUE(zero) << zero.error().message;
  io::ReadReport report;
  auto poses = io::read_trajectory(sequence() / "groundtruth.txt", report);
  ASSERT_TRUE(poses);
  const Eigen::Vector3d shift(482913, 4649776, 120);
  std::ofstream(sequence() / "groundtruth.txt") << io::format_trajectory(
      poses->transformed(Pose{Eigen::Quaterniond::Identity(), shift}, Pose{}).rows());
  options.sequence.origin = "auto";
  options.world_coordinates = true;
  options.pcd = true;
  const auto utm = map("utm", options);
  ASSERT_TRUE(utm) << utm.error().message;
  EXPECT_EQ(utm->info.local_origin, zero->info.local_origin + shift);
  // Positions of seven digits have lost some of theirs: a point on the border of a voxel may fall beside it.
  const auto occupied = static_cast<double>(zero->info.map->occupied_voxels);
  EXPECT_NEAR(static_cast<double>(utm->info.map->occupied_voxels), occupied, 0.01 * occupied + 2);
  EXPECT_EQ(utm->info.map->points_outside, 0U);
  const std::string origin = "local origin 48291";
  EXPECT_THAT(content_of(root_ / "utm" / "cloud.ply").substr(0, 300), HasSubstr(origin));
  EXPECT_THAT(content_of(root_ / "utm" / "cloud.pcd").substr(0, 300), HasSubstr(origin));
  EXPECT_THAT(content_of(root_ / "utm" / "map.json"), HasSubstr("local_origin_m"));
  EXPECT_THAT(content_of(root_ / "utm" / "cloud_world.ply").substr(0, 300), HasSubstr("property double x"));
  const auto back = io::read_trajectory(root_ / "utm" / "trajectory_world.txt", report);
  ASSERT_TRUE(back);
  EXPECT_LT((back->rows().front().pose.translation - poses->rows().front().pose.translation - shift).norm(),
            1e-6);
  const auto read = io::read_run(root_ / "utm");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->info.local_origin, utm->info.local_origin);
}

}  // namespace
}  // namespace pade
