// `pade map`: a recorded flight in, depth and an obstacle map out.
#include <array>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include "pade/checks/run_hints.hpp"
#include "pade/flow/flow_estimator.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/text.hpp"
#include "pade/offline/depth_from.hpp"
#include "pade/offline/map_sequence.hpp"
#include "pade/report/tables/accuracy_tables.hpp"

#include "commands.hpp"
#include "enum_option.hpp"
#include "options/sensor_log.hpp"
#include "progress.hpp"

namespace pade::cli {
namespace {

struct MapArguments {
  std::string sequence;
  std::string out;
  std::string config;
  std::string save;
  bool paper = false;
  bool force = false;
  bool strict = false;
  bool json = false;
  bool pcd = false;
  bool world_coordinates = false;
  bool no_report = false;
  int threads = 1;

  std::optional<std::string> flow, poses, calibration, world_up, origin, topics, refine_motion, feed_camera,
      log, time_offset;
  std::optional<DepthFrom> depth;
  std::optional<depth::Model> model;
  std::optional<depth::Reading> reading;
  std::optional<depth::Derotation> derotate;
  std::optional<depth::Gates> gates;
  std::optional<Order> order;
  std::optional<int> window, step, longest_step, camera;
  std::optional<double> range, voxel, map_range;
  std::optional<navigation::ImuClass> imu;
};

template <class T>
void set(T& field, const std::optional<T>& given) {
  if (given) field = *given;
}

/// Defaults, then --paper, then the file of --config, then the single options.
Result<MapSequenceOptions> options_of(const MapArguments& arguments) {
  MapSequenceOptions options;
  if (arguments.paper) options.mapper = as_printed(options.mapper);
  const bool of_pair =
      !arguments.depth || *arguments.depth == DepthFrom::pade || *arguments.depth == DepthFrom::ttc;
  if (arguments.paper && !of_pair) {
    return Error{
        fmt::format("--depth: found {} beside --paper, which is of one pair of frames; expected pade or ttc",
                    to_name(*arguments.depth))};
  }
  if (arguments.imu) set_imu(options, *arguments.imu);
  if (!arguments.config.empty()) {
    const auto text = io::read_file(arguments.config);
    if (!text) return text.error();
    if (Status status = read_options(*text, arguments.config, options); !status) return status.error();
    if (arguments.imu && options.imu != *arguments.imu) {  // its single options stay, its class does not
      set_imu(options, *arguments.imu);
      if (Status status = io::from_yaml(*text, arguments.config, options); !status) return status.error();
      options.imu = *arguments.imu;
    }
  }
  ObstacleMapperOptions& mapper = options.mapper;
  set(mapper.flow, arguments.flow);
  if (arguments.depth) choose_depth(*arguments.depth, mapper);
  set(mapper.depth.model, arguments.model);
  set(mapper.depth.reading, arguments.reading);
  set(mapper.depth.gates, arguments.gates);
  set(mapper.depth.window, arguments.window);
  set(mapper.depth.range, arguments.range);
  set(mapper.derotation, arguments.derotate);
  set(mapper.order, arguments.order);
  set(mapper.step, arguments.step);
  set(mapper.longest_step, arguments.longest_step);
  if (arguments.refine_motion) mapper.refinement.on = *arguments.refine_motion == "on";
  set(mapper.map.voxel, arguments.voxel);
  set(mapper.map.range, arguments.map_range);
  set(options.sequence.poses, arguments.poses);
  set(options.sequence.calibration, arguments.calibration);
  set(options.sequence.world_up, arguments.world_up);
  set(options.sequence.origin, arguments.origin);
  set(options.sequence.camera, arguments.camera);
  set(options.sequence.topics, arguments.topics);
  set(options.log, arguments.log);
  set(options.time_offset, arguments.time_offset);
  if (arguments.feed_camera) options.navigation.filter.camera = *arguments.feed_camera == "on";
  options.sequence.strict = options.sequence.strict || arguments.strict;
  options.world_coordinates = options.world_coordinates || arguments.world_coordinates;
  options.pcd = options.pcd || arguments.pcd;
  options.report = options.report && !arguments.no_report;
  return options;
}

Result<MapResult> map(const MapArguments& arguments) {
  const auto started = std::chrono::steady_clock::now();
  const auto options = options_of(arguments);
  if (!options) return options.error();
  const auto stacks = io::ImageStacks::parse(arguments.save);
  if (!stacks) return stacks.error();
  const auto read = [](const std::filesystem::path& place, const std::string& topics) {
    io::NavigationLogOptions log_options;
    log_options.topics = topics;
    return read_sensor_log(place, log_options);
  };
  std::optional<Progress> search;
  const auto compared = [&](std::size_t done, std::size_t total) {
    if (!search) search.emplace("Comparing turns", total);
    search->show(done, "");
    return !io::interrupted();
  };
  const auto sequence = open_sequence(arguments.sequence, *options, read, compared);
  search.reset();
  if (!sequence) return sequence.error();
  io::RunWriterOptions output;
  output.overwrite = arguments.force ? io::Overwrite::replace : io::Overwrite::refuse;
  output.save = *stacks;
  output.image_size = sequence->camera().size();
  output.range_limit = options->mapper.depth.range;
  auto writer = io::RunWriter::create(arguments.out, output);
  if (!writer) return writer.error();

  Progress progress("Mapping", sequence->size());
  const auto step = [&](const MapProgress& now) {
    progress.step(fmt::format("{} depth images, {} skipped", now.mapped, now.skipped));
    return !io::interrupted();
  };
  return map_sequence(*sequence, *options, *writer, arguments.threads, step, started);
}

void print_table(const MapArguments& arguments, const MapResult& result) {
  const io::RunInfo& info = result.info;
  fmt::print("{:14} {} of {} frames used, {} depth images, {} skipped\n", "Flight", info.health.frames_used,
             info.health.frames, info.health.depth_images, info.health.skipped.size());
  constexpr std::size_t kNamed = 5;
  for (std::size_t i = 0; i < std::min(kNamed, info.health.skipped.size()); ++i) {
    fmt::print("{:14} {}: {}\n", i == 0 ? "  skipped" : "", info.health.skipped[i].file,
               info.health.skipped[i].reason);
  }
  if (info.health.skipped.size() > kNamed) {
    fmt::print("{:14} ... and {} more, in run.json\n", "", info.health.skipped.size() - kNamed);
  }
  for (const std::string& warning : info.health.warnings) fmt::print("{:14} {}\n", "  note", warning);
  std::uint64_t cells = 0;
  for (const std::uint64_t count : info.state_pixels) cells += count;
  fmt::print("{:14}", "Pixels");
  for (std::size_t s = 0; s < info.state_pixels.size(); ++s) {
    const double share =
        cells > 0 ? static_cast<double>(info.state_pixels[s]) / static_cast<double>(cells) : 0;
    fmt::print(" {:.1f} % {}{}", 100 * share, depth_state_names[s],
               s + 1 < info.state_pixels.size() ? "," : "\n");
  }
  if (info.map) {
    fmt::print("{:14} {} occupied and {} free voxels of {} m\n", "Map", info.map->occupied_voxels,
               info.map->free_voxels, info.map->voxel);
    if (info.map->points_outside > 0) {
      fmt::print("{:14} {} points lie outside of what the map can hold\n", "", info.map->points_outside);
    }
  }
  fmt::print("{}", evaluation::to_table(info.hints));
  if (!result.timing.stages.empty()) {
    const io::StageTiming& total = result.timing.stages.back();
    fmt::print(
        "{:14} {:.1f} frames/s; latency {:.1f} ms median, {:.1f} p99, {:.1f} max; peak memory {:.0f} MB\n",
        "Time", result.timing.frames_per_second, total.p50, total.p99, total.max,
        static_cast<double>(result.timing.peak_memory) / 1e6);
  }
  if (result.accuracy) fmt::print("\n{}", evaluation::to_table(*result.accuracy));
  std::error_code code;
  const bool report = std::filesystem::exists(std::filesystem::path(arguments.out) / "report.html", code);
  fmt::print("\nWritten to {}{}\n", arguments.out,
             report ? fmt::format("; look at {}/report.html", arguments.out) : "");
}

void run(const MapArguments& arguments, Context& context) {
  io::watch_for_interrupts();
  cv::setNumThreads(1);  // one core, and the same bits everywhere
  const auto result = map(arguments);
  if (!result) {
    fmt::print(stderr, "pade map: {}\n", result.error().message);
    context.exit_code = io::interrupted() ? 130 : 1;
    return;
  }
  if (arguments.json) {
    fmt::print("{}\n", io::to_json(result->info));
  } else {
    print_table(arguments, *result);
  }
}

void add_pipeline_options(CLI::App& map, MapArguments& a) {
  std::vector<std::string> methods = flow::flow_estimator_names();
  methods.emplace_back("dis");
  map.add_option("--flow", a.flow,
                 "optical-flow method (default clg-fast-half, of which multi-view uses a cheaper form);\ndis "
                 "= dis-medium")
      ->check(CLI::IsMember(methods));
  add_enum(
      map, "--depth", a.depth,
      "from the frames of the last seconds (multi-view, the default), from pairs of frames with refined\n"
      "motion, checks and bounds (two-view: less time), or from one pair as in the paper: with "
      "the\npose (pade) or by time to collision (ttc)");
  add_enum(map, "--model", a.model,
           "finite motion (exact, the default) or Eq. 1 of the paper (instantaneous)");
  add_enum(map, "--reading", a.reading, "how Eq. 2 is inverted (default least-squares)");
  add_enum(map, "--derotate", a.derotate,
           "remove rotation from the image before matching (default) or from the flow");
  add_enum(map, "--order", a.order,
           "depth on the newest frame of a pair (default, no latency) or on the first");
  add_enum(map, "--gates", a.gates, "off: publish every positive depth, however doubtful (default on)");
  map.add_option("--window", a.window, "n: one depth per n x n pixels (default 1)")
      ->check(CLI::Range(1, 1024));
  map.add_option("--step", a.step, "pair each frame with the k-th before it (default 1)")
      ->check(CLI::Range(1, 1000));
  map.add_option(
         "--longest-step", a.longest_step,
         "pair it also with one up to the k-th before it, for precision (default 4; 1: one pair only)")
      ->check(CLI::Range(1, 1000));
  map.add_option("--refine-motion", a.refine_motion,
                 "on (default): the images refine rotation and direction of motions that are not exact; off")
      ->check(CLI::IsMember({"on", "off"}));
  map.add_option("--range", a.range, "farthest depth that is published, m (default 20)")
      ->check(CLI::PositiveNumber);
  map.add_option("--voxel", a.voxel, "side of the map's voxels, m (default 0.1)")->check(CLI::PositiveNumber);
  map.add_option("--map-range", a.map_range, "depth up to which the map is updated, m (default 20)")
      ->check(CLI::PositiveNumber);
  map.add_flag("--paper", a.paper,
               "as the paper prints it: instantaneous, samelson, derotated flow, first frame, window 4");
}

}  // namespace

void add_map(CLI::App& app, Context& context) {
  auto a = std::make_shared<MapArguments>();
  CLI::App* map = app.add_subcommand("map", "Map a recorded flight: depth images and an obstacle map.");
  map->footer(
      "SEQUENCE is a folder in the TUM RGB-D, EuRoC, KITTI odometry, TartanAir or ICL-NUIM layout\n"
      "(docs/sequences.md), or a recording of ROS: rosbag 2.0 (.bag), MCAP or rosbag2's .db3 "
      "(docs/formats.md).\n"
      "The run folder holds map.bt and map.ot (octovis), map.json, cloud.ply, trajectory.txt, run.json, "
      "timing.json,\n"
      "report.html and, if the flight has true depth, evaluation.json and .csv.\n"
      "Examples:\n"
      "  pade map flight --out run\n"
      "  pade map images --out run --poses from-imu-gnss --log flight.ulg --time-offset auto\n"
      "  pade map flight --out run --flow dis-fast --range 40 --save depth,sigma,state,bound\n"
      "  pade map flight --out literal --paper");
  map->add_option("sequence", a->sequence, "folder or recording of the flight")->required();
  map->add_option("-o,--out", a->out, "folder of the run, made by this command")->required();
  add_pipeline_options(*map, *a);
  map->add_option(
      "--poses", a->poses,
      "groundtruth (default), original, from-imu-gnss (imu.csv and gnss.csv through the navigation\n"
      "filter), or a pose file (TUM)");
  map->add_option(
      "--log", a->log,
      "for --poses from-imu-gnss: where the sensors are, if not beside the images: .ulg, .tlog, a "
      "recording\nof ROS, a folder");
  map->add_option(
      "--time-offset", a->time_offset,
      "for --poses from-imu-gnss: time of a pose = time of the image + this, s; or auto: found from the\n"
      "turns of images and gyroscope, as pade calibrate time does (default: what the calibration says)");
  add_enum(*map, "--imu", a->imu, "class of the IMU, for --poses from-imu-gnss (default industrial)");
  map->add_option(
         "--feed-camera", a->feed_camera,
         "for --poses from-imu-gnss: on: what the images show of the motion goes into the navigation\n"
         "filter, too, which then knows its yaw without a compass; off (default)")
      ->check(CLI::IsMember({"on", "off"}));
  map->add_option("--calibration", a->calibration, "calibration file instead of the sequence's own");
  map->add_option("--topics", a->topics,
                  "topics of a recording that are meant where several fit, separated by blanks");
  map->add_option("--world-up", a->world_up, "axis of the pose world that points up: +x -x +y -y +z -z");
  map->add_option("--camera", a->camera, "which camera of a calibration file that holds several, from 0")
      ->check(CLI::Range(0, 99));
  map->add_option("--origin", a->origin,
                  "point of the pose world that is 0 0 0 of the run: auto (default: near the flight if that\n"
                  "is farther than 1 km from 0 0 0, as in UTM), flight, none, or \"x y z\"");
  map->add_flag("--world-coordinates", a->world_coordinates,
                "also write cloud and trajectory in the coordinates of the poses (cloud_world.ply ...)");
  map->add_option("--save", a->save, "image stacks to write: any of depth,sigma,state,bound,flow");
  map->add_option("--config", a->config, "YAML file with options as run.json echoes them");
  map->add_option("--threads", a->threads, "2 reads ahead; the result is the same")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  map->add_flag("--strict", a->strict, "refuse a recording with anything that would be skipped");
  map->add_flag("--pcd", a->pcd, "also write cloud.pcd");
  map->add_flag("--no-report", a->no_report, "do not write report.html");
  map->add_flag("--force", a->force, "replace a run that is there already");
  map->add_flag("--json", a->json, "print run.json instead of the table");
  map->callback([a, &context] { run(*a, context); });
}

}  // namespace pade::cli
