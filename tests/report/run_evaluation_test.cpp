// What a run wrote down about its accuracy, and what its depth images say afterwards, agree.
#include "pade/report/run_evaluation.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/run/run_writer.hpp"
#include "pade/report/tables/accuracy_tables.hpp"

#include "evaluation/synthetic_depth.hpp"
#include "support/temporary_folder.hpp"

namespace pade::evaluation {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

const cv::Size kSize(64, 48);
constexpr double kRange = 18;
constexpr int kFrames = 3;

// A TUM sequence of textured frames with the ramp as true depth, in millimetres; frames are a second apart.
void write_sequence(const fs::path& folder, bool with_truth) {
  fs::create_directories(folder / "rgb");
  std::ofstream(folder / "camera.yaml")
      << "width: 64\nheight: 48\nfx: 50\nfy: 50\ncx: 31.5\ncy: 23.5\n"
         "distortion_model: none\ndistortion: []\ndepth_scale: 1000\nworld_up: \"-y\"\n";
  std::ofstream poses(folder / "groundtruth.txt");
  for (int i = 0; i < kFrames; ++i) {
    const std::string name = to_string(Time::from_seconds(i));
    cv::Mat image(kSize, CV_8UC1);
    cv::randu(image, 1, 255);
    EXPECT_TRUE(io::save_image((folder / "rgb" / (name + ".png")).string(), image));
    poses << name << " " << 0.1 * i << " 0 0 0 0 0 1\n";
    if (!with_truth) continue;
    fs::create_directories(folder / "depth");
    cv::Mat millimetres = test::truth_ramp(kSize);
    cv::patchNaNs(millimetres, 0);
    millimetres.convertTo(millimetres, CV_16UC1, 1000);
    EXPECT_TRUE(io::save_image((folder / "depth" / (name + ".png")).string(), millimetres));
  }
}

Status write_run(const fs::path& folder, const io::Sequence& sequence, std::string_view save, cv::Size size) {
  auto writer = io::RunWriter::create(
      folder, {io::Overwrite::refuse, io::ImageStacks::parse(save).value(), size, kRange});
  if (!writer) return writer.error();
  Accumulator accumulator(kRange);
  for (unsigned i = 0; i < kFrames; ++i) {
    cv::Mat truth = test::truth_ramp(size);
    if (sequence.has_truth()) truth = sequence.truth(i).value();
    const DepthImage depth = test::noisy_estimate(truth, 0.1, i, 2);
    accumulator.add(depth, truth);
    if (Status status = writer->add(depth); !status) return status;
  }
  if (Status status = writer->write("evaluation.json", to_json(accumulator.result())); !status) return status;
  io::RunInfo info;
  info.sequence = sequence.folder();
  info.camera.width = size.width;
  info.camera.height = size.height;
  return writer->finish(info, [] { return io::RunTiming(); });
}

class RunEvaluation : public testing::Test {
 protected:
  io::Sequence sequence(bool with_truth) {
    write_sequence(here_ / "sequence", with_truth);
    auto sequence = io::Sequence::open(here_ / "sequence");
    EXPECT_TRUE(sequence.ok()) << sequence.error().message;
    return std::move(sequence).value();
  }
  test::TemporaryFolder here_;
};

TEST_F(RunEvaluation, OfTheDepthImagesIsThatOfTheRun) {
  const io::Sequence truth = sequence(true);
  const Status written = write_run(here_ / "run", truth, "depth,sigma", kSize);
  ASSERT_TRUE(written.ok()) << written.error().message;
  const auto run = io::read_run(here_ / "run");
  ASSERT_TRUE(run.ok()) << run.error().message;
  const auto stored = stored_accuracy(*run);
  const auto anew = evaluate_stack(*run, truth);
  ASSERT_TRUE(stored.ok() && stored->has_value());
  ASSERT_TRUE(anew.ok()) << anew.error().message;
  EXPECT_EQ(anew->frames, kFrames);
  const double half_count = 0.5 / run->info.depth_scale;
  for (std::size_t i = 0; i < range_count; ++i) {
    const RangeAccuracy& a = anew->ranges[i];
    const RangeAccuracy& b = (*stored)->ranges[i];
    ASSERT_GT(b.pixels, 100U);
    EXPECT_EQ(a.truth_pixels, b.truth_pixels);
    EXPECT_EQ(a.pixels, b.pixels) << "what lies beyond the range limit must stay beyond it";
    EXPECT_NEAR(a.mean, b.mean, half_count);
    EXPECT_NEAR(a.median, b.median, half_count + 0.001 * b.median);
    EXPECT_NEAR(a.relative_mean, b.relative_mean, half_count);
    EXPECT_NEAR(a.rms_of_sigma, b.rms_of_sigma, 0.01);
  }
}

TEST_F(RunEvaluation, NeedsDepthImages) {
  const io::Sequence truth = sequence(true);
  ASSERT_TRUE(write_run(here_ / "run", truth, "state", kSize).ok());
  const auto run = io::read_run(here_ / "run");
  EXPECT_THAT(evaluate_stack(*run, truth).error().message, HasSubstr("--save depth"));
}

TEST_F(RunEvaluation, NeedsTruth) {
  const io::Sequence blind = sequence(false);
  ASSERT_TRUE(write_run(here_ / "run", blind, "depth", kSize).ok());
  const auto run = io::read_run(here_ / "run");
  EXPECT_THAT(evaluate_stack(*run, blind).error().message, HasSubstr("no true depth"));
}

TEST_F(RunEvaluation, NamesTrueDepthThatCannotBeUsed) {
  const auto damaged = [&](int i) {
    fs::resize_file(here_ / "sequence" / "depth" / (to_string(Time::from_seconds(i)) + ".png"), 100);
  };
  const io::Sequence truth = sequence(true);
  ASSERT_TRUE(write_run(here_ / "run", truth, "depth", kSize).ok());
  const auto run = io::read_run(here_ / "run");
  damaged(1);
  std::vector<io::Skipped> skipped;
  const auto rest = evaluate_stack(*run, truth, &skipped);
  ASSERT_TRUE(rest) << rest.error().message;
  EXPECT_EQ(rest->frames, kFrames - 1);
  ASSERT_EQ(skipped.size(), 1U);
  EXPECT_EQ(skipped[0].file, "depth/1.000000.png");
  EXPECT_FALSE(skipped[0].reason.empty());
  for (const int i : {0, 2}) damaged(i);
  const auto none = evaluate_stack(*run, truth);
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("depth/0.000000.png"));
}

TEST_F(RunEvaluation, NeedsTheSequenceOfTheRun) {
  const io::Sequence truth = sequence(true);
  ASSERT_TRUE(write_run(here_ / "run", truth, "depth", kSize).ok());
  auto run = io::read_run(here_ / "run");
  run->info.camera.width = 65;
  EXPECT_THAT(evaluate_stack(*run, truth).error().message, HasSubstr("expected 65 x 48"));
}

TEST_F(RunEvaluation, StoredIsRefusedWhereItIsCorruptAndEmptyWhereThereIsNone) {
  const io::Sequence truth = sequence(true);
  ASSERT_TRUE(write_run(here_ / "run", truth, "", kSize).ok());
  const auto run = io::read_run(here_ / "run");
  std::ofstream(here_ / "run/evaluation.json") << "{";
  EXPECT_THAT(stored_accuracy(*run).error().message, HasSubstr("evaluation.json"));
  fs::remove(here_ / "run/evaluation.json");
  EXPECT_FALSE(stored_accuracy(*run).value().has_value());
}

}  // namespace
}  // namespace pade::evaluation
