// A session in real time, with a camera and poses that are made here.
#include "pade/live/session.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/io/text.hpp"
#include "pade/live/recordings/session_recorder.hpp"

#include "live/wall_camera.hpp"
#include "support/temporary_folder.hpp"

namespace pade::live {
namespace {

/// Facing north, to the east.
class EastwardPoses : public NavigationSource {
 public:
  explicit EastwardPoses(Time zero) : zero_(zero) {}
  [[nodiscard]] PoseAnswer pose_at(Time time) const override {
    const double age = seconds_between(time, now_of_ours());
    // Messages come at their rate: the one after a time is there when the next is due, and then as late as
    // the link makes it.
    const double phase = seconds_between(zero_, time);
    const double until_next = burst > 0 ? burst * (std::floor(phase / burst) + 1) - phase : 0;
    if (!come || age < late + until_next) return {};
    PoseAnswer answer{PoseAnswer::Kind::valid, {}, {}, jumped};
    answer.T_world_body.rotation = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ());
    answer.T_world_body.translation = start;
    answer.T_world_body.translation.x() += kSpeed * seconds_between(zero_, time);
    return answer;
  }

  std::atomic<bool> come{true};
  std::atomic<double> late{0};   // s
  std::atomic<double> burst{0};  // s from message to message
  std::atomic<std::size_t> jumped{0};
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  // to be set before the session runs
  [[nodiscard]] std::optional<Matrix6d> motion_covariance(Time t1, Time t2,
                                                          const Pose& /*camera*/) const override {
    if (!known_motion) return std::nullopt;
    return Matrix6d(seconds_between(t1, t2) * Matrix6d::Identity());
  }
  bool known_motion = false;

 private:
  Time zero_;
};

class Gatherer : public Sink {
 public:
  void take(const LiveUpdate& update) override {
    if (pause > 0) std::this_thread::sleep_for(std::chrono::milliseconds(pause));
    ages.push_back(seconds_between(update.time, now_of_ours()));
    last = update;
  }
  void begin_anew() override { ++begun_anew; }
  void forget(const std::shared_ptr<const mapping::MapView>& view,
              const mapping::MapChange& change) override {
    EXPECT_FALSE(change.became_unknown.empty());
    last.view = view;
    ++forgotten;
  }
  int begun_anew = 0;
  int forgotten = 0;
  std::vector<double> ages;
  LiveUpdate last;
  std::atomic<int> pause{0};  // ms
};

/// What goes into the mapper.
class Covariances : public InputSink {
 public:
  void take(const MapperInput& input) override {
    times.push_back(input.time);
    covariances.push_back(input.covariance);
  }
  void begin_anew() override {}
  std::vector<Time> times;
  std::vector<Matrix6d> covariances;
};

/// A session for some seconds.
struct Bed {
  explicit Bed(double rate, InputSink* recorder = nullptr, double forget_after = 0)
      : camera(rate), poses(camera.zero) {
    mapper.map.forget_after = forget_after;
    Pose mounting;
    mounting.rotation = Eigen::Quaterniond(forward_camera_rotation());
    mapper.map.voxel = 0.25;  // a pixel sees 5 cm of the wall
    SessionOptions options;
    options.velocity_sigma = 0.02;
    auto made = Session::create({camera, poses, {&gatherer}, progress, mounting, recorder}, options, mapper);
    EXPECT_TRUE(made) << made.error().message;
    session = std::make_unique<Session>(std::move(*made));
  }
  template <class Meanwhile>
  const SessionCounts& run(double seconds, const Meanwhile& meanwhile) {
    const Time start = now_of_ours();
    session->run([&] {
      const double elapsed = seconds_between(start, now_of_ours());
      meanwhile(elapsed);
      return elapsed > seconds;
    });
    return session->counts();
  }
  ObstacleMapperOptions mapper;
  WallCamera camera;
  EastwardPoses poses;
  Gatherer gatherer;
  Progress progress;
  std::unique_ptr<Session> session;
};

void expect_all_counted(const SessionCounts& counts, std::size_t delivered) {
  EXPECT_EQ(counts.frames, delivered);
  EXPECT_EQ(counts.frames, counts.mapped + counts.skipped + counts.dropped);
}

std::string bytes_of(const mapping::OccupancyMap& map) {
  return io::bytes_of(io::encode_map(map, io::MapFormat::bt));
}

/// The map that a recording makes.
std::string replayed(const std::filesystem::path& file, const ObstacleMapperOptions& options) {
  const auto sequence = io::Sequence::open(file);
  EXPECT_TRUE(sequence) << sequence.error().message;
  if (!sequence) return {};
  auto mapper = ObstacleMapper::create(sequence->camera(), options, sequence->mask());
  EXPECT_TRUE(mapper);
  for (std::size_t i = 0; i < sequence->size(); ++i) {
    const auto frame = sequence->frame(i);
    EXPECT_TRUE(frame) << frame.error().message;
    if (frame) mapper->add(frame->image, frame->time, frame->T_world_camera, frame->motion_covariance);
  }
  return bytes_of(mapper->map());
}

TEST(Session, MapsTheWallAhead) {
  Bed bed(10);
  const auto& counts = bed.run(2, [](double) {});
  expect_all_counted(counts, bed.camera.delivered);
  EXPECT_GT(counts.mapped, 8U);
  ASSERT_FALSE(bed.gatherer.ages.empty());
  const LiveUpdate& last = bed.gatherer.last;
  EXPECT_GT(last.depth_share, 0.3);
  const auto distances = obstacle_distances(*last.view, last.T_world_body, SectorOptions{});
  EXPECT_NEAR(distances[0], 285, 50);
  EXPECT_EQ(distances[36], kUnknownDistance);  // behind
  EXPECT_GT(bed.progress.depth, 0);
  EXPECT_TRUE(bed.session->map().bounds().max().y() > 2.5);
}

TEST(Session, SaysWhyNoImageComesWhileNoneDoes) {
  Bed bed(10);
  std::string before, meanwhile;
  bed.run(2.2, [&](double elapsed) {
    bed.camera.stalled = elapsed > 0.6 && elapsed < 1.6;
    if (elapsed < 0.8) before += bed.progress.no_image.get();
    if (elapsed < 1.5) meanwhile = bed.progress.no_image.get();
  });
  EXPECT_EQ(before, "");
  EXPECT_EQ(meanwhile, "somebody stands before it");
  EXPECT_EQ(bed.progress.no_image.get(), "");
}

/// A source of poses that knows how good its motions are is believed; else the options are.
TEST(Session, TheMotionIsAsGoodAsItsSourceSays) {
  for (const bool known : {true, false}) {
    Covariances seen;
    Bed bed(10, &seen);
    bed.poses.known_motion = known;
    bed.run(1, [](double) {});
    ASSERT_GT(seen.times.size(), 2U);
    for (std::size_t i = 1; i < seen.times.size(); ++i) {
      const double dt = seconds_between(seen.times[i - 1], seen.times[i]);
      const double variance = known ? dt : 0.02 * 0.02 * dt * dt;
      EXPECT_NEAR(seen.covariances[i](0, 0), variance, 1e-6 * variance) << i;
    }
  }
}

TEST(Session, AFrameWhosePoseDoesNotComeIsSkippedAfterItsTime) {
  Bed bed(10);
  bed.poses.come = false;
  const auto& counts = bed.run(1.5, [](double) {});
  expect_all_counted(counts, bed.camera.delivered);
  EXPECT_EQ(counts.mapped, 0U);
  EXPECT_GT(counts.reasons.at("no pose in time"), 5U);
  EXPECT_EQ(bed.progress.depth, 0);
}

TEST(Session, FramesWaitForLatePoses) {
  // Poses come in bursts, twelve times a second: nothing is lost.
  Bed bed(10);
  const auto& counts = bed.run(2, [&](double elapsed) { bed.poses.come = std::fmod(elapsed, 0.08) > 0.05; });
  expect_all_counted(counts, bed.camera.delivered);
  EXPECT_GT(counts.mapped * 10, counts.frames * 7);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Four frames of a fast camera are fewer than its poses are late: they must not push each other out for
/// ever.
TEST(Session, AFastCameraIsMappedWithPosesThatAreLate) {
  for (const double late : {0.0, 0.05, 0.1, 0.15}) {
    Bed bed(60);
    bed.poses.late = late;
    bed.poses.burst = 1.0 / 30;
    const auto& counts = bed.run(2, [](double) {});
    expect_all_counted(counts, bed.camera.delivered);
    EXPECT_GT(counts.mapped, 16U) << late;  // 8 Hz
    if (late <= 0.1) {
      const auto found = counts.reasons.find("the session ended");
      const std::size_t at_the_end = found == counts.reasons.end() ? 0 : found->second;
      EXPECT_LE((counts.skipped - at_the_end) * 100, counts.frames + 100) << late;
    }
    ASSERT_FALSE(bed.gatherer.ages.empty());
    EXPECT_LT(median(bed.gatherer.ages), 0.3) << late;
  }
}

/// Sectors older than 0.3 s are not sent: a mapper that falls behind passes over frames rather than all being
/// late.
TEST(Session, AMapperThatFallsBehindMapsTheNewestThatHasAPose) {
  Bed bed(30);
  bed.poses.late = 0.1;
  bed.poses.burst = 1.0 / 30;
  bed.gatherer.pause = 80;
  const auto& counts = bed.run(2.5, [](double) {});
  expect_all_counted(counts, bed.camera.delivered);
  ASSERT_FALSE(bed.gatherer.ages.empty());
  EXPECT_LT(median(bed.gatherer.ages), 0.3);  // the machine has other tests to run
}

TEST(Session, ASlowMapperDropsOldFramesAndKeepsTheNewest) {
  Bed bed(40);
  bed.gatherer.pause = 150;
  const auto& counts = bed.run(2, [](double) {});
  expect_all_counted(counts, bed.camera.delivered);
  EXPECT_GT(counts.dropped, counts.frames / 3);
  EXPECT_GT(counts.mapped, 5U);
}

TEST(Session, AJumpOfThePosesBeginsTheMapAnew) {
  Bed bed(10);
  const auto& counts = bed.run(1.6, [&](double elapsed) { bed.poses.jumped = elapsed > 0.8 ? 1 : 0; });
  expect_all_counted(counts, bed.camera.delivered);
  EXPECT_EQ(counts.restarts, 1U);
  EXPECT_EQ(bed.gatherer.begun_anew, 1);
  EXPECT_LT(counts.mapped_anew, counts.mapped);
  EXPECT_GT(counts.mapped_anew, 0U);
}

/// A map ends 32768 voxels from its origin; the flight does not.
TEST(Session, FarFromTheOriginOfThePosesTheMapHasOneOfItsOwn) {
  const test::TemporaryFolder folder;
  const WallCamera camera(10);
  auto recorder = SessionRecorder::create(folder / "flight.mcap", camera.camera(), camera.mask());
  ASSERT_TRUE(recorder) << recorder.error().message;
  Bed bed(10, recorder->get());
  bed.poses.start = {0, -40'000, 120};
  const auto& counts = bed.run(2, [](double) {});
  EXPECT_EQ(counts.restarts, 0U);
  EXPECT_EQ(counts.outside, 0U);
  EXPECT_NEAR(bed.session->origin().y(), -40'000, 1);
  EXPECT_NEAR(bed.session->origin().z(), 120, 1);
  EXPECT_EQ(bed.gatherer.last.origin, bed.session->origin()) << "whoever shows the map has to know";
  EXPECT_GT(bed.session->map().counts().occupied, 50U);
  ASSERT_FALSE(bed.gatherer.ages.empty());
  const LiveUpdate& last = bed.gatherer.last;
  EXPECT_NEAR(obstacle_distances(*last.view, last.T_world_body, SectorOptions{})[0], 285, 50);
  ASSERT_TRUE((*recorder)->finish());
  EXPECT_EQ(replayed(folder / "flight.mcap", bed.mapper), bytes_of(bed.session->map()));
}

TEST(Session, NearTheBorderOfAMapAnotherIsBegun) {
  Bed bed(10);
  bed.poses.start = {32768 * bed.mapper.map.voxel - 200 - 0.8 * kSpeed, 5, 0};
  const auto& counts = bed.run(1.6, [](double) {});
  expect_all_counted(counts, bed.camera.delivered);
  EXPECT_EQ(counts.restarts, 1U);
  EXPECT_EQ(counts.borders, 1U);
  EXPECT_EQ(bed.gatherer.begun_anew, 1);
  EXPECT_LT(counts.mapped_anew, counts.mapped);
  EXPECT_NEAR(bed.session->origin().x(), bed.poses.start.x() + 0.8 * kSpeed, 0.3);
  EXPECT_NEAR(bed.session->origin().y(), 5, 1e-6);
  EXPECT_LT(bed.gatherer.last.T_world_body.translation.norm(), 2);
}

/// A recording that is played at half its pace falls behind our clock, and is mapped nevertheless.
TEST(Session, FramesOfARecordingThatFallsBehindAreMapped) {
  Bed bed(10);
  bed.camera.lag = 20;
  const auto& counts = bed.run(1.6, [](double) {});
  expect_all_counted(counts, bed.camera.delivered);
  EXPECT_GT(counts.mapped * 10, counts.frames * 7);
  EXPECT_LT(seconds_between(Time{bed.progress.depth}, now_of_ours()), 10) << "the depth is not stale";
  EXPECT_LT(seconds_between(Time{bed.progress.image}, now_of_ours()), 10) << "nor is the camera";
}

/// An autopilot that starts anew on the ground and then has no pose leaves the flight's map as it is.
TEST(Session, AJumpWithoutAPoseKeepsTheMap) {
  Bed bed(10);
  const auto& counts = bed.run(1.6, [&](double elapsed) {
    bed.poses.jumped = elapsed > 0.8 ? 1 : 0;
    bed.poses.come = elapsed <= 0.8;
  });
  EXPECT_EQ(counts.restarts, 0U);
  EXPECT_FALSE(bed.session->map().bounds().isEmpty());
}

std::size_t free_voxels(const mapping::MapView& view) { return view.in_box(view.bounds()).free; }

/// Whether the camera stands still or its frames have no poses: what nobody sees again is not known for ever.
TEST(Session, ForgetsFreeSpaceWhereNothingIsMapped) {
  for (const bool no_frames : {true, false}) {
    Bed bed(15, nullptr, 0.4);
    std::size_t most = 0;
    const auto& counts = bed.run(3, [&](double elapsed) {
      if (elapsed <= 1.2 && bed.gatherer.last.view)
        most = std::max(most, free_voxels(*bed.gatherer.last.view));
      bed.camera.stalled = no_frames && elapsed > 1.2;
      bed.poses.come = no_frames || elapsed <= 1.2;
    });
    EXPECT_GT(counts.mapped, 5U) << no_frames;
    ASSERT_GT(most, 100U) << no_frames;
    EXPECT_GT(bed.gatherer.forgotten, 0) << no_frames;
    EXPECT_LT(10 * free_voxels(*bed.gatherer.last.view), most) << no_frames;
    EXPECT_EQ(bed.session->map().counts().free, free_voxels(*bed.gatherer.last.view)) << no_frames;
  }
}

TEST(SessionRecording, MakesTheSameMapAgain) {
  const test::TemporaryFolder folder;
  for (const char* const name : {"flight.mcap", "flight.bag"}) {
    const WallCamera camera(10);  // as that of the bed
    auto recorder = SessionRecorder::create(folder / name, camera.camera(), camera.mask());
    ASSERT_TRUE(recorder) << recorder.error().message;
    Bed bed(10, recorder->get());
    const auto& counts = bed.run(2, [](double) {});
    const Status finished = (*recorder)->finish();
    ASSERT_TRUE(finished) << finished.error().message;
    ASSERT_EQ((*recorder)->report().left_out, 0U);
    EXPECT_GT(counts.mapped, 8U);
    EXPECT_EQ(replayed(folder / name, bed.mapper), bytes_of(bed.session->map())) << name;
  }
}

TEST(SessionRecording, BeginsAnewWithTheMap) {
  const test::TemporaryFolder folder;
  const WallCamera camera(10);
  auto recorder = SessionRecorder::create(folder / "flight.mcap", camera.camera(), camera.mask());
  ASSERT_TRUE(recorder) << recorder.error().message;
  Bed bed(10, recorder->get());
  bed.run(2, [&](double elapsed) { bed.poses.jumped = elapsed > 1 ? 1 : 0; });
  ASSERT_TRUE((*recorder)->finish());
  EXPECT_EQ((*recorder)->report().file, folder / "flight-2.mcap");
  EXPECT_EQ(replayed(folder / "flight-2.mcap", bed.mapper), bytes_of(bed.session->map()));
  EXPECT_TRUE(std::filesystem::exists(folder / "flight.mcap"));
  EXPECT_EQ(folder.entries(), 2U);
}

/// Frames of 8 x 8 pixels for a recorder.
class FewFrames {
 public:
  explicit FewFrames(std::filesystem::path file, const RecorderLimits& limits = {})
      : recorder_(SessionRecorder::create(std::move(file), camera(), {}, limits)) {}
  SessionRecorder& operator*() { return *recorder_.value(); }
  void add(int frames) {
    for (int i = 0; i < frames; ++i)
      recorder_.value()->take(
          {cv::Mat::zeros(8, 8, CV_8UC1), Time{++count_ * 100'000'000LL}, Pose{}, Matrix6d::Zero()});
  }
  /// Frames in a recording.
  static std::size_t in(const std::filesystem::path& file) {
    const auto sequence = io::Sequence::open(file);
    EXPECT_TRUE(sequence) << sequence.error().message;
    return sequence ? sequence->size() : 0;
  }

 private:
  static Camera camera() {
    Camera camera;
    camera.width = camera.height = 8;
    camera.fx = camera.fy = 8;
    return camera;
  }
  Result<std::unique_ptr<SessionRecorder>> recorder_;
  int count_ = 0;
};

void write_text(const std::filesystem::path& file, const std::string& text) { std::ofstream(file) << text; }
std::string text_in(const std::filesystem::path& file) {
  const auto text = io::read_file(file);
  return text ? *text : std::string();
}

/// A power cut and a start anew: what was recorded until then is all that there is of that flight.
TEST(SessionRecording, IsNeverWrittenOverByALaterSession) {
  const test::TemporaryFolder folder;
  write_text(folder / "flight.mcap", "finished");
  write_text(folder / "flight.mcap.part", "begun");
  write_text(folder / "flight-2.mcap.part", "begun, second map");
  FewFrames flight(folder / "flight.mcap");
  EXPECT_THAT((*flight).report().earlier, ::testing::ElementsAre((folder / "flight-1.mcap").string(),
                                                                 (folder / "flight-3.mcap.part").string()));
  flight.add(3);
  (*flight).begin_anew();
  flight.add(2);
  ASSERT_TRUE((*flight).finish());
  EXPECT_EQ(text_in(folder / "flight-1.mcap"), "finished");
  EXPECT_EQ(text_in(folder / "flight-2.mcap.part"), "begun, second map");
  EXPECT_EQ(text_in(folder / "flight-3.mcap.part"), "begun");
  EXPECT_EQ(FewFrames::in(folder / "flight.mcap"), 3U);
  EXPECT_EQ((*flight).report().file, folder / "flight-4.mcap");
  EXPECT_EQ(FewFrames::in(folder / "flight-4.mcap"), 2U);
  EXPECT_EQ(folder.entries(), 5U);
}

/// The map needs the last of the disk more than the recording does.
TEST(SessionRecording, EndsWholeBeforeTheDiskIsFull) {
  const test::TemporaryFolder folder;
  std::atomic<int> asked{0};  // when it begins, and for each frame
  RecorderLimits limits;
  limits.available = [&](const std::filesystem::path& /*file*/) -> std::uintmax_t {
    return asked++ < 4 ? 500'000'000 : 499'999'999;
  };
  FewFrames flight(folder / "flight.mcap", limits);
  flight.add(4);
  (*flight).begin_anew();
  flight.add(2);
  ASSERT_TRUE((*flight).finish());
  const RecorderReport report = (*flight).report();
  EXPECT_EQ(report.ended, "the disk has less than 500 MB left");
  EXPECT_EQ(report.left_out, 3U);
  EXPECT_EQ(report.file, folder / "flight.mcap");
  EXPECT_EQ(folder.entries(), 1U);
  EXPECT_EQ(FewFrames::in(folder / "flight.mcap"), 3U);

  FewFrames late(folder / "late.mcap", limits);
  late.add(1);
  const Status finished = (*late).finish();
  ASSERT_FALSE(finished);
  EXPECT_THAT(finished.error().message, ::testing::HasSubstr("nothing was recorded: the disk has less"));
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(SessionRecording, WithoutAFrameSaysSo) {
  const test::TemporaryFolder folder;
  auto recorder = SessionRecorder::create(folder / "flight.mcap", Camera{}, {});
  ASSERT_TRUE(recorder);
  const Status finished = (*recorder)->finish();
  ASSERT_FALSE(finished);
  EXPECT_THAT(finished.error().message, ::testing::HasSubstr("nothing was recorded"));
  EXPECT_EQ(folder.entries(), 0U);
}

TEST(Session, SaysHowFarTheStampsAreOffOnceItIsCertain) {
  EXPECT_EQ(stamp_text(std::nullopt), "");
  EXPECT_EQ(stamp_text(StampOffset{-0.012, 0.004, 20}), "");  // three sigmas
  EXPECT_EQ(stamp_text(StampOffset{0.003, 0.0001, 20}), "");  // too small to matter
  EXPECT_EQ(stamp_text(StampOffset{-0.012, 0.0005, 20}),
            "the images' stamps are 12.0 ms late (1 sigma 0.5 ms): add -0.0120 to session.time_offset");
  EXPECT_THAT(stamp_text(StampOffset{0.02, 0.001, 20}), ::testing::HasSubstr("20.0 ms early"));
}

}  // namespace
}  // namespace pade::live
