#include "raw_gnss.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/io/atomic_output.hpp"
#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/navigation/gnss/raw_run.hpp"
#include "pade/report/gnss/raw_gnss_report.hpp"

#include "options/json_text.hpp"

namespace pade::cli {
namespace {

constexpr const char* kRawMarker = "epochs.csv";

nlohmann::ordered_json json_of_options(const gnss::PositioningOptions& options) {
  nlohmann::ordered_json json;
  visit(options, [&](const char* name, const auto& value) { json[name] = value; });
  return json;
}

nlohmann::ordered_json raw_json(const gnss::RawLog& log, const gnss::RawRun& run,
                                const gnss::PositioningOptions& options,
                                const std::optional<RawScore>& score) {
  const RawSummary s = summary_of(run);
  nlohmann::ordered_json json = {{"epochs", s.epochs},
                                 {"with_position", s.with_position},
                                 {"with_velocity", s.with_velocity},
                                 {"with_phase_step", s.with_step},
                                 {"satellites_mean", s.satellites},
                                 {"range_residual_rms_m", s.range_rms},
                                 {"rate_residual_rms_mps", s.rate_rms},
                                 {"phase_residual_rms_m", s.phase_rms},
                                 {"phases_refused", s.slips}};
  for (std::size_t i = 0; i < gnss::kUses; ++i) {
    json["satellites"][gnss::to_name(static_cast<gnss::Use>(i))] = run.uses.at(i);
  }
  if (score) {
    json["against_truth"] = {{"epochs", score->epochs},
                             {"horizontal_median_m", score->horizontal_median},
                             {"horizontal_rms_m", score->horizontal_rms},
                             {"horizontal_95_m", score->horizontal_95},
                             {"vertical_rms_m", score->vertical_rms}};
  }
  json["options"] = json_of_options(options);
  const gnss::PositioningOptions found = run.noise.applied_to(options);
  json["noise_at_the_end"] = {{"doppler_sigma", found.doppler_sigma}, {"phase_sigma", found.phase_sigma}};
  json["remarks"] = log.remarks;
  return json;
}

void print_summary(const gnss::RawLog& log, const gnss::RawRun& run, const std::optional<RawScore>& score) {
  for (const std::string& remark : log.remarks) fmt::print("{}\n", remark);
  const RawSummary s = summary_of(run);
  fmt::print(
      "{} epochs: {} with a position of {:.1f} satellites on average, {} with a velocity, {} with a step of "
      "phases\n",
      s.epochs, s.with_position, s.satellites, s.with_velocity, s.with_step);
  fmt::print(
      "residuals, rms: pseudorange {:.2f} m, range rate {:.3f} m/s, phase {:.1f} mm; {} phases refused\n",
      s.range_rms, s.rate_rms, 1e3 * s.phase_rms, s.slips);
  std::string uses;
  for (std::size_t i = 0; i < gnss::kUses; ++i) {
    if (run.uses.at(i) == 0) continue;
    uses += fmt::format("{}{} {}", uses.empty() ? "" : ", ", run.uses.at(i),
                        gnss::to_name(static_cast<gnss::Use>(i)));
  }
  fmt::print("satellites: {}\n", uses);
  if (score) {
    fmt::print(
        "against truth: horizontal {:.2f} m median, {:.2f} m rms, {:.2f} m 95 %; vertical {:.2f} m rms ({} "
        "epochs)\n",
        score->horizontal_median, score->horizontal_rms, score->horizontal_95, score->vertical_rms,
        score->epochs);
  }
}

/// "x.obs", "x.rnx", "x.ubx" or "x.23o".
bool is_named_so(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool by_year =
      ending.size() == 4 && ending[3] == 'o' && std::isdigit(ending[1]) != 0 && std::isdigit(ending[2]) != 0;
  return by_year || ending == ".obs" || ending == ".rnx" || ending == ".ubx";
}

}  // namespace

bool is_raw_gnss_file(const std::string& path) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) return false;
  if (is_named_so(path)) return true;  // what is in it is for the reader to say
  std::string start(io::kRawGnssStart, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(stream.gcount()));
  return io::raw_gnss_kind(start).has_value();
}

Status navigate_raw(const RawGnssArguments& arguments) {
  const auto overwrite = arguments.force ? io::Overwrite::replace : io::Overwrite::refuse;
  auto output = io::OutputFolder::create(arguments.out, overwrite, kRawMarker);
  if (!output) return output.error();
  auto log = io::read_raw_gnss(arguments.log);
  if (!log) return log.error();
  if (!log->odometry.empty()) {
    log->remarks.push_back(fmt::format("{} samples of odometry are not used; --raw-coupling tight uses them",
                                       log->odometry.size()));
  }
  const gnss::RawRun run = gnss::run_raw(*log, arguments.options);
  for (std::string& sentence : gnss::unusable_satellites(run)) log->remarks.push_back(std::move(sentence));
  for (std::string& remark : gnss::remarks_on(run.noise, arguments.options))
    log->remarks.push_back(std::move(remark));
  const auto fixes = gnss_log_of(run);
  if (!fixes) {
    std::string remarks;
    for (const std::string& remark : log->remarks) remarks += "\n  " + remark;
    return Error{fmt::format(
        "{}: no epoch has enough satellites for a position; {} satellites without ephemeris, {} with "
        "a stale one, {} unhealthy{}",
        arguments.log, run.uses.at(static_cast<std::size_t>(gnss::Use::no_ephemeris)),
        run.uses.at(static_cast<std::size_t>(gnss::Use::stale)),
        run.uses.at(static_cast<std::size_t>(gnss::Use::unhealthy)), remarks)};
  }
  const auto score = score_positions(*log, run);
  const auto json = raw_json(*log, run, arguments.options, score);
  const std::string title = "Raw GNSS of " + std::filesystem::path(arguments.log).filename().string();
  for (const auto& [file, content] : {std::pair<std::string, std::string>{kRawMarker, format_epochs(run)},
                                      {"residuals.csv", format_residuals(run)},
                                      {"gnss.csv", io::format_gnss(*fixes)},
                                      {"navigation.json", json_text(json) + "\n"},
                                      {"report.html", raw_report(title, *log, run, score)}}) {
    if (Status written = output->write(file, content); !written) return written;
  }
  if (Status committed = output->commit(); !committed) return committed;
  if (arguments.json) {
    fmt::print("{}\n", json_text(json));
    return {};
  }
  print_summary(*log, run, score);
  fmt::print("{}\n", (std::filesystem::path(arguments.out) / "report.html").string());
  return {};
}

}  // namespace pade::cli
