#include "pade/io/navigation/navigation_log.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include <GeographicLib/LocalCartesian.hpp>
#include <fmt/format.h>

#include "pade/io/navigation/navigation_table.hpp"

namespace pade::io {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kStandardGravity = 9.80665;

enum class BodyFrame { flu, frd };

/// Coordinates in the file's body frame to FLU.
Vector3d to_flu(BodyFrame frame, const Vector3d& v) {
  return frame == BodyFrame::flu ? v : Vector3d(v.x(), -v.y(), -v.z());
}
Vector3d enu_from_ned(const Vector3d& v) { return {v.y(), v.x(), -v.z()}; }

Vector3d vector_at(const NumericTable& table, std::size_t row, std::size_t column) {
  return {table.at(row, column), table.at(row, column + 1), table.at(row, column + 2)};
}

/// How the first column, or another one, counts time.
struct Clock {
  std::optional<std::size_t> nanosecond_column;  ///< else the first column, in seconds

  static Clock of(const NumericTable& table, std::string_view nanoseconds) {
    return {table.column(nanoseconds)};
  }
  [[nodiscard]] std::optional<Time> at(const NumericTable& table, std::size_t row) const {
    if (!nanosecond_column) return parse_time(table.stamps[row]);
    if (*nanosecond_column == 0) {  // EuRoC: 19 digits, more than a double holds
      const std::string_view text = table.stamps[row];
      Time time;
      const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), time.nanoseconds);
      if (status != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
      return time;
    }
    const double value = table.at(row, *nanosecond_column);
    if (!(std::abs(value) < 9.2e18)) return std::nullopt;
    return Time{static_cast<std::int64_t>(value)};
  }
};

void remark_left_out(const NumericTable& table, std::size_t left_out, std::vector<std::string>& remarks) {
  if (left_out + table.bad_lines == 0) return;
  remarks.push_back(
      fmt::format("{}: {} of {} rows left out (a value that is not finite, or another number of fields)",
                  table.name, left_out + table.bad_lines, table.rows() + table.bad_lines));
}

/// Stamps counted in ms, µs or ns would make every interval thousands of seconds long.
template <class Sample>
Status check_stamps(const std::vector<Sample>& samples, std::string_view name) {
  if (samples.size() < 3) return {};
  std::vector<double> steps;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    steps.push_back(std::abs(seconds_between(samples[i - 1].time, samples[i].time)));
  }
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  const double median = steps[steps.size() / 2];
  if (median <= 1) return {};
  return Error{
      fmt::format("{}: samples are {:.3g} s apart (median), expected at most 1 s: stamps are not in seconds?",
                  name, median)};
}

/// The norm of the specific force is near gravity most of the time, whatever the vehicle does.
Status check_units(const std::vector<ImuSample>& samples, std::string_view name) {
  std::vector<double> force;
  std::vector<double> rate;
  for (const ImuSample& sample : samples) {
    force.push_back(sample.specific_force.norm());
    rate.push_back(sample.angular_rate.norm());
  }
  const auto median = [](std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  const double median_force = median(force);
  if (median_force > 0.7 && median_force < 1.4) {
    return Error{fmt::format(
        "{}: the specific force is {:.2f} (median norm), expected about {:.2f} m/s²: this is in g", name,
        median_force, kStandardGravity)};
  }
  if (median_force > 700 && median_force < 1400) {
    return Error{fmt::format(
        "{}: the specific force is {:.0f} (median norm), expected about {:.2f} m/s²: this is in mg", name,
        median_force, kStandardGravity)};
  }
  if (median_force < 3 || median_force > 40) {
    return Error{fmt::format("{}: the specific force is {:.3g} (median norm), expected about {:.2f} m/s²",
                             name, median_force, kStandardGravity)};
  }
  const double median_rate = median(rate);
  if (median_rate > 15) {
    return Error{fmt::format(
        "{}: the angular rate is {:.1f} (median norm), which no vehicle keeps up in rad/s: this is in deg/s",
        name, median_rate)};
  }
  return {};
}

/// The columns of an IMU file, by layout.
struct ImuLayout {
  Clock clock;
  std::size_t rate = 0;
  std::size_t force = 0;
  BodyFrame frame = BodyFrame::flu;
};

std::optional<BodyFrame> body_frame(const std::string& text) {
  const bool frd = text.find("frame=FRD") != std::string::npos || text.find("(FRD") != std::string::npos;
  const bool flu = text.find("frame=FLU") != std::string::npos || text.find("(FLU") != std::string::npos;
  if (frd == flu) return std::nullopt;
  return frd ? BodyFrame::frd : BodyFrame::flu;
}

Error no_frame(const NumericTable& table, std::string_view expected) {
  return Error{fmt::format("{}: no frame given, expected a line '# frame={}'", table.name, expected)};
}

Result<ImuLayout> imu_layout(const NumericTable& table) {
  ImuLayout layout;
  std::string_view rate = "g";
  std::string_view force = "a";
  if (table.column("IMU::UncompGyro")) {  // VectorNav export, body FRD
    layout.clock = Clock::of(table, "Time::GpsTow [ns]");
    layout.frame = BodyFrame::frd;
    rate = "IMU::UncompGyro";
    force = "IMU::UncompAccel";
  } else if (table.column("w_RS_S")) {  // EuRoC: the sensor's own axes are the body
    layout.clock = Clock::of(table, "timestamp");
    rate = "w_RS_S";
    force = "a_RS_S";
  } else {
    const auto frame = body_frame(table.comment);
    if (!frame) return no_frame(table, "FLU' or '# frame=FRD");
    layout.frame = *frame;
  }
  const auto rate_column = table.group(rate, 3);
  if (!rate_column) return rate_column.error();
  const auto force_column = table.group(force, 3);
  if (!force_column) return force_column.error();
  layout.rate = *rate_column;
  layout.force = *force_column;
  return layout;
}

std::optional<Vector3d> three_numbers(std::string_view text) {
  Vector3d value;
  for (int i = 0; i < 3; ++i) {
    while (!text.empty() && (text.front() == ' ' || text.front() == ',')) text.remove_prefix(1);
    const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), value[i]);
    if (status != std::errc{}) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
  }
  return value.allFinite() ? std::optional(value) : std::nullopt;
}

/// Three numbers after a keyword of the comment.
std::optional<Vector3d> three_after(const std::string& comment, std::string_view keyword) {
  const std::size_t found = comment.find(keyword);
  if (found == std::string::npos) return std::nullopt;
  return three_numbers(std::string_view(comment).substr(found + keyword.size()));
}

/// The columns of a GNSS file, by layout.
struct GnssLayout {
  Clock clock;
  bool ned = false;
  bool geodetic = false;                      ///< position is latitude, longitude (degrees), height
  std::size_t position = 0;                   ///< 3 columns
  std::size_t velocity = 0;                   ///< 3 columns
  std::optional<std::size_t> position_sigma;  ///< 3 columns
  std::optional<std::size_t> velocity_sigma;  ///< `velocity_sigma_count` columns
  std::size_t velocity_sigma_count = 3;
};

Result<GnssLayout> gnss_layout(const NumericTable& table) {
  GnssLayout layout;
  const auto take = [&](std::string_view prefix, std::size_t& column) -> Status {
    const auto found = table.group(prefix, 3);
    if (!found) return found.error();
    column = *found;
    return {};
  };
  Status sigmas;
  const auto take_sigmas = [&](std::string_view prefix, std::size_t count,
                               std::optional<std::size_t>& column) {
    if (!table.column(prefix)) return;
    const auto found = table.group(prefix, count);
    if (found) {
      column = *found;
    } else if (sigmas.ok()) {
      sigmas = found.error();
    }
  };
  Status position;
  Status velocity;
  if (table.column("GNSS1::PosLla")) {  // VectorNav export
    layout.clock = Clock::of(table, "GNSS1::Tow [ns]");
    layout.ned = layout.geodetic = true;
    position = take("GNSS1::PosLla", layout.position);
    velocity = take("GNSS1::VelNed", layout.velocity);
    layout.velocity_sigma_count = 1;
    take_sigmas("GNSS1::PosU", 3, layout.position_sigma);
    take_sigmas("GNSS1::VelU", 1, layout.velocity_sigma);
  } else if (table.column("pN_m") || (table.column("lat_deg") && table.column("vN_mps"))) {  // the recordings
    layout.ned = true;
    layout.geodetic = !table.column("pN_m");
    position = take(layout.geodetic ? "lat_deg" : "pN_m", layout.position);
    velocity = take("vN_mps", layout.velocity);
    take_sigmas("sN", 3, layout.position_sigma);
    take_sigmas("svN", 3, layout.velocity_sigma);
  } else {
    const bool enu = table.comment.find("frame=ENU") != std::string::npos;
    layout.ned = table.comment.find("frame=NED") != std::string::npos;
    if (enu == layout.ned) return no_frame(table, "ENU origin=lat,lon,h' or '# frame=NED origin=lat,lon,h");
    if (table.width() < 13) {
      return Error{fmt::format("{}: {} columns, expected 13 (t_s, position, velocity, six sigmas)",
                               table.name, table.width())};
    }
    layout.position = 1;
    layout.velocity = 4;
    layout.position_sigma = 7;
    layout.velocity_sigma = 10;
  }
  if (!position.ok()) return position.error();
  if (!velocity.ok()) return velocity.error();
  if (!sigmas.ok()) return sigmas.error();
  return layout;
}

/// Standard deviations of one row as a diagonal covariance in ENU; NaN where the row has none.
Matrix3d covariance_at(const NumericTable& table, std::size_t row, std::optional<std::size_t> column,
                       std::size_t count, bool ned, const Vector3d& fallback) {
  Vector3d sigma = fallback;
  if (column) {
    sigma =
        count == 1 ? Vector3d(Vector3d::Constant(table.at(row, *column))) : vector_at(table, row, *column);
    if (ned) sigma = enu_from_ned(sigma);
  }
  return sigma.cwiseAbs2().asDiagonal();
}

}  // namespace

Result<std::vector<ImuSample>> parse_imu(std::string_view text, std::string_view name,
                                         std::vector<std::string>& remarks) {
  const auto table = parse_table(text, name);
  if (!table) return table.error();
  const auto layout = imu_layout(*table);
  if (!layout) return layout.error();
  std::vector<ImuSample> samples;
  std::size_t left_out = 0;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto time = layout->clock.at(*table, row);
    const Vector3d rate = vector_at(*table, row, layout->rate);
    const Vector3d force = vector_at(*table, row, layout->force);
    if (!time || !rate.allFinite() || !force.allFinite()) {
      ++left_out;
      continue;
    }
    samples.push_back({*time, to_flu(layout->frame, rate), to_flu(layout->frame, force)});
  }
  if (samples.empty()) return Error{fmt::format("{}: no row with a stamp and six finite values", name)};
  remark_left_out(*table, left_out, remarks);
  if (const Status status = check_stamps(samples, name); !status.ok()) return status.error();
  if (const Status status = check_units(samples, name); !status.ok()) return status.error();
  return samples;
}

Result<GnssLog> parse_gnss(std::string_view text, std::string_view name, const GnssDefaults& defaults,
                           std::vector<std::string>& remarks) {
  const auto table = parse_table(text, name);
  if (!table) return table.error();
  const auto layout = gnss_layout(*table);
  if (!layout) return layout.error();
  GnssLog log;
  if (const auto origin = three_after(table->comment, "origin="))
    log.origin = {(*origin)[0], (*origin)[1], (*origin)[2]};
  log.lever_arm = three_after(table->comment, "lever_arm=");
  if (const auto frd = three_after(table->comment, "lever FRD "))
    log.lever_arm = to_flu(BodyFrame::frd, *frd);
  const Vector3d position_sigma(defaults.position_horizontal, defaults.position_horizontal,
                                defaults.position_vertical);
  const Vector3d velocity_sigma(defaults.velocity_horizontal, defaults.velocity_horizontal,
                                defaults.velocity_vertical);
  if (!layout->position_sigma || !layout->velocity_sigma) {
    remarks.push_back(fmt::format("{}: no sigmas; taken as {}/{} m and {}/{} m/s (horizontal/vertical)", name,
                                  defaults.position_horizontal, defaults.position_vertical,
                                  defaults.velocity_horizontal, defaults.velocity_vertical));
  }

  std::optional<GeographicLib::LocalCartesian> local;
  std::size_t left_out = 0;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto time = layout->clock.at(*table, row);
    Vector3d position = vector_at(*table, row, layout->position);
    const Vector3d velocity = vector_at(*table, row, layout->velocity);
    const Matrix3d position_covariance =
        covariance_at(*table, row, layout->position_sigma, 3, layout->ned, position_sigma);
    const Matrix3d velocity_covariance = covariance_at(
        *table, row, layout->velocity_sigma, layout->velocity_sigma_count, layout->ned, velocity_sigma);
    const bool on_earth = !layout->geodetic || (std::abs(position[0]) <= 90 && std::abs(position[1]) <= 540);
    const bool has_fix = position.allFinite() && on_earth && position_covariance.allFinite();
    const bool has_velocity = velocity.allFinite() && velocity_covariance.allFinite();
    if (!time || (!has_fix && !has_velocity)) {
      ++left_out;
      continue;
    }
    if (has_fix) {
      if (layout->geodetic) {
        if (!local) {
          log.origin = {position[0], position[1], position[2]};
          local.emplace(position[0], position[1], position[2]);
        }
        const Vector3d geodetic = position;
        local->Forward(geodetic[0], geodetic[1], geodetic[2], position[0], position[1], position[2]);
      } else if (layout->ned) {
        position = enu_from_ned(position);
      }
      log.fixes.push_back({*time, position, position_covariance});
    }
    if (has_velocity) {
      log.velocities.push_back({*time, layout->ned ? enu_from_ned(velocity) : velocity, velocity_covariance});
    }
  }
  // A log at the rate of another sensor repeats each epoch.
  const auto same_stamp = [](const auto& a, const auto& b) { return a.time == b.time; };
  log.fixes.erase(std::unique(log.fixes.begin(), log.fixes.end(), same_stamp), log.fixes.end());
  log.velocities.erase(std::unique(log.velocities.begin(), log.velocities.end(), same_stamp),
                       log.velocities.end());
  if (log.fixes.empty() && log.velocities.empty())
    return Error{fmt::format("{}: no row with a stamp and a finite position or velocity", name)};
  remark_left_out(*table, left_out, remarks);
  return log;
}

Result<std::vector<BarometricHeight>> parse_barometer(std::string_view text, std::string_view name,
                                                      std::vector<std::string>& remarks) {
  const auto table = parse_table(text, name);
  if (!table) return table.error();
  const auto height = table->group("height_m", 1);
  if (!height) return height.error();
  const auto sigma = table->column("sigma_m");
  std::vector<BarometricHeight> samples;
  std::size_t left_out = 0;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto time = parse_time(table->stamps[row]);
    const double value = table->at(row, *height);
    const double deviation = sigma ? table->at(row, *sigma) : 0.3;
    if (!time || !std::isfinite(value) || !std::isfinite(deviation)) {
      ++left_out;
      continue;
    }
    samples.push_back({*time, value, deviation});
  }
  remark_left_out(*table, left_out, remarks);
  return samples;
}

Result<std::vector<MagneticField>> parse_magnetometer(std::string_view text, std::string_view name,
                                                      std::vector<std::string>& remarks) {
  const auto table = parse_table(text, name);
  if (!table) return table.error();
  const auto frame = body_frame(table->comment);
  if (!frame) return no_frame(*table, "FLU' or '# frame=FRD");
  const auto field = table->group("m", 3);
  if (!field) return field.error();
  std::vector<MagneticField> samples;
  std::size_t left_out = 0;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto time = parse_time(table->stamps[row]);
    const Vector3d value = to_flu(*frame, vector_at(*table, row, *field));
    if (!time || !value.allFinite()) {
      ++left_out;
      continue;
    }
    samples.push_back({*time, value, 0.05});
  }
  remark_left_out(*table, left_out, remarks);
  return samples;
}

Result<std::vector<TrueState>> parse_truth(std::string_view text, std::string_view name,
                                           std::vector<std::string>& remarks) {
  const auto table = parse_table(text, name);
  if (!table) return table.error();
  const bool euroc = table->column("p_RS_R").has_value();
  const auto position = table->group(euroc ? "p_RS_R" : "pN_m", 3);
  if (!position) return position.error();
  const auto velocity = table->group(euroc ? "v_RS_R" : "vN_mps", 3);
  if (!velocity) return velocity.error();
  const auto rotation = table->group(euroc ? "q_RS" : "qw", 4);
  if (!rotation) return rotation.error();
  const Clock clock = euroc ? Clock::of(*table, "timestamp") : Clock{};
  // (1,0,0) north of NED is y of ENU; FRD and FLU differ by half a turn about x.
  const Eigen::Quaterniond R_enu_ned((Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished());
  const Eigen::Quaterniond R_frd_flu(0, 1, 0, 0);
  std::vector<TrueState> states;
  std::size_t left_out = 0;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto time = clock.at(*table, row);
    TrueState state;
    state.T_world_body.translation = vector_at(*table, row, *position);
    state.velocity = vector_at(*table, row, *velocity);
    Eigen::Quaterniond q(table->at(row, *rotation), table->at(row, *rotation + 1),
                         table->at(row, *rotation + 2), table->at(row, *rotation + 3));
    if (!time || !state.T_world_body.translation.allFinite() || !state.velocity.allFinite() ||
        !(std::abs(q.norm() - 1) < 0.01)) {
      ++left_out;
      continue;
    }
    state.time = *time;
    if (!euroc) {
      state.T_world_body.translation = enu_from_ned(state.T_world_body.translation);
      state.velocity = enu_from_ned(state.velocity);
      q = R_enu_ned * q * R_frd_flu;
    }
    state.T_world_body.rotation = q.normalized();
    states.push_back(state);
  }
  remark_left_out(*table, left_out, remarks);
  if (states.empty())
    return Error{fmt::format("{}: no row with a stamp, finite values and a unit quaternion", name)};
  return states;
}

Result<std::vector<Time>> parse_stamps(std::string_view text, std::string_view name) {
  std::vector<Time> stamps;
  std::size_t line_number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
    ++line_number;
    line = line.substr(0, line.find_first_of(", \t\r"));
    if (line.empty() || line.front() == '#') continue;
    const auto time = parse_time(line);
    if (!time) {
      if (stamps.empty() && std::isalpha(static_cast<unsigned char>(line.front())) != 0) continue;  // heading
      return Error{fmt::format("{}:{}: found '{}', expected a stamp in seconds", name, line_number,
                               line.substr(0, 40))};
    }
    stamps.push_back(*time);
  }
  if (stamps.empty()) return Error{fmt::format("{}: no stamp found", name)};
  return stamps;
}

}  // namespace pade::io
