// What a run writes, a reader gets back; what is not a run is refused.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/formats/flow_file.hpp"
#include "pade/io/image/image_codec.hpp"
#include "pade/io/run/run_images.hpp"
#include "pade/io/run/run_reader.hpp"
#include "pade/io/run/run_writer.hpp"
#include "pade/io/text.hpp"

#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {
namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr double kRange = 20;

// A depth image whose values differ everywhere, with holes.
DepthImage ramp(cv::Size size, int window, std::int64_t nanoseconds) {
  const int columns = (size.width + window - 1) / window;
  const int rows = (size.height + window - 1) / window;
  DepthImage image{{nanoseconds},
                   window,
                   cv::Mat(rows, columns, CV_32FC1),
                   cv::Mat(rows, columns, CV_32FC1),
                   cv::Mat(rows, columns, CV_8UC1),
                   {},
                   cv::Mat(rows, columns, CV_32FC1)};
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const bool hole = (x + y) % 5 == 0;
      const float depth = 0.5F + 0.013F * static_cast<float>(x + columns * y);
      image.depth.at<float>(y, x) = hole ? kNaN : depth;
      image.variance.at<float>(y, x) = hole ? kNaN : 0.01F * depth;
      image.bound.at<float>(y, x) = (x + y) % 3 == 0 ? kNaN : 0.7F * depth;
      image.state.at<std::uint8_t>(y, x) = hole ? std::uint8_t{3} : std::uint8_t{0};
    }
  }
  return image;
}

RunInfo some_info(cv::Size size) {
  RunInfo info;
  info.version = "1.2.3";
  info.sequence = "/data/flight \"7\"";
  info.poses = "groundtruth.txt";
  info.options = R"({"depth":{"window":2}})";
  info.camera.width = size.width;
  info.camera.height = size.height;
  info.camera.fx = info.camera.fy = 21.5;
  info.window = 2;
  info.health = {
      5, 4, 3, 7, 8, {{"rgb/3.png", "found 0 bytes"}}, {"world_up is a guess"}, NavigationHealth{}};
  NavigationHealth& navigation = *info.health.navigation;
  navigation.filter.status = navigation::NavigationStatus::dead_reckoning;
  navigation.filter.times_lost = 3;
  navigation.frames = 40;
  navigation.speed_median = 1.5;
  navigation.speed_largest = 9.25;
  navigation.sensors = {{"gnss_velocity", 100, 7, 1.25}};
  info.world_up = WorldUp{{0, -1, 0}, true, "camera.yaml"};
  info.origin = GeographicOrigin{48.1, 11.6, 519.0};
  info.map = MapSummary{0.1, 123, 4567, 9000, 800, 70, 6, 5000};
  info.motion = {3, 1, 0.25, 0.125, 1.5, StampOffset{-0.03, 0.001, 25}};
  info.masked_share = 0.0625;
  info.hints = {{"empty-map", HintSeverity::error, "the map is \"empty\"", "fly nearer"},
                {"large-mask", HintSeverity::warning, "61 % is masked", "check mask.png"}};
  return info;
}

RunTiming some_timing() { return {{summarise("flow", {3, 1, 2})}, 24.5, 1U << 20U}; }

Status write_run(const fs::path& folder, cv::Size size, std::string_view save, const DepthImage& depth) {
  RunWriterOptions options{Overwrite::refuse, ImageStacks::parse(save).value(), size, kRange};
  auto writer = RunWriter::create(folder, options);
  if (!writer) return writer.error();
  FlowField flow{cv::Mat(size, CV_32FC2, cv::Scalar(1.5, -2.25)), {}};
  flow.vectors.at<cv::Vec2f>(0, 0) = {kNaN, 0};
  if (Status status = writer->add(depth, flow); !status) return status;
  writer->add_pose(depth.time, Pose{});
  return writer->finish(some_info(size), some_timing);
}

class RunFolder : public testing::TestWithParam<int> {};

TEST_P(RunFolder, GivesBackDepthWithinHalfACount) {
  const test::TemporaryFolder here;
  const cv::Size size(23, 17);
  const DepthImage written = ramp(size, GetParam(), 12'345'678'900);
  const Status status = write_run(here / "run", size, "depth,sigma,state,bound,flow", written);
  ASSERT_TRUE(status.ok()) << status.error().message;

  const auto run = read_run(here / "run");
  ASSERT_TRUE(run.ok()) << run.error().message;
  EXPECT_EQ(run->depth_times, std::vector{written.time});
  EXPECT_GE(run->info.depth_scale * kRange, 65535 - kRange) << "the scale uses the 16 bits";
  EXPECT_LE(run->info.depth_scale * kRange, 65535) << "and the range limit fits";
  const auto read = read_depth_image(*run, written.time);
  ASSERT_TRUE(read.ok()) << read.error().message;
  const DepthImage full = at_full_size(written, size);
  ASSERT_EQ(read->depth.size(), size);
  const double half_count = 0.5001 / run->info.depth_scale;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float z = full.depth.at<float>(y, x);
      EXPECT_EQ(read->state.at<std::uint8_t>(y, x), full.state.at<std::uint8_t>(y, x));
      ASSERT_EQ(std::isnan(read->depth.at<float>(y, x)), std::isnan(z)) << x << ", " << y;
      const float bound = full.bound.at<float>(y, x);
      ASSERT_EQ(std::isnan(read->bound.at<float>(y, x)), std::isnan(bound)) << x << ", " << y;
      if (!std::isnan(bound)) {
        EXPECT_LE(read->bound.at<float>(y, x), bound) << "a bound is never rounded up";
        EXPECT_GT(read->bound.at<float>(y, x), bound - 1.0001 / run->info.bound_scale);
      }
      if (std::isnan(z)) continue;
      EXPECT_NEAR(read->depth.at<float>(y, x), z, half_count);
      EXPECT_NEAR(std::sqrt(read->variance.at<float>(y, x)), std::sqrt(full.variance.at<float>(y, x)),
                  half_count);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Window, RunFolder, testing::Values(1, 4),
                         [](const auto& instance) { return "n" + std::to_string(instance.param); });

TEST(RunFolderFiles, AreThoseThatWereAskedFor) {
  const test::TemporaryFolder here;
  const cv::Size size(8, 6);
  ASSERT_TRUE(write_run(here / "bare", size, "", ramp(size, 1, 0)).ok());
  for (const char* stack : {"depth", "sigma", "state", "bound", "flow"})
    EXPECT_FALSE(fs::exists(here / "bare" / stack));
  for (const char* file : {"run.json", "timing.json", "trajectory.txt"})
    EXPECT_TRUE(fs::exists(here / "bare" / file));
  ASSERT_TRUE(write_run(here / "flow", size, "flow", ramp(size, 1, 0)).ok());
  const cv::Mat flow = read_flow(here / "flow/flow/0.000000.png").value();
  EXPECT_EQ(flow.at<cv::Vec2f>(3, 3), cv::Vec2f(1.5F, -2.25F));
  EXPECT_TRUE(std::isnan(flow.at<cv::Vec2f>(0, 0)[0]));
}

TEST(RunFolderFiles, AreTheSameBytesTwiceButForTheTiming) {
  const test::TemporaryFolder here;
  const cv::Size size(31, 9);
  ASSERT_TRUE(write_run(here / "a", size, "depth,sigma,state,bound,flow", ramp(size, 2, 5)).ok());
  ASSERT_TRUE(write_run(here / "b", size, "depth,sigma,state,bound,flow", ramp(size, 2, 5)).ok());
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(here / "a")) {
    if (!entry.is_regular_file() || entry.path().filename() == "timing.json") continue;
    ++files;
    EXPECT_EQ(read_file(entry.path()).value(),
              read_file(here / "b" / fs::relative(entry.path(), here / "a")).value());
  }
  EXPECT_EQ(files, 7);
}

TEST(RunFolderFiles, SayWhatTheRunSaysAboutItself) {
  const test::TemporaryFolder here;
  const cv::Size size(10, 10);
  ASSERT_TRUE(write_run(here / "run", size, "", ramp(size, 1, 0)).ok());
  const auto run = read_run(here / "run");
  ASSERT_TRUE(run.ok()) << run.error().message;
  const RunInfo& info = run->info;
  const RunInfo expected = some_info(size);
  EXPECT_EQ(info.version, expected.version);
  EXPECT_EQ(info.sequence, expected.sequence);
  EXPECT_EQ(info.options, expected.options);
  EXPECT_EQ(info.camera, expected.camera);
  EXPECT_EQ(info.window, 2);
  EXPECT_EQ(info.health.frames_used, 4);
  ASSERT_EQ(info.health.skipped.size(), 1U);
  EXPECT_EQ(info.health.skipped[0].reason, "found 0 bytes");
  EXPECT_THAT(info.health.warnings, ElementsAre("world_up is a guess"));
  ASSERT_TRUE(info.world_up.has_value());
  EXPECT_EQ(info.world_up->direction, Eigen::Vector3d(0, -1, 0));
  EXPECT_TRUE(info.world_up->stated);
  EXPECT_EQ(info.world_up->source, expected.world_up->source);
  ASSERT_TRUE(info.origin.has_value());
  EXPECT_EQ(info.origin->latitude_deg, 48.1);
  ASSERT_TRUE(info.map.has_value());
  EXPECT_EQ(info.map->free_voxels, 4567U);
  EXPECT_EQ(to_json(info), to_json(run_info_from_json(to_json(info), "again").value()));
  EXPECT_EQ(info.state_pixels[0], 80U);
  EXPECT_EQ(info.state_pixels[3], 20U);
  ASSERT_EQ(run->timing.stages.size(), 1U);
  EXPECT_EQ(run->timing.stages[0].p50, 2);
  EXPECT_EQ(run->timing.stages[0].max, 3);
}

TEST(RunFolderFiles, KeepTheHintsAndWhatTheyLookAt) {
  const test::TemporaryFolder here;
  const cv::Size size(10, 10);
  ASSERT_TRUE(write_run(here / "run", size, "", ramp(size, 1, 0)).ok());
  const RunInfo info = read_run(here / "run").value().info;
  const RunInfo expected = some_info(size);
  EXPECT_EQ(info.hints, expected.hints);
  EXPECT_EQ(info.health.frames_without_pose, 7);
  EXPECT_EQ(info.health.motions_without_scale, 8);
  ASSERT_TRUE(info.health.navigation);
  EXPECT_EQ(info.health.navigation->filter.status, navigation::NavigationStatus::dead_reckoning);
  EXPECT_EQ(info.health.navigation->filter.times_lost, 3U);
  EXPECT_EQ(info.health.navigation->frames, 40U);
  EXPECT_EQ(info.health.navigation->speed_median, 1.5);
  EXPECT_EQ(info.health.navigation->speed_largest, 9.25);
  ASSERT_EQ(info.health.navigation->sensors.size(), 1U);
  EXPECT_EQ(info.health.navigation->sensors[0].refused, 7U);
  EXPECT_EQ(info.health.navigation->sensors[0].chi_square, 1.25);
  EXPECT_EQ(info.map->depths, 9000U);
  EXPECT_EQ(info.map->depths_beyond, 800U);
  EXPECT_EQ(info.map->depths_uncertain, 70U);
  EXPECT_EQ(info.map->points_outside, 6U);
  EXPECT_EQ(info.map->hits, 5000U);
  EXPECT_EQ(info.motion.pairs, 3U);
  EXPECT_EQ(info.motion.still_pairs, 1U);
  EXPECT_EQ(info.motion.baseline, 0.25);
  EXPECT_EQ(info.motion.rotation_sigma, 0.125);
  EXPECT_EQ(info.motion.direction_sigma, 1.5);
  ASSERT_TRUE(info.motion.stamp_offset);
  EXPECT_EQ(info.motion.stamp_offset->seconds, -0.03);
  EXPECT_EQ(info.motion.stamp_offset->sigma, 0.001);
  EXPECT_EQ(info.motion.stamp_offset->pairs, 25U);
  EXPECT_EQ(info.masked_share, 0.0625);
}

TEST(RunFolderFiles, RefuseABoundThatTheDepthImagesDoNotHave) {
  const test::TemporaryFolder here;
  const cv::Size size(10, 10);
  DepthImage depth = ramp(size, 1, 0);
  depth.bound.release();
  const Status status = write_run(here / "run", size, "bound", depth);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("found no bound"));
  EXPECT_FALSE(fs::exists(here / "run"));
}

TEST(RunFolderFiles, TurnABoundOfLessThanACountIntoNone) {
  const cv::Mat metres = (cv::Mat_<float>(1, 4) << 0.0099F, 0.0101F, 1e9F, kNaN);
  const cv::Mat counts = *decode_image(encode_bounds(metres, 100), Pixels::stored);
  EXPECT_EQ(counts.at<std::uint16_t>(0), 0);
  EXPECT_EQ(counts.at<std::uint16_t>(1), 1);
  EXPECT_EQ(counts.at<std::uint16_t>(2), 65535);
  EXPECT_EQ(counts.at<std::uint16_t>(3), 0);
}

TEST(RunFolderFiles, SaturateButNeverTurnIntoNone) {
  cv::Mat metres(1, 4, CV_32FC1);
  metres.at<float>(0) = 1e-6F;
  metres.at<float>(1) = 1e9F;
  metres.at<float>(2) = std::numeric_limits<float>::infinity();
  metres.at<float>(3) = -1;
  const cv::Mat counts = *decode_image(encode_metres(metres, 100), Pixels::stored);
  EXPECT_EQ(counts.at<std::uint16_t>(0), 1);
  EXPECT_EQ(counts.at<std::uint16_t>(1), 65535);
  EXPECT_EQ(counts.at<std::uint16_t>(2), 65535);
  EXPECT_EQ(counts.at<std::uint16_t>(3), 0);
}

TEST(RunReader, RefusesAFolderThatIsNoRun) {
  const test::TemporaryFolder here;
  EXPECT_THAT(read_run(here / "none").error().message, HasSubstr("no such folder"));
  EXPECT_THAT(read_run(here.path()).error().message, HasSubstr("no run.json"));
}

struct Corruption {
  const char* name;
  const char* from;
  const char* to;
  const char* where;
};
class CorruptRun : public testing::TestWithParam<Corruption> {};

TEST_P(CorruptRun, IsRefusedWithTheField) {
  const test::TemporaryFolder here;
  const cv::Size size(4, 4);
  ASSERT_TRUE(write_run(here / "run", size, "depth", ramp(size, 1, 0)).ok());
  std::string text = read_file(here / "run/run.json").value();
  const std::size_t at = text.find(GetParam().from);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, std::string(GetParam().from).size(), GetParam().to);
  std::ofstream(here / "run/run.json") << text;
  const auto run = read_run(here / "run");
  ASSERT_FALSE(run.ok());
  EXPECT_THAT(run.error().message,
              AllOf(HasSubstr("run.json"), HasSubstr(GetParam().where), HasSubstr("expected")));
}

INSTANTIATE_TEST_SUITE_P(With, CorruptRun,
                         testing::Values(Corruption{"BrokenJson", "{", "[", "byte"},
                                         Corruption{"AnotherFormat", "pade run 2", "pade run 9", "format"},
                                         Corruption{"TextForANumber", "\"range_limit_m\": 20.0",
                                                    "\"range_limit_m\": \"far\"", "range_limit_m"},
                                         Corruption{"AnUnknownSeverity", "\"severity\": \"error\"",
                                                    "\"severity\": \"fatal\"", "hints[0].severity"},
                                         Corruption{"AFieldMissing", "\"fx\"", "\"f\"", "camera.fx"},
                                         Corruption{"NoScale", "\"depth_scale\": 3276.0",
                                                    "\"depth_scale\": 0", "depth_scale"}),
                         [](const auto& instance) { return instance.param.name; });

TEST(CorruptStack, IsRefusedWithTheFile) {
  const test::TemporaryFolder here;
  const cv::Size size(4, 4);
  ASSERT_TRUE(write_run(here / "run", size, "depth", ramp(size, 1, 0)).ok());
  fs::resize_file(here / "run/depth/0.000000.png", 0);
  const auto run = read_run(here / "run");
  ASSERT_TRUE(run.ok());
  EXPECT_THAT(read_depth_image(*run, Time{0}).error().message, HasSubstr("0.000000.png"));
}

TEST(ImageStackNames, AreReadInAnyOrderAndOthersRefused) {
  const auto some = ImageStacks::parse("flow,depth");
  ASSERT_TRUE(some.ok());
  EXPECT_TRUE(some->flow && some->depth && !some->sigma && !some->state);
  EXPECT_THAT(ImageStacks::parse("depth,variance").error().message, HasSubstr("'variance'"));
}

TEST(StageTimingSummary, UsesNearestRanks) {
  std::vector<double> times;
  for (int i = 100; i >= 1; --i) times.push_back(i);
  const StageTiming timing = summarise("flow", times);
  EXPECT_EQ(timing.p50, 50);
  EXPECT_EQ(timing.p99, 99);
  EXPECT_EQ(timing.max, 100);
  EXPECT_EQ(timing.mean, 50.5);
  EXPECT_EQ(summarise("flow", {}).count, 0U);
  EXPECT_GT(peak_memory(), 1U << 20U);
}

}  // namespace
}  // namespace pade::io
