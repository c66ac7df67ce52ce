// Log folders, and our own layout as text.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "pade/io/foreign_file.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/recording.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

/// The file in `folder` whose name ends with `ending`; empty where there is none.
std::filesystem::path file_ending_with(const std::filesystem::path& folder, std::string_view ending) {
  std::vector<std::filesystem::path> found;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (it->path().filename().string().ends_with(ending)) found.push_back(it->path());
  }
  std::sort(found.begin(), found.end());
  return found.empty() ? std::filesystem::path() : found.front();
}

Result<std::filesystem::path> gnss_file(const std::filesystem::path& folder, const std::string& chosen) {
  namespace fs = std::filesystem;
  if (!chosen.empty()) return folder / chosen;
  if (path_exists(folder / "gnss.csv")) return folder / "gnss.csv";
  std::vector<std::string> candidates;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string file = it->path().filename().string();
    if (file.ends_with(".csv") && (file.starts_with("gnss") || file.ends_with("-gnss.csv")))
      candidates.push_back(file);
  }
  std::sort(candidates.begin(), candidates.end());
  if (candidates.empty()) return fs::path();
  if (candidates.size() == 1) return folder / candidates.front();
  return Error{fmt::format("{}: {} GNSS files, choose one: {}", folder.string(), candidates.size(),
                           fmt::join(candidates, ", "))};
}

template <class Parse>
auto read_optional(const std::filesystem::path& path, Parse parse, std::vector<std::string>& remarks)
    -> decltype(parse(std::string_view(), std::string_view(), remarks)) {
  if (path.empty() || !path_exists(path)) {
    return typename std::remove_cvref_t<decltype(*parse(std::string_view(), std::string_view(), remarks))>{};
  }
  const auto text = read_file(path);
  if (!text) return text.error();
  return parse(*text, path.string(), remarks);
}

}  // namespace

Result<NavigationLog> read_navigation_log(const std::filesystem::path& folder,
                                          const NavigationLogOptions& options) {
  namespace fs = std::filesystem;
  NavigationLog log;
  std::error_code failure;
  if (is_recording(folder)) {
    if (!options.gnss.empty())
      return Error{fmt::format("{}: found a recording, whose GNSS are topics, expected no GNSS file ({})",
                               folder.string(), in_quotes(options.gnss))};
    return read_recording_sensors(folder, options.topics);
  }
  if (!options.topics.empty()) {
    return Error{fmt::format("{}: is no recording of ROS, expected one since topics are named ({})",
                             folder.string(), in_quotes(options.topics))};
  }
  if (fs::is_regular_file(folder, failure)) {
    return Error{fmt::format("{}: is a file, expected a folder with imu.csv and gnss.csv{}", folder.string(),
                             advice_for(folder))};
  }
  fs::path imu = folder / "imu.csv";
  fs::path truth = folder / "truth.csv";
  for (const fs::path& euroc : {folder / "mav0", folder}) {
    if (!path_exists(imu) && path_exists(euroc / "imu0" / "data.csv")) {
      imu = euroc / "imu0" / "data.csv";
      truth = euroc / "state_groundtruth_estimate0" / "data.csv";
    }
  }
  if (!path_exists(imu)) imu = file_ending_with(folder, "-imu.csv");
  if (const auto why = imu.empty() ? why_no_recording(folder) : std::nullopt)
    return Error{folder.string() + ": " + *why};
  if (imu.empty())
    return Error{
        fmt::format("{}: no IMU log found, expected imu.csv or mav0/imu0/data.csv (raw GNSS alone: --raw; "
                    "with odometry: --raw-coupling tight){}",
                    folder.string(), found_files(folder, ".csv"))};
  const auto imu_text = read_file(imu);
  if (!imu_text) return imu_text.error();
  auto samples = parse_imu(*imu_text, imu.string(), log.remarks);
  if (!samples) return samples.error();
  log.imu = std::move(*samples);

  const auto gnss_path = gnss_file(folder, options.gnss);
  if (!gnss_path) return gnss_path.error();
  if (!gnss_path->empty()) {
    const auto text = read_file(*gnss_path);
    if (!text) return text.error();
    auto gnss = parse_gnss(*text, gnss_path->string(), options.gnss_defaults, log.remarks);
    if (!gnss) return gnss.error();
    log.gnss = std::move(*gnss);
  } else {
    log.remarks.push_back(fmt::format("{}: no GNSS log found, expected gnss.csv{}", folder.string(),
                                      found_files(folder, ".csv")));
  }
  auto barometer = read_optional(folder / "baro.csv", parse_barometer, log.remarks);
  if (!barometer) return barometer.error();
  log.barometer = std::move(*barometer);
  auto magnetometer = read_optional(folder / "mag.csv", parse_magnetometer, log.remarks);
  if (!magnetometer) return magnetometer.error();
  log.magnetometer = std::move(*magnetometer);
  const bool simulated = !path_exists(truth) && path_exists(folder / "body_truth.txt");
  auto states = simulated ? read_optional(folder / "body_truth.txt", parse_body_truth, log.remarks)
                          : read_optional(truth, parse_truth, log.remarks);
  if (!states) return states.error();
  log.truth = std::move(*states);
  return log;
}

Result<std::vector<TrueState>> parse_body_truth(std::string_view text, std::string_view name,
                                                std::vector<std::string>& remarks) {
  ReadReport report;
  const auto trajectory = parse_trajectory(text, std::string(name), report);
  if (!trajectory) return trajectory.error();
  for (const Skipped& row : report.skipped) remarks.push_back(row.file + ": " + row.reason);
  const auto& rows = trajectory->rows();
  std::vector<TrueState> states;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const StampedPose& before = rows[i > 0 ? i - 1 : i];
    const StampedPose& after = rows[std::min(i + 1, rows.size() - 1)];
    const double interval = std::max(seconds_between(before.time, after.time), 1e-9);
    states.push_back(
        {rows[i].time, rows[i].pose, (after.pose.translation - before.pose.translation) / interval});
  }
  return states;
}

std::string format_imu(const std::vector<ImuSample>& samples) {
  std::string text = "# frame=FLU\nt_s,gx,gy,gz,ax,ay,az\n";
  for (const ImuSample& s : samples) {
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{}\n", to_string(s.time), s.angular_rate.x(),
                   s.angular_rate.y(), s.angular_rate.z(), s.specific_force.x(), s.specific_force.y(),
                   s.specific_force.z());
  }
  return text;
}

std::string format_gnss(const GnssLog& log) {
  std::string text = "# frame=ENU";
  const GeodeticOrigin origin = log.origin.value_or(GeodeticOrigin{});
  fmt::format_to(std::back_inserter(text), " origin={},{},{}", origin.latitude, origin.longitude,
                 origin.height);
  if (log.lever_arm) {
    fmt::format_to(std::back_inserter(text), " lever_arm={},{},{}", log.lever_arm->x(), log.lever_arm->y(),
                   log.lever_arm->z());
  }
  text += "\nt_s,pE,pN,pU,vE,vN,vU,sE,sN,sU,svE,svN,svU\n";
  const auto add = [&](Time time, const GnssFix* fix, const GnssVelocity* velocity) {
    const Eigen::Vector3d none = Eigen::Vector3d::Constant(std::nan(""));
    const Eigen::Vector3d p = fix != nullptr ? fix->position : none;
    const Eigen::Vector3d v = velocity != nullptr ? velocity->velocity : none;
    const auto sigmas = [&](const auto* one) {
      return one != nullptr ? Eigen::Vector3d(one->covariance.diagonal().cwiseSqrt()) : none;
    };
    const Eigen::Vector3d s = sigmas(fix), sv = sigmas(velocity);
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{},{},{},{},{}\n", to_string(time),
                   p.x(), p.y(), p.z(), v.x(), v.y(), v.z(), s.x(), s.y(), s.z(), sv.x(), sv.y(), sv.z());
  };
  auto velocity = log.velocities.begin();
  for (const GnssFix& fix : log.fixes) {
    for (; velocity != log.velocities.end() && velocity->time < fix.time; ++velocity)
      add(velocity->time, nullptr, &*velocity);
    const bool paired = velocity != log.velocities.end() && velocity->time == fix.time;
    add(fix.time, &fix, paired ? &*velocity : nullptr);
    if (paired) ++velocity;
  }
  for (; velocity != log.velocities.end(); ++velocity) add(velocity->time, nullptr, &*velocity);
  return text;
}

}  // namespace pade::io
