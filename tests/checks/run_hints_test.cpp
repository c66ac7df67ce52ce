// Each thing that spoils a run is said, with its reason; a good run is left in peace.
#include "pade/checks/run_hints.hpp"

#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pade::evaluation {
namespace {
using testing::AllOf;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr std::size_t index_of(DepthState state) { return static_cast<std::size_t>(state); }

/// 1000 pixels, most of them with depth; 50 frames, 49 pairs.
io::RunInfo good_run() {
  io::RunInfo info;
  info.options = R"({"mapper":{"map":{"range":20.0,"hit_max_relative_sigma":0.25}}})";
  info.health.frames = 50;
  info.health.frames_used = 50;
  info.health.depth_images = 49;
  info.state_pixels = {700, 20, 100, 80, 50, 50, 0};
  info.map = io::MapSummary{0.1, 500, 9000, 700, 50, 200, 0, 3000};
  info.motion = {49, 0, 0.2, 0, 0, {}};
  return info;
}

/// All pixels in one state.
void only(io::RunInfo& info, DepthState state) {
  info.state_pixels = {};
  info.state_pixels[index_of(state)] = 1000;
  info.map->depths = state == DepthState::measured ? 1000 : 0;
  info.map->depths_beyond = info.map->depths_uncertain = info.map->hits = 0;
}

void empty(io::RunInfo& info) { info.map->occupied_voxels = 0; }

TEST(RunHints, AreNoneForAGoodRun) {
  EXPECT_THAT(hints_of(good_run()), IsEmpty());
  EXPECT_EQ(to_table(hints_of(good_run())), "");
}

TEST(RunHints, AreNoneForARunThatIsGoodButForAFewThings) {
  io::RunInfo info = good_run();
  info.health.frames_used = 47;
  info.health.frames_without_pose = 2;
  info.health.motions_without_scale = 10;
  info.motion.still_pairs = 10;
  info.masked_share = 0.3;
  info.map->points_outside = 5;
  EXPECT_THAT(hints_of(info), IsEmpty());
}

struct HintCase {
  const char* name;
  std::function<void(io::RunInfo&)> spoil;
  const char* id;
  const char* reason;
  const char* advice;
};

class RunHint : public testing::TestWithParam<HintCase> {};

TEST_P(RunHint, NamesTheReasonAndWhatToTry) {
  io::RunInfo info = good_run();
  GetParam().spoil(info);
  EXPECT_THAT(hints_of(info), Contains(AllOf(Field(&Hint::id, GetParam().id),
                                             Field(&Hint::message, HasSubstr(GetParam().reason)),
                                             Field(&Hint::advice, HasSubstr(GetParam().advice)))));
}

INSTANTIATE_TEST_SUITE_P(
    Of, RunHint,
    testing::Values(HintCase{"NoPairs",
                             [](io::RunInfo& run) {
                               run.health.depth_images = 0;
                               run.health.frames_used = 3;
                             },
                             "no-depth", "only 3 frames", "--step 1"},
                    HintCase{"PosesTooUncertain",
                             [](io::RunInfo& run) {
                               empty(run);
                               run.map->depths_uncertain = run.map->depths - run.map->depths_beyond;
                               run.motion.rotation_sigma = 0.25;
                               run.motion.direction_sigma = 4.5;
                             },
                             "empty-map", "0.25° in rotation and 4.5° in direction", "better poses"},
                    HintCase{"PosesTooUncertainAndNotRefined",
                             [](io::RunInfo& run) {
                               empty(run);
                               run.options = R"({"mapper":{"refinement":{"on":false}}})";
                               run.map->depths_uncertain = run.map->depths - run.map->depths_beyond;
                               run.motion.rotation_sigma = 0.25;
                             },
                             "empty-map", "0.25° in rotation", "--refine-motion on"},
                    HintCase{"TooLittleParallaxForTheMap",
                             [](io::RunInfo& run) {
                               empty(run);
                               run.map->depths_uncertain = run.map->depths - run.map->depths_beyond;
                               run.motion.baseline = 0.012;
                             },
                             "empty-map", "moves 1.2 cm", "--step"},
                    HintCase{"RangeTooSmall",
                             [](io::RunInfo& run) {
                               empty(run);
                               run.map->depths_beyond = run.map->depths;
                               run.map->depths_uncertain = 0;
                             },
                             "empty-map", "range of 20 m", "--map-range"},
                    HintCase{"AllOutside",
                             [](io::RunInfo& run) {
                               empty(run);
                               run.map->points_outside = 400;
                             },
                             "empty-map", "reaches 3277 m", "--origin flight"},
                    HintCase{"Scattered",
                             [](io::RunInfo& run) {
                               empty(run);
                               run.map->hits = 0;
                             },
                             "empty-map", "scattered", "--voxel"},
                    HintCase{"TakenBack", [](io::RunInfo& run) { empty(run); }, "empty-map",
                             "3000 hits were taken back", "pade info"},
                    HintCase{"EmptyForWantOfTexture",
                             [](io::RunInfo& run) {
                               empty(run);
                               only(run, DepthState::no_texture);
                             },
                             "empty-map", "no texture", "exposure"},
                    HintCase{"Hover",
                             [](io::RunInfo& run) {
                               only(run, DepthState::low_parallax);
                               run.motion = {49, 49, 0.001, 0, 0, {}};
                             },
                             "standing-still", "100 %", "--step"},
                    HintCase{"LateStamps",
                             [](io::RunInfo& run) {
                               run.motion.stamp_offset = StampOffset{-0.0312, 0.001, 20};
                             },
                             "stamps-late", "31.2 ms late", "add -0.0312 to time_offset_s"},
                    HintCase{"EarlyStamps",
                             [](io::RunInfo& run) {
                               run.motion.stamp_offset = StampOffset{0.0312, 0.001, 20};
                             },
                             "stamps-early", "31.2 ms early", "add 0.0312 to time_offset_s"},
                    HintCase{"LowParallax", [](io::RunInfo& run) { only(run, DepthState::low_parallax); },
                             "mostly-unmeasured", "hardly moves", "--step"},
                    HintCase{"AtTheEpipole", [](io::RunInfo& run) { only(run, DepthState::epipole); },
                             "mostly-unmeasured", "epipole", "sideways"},
                    HintCase{"WrongPoses", [](io::RunInfo& run) { only(run, DepthState::inconsistent); },
                             "mostly-unmeasured", "contradict the poses", "pade info"},
                    HintCase{"FastTurns", [](io::RunInfo& run) { only(run, DepthState::out_of_view); },
                             "mostly-unmeasured", "share little", "more frames per second"},
                    HintCase{"MaskedAway",
                             [](io::RunInfo& run) {
                               only(run, DepthState::out_of_view);
                               run.masked_share = 0.9;
                             },
                             "mostly-unmeasured", "mask covers 90 %", "mask.png"},
                    HintCase{"LargeMask", [](io::RunInfo& run) { run.masked_share = 0.6; }, "large-mask",
                             "60 %", "mask.png"},
                    HintCase{"SomeOutside", [](io::RunInfo& run) { run.map->points_outside = 100; },
                             "outside-map", "22 % of the points", "--origin flight"},
                    HintCase{"MostlyUncertain", [](io::RunInfo& run) { run.map->depths_uncertain = 600; },
                             "mostly-uncertain", "92 % of the depths", "--step"},
                    HintCase{"BeyondTheMap",
                             [](io::RunInfo& run) {
                               run.map->depths_beyond = 500;
                               run.map->depths_uncertain = 0;
                             },
                             "beyond-map", "71 % of the depths", "--map-range"},
                    HintCase{"NothingFree", [](io::RunInfo& run) { run.map->free_voxels = 0; },
                             "nothing-free", "no free space", "pade info"},
                    HintCase{"FramesWithoutPose",
                             [](io::RunInfo& run) {
                               run.health.frames_used = 30;
                               run.health.frames_without_pose = 20;
                             },
                             "poses-refused", "20 of 50 frames (40 %)", "times"},
                    HintCase{"ScaleInvalid", [](io::RunInfo& run) { run.health.motions_without_scale = 40; },
                             "poses-too-short", "40 motions", "--step"},
                    HintCase{"DamagedImages",
                             [](io::RunInfo& run) {
                               run.health.frames_used = 30;
                               run.health.skipped = {{"rgb/1.png", "found 0 bytes"}};
                             },
                             "frames-skipped", "found 0 bytes", "damaged"}),
    [](const auto& instance) { return instance.param.name; });

TEST(RunHints, PixelsWithABoundAreNotUnmeasured) {
  io::RunInfo info = good_run();
  only(info, DepthState::far);
  EXPECT_THAT(hints_of(info), Not(Contains(Field(&Hint::id, "mostly-unmeasured"))));
}

TEST(RunHints, AnEmptyMapComesFirstAndIsAnError) {
  io::RunInfo info = good_run();
  info.masked_share = 0.9;
  empty(info);
  const auto hints = hints_of(info);
  ASSERT_GE(hints.size(), 2U);
  EXPECT_EQ(hints.front().id, "empty-map");
  EXPECT_EQ(hints.front().severity, HintSeverity::error);
  EXPECT_THAT(to_table(hints), AllOf(HasSubstr("ERROR"), HasSubstr("Warning"), HasSubstr(hints[1].advice)));
}

TEST(RunHints, NoMapIsEverEmptyWithoutAWord) {
  // Whatever the counts are.
  for (const std::uint64_t depths : {0, 5, 700}) {
    for (const std::uint64_t beyond : {0, 5, 700}) {
      for (const std::uint64_t uncertain : {0, 5, 700}) {
        for (const std::uint64_t outside : {0, 700}) {
          for (const std::uint64_t hits : {0, 700}) {
            if (beyond + uncertain > depths) continue;
            io::RunInfo info = good_run();
            info.map = io::MapSummary{0.1, 0, 0, depths, beyond, uncertain, outside, hits};
            const auto hints = hints_of(info);
            ASSERT_FALSE(hints.empty());
            EXPECT_EQ(hints[0].id, "empty-map");
            EXPECT_FALSE(hints[0].advice.empty());
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace pade::evaluation
