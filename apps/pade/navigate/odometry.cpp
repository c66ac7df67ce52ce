#include "odometry.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/io/atomic_output.hpp"
#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/navigation/gnss/raw_run.hpp"
#include "pade/report/gnss/odometry_report.hpp"

#include "options/json_text.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;
using navigation::PlanarCoupling;
using navigation::PlanarOptions;
using navigation::PlanarRun;

constexpr const char* kPositionsFile = "positions.csv";

std::optional<io::RawGnssKind> kind_by_start(const fs::path& path) {
  std::error_code failure;
  if (!fs::is_regular_file(path, failure)) return std::nullopt;
  std::string start(io::kRawGnssStart, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(stream.gcount()));
  return io::raw_gnss_kind(start);
}

nlohmann::ordered_json json_of(const RawScore& score) {
  return {{"epochs", score.epochs},
          {"horizontal_median_m", score.horizontal_median},
          {"horizontal_rms_m", score.horizontal_rms},
          {"horizontal_95_m", score.horizontal_95},
          {"vertical_rms_m", score.vertical_rms}};
}

/// What a person should know of the run, one sentence each.
std::vector<std::string> remarks_of(const gnss::RawLog& log, const PlanarRun& run) {
  std::vector<std::string> remarks = log.remarks;
  const auto say = [&](std::size_t count, const char* what) {
    if (count > 0) remarks.push_back(fmt::format("{} {}", count, what));
  };
  say(run.outside, "epochs lie outside of the odometry and are not used");
  say(run.before_start, "epochs lie before a position to start from and are not used");
  if (run.starts > 1)
    say(run.starts, "starts: a minute behind the last odometry nothing is known of the motion");
  say(run.without_position, "epochs give no position alone and are not used (loose)");
  say(run.tally.untimely, "epochs repeat a time or go back and are not used");
  say(run.tally.gaps, "gaps in the odometry, in which the position is held by the satellites alone");
  say(run.tally.reacquired,
      "times the satellites contradicted the filter for so long that they were believed");
  if (!run.yaw_found)
    remarks.emplace_back("the yaw was never found: too short a way, or positions too uncertain");
  return remarks;
}

nlohmann::ordered_json odometry_json(const gnss::RawLog& log, const PlanarRun& run, const gnss::RawRun& alone,
                                     const OdometryArguments& arguments) {
  const navigation::PlanarEstimate& last = run.frames.back().estimate;
  nlohmann::ordered_json json = {
      {"coupling", arguments.coupling == PlanarCoupling::tight ? "tight" : "loose"},
      {"epochs", log.known_ranges.size()},
      {"epochs_with_position", run.frames.size()},
      {"odometry", {{"samples", log.odometry.size()}, {"gaps", run.tally.gaps}}},
      {"ranges",
       {{"counted", run.tally.counted}, {"doubted", run.tally.doubted}, {"refused", run.tally.refused}}},
      {"clock_jumps", run.tally.clock_jumps},
      {"times_believed_anew", run.tally.reacquired},
      {"yaw_known_after_s", nullptr},
      {"at_the_end",
       {{"yaw_sigma_deg", last.yaw_sigma * 180 / std::numbers::pi},
        {"scale", last.scale},
        {"scale_sigma", last.scale_sigma},
        {"yaw_rate_bias_radps", last.yaw_rate_bias},
        {"clock_drift_mps", last.drift}}}};
  if (run.yaw_found) {
    json["yaw_known_after_s"] = seconds_between(run.frames.front().estimate.time, *run.yaw_found);
  }
  if (const auto score = score_planar(log, run)) {
    json["against_truth"] = json_of(score->score);
    json["against_truth"]["nees_mean"] = score->nees;
  }
  if (const auto score = score_positions(log, alone))
    json["each_epoch_alone_against_truth"] = json_of(*score);
  const PlanarOptions options;
  PlanarOptions::visit(options, [&](const char* name, const auto& value, const char* /*meaning*/) {
    json["options"]["odometry"][name] = value;
  });
  gnss::visit(arguments.positioning,
              [&](const char* name, const auto& value) { json["options"]["satellites"][name] = value; });
  json["remarks"] = remarks_of(log, run);
  return json;
}

void print_score(const char* name, const RawScore& score) {
  fmt::print(
      "{}: horizontal {:.2f} m median, {:.2f} m rms, {:.2f} m 95 %; vertical {:.2f} m rms ({} epochs)\n",
      name, score.horizontal_median, score.horizontal_rms, score.horizontal_95, score.vertical_rms,
      score.epochs);
}

void print_run(const gnss::RawLog& log, const PlanarRun& run, const gnss::RawRun& alone,
               PlanarCoupling coupling) {
  for (const std::string& remark : remarks_of(log, run)) fmt::print("{}\n", remark);
  const navigation::PlanarEstimate& last = run.frames.back().estimate;
  fmt::print("{} of {} epochs with a position, from raw GNSS and {} samples of odometry\n", run.frames.size(),
             log.known_ranges.size(), log.odometry.size());
  if (run.yaw_found) {
    fmt::print(
        "yaw known after {:.1f} s, at the end to {:.2f}°; wheels' scale {:.4f} ± {:.4f}; bias of the yaw "
        "rate "
        "{:.4f} rad/s\n",
        seconds_between(run.frames.front().estimate.time, *run.yaw_found),
        last.yaw_sigma * 180 / std::numbers::pi, last.scale, last.scale_sigma, last.yaw_rate_bias);
  }
  if (coupling == PlanarCoupling::tight) {
    fmt::print("ranges: {} counted, {} doubted, {} refused; the clock jumped {} times\n", run.tally.counted,
               run.tally.doubted, run.tally.refused, run.tally.clock_jumps);
  }
  if (const auto score = score_positions(log, alone)) print_score("against truth, each epoch alone", *score);
  if (const auto score = score_planar(log, run)) {
    print_score("against truth, with odometry", score->score);
    fmt::print("squared error in its covariance: {:.1f} (2 is consistent)\n", score->nees);
  }
}

}  // namespace

bool is_known_ranges(const std::string& path) {
  std::error_code failure;
  if (!fs::is_directory(path, failure)) return kind_by_start(path) == io::RawGnssKind::known_ranges;
  bool ranges = false;
  for (fs::directory_iterator it(path, failure), end; !failure && it != end; it.increment(failure)) {
    const auto kind = kind_by_start(it->path());
    if (kind == io::RawGnssKind::observations || kind == io::RawGnssKind::ubx) return false;
    ranges = ranges || kind == io::RawGnssKind::known_ranges;
  }
  return ranges;
}

Status navigate_odometry(const OdometryArguments& arguments) {
  const auto overwrite = arguments.force ? io::Overwrite::replace : io::Overwrite::refuse;
  auto output = io::OutputFolder::create(arguments.out, overwrite, kPositionsFile);
  if (!output) return output.error();
  auto log = io::read_raw_gnss(arguments.log);
  if (!log) return log.error();
  log->remarks.insert(log->remarks.end(), arguments.remarks.begin(), arguments.remarks.end());
  if (log->odometry.empty()) {
    return Error{
        fmt::format("{}: found ranges without Doppler, expected odometry beside them (odom3 lines), or "
                    "RINEX 3 observations or UBX beside an IMU; --raw plays the ranges alone",
                    arguments.log)};
  }
  const PlanarRun run = navigation::run_planar(*log, arguments.positioning, {}, arguments.coupling);
  if (run.frames.empty()) {
    return Error{
        fmt::format("{}: no epoch has enough satellites for a position: {} epochs, {} of them outside of the "
                    "odometry",
                    arguments.log, log->known_ranges.size(), run.outside)};
  }
  const gnss::RawRun alone = gnss::run_raw(*log, arguments.positioning);
  const auto json = odometry_json(*log, run, alone, arguments);
  const std::string name = fs::path(arguments.log).filename().string();
  std::vector<std::pair<std::string, std::string>> files{
      {kPositionsFile, format_positions(run)},
      {"trajectory.txt", format_planar_trajectory(run)},
      {"residuals.csv", format_residuals(alone)},
      {"raw_report.html",
       raw_report("Raw GNSS alone, epoch by epoch", *log, alone, score_positions(*log, alone))},
      {"navigation.json", json_text(json) + "\n"},
      {"report.html", odometry_report("Raw GNSS and odometry of " + name, *log, run, alone)}};
  if (arguments.coupling == PlanarCoupling::tight) files.emplace_back("ranges.csv", format_ranges(run));
  for (const auto& [file, content] : files) {
    if (Status written = output->write(file, content); !written) return written;
  }
  if (Status committed = output->commit(); !committed) return committed;
  if (arguments.json) {
    fmt::print("{}\n", json_text(json));
    return {};
  }
  print_run(*log, run, alone, arguments.coupling);
  fmt::print("{}\n", (fs::path(arguments.out) / "report.html").string());
  return {};
}

}  // namespace pade::cli
