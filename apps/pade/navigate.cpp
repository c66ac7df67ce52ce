// `pade navigate`: a log of IMU and GNSS through the navigation filter.
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/io/atomic_output.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/text.hpp"
#include "pade/navigation/navigation_run.hpp"
#include "pade/report/navigation_report.hpp"

#include "commands.hpp"

namespace pade::cli {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr const char* kMarker = "relative_motion.csv";

struct Arguments {
  std::string log;
  std::string out;
  std::string gnss;
  std::string frames;
  std::string imu = "industrial";
  std::string vehicle = "free";
  double rate = 10;
  double gravity = 9.80665;
  double heading = 0;
  double heading_sigma = 2;
  CLI::Option* heading_given = nullptr;
  bool force = false;
  bool json = false;
};

Result<NavigationRunOptions> run_options(const Arguments& arguments, const NavigationLog& log) {
  NavigationRunOptions options;
  options.rate = arguments.rate;
  options.on_road = arguments.vehicle == "road";
  options.navigator.filter = navigation::FilterOptions::of(
      from_name<navigation::ImuClass>(arguments.imu).value_or(navigation::ImuClass::industrial));
  options.navigator.filter.gravity = arguments.gravity;
  options.navigator.gnss_lever_arm = log.gnss.lever_arm.value_or(Eigen::Vector3d::Zero());
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
  return options;
}

using Score = std::optional<evaluation::MotionSummary>;

nlohmann::json summary(const NavigationRun& run, const Score& score) {
  nlohmann::json json = {{"status", std::string(to_name(run.health.status))},
                         {"frames", run.frames.size()},
                         {"frames_without_answer", run.frames_without_answer},
                         {"imu_refused", run.health.imu_refused},
                         {"imu_gaps", run.health.imu_gaps},
                         {"measurements_too_late", run.health.too_late},
                         {"measurements_repeated", run.health.duplicates},
                         {"measurements_unusable", run.health.unusable},
                         {"restarts", run.health.restarts}};
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

Status navigate(const Arguments& arguments) {
  const auto overwrite = arguments.force ? io::Overwrite::replace : io::Overwrite::refuse;
  auto output = io::OutputFolder::create(arguments.out, overwrite, kMarker);
  if (!output) return output.error();
  io::NavigationLogOptions log_options;
  log_options.gnss = arguments.gnss;
  const auto log = io::read_navigation_log(arguments.log, log_options);
  if (!log) return log.error();
  const auto options = run_options(arguments, *log);
  if (!options) return options.error();
  const NavigationRun run = run_navigation(*log, *options);
  if (run.frames.empty()) {
    return Error{fmt::format(
        "{}: the filter never found its attitude and yaw (status: {}), expected two seconds at rest and "
        "a heading, or GNSS velocities of a vehicle that accelerates",
        arguments.log, to_name(run.health.status))};
  }
  const Score score = score_motions(*log, *options, run);
  nlohmann::json json = summary(run, score);
  json["remarks"] = log->remarks;
  const std::string title = "Navigation of " + std::filesystem::path(arguments.log).filename().string();
  for (const auto& [file, content] :
       {std::pair<std::string, std::string>{"trajectory.txt", format_trajectory(run)},
        {kMarker, format_relative_motion(run)},
        {"navigation.json", json.dump(2) + "\n"},
        {"report.html", navigation_report(title, *log, run, score)}}) {
    if (Status written = output->write(file, content); !written) return written;
  }
  if (Status committed = output->commit(); !committed) return committed;
  if (arguments.json) {
    fmt::print("{}\n", json.dump(2));
    return {};
  }
  for (const std::string& remark : log->remarks) fmt::print("{}\n", remark);
  fmt::print("{} frames, {} without a pose; status at the end: {}\n", run.frames.size(),
             run.frames_without_answer, to_name(run.health.status));
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
  auto arguments = std::make_shared<Arguments>();
  command->add_option("log", arguments->log, "Folder with imu.csv and gnss.csv, EuRoC, or a VectorNav export")
      ->required();
  command->add_option("-o,--out", arguments->out, "Output folder")->required();
  command->add_option("--gnss", arguments->gnss, "GNSS file in the folder, where there are several");
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
