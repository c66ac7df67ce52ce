#include "pade/offline/map_sequence.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <future>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/checks/run_hints.hpp"
#include "pade/core/option_check.hpp"
#include "pade/core/version.hpp"
#include "pade/io/formats/cloud_files.hpp"
#include "pade/io/formats/map_files.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/text.hpp"
#include "pade/offline/calibration/clock_calibration.hpp"
#include "pade/offline/poses_from_sensors.hpp"
#include "pade/offline/run_tally.hpp"
#include "pade/report/report.hpp"
#include "pade/report/tables/accuracy_tables.hpp"

namespace pade {
namespace {

constexpr std::size_t kReportFrames = 4;

/// A frame as it comes from the disk, with its truth.
struct Loaded {
  Result<Frame> frame = Error{};
  cv::Mat truth;                         // empty where there is none
  std::optional<io::Skipped> bad_truth;  // why, where a depth image is there
};

Loaded load(const io::Sequence& sequence, std::size_t i) {
  Loaded loaded{sequence.frame(i), {}, {}};
  const std::filesystem::path& file = sequence.depth_file(i);
  if (file.empty()) return loaded;
  if (auto truth = sequence.truth(i)) {
    loaded.truth = *truth;
  } else {
    loaded.bad_truth = io::skipped_in(sequence.folder(), file.string(), truth.error().message);
  }
  return loaded;
}

double masked_share(const cv::Mat& mask) {
  return 1 - static_cast<double>(cv::countNonZero(mask)) / static_cast<double>(mask.total());
}

/// What stands on what is judged along +z of the world of the poses.
Status check_footing(const io::Sequence& sequence, const depth::FootingOptions& footing) {
  constexpr double kAgrees = 0.999;
  const auto& up = sequence.world_up();
  if (!footing.on || (up && up->direction.z() > kAgrees)) return {};
  return Error{
      fmt::format("footing.on: needs poses in a world whose up is +z; found {}; leave it off, or state "
                  "the true up with --world-up or world_up in camera.yaml",
                  up ? io::to_text(up->direction) + " (" + up->source + ")" : "no common up")};
}

/// Reads frames in order, with a second thread one frame ahead.
class Reader {
 public:
  Reader(const io::Sequence& sequence, bool ahead) : sequence_(sequence), ahead_(ahead) { prefetch(0); }
  Loaded next() {
    Loaded loaded = pending_.valid() ? pending_.get() : load(sequence_, i_);
    prefetch(++i_);
    return loaded;
  }

 private:
  void prefetch(std::size_t i) {
    if (ahead_ && i < sequence_.size()) {
      pending_ = std::async(std::launch::async, [this, i] { return load(sequence_, i); });
    }
  }
  const io::Sequence& sequence_;
  bool ahead_;
  std::size_t i_ = 0;
  std::future<Loaded> pending_;
};

/// Everything a run gathers while it goes.
class Run {
 public:
  Run(const io::Sequence& sequence, const MapSequenceOptions& options, io::RunWriter& writer,
      ObstacleMapper mapper)
      : sequence_(sequence),
        options_(options),
        writer_(writer),
        mapper_(std::move(mapper)),
        cloud_(options.cloud),
        accuracy_(options.mapper.depth.range),
        tally_(sequence.camera(), options.mapper.map) {
    const std::size_t pairs = sequence.size() - std::min(sequence.size(), step());
    for (const std::size_t pair : evaluation::evenly_spread(pairs, kReportFrames)) {
      shown_.push_back(sequence.time(options.mapper.order == Order::newest ? pair + step() : pair));
    }
  }

  Status add(std::size_t i, Loaded loaded) {
    depth_files_ += sequence_.depth_file(i).empty() ? 0 : 1;
    if (loaded.bad_truth) {
      bad_truths_.push_back(std::move(*loaded.bad_truth));
      if (sequence_.options().strict) {
        return Error{fmt::format("{}: {}, refused because of strict",
                                 (sequence_.folder() / bad_truths_.back().file).string(),
                                 bad_truths_.back().reason)};
      }
    }
    if (!loaded.frame) {
      undecodable_.push_back({sequence_.image_file(i).string(), loaded.frame.error().message});
      ++missed_;
      return sequence_.check(undecodable_.size());
    }
    const Frame& frame = *loaded.frame;
    truths_[frame.time] = std::move(loaded.truth);
    while (truths_.size() > step() + 1) truths_.erase(truths_.begin());

    const double cpu_before = io::thread_cpu_seconds();
    const MapperUpdate& update = mapper_.add(frame.image, frame.time, frame.T_world_camera,
                                             over_missed(frame.motion_covariance, missed_));
    stages_cpu_ += io::thread_cpu_seconds() - cpu_before;
    if (update.outcome == MapperUpdate::Outcome::skipped) {
      undecodable_.push_back({sequence_.image_file(i).string(), update.reason});
      ++missed_;
      return sequence_.check(undecodable_.size());
    }
    missed_ = 0;
    ++used_;
    writer_.add_pose(frame.time, mapper_.T_world_camera());
    path_.push_back(mapper_.T_world_camera().translation);
    if (options_.world_coordinates) {
      Pose pose = mapper_.T_world_camera();
      pose.translation += sequence_.local_origin();
      world_path_.push_back({frame.time, pose});
    }
    look_ = mapper_.T_world_camera().matrix3().col(2);
    return update.outcome == MapperUpdate::Outcome::mapped ? take(update, frame.image) : Status();
  }

  [[nodiscard]] MapProgress progress(std::size_t done) const {
    return {done, sequence_.size(), mapper_.health().mapped,
            sequence_.skipped().size() + undecodable_.size()};
  }

  /// The page shows the time and memory until then, timing.json those of everything that is written.
  Result<MapResult> finish(std::chrono::steady_clock::time_point started) {
    MapResult result;
    result.info = writer_.completed(info());
    result.info.hints = evaluation::hints_of(result.info);
    if (!accuracy_.empty()) result.accuracy = accuracy_.result();
    if (Status status = write(result); !status) return status.error();
    if (options_.report) {
      result.timing = timing(started);
      if (Status status = writer_.write("report.html", report(result)); !status) return status.error();
    }
    const auto last = [&] { return result.timing = timing(started); };
    if (Status status = writer_.finish(result.info, last); !status) return status.error();
    return result;
  }

 private:
  [[nodiscard]] std::size_t step() const { return static_cast<std::size_t>(options_.mapper.step); }

  Status take(const MapperUpdate& update, const cv::Mat& newest) {
    for (std::size_t stage = 0; stage < stage_names.size(); ++stage) {
      milliseconds_[stage].push_back(1e3 * update.seconds[stage]);
    }
    const Time time = update.depth.time;
    const cv::Mat& image = options_.mapper.order == Order::newest ? newest : update.reference.image;
    const cv::Mat& truth = truths_[time];
    accuracy_.add(update.depth, truth);
    tally_.add(update);
    cloud_.add(update.depth, sequence_.camera(), update.reference.T_world_camera, image);
    if (options_.report && std::find(shown_.begin(), shown_.end(), time) != shown_.end()) {
      frames_.push_back({to_string(time),
                         image.clone(),
                         update.flow.vectors.clone(),
                         {time,
                          update.depth.window,
                          update.depth.depth.clone(),
                          update.depth.variance.clone(),
                          update.depth.state.clone(),
                          {},
                          update.depth.bound.clone()},
                         truth.clone()});
    }
    return writer_.add(update.depth, update.flow);
  }

  [[nodiscard]] io::RunInfo info() const {
    io::RunInfo info;
    info.version = version;
    info.sequence = io::absolute_path(sequence_.folder()).lexically_normal();
    info.poses = sequence_.pose_file().filename().string();
    info.options =  // names of files may hold bytes that are no UTF-8
        io::json_of(options_).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    info.camera = sequence_.camera();
    info.window = options_.mapper.depth.window;
    info.range_limit = options_.mapper.depth.range;
    info.health.frames = static_cast<int>(sequence_.listed_frames());
    info.health.frames_used = static_cast<int>(used_);
    info.health.depth_images = static_cast<int>(mapper_.health().mapped);
    info.health.frames_without_pose = static_cast<int>(sequence_.frames_without_pose());
    info.health.motions_without_scale = static_cast<int>(sequence_.motions_without_scale());
    info.health.skipped = sequence_.skipped();
    info.health.skipped.insert(info.health.skipped.end(), undecodable_.begin(), undecodable_.end());
    info.health.skipped.insert(info.health.skipped.end(), bad_truths_.begin(), bad_truths_.end());
    info.health.navigation = sequence_.navigation();
    info.health.warnings = sequence_.notes();
    if (!bad_truths_.empty()) {
      info.health.warnings.push_back(
          fmt::format("the true depth of {} of {} frames cannot be read and nothing is compared with it; "
                      "first: {}: {}",
                      bad_truths_.size(), depth_files_, bad_truths_[0].file, bad_truths_[0].reason));
    }
    info.world_up = sequence_.world_up();
    info.origin = sequence_.origin();
    info.local_origin = sequence_.local_origin();
    info.map = tally_.map_summary(mapper_.map());
    info.motion = tally_.motion_summary();
    info.motion.stamp_offset = mapper_.health().stamp_offset;
    info.masked_share = masked_share(sequence_.mask());
    return info;
  }

  [[nodiscard]] io::RunTiming timing(std::chrono::steady_clock::time_point started) const {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    io::RunTiming timing;
    for (std::size_t stage = 0; stage < stage_names.size(); ++stage) {
      timing.stages.push_back(io::summarise(stage_names[stage], milliseconds_[stage]));
    }
    timing.frames_per_second = seconds > 0 ? static_cast<double>(used_) / seconds : 0;
    timing.peak_memory = io::peak_memory();
    timing.cpu_seconds = io::cpu_seconds();
    timing.stages_cpu_seconds = stages_cpu_;
    return timing;
  }

  Status write(const MapResult& result) {
    const Eigen::Vector3d& shift = result.info.local_origin;
    const std::string world = "world frame of " + result.info.poses + " (metres)";
    const std::string frame = shift.isZero(0)
                                  ? world
                                  : fmt::format("{}\nlocal origin {} {} {}: add it to get back to that frame",
                                                world, shift.x(), shift.y(), shift.z());
    // One after the other, so that no two of them are held at a time.
    Status status;
    const auto write = [&](const char* name, const auto& content) {
      if (status) status = writer_.write(name, content);
    };
    write("cloud.ply", io::encode_ply(cloud_.cloud(), frame));
    write("map.bt", io::encode_map(mapper_.map(), io::MapFormat::bt));
    write("map.ot", io::encode_map(mapper_.map(), io::MapFormat::ot));
    write("map.json", io::encode_side_car(options_.mapper.map, result.info.origin, shift));
    if (options_.pcd) write("cloud.pcd", io::encode_pcd(cloud_.cloud(), frame));
    if (options_.world_coordinates) {
      write("cloud_world.ply", io::encode_ply(cloud_.cloud(), world, shift));
      write("trajectory_world.txt", io::format_trajectory(world_path_));
      if (options_.pcd) write("cloud_world.pcd", io::encode_pcd(cloud_.cloud(), world, shift));
    }
    if (result.accuracy) {
      write("evaluation.json", evaluation::to_json(*result.accuracy));
      write("evaluation.csv", evaluation::to_csv(*result.accuracy));
    }
    return status;
  }

  std::string report(const MapResult& result) {
    return evaluation::to_html(
        {result.info, result.timing, result.accuracy, std::move(frames_), &mapper_.map(), path_, look_});
  }

  const io::Sequence& sequence_;
  const MapSequenceOptions& options_;
  io::RunWriter& writer_;
  ObstacleMapper mapper_;
  mapping::CloudBuilder cloud_;
  evaluation::Accumulator accuracy_;
  RunTally tally_;
  std::vector<Time> shown_;  // frames of the report
  std::vector<evaluation::ReportFrame> frames_;
  std::map<Time, cv::Mat> truths_;  // of the frames whose depth may still come
  std::vector<io::Skipped> undecodable_;
  std::vector<io::Skipped> bad_truths_;
  std::size_t depth_files_ = 0;
  std::vector<Eigen::Vector3d> path_;
  std::vector<io::StampedPose> world_path_;         // where options_.world_coordinates
  Eigen::Vector3d look_ = Eigen::Vector3d::Zero();  // optical axis at the last pose
  std::array<std::vector<double>, stage_names.size()> milliseconds_;
  double stages_cpu_ = 0;  // s
  std::size_t used_ = 0;
  int missed_ = 0;  // frames since the last one that was used
};

}  // namespace

Status check(const MapSequenceOptions& options) {
  if (Status status = within("mapper", check(options.mapper)); !status) return status;
  if (Status status = within("sequence", check(options.sequence)); !status) return status;
  if (Status status = within("navigation", check(options.navigation)); !status) return status;
  return within("cloud", check(options.cloud));
}

void set_imu(MapSequenceOptions& options, navigation::ImuClass imu) {
  options.imu = imu;
  options.navigation.filter = navigation::FilterOptions::of(imu);
}

Status read_options(std::string_view text, std::string_view file, MapSequenceOptions& options) {
  MapSequenceOptions read = options;
  if (Status status = io::from_yaml(text, file, read); !status) return status;
  if (read.imu == options.imu) {
    options = read;
    return {};
  }
  set_imu(options, read.imu);
  return io::from_yaml(text, file, options);
}

/// Fills in the offset from the turns of images and gyroscope. What was read once is kept.
static Status find_offset(const io::Sequence& images,
                          const std::function<bool(std::size_t, std::size_t)>& progress,
                          SensorSource& source) {
  const std::filesystem::path place = source.log.empty() ? images.folder() : source.log;
  io::NavigationLogOptions log_options;
  log_options.topics = source.topics;
  auto checked = source.read ? source.read(place, source.topics) : read_checked_log(place, log_options);
  if (!checked) return checked.error();
  const auto found = calibrate_clock(images, checked->log.imu, progress);
  if (!found) return found.error();
  const TurnAlignment& a = found->alignment;
  source.time_offset = a.offset;
  source.found = fmt::format("found from the turns of {} pairs of images (1 sigma {:.2f} ms)", a.pairs,
                             1e3 * a.offset_sigma);
  for (const std::string& note : notes_on(*found, images.calibration().T_body_camera))
    source.found += "; " + note;
  source.read = [kept = std::move(*checked)](const auto&, const auto&) -> Result<CheckedLog> { return kept; };
  return {};
}

Result<io::Sequence> open_sequence(const std::filesystem::path& folder, const MapSequenceOptions& options,
                                   const LogReader& reader,
                                   const std::function<bool(std::size_t, std::size_t)>& progress) {
  const bool fed = options.navigation.filter.camera;
  if (fed && options.sequence.poses != poses_from_sensors) {
    return Error{fmt::format(
        "navigation.filter.camera (--feed-camera) is on and the poses are {}, expected {}: nothing else "
        "has a filter to feed",
        options.sequence.poses, poses_from_sensors)};
  }
  if (fed && !options.mapper.refinement.on) {
    return Error{
        "navigation.filter.camera (--feed-camera) is on and mapper.refinement.on (--refine-motion) is off, "
        "expected on: it is the refinement that finds the motion"};
  }
  if (options.sequence.poses != poses_from_sensors) {
    for (const auto& [name, value] :
         {std::pair{"log", &options.log}, {"time-offset", &options.time_offset}}) {
      if (value->empty()) continue;
      return Error{
          fmt::format("--{}: found {} and the poses are {}, expected --poses {}: nothing else reads it", name,
                      io::in_quotes(*value), options.sequence.poses, poses_from_sensors)};
    }
    return io::Sequence::open(folder, options.sequence);
  }
  SensorSource source{
      options.log, options.log.empty() ? options.sequence.topics : std::string(), reader, {}, {}};
  const bool searched = options.time_offset == "auto";
  if (!searched && !options.time_offset.empty()) {
    source.time_offset = io::parse_number(options.time_offset);
    constexpr double kMost = 4e9;  // s, as far as stamps go
    if (!source.time_offset || !(std::abs(*source.time_offset) < kMost)) {
      return Error{fmt::format("--time-offset: found {}, expected seconds or auto",
                               io::in_quotes(options.time_offset))};
    }
  }
  if (!fed && !searched)
    return io::Sequence::open(folder, options.sequence, poses_from_imu_gnss(options.navigation, source));
  // First for the images alone, of which the filter has yet to say which ones have a pose.
  const auto images = open_images(folder, options.sequence);
  if (!images) return images.error();
  if (searched) {
    // Before the search, which takes minutes.
    const Status mounted = check_mounting(images->folder(), images->calibration());
    if (!mounted) return mounted.error();
    if (Status status = find_offset(*images, progress, source); !status) return status.error();
  }
  if (!fed)
    return io::Sequence::open(folder, options.sequence, poses_from_imu_gnss(options.navigation, source));
  const FedImages looked_at{*images, options.mapper.refinement};
  return io::Sequence::open(folder, options.sequence,
                            poses_from_imu_gnss(options.navigation, source, &looked_at));
}

Result<MapResult> map_sequence(const io::Sequence& sequence, const MapSequenceOptions& options,
                               io::RunWriter& writer, int threads,
                               const std::function<bool(const MapProgress&)>& progress,
                               std::chrono::steady_clock::time_point started) {
  if (const Status status = check(options); !status) return status.error();
  if (const Status status = check_footing(sequence, options.mapper.footing); !status) return status.error();
  auto mapper = ObstacleMapper::create(sequence.camera(), options.mapper, sequence.mask());
  if (!mapper) return mapper.error();

  Run run(sequence, options, writer, std::move(mapper).value());
  Reader reader(sequence, threads > 1);
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    if (Status status = run.add(i, reader.next()); !status) return status.error();
    if (progress && !progress(run.progress(i + 1))) return io::interrupted_error();
  }
  return run.finish(started);
}

}  // namespace pade
