// `pade navigate`: a log of IMU and GNSS through the navigation filter.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/checks/run_hints.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/run/health_json.hpp"
#include "pade/io/sequence/calibration.hpp"
#include "pade/io/text.hpp"
#include "pade/io/world.hpp"
#include "pade/navigation/navigation_run.hpp"
#include "pade/offline/checked_log.hpp"
#include "pade/report/gnss/raw_gnss_report.hpp"
#include "pade/report/navigation_report.hpp"

#include "commands.hpp"
#include "odometry.hpp"
#include "options/json_text.hpp"
#include "options/sensor_log.hpp"
#include "options/unused_options.hpp"
#include "raw_gnss.hpp"
#include "tight.hpp"

namespace pade::cli {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr const char* kMarker = "relative_motion.csv";

struct NavigateArguments {
  std::string log;
  std::string out;
  std::string gnss;
  std::string frames;
  std::string topics;
  std::string imu = "industrial";
  std::string vehicle = "free";
  double rate = 10;
  double gravity = 9.80665;
  double heading = 0;
  double heading_sigma = 2;
  double gnss_latency = 0, velocity_latency = 0, barometer_latency = 0, magnetometer_latency = 0;
  double declination = 0;
  std::string lever_arm;
  std::string calibration;
  int camera = 0;
  CLI::Option* velocity_latency_given = nullptr;
  CLI::Option* heading_given = nullptr;
  bool raw = false;
  std::string raw_coupling;
  std::string raw_gnss;
  double elevation_mask = 10;
  gnss::PositioningOptions noise;  ///< whose sigmas are asked for
  CLI::Option* doppler_sigma_given = nullptr;
  CLI::Option* phase_sigma_given = nullptr;
  bool force = false;
  bool json = false;
  const CLI::App* command = nullptr;
};

/// Lever arm, and what a calibration says of where the camera sits.
Status set_mounting(const NavigateArguments& arguments, NavigationRunOptions& options) {
  if (!arguments.calibration.empty()) {
    const auto calibration = io::read_calibration(arguments.calibration, arguments.camera);
    if (!calibration) return calibration.error();
    if (!calibration->T_body_camera) {
      return Error{
          fmt::format("{}: found no mounting of the camera in it, expected T_body_camera, T_BS or T_cam_imu",
                      arguments.calibration)};
    }
    options.T_body_camera = *calibration->T_body_camera;
    options.navigator.camera_time_offset = calibration->time_offset_s.value_or(0);
    if (calibration->gnss_lever_arm) options.navigator.gnss_lever_arm = *calibration->gnss_lever_arm;
  }
  if (arguments.lever_arm.empty()) return {};
  const auto arm = io::parse_point(arguments.lever_arm);
  if (!arm) {
    return Error{fmt::format("--lever-arm: found {}, expected \"x,y,z\" in metres, forward, left, up",
                             io::in_quotes(arguments.lever_arm))};
  }
  options.navigator.gnss_lever_arm = *arm;
  return {};
}

/// What the parser lets through although it is no number.
Status check_numbers(const NavigateArguments& arguments) {
  for (const auto& [option, value] : {std::pair{"--rate", arguments.rate},
                                      {"--heading", arguments.heading},
                                      {"--heading-sigma", arguments.heading_sigma},
                                      {"--gravity", arguments.gravity},
                                      {"--declination", arguments.declination},
                                      {"--gnss-latency", arguments.gnss_latency},
                                      {"--gnss-velocity-latency", arguments.velocity_latency},
                                      {"--baro-latency", arguments.barometer_latency},
                                      {"--mag-latency", arguments.magnetometer_latency}}) {
    if (!std::isfinite(value)) return Error{fmt::format("{}: found {}, expected a number", option, value)};
  }
  if (!(arguments.heading_sigma > 0))
    return Error{fmt::format("--heading-sigma: found {}, expected degrees above 0", arguments.heading_sigma)};
  return {};
}

Result<NavigationRunOptions> run_options(const NavigateArguments& arguments, const NavigationLog& log) {
  if (const Status numbers = check_numbers(arguments); !numbers) return numbers.error();
  NavigationRunOptions options;
  options.rate = arguments.rate;
  options.on_road = arguments.vehicle == "road";
  options.navigator.filter = navigation::FilterOptions::of(
      from_name<navigation::ImuClass>(arguments.imu).value_or(navigation::ImuClass::industrial));
  options.navigator.filter.gravity = arguments.gravity;
  options.navigator.filter.raw_gnss = arguments.raw_coupling == "tight";
  options.navigator.gnss_lever_arm = log.gnss.lever_arm.value_or(Eigen::Vector3d::Zero());
  if (const Status mounted = set_mounting(arguments, options); !mounted) return mounted.error();
  options.navigator.gnss_position_latency = arguments.gnss_latency;
  options.navigator.gnss_velocity_latency =
      arguments.velocity_latency_given->count() > 0 ? arguments.velocity_latency : arguments.gnss_latency;
  options.navigator.barometer_latency = arguments.barometer_latency;
  options.navigator.magnetometer_latency = arguments.magnetometer_latency;
  options.navigator.declination = arguments.declination * kDegree;
  if (arguments.heading_given->count() > 0 && !log.imu.empty()) {
    options.heading =
        Heading{log.imu.front().time, arguments.heading * kDegree, arguments.heading_sigma * kDegree};
    options.heading->time.nanoseconds += 1'000'000'000;  // within the levelling at the start
  }
  if (!arguments.frames.empty()) {
    const auto text = io::read_file(arguments.frames);
    if (!text) return text.error();
    auto stamps = io::parse_stamps(*text, arguments.frames);
    if (!stamps) return stamps.error();
    options.frames = std::move(*stamps);
  }
  if (const Status sensible = navigation::check(options.navigator); !sensible) return sensible.error();
  return options;
}

using Score = std::optional<evaluation::MotionSummary>;

nlohmann::ordered_json summary(const NavigationRun& run, const Score& score, const std::vector<Hint>& hints) {
  nlohmann::ordered_json json = io::json_of(run.health);
  json["hints"] = nlohmann::ordered_json::array();
  for (const Hint& hint : hints) {
    json["hints"].push_back({{"id", hint.id},
                             {"severity", to_name(hint.severity)},
                             {"message", hint.message},
                             {"advice", hint.advice}});
  }
  if (score) {
    json["against_truth"] = {{"pairs", score->pairs},
                             {"translation_median_m", score->translation_median},
                             {"translation_95_m", score->translation_95},
                             {"rotation_95_deg", score->rotation_95 / kDegree},
                             {"nees_mean", score->nees_mean},
                             {"rotation_nees_mean", score->rotation_nees_mean},
                             {"length_nees_mean", score->length_nees_mean},
                             {"direction_95_deg", score->direction_95 / kDegree},
                             {"direction_nees_mean", score->direction_nees_mean},
                             {"scale_valid_where_good", score->valid_where_good},
                             {"scale_invalid_where_bad", score->invalid_where_bad},
                             {"direction_valid_where_good", score->direction_valid_where_good},
                             {"direction_invalid_where_bad", score->direction_invalid_where_bad}};
  }
  return json;
}

gnss::PositioningOptions positioning_options(const NavigateArguments& arguments) {
  gnss::PositioningOptions options = arguments.noise;
  options.elevation_mask = arguments.elevation_mask * kDegree;
  // Who knows the receiver is believed.
  options.estimate_doppler_sigma = arguments.doppler_sigma_given->count() == 0;
  options.estimate_phase_sigma = arguments.phase_sigma_given->count() == 0;
  return options;
}

/// The raw GNSS that takes the place of the log's positions and velocities; nothing where none is asked for.
Result<std::optional<RawInput>> take_raw_gnss(const NavigateArguments& arguments, NavigationLog& log) {
  if (arguments.raw_coupling.empty()) return std::optional<RawInput>{};
  auto input = read_raw_input(arguments.raw_gnss.empty() ? arguments.log : arguments.raw_gnss, log.imu,
                              positioning_options(arguments));
  if (!input) return input.error();
  log.gnss.fixes.clear();
  log.gnss.velocities.clear();
  log.gnss.origin = input->origin;
  std::erase_if(log.remarks,
                [](const std::string& r) { return r.find("no GNSS log found") != std::string::npos; });
  log.remarks.push_back(input->remark);
  log.remarks.insert(log.remarks.end(), input->log.remarks.begin(), input->log.remarks.end());
  return std::optional<RawInput>(std::move(*input));
}

nlohmann::ordered_json json_of(const navigation::RawTally& tally) {
  const auto counts = [](const navigation::RawCounts& c) {
    return nlohmann::ordered_json{{"used", c.used}, {"refused", c.refused}};
  };
  return {{"ranges", counts(tally.ranges)},
          {"rates", counts(tally.rates)},
          {"phases", counts(tally.phases)},
          {"clock_jumps", tally.clock_jumps}};
}

Result<CheckedLog> read_log(const NavigateArguments& arguments) {
  io::NavigationLogOptions options;
  options.gnss = arguments.gnss;
  options.topics = arguments.topics;
  return read_sensor_log(arguments.log, options);
}

Status navigate(const NavigateArguments& arguments) {
  if (!arguments.raw_coupling.empty() && arguments.raw_gnss.empty() && !arguments.raw &&
      is_known_ranges(arguments.log)) {
    const Status fits = refuse_unused(*arguments.command,
                                      {"--out", "--raw-coupling", "--elevation-mask", "--force", "--json"},
                                      "odometry and no IMU");
    if (!fits) return fits;
    OdometryArguments odometry;
    odometry.log = arguments.log;
    odometry.out = arguments.out;
    if (arguments.raw_coupling == "loose") odometry.coupling = navigation::PlanarCoupling::loose;
    odometry.positioning = positioning_options(arguments);
    odometry.force = arguments.force;
    odometry.json = arguments.json;
    if (const auto beside = read_log(arguments); beside && !beside->log.imu.empty()) {
      odometry.remarks.push_back(
          fmt::format("the {} samples of the IMU beside them are not used: the ranges have no "
                      "Doppler",
                      beside->log.imu.size()));
    }
    return navigate_odometry(odometry);
  }
  if (arguments.raw || is_raw_gnss_file(arguments.log)) {
    const Status fits = refuse_unused(*arguments.command,
                                      {"--out", "--raw", "--elevation-mask", "--pseudorange-sigma",
                                       "--doppler-sigma", "--phase-sigma", "--force", "--json"},
                                      "raw GNSS alone, without an IMU");
    if (!fits) return fits;
    return navigate_raw(
        {arguments.log, arguments.out, positioning_options(arguments), arguments.force, arguments.json});
  }
  for (const char* option :
       {"--raw-gnss", "--elevation-mask", "--pseudorange-sigma", "--doppler-sigma", "--phase-sigma"}) {
    if (arguments.raw_coupling.empty() && arguments.command->get_option(option)->count() > 0) {
      return Error{fmt::format(
          "{}: found it without --raw-coupling, expected both: alone it would do nothing", option)};
    }
  }
  const auto overwrite = arguments.force ? io::Overwrite::replace : io::Overwrite::refuse;
  auto output = io::OutputFolder::create(arguments.out, overwrite, kMarker);
  if (!output) return output.error();
  auto checked = read_log(arguments);
  if (!checked) return checked.error();
  const auto raw = take_raw_gnss(arguments, checked->log);
  if (!raw) return raw.error();
  gnss::RawRun alone;  // each epoch by itself, for the page that shows residuals and slips
  if (*raw) {
    alone = gnss::run_raw((*raw)->log, positioning_options(arguments));
    for (std::string& sentence : gnss::unusable_satellites(alone)) {
      checked->log.remarks.push_back(std::move(sentence));
    }
  }
  const NavigationLog* const log = &checked->log;
  auto options = run_options(arguments, *log);
  if (!options) return options.error();
  if (*raw) options->raw = (*raw)->epochs;
  check_with_latencies(*checked, options->navigator);
  const NavigationRun run = run_navigation(*log, *options);
  if (run.frames.empty()) return never_aligned(arguments.log, *checked, run);
  std::vector<Hint> hints = all_hints(*checked, run);
  if (arguments.raw_coupling == "tight" && run.raw.ranges.used == 0) {
    hints.insert(
        hints.begin(),
        Hint{"raw-unused", HintSeverity::error,
             "the filter has used no pseudorange: what it says is the IMU's alone",
             "see that the raw GNSS has observations and satellites' messages of the hours of the IMU"});
  }
  const Score score = score_motions(*log, *options, run);
  nlohmann::ordered_json json = summary(run, score, hints);
  json["remarks"] = log->remarks;
  if (*raw) {
    json["raw_gnss"] = json_of(run.raw);
    for (const auto& [file, content] :
         {std::pair<std::string, std::string>{"residuals.csv", format_residuals(alone)},
          {"raw_report.html", raw_report("Raw GNSS alone, epoch by epoch", (*raw)->log, alone, {})}}) {
      if (Status written = output->write(file, content); !written) return written;
    }
  }
  std::string slips = slip_plot(run);  // as the filter found them; a loose one looks at no phase
  if (slips.empty() && *raw) slips = slip_plot(alone);
  const std::string title = "Navigation of " + std::filesystem::path(arguments.log).filename().string();
  for (const auto& [file, content] :
       {std::pair<std::string, std::string>{"trajectory.txt", format_trajectory(run)},
        {kMarker, format_relative_motion(run)},
        {"navigation.json", json_text(json) + "\n"},
        {"report.html", navigation_report(title, *log, *options, run, score, slips)}}) {
    if (Status written = output->write(file, content); !written) return written;
  }
  if (Status committed = output->commit(); !committed) return committed;
  if (arguments.json) {
    fmt::print("{}\n", json_text(json));
    return {};
  }
  fmt::print("{}", evaluation::to_table(hints));
  for (const std::string& remark : log->remarks) fmt::print("{}\n", remark);
  const NavigationHealth& health = run.health;
  fmt::print(
      "{} frames, {} of them lost, {} without a pose; status at the end: {}; speed {:.1f} m/s median, {:.1f} "
      "largest\n",
      health.frames, health.frames_lost, health.frames_without_answer, to_name(health.filter.status),
      health.speed_median, health.speed_largest);
  for (const auto& sensor : health.sensors) {
    fmt::print("{}: {} measurements, {} refused, mean χ² {:.2f} per component (1 is consistent)\n",
               sensor.sensor, sensor.measurements, sensor.refused, sensor.chi_square);
  }
  if (*raw && arguments.raw_coupling == "tight") {
    fmt::print(
        "satellite by satellite, used / refused: ranges {} / {}, rates {} / {}, phases {} / {}; the clock "
        "jumped {} times\n",
        run.raw.ranges.used, run.raw.ranges.refused, run.raw.rates.used, run.raw.rates.refused,
        run.raw.phases.used, run.raw.phases.refused, run.raw.clock_jumps);
  }
  if (score) {
    fmt::print(
        "against truth, frame to frame: translation {:.2f} cm median, {:.2f} cm 95 % (NEES {:.2f}); rotation "
        "{:.4f}° 95 % (NEES {:.2f}); 3 is consistent\n",
        100 * score->translation_median, 100 * score->translation_95, score->nees_mean,
        score->rotation_95 / kDegree, score->rotation_nees_mean);
  }
  fmt::print("{}\n", (std::filesystem::path(arguments.out) / "report.html").string());
  return {};
}

}  // namespace

void add_navigate(CLI::App& app, Context& context) {
  auto* command = app.add_subcommand("navigate", "Trajectory and frame-to-frame motion from IMU and GNSS");
  auto arguments = std::make_shared<NavigateArguments>();
  arguments->command = command;
  command
      ->add_option("log", arguments->log,
                   "Folder with imu.csv and gnss.csv, EuRoC, a VectorNav export, a ground station's .tlog, "
                   "PX4's .ulg, a recording of ROS (.bag, .mcap, .db3) "
                   "(docs/formats.md); or raw GNSS: a file of RINEX 3 observations, UBX or libRSF ranges")
      ->required();
  command->add_option("-o,--out", arguments->out, "Output folder")->required();
  command->add_option("--gnss", arguments->gnss, "GNSS file in the folder, if there are several");
  command->add_option("--topics", arguments->topics,
                      "Topics of a recording that are meant where several fit, separated by blanks");
  command->add_option("--rate", arguments->rate, "Frames per second of relative_motion.csv")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1000.0));
  command->add_option("--frames", arguments->frames,
                      "File with frame times, one per line, instead of --rate");
  command->add_option("--imu", arguments->imu, "Class of the IMU")
      ->capture_default_str()
      ->check(CLI::IsMember({"industrial", "consumer"}));
  command->add_option("--vehicle", arguments->vehicle, "free, or road: on wheels, along its x axis only")
      ->capture_default_str()
      ->check(CLI::IsMember({"free", "road"}));
  command->add_option("--gravity", arguments->gravity, "Local gravity, m/s²")
      ->capture_default_str()
      ->check(CLI::Range(9.7, 9.9));
  arguments->heading_given = command->add_option("--heading", arguments->heading,
                                                 "Known yaw at the start, degrees from east towards north");
  command->add_option("--heading-sigma", arguments->heading_sigma, "Its standard deviation, degrees")
      ->capture_default_str();
  command
      ->add_option("--gnss-latency", arguments->gnss_latency,
                   "Latency of the GNSS, s: how late its stamps are")
      ->capture_default_str()
      ->check(CLI::Range(-100.0, 100.0));
  arguments->velocity_latency_given =
      command
          ->add_option("--gnss-velocity-latency", arguments->velocity_latency,
                       "The same of its velocities, if they differ from the positions")
          ->check(CLI::Range(-100.0, 100.0));
  command->add_option("--baro-latency", arguments->barometer_latency, "The same of the barometer")
      ->check(CLI::Range(-100.0, 100.0));
  command->add_option("--mag-latency", arguments->magnetometer_latency, "The same of the magnetometer")
      ->check(CLI::Range(-100.0, 100.0));
  command->add_option("--lever-arm", arguments->lever_arm,
                      "Antenna in the body frame, \"x,y,z\": forward, left, up, m (else what the logs say)");
  command
      ->add_option("--declination", arguments->declination,
                   "Of magnetic north, from north towards east, degrees")
      ->check(CLI::Range(-180.0, 180.0));
  command->add_option(
      "--calibration", arguments->calibration,
      "Calibration whose camera the motions are of: its mounting and time offset (else the body's)");
  command->add_option("--camera", arguments->camera, "Which camera of it, from 0")->check(CLI::Range(0, 99));
  command->add_flag("--raw", arguments->raw,
                    "The folder's raw GNSS alone, epoch by epoch, without IMU (docs/gnss.md)");
  command
      ->add_option("--elevation-mask", arguments->elevation_mask,
                   "Of raw GNSS: lower satellites are not used, degrees")
      ->capture_default_str()
      ->check(CLI::Validator(
          [](const std::string& text) {
            const auto degrees = io::parse_number(text);
            const bool sensible = degrees && std::isfinite(*degrees) && *degrees >= 0 && *degrees <= 60;
            return sensible ? std::string()
                            : fmt::format("found {}, expected 0 to 60 degrees", io::in_quotes(text));
          },
          "FLOAT in [0 - 60]"));
  const auto add_sigma = [&](const char* name, double& sigma, double most, const char* what) {
    return command->add_option(name, sigma, what)->capture_default_str()->check(CLI::Range(1e-6, most));
  };
  add_sigma("--pseudorange-sigma", arguments->noise.pseudorange_sigma, 1e3,
            "Of raw GNSS: noise of a pseudorange in the zenith at 45 dB-Hz, m");
  arguments->doppler_sigma_given =
      add_sigma("--doppler-sigma", arguments->noise.doppler_sigma, 100,
                "The same of the range's rate, m/s; if it is not given it grows to what the residuals show");
  arguments->phase_sigma_given =
      add_sigma("--phase-sigma", arguments->noise.phase_sigma, 1,
                "The same of the phase, m; if it is not given it grows to what the residuals show");
  command
      ->add_option("--raw-coupling", arguments->raw_coupling,
                   "Raw GNSS beside the IMU in place of gnss.csv: tight, each satellite for itself "
                   "(docs/navigation.md, "
                   "section 7), or loose, the positions and velocities that come of each epoch; of libRSF "
                   "ranges beside "
                   "their odometry (section 8)")
      ->check(CLI::IsMember({"loose", "tight"}));
  command->add_option("--raw-gnss", arguments->raw_gnss,
                      "Where that raw GNSS is, if not in the folder of the log");
  command->add_flag("--force", arguments->force, "Replace an earlier output");
  command->add_flag("--json", arguments->json, "Print the summary as JSON");
  command->callback([arguments, &context] {
    if (const Status status = navigate(*arguments); !status.ok()) {
      fmt::print(stderr, "pade navigate: {}\n", status.error().message);
      context.exit_code = 1;
    }
  });
}

}  // namespace pade::cli
