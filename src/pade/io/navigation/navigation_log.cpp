#include "pade/io/navigation/navigation_log.hpp"

#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "pade/io/navigation/navigation_columns.hpp"
#include "pade/io/navigation/navigation_table.hpp"

namespace pade::io {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr StampRule kSlowSensor{{}, {}, 30};

constexpr std::array kFields = {
    TripleNames{"mx", "my", "mz"}, TripleNames{"mag_x", "mag_y", "mag_z"},
    TripleNames{"magx", "magy", "magz"},  // ArduPilot
    TripleNames{"magnetometer_ga[0]", "magnetometer_ga[1]", "magnetometer_ga[2]"}};

}  // namespace

Result<std::vector<BarometricHeight>> parse_barometer(std::string_view text, std::string_view name,
                                                      std::vector<std::string>& remarks) {
  const auto table = parse_table(text, name);
  if (!table) return table.error();
  const auto height = table->column({"height", "alt", "altitude", "baro_alt_meter"});
  if (!height) {
    return Error{fmt::format("{}: found the columns {}; expected height_m, alt, altitude or baro_alt_meter",
                             name, table->column_names())};
  }
  const auto scale = length_scale(table->columns[*height].unit);
  if (!scale) return unknown_unit(*table, *height, "m, cm, mm or ft");
  const auto sigma = table->column("sigma");
  const auto times = times_of(*table, kSlowSensor, remarks);
  if (!times) return times.error();
  std::vector<BarometricHeight> samples;
  std::size_t left_out = 0;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto time = (*times)[row];
    const double value = *scale * table->at(row, *height);
    const double deviation = sigma ? table->at(row, *sigma) : 0.3;
    if (!time || !std::isfinite(value) || !std::isfinite(deviation)) {
      ++left_out;
      continue;
    }
    samples.push_back({*time, value, deviation > 0 ? deviation : 0.3});
  }
  remark_left_out(*table, left_out, remarks);
  return samples;
}

Result<std::vector<MagneticField>> parse_magnetometer(std::string_view text, std::string_view name,
                                                      std::vector<std::string>& remarks) {
  const auto table = parse_table(text, name);
  if (!table) return table.error();
  const auto field = find_triple(*table, kFields);
  if (!field) {
    return Error{
        fmt::format("{}: found the columns {}; expected mx my mz, mag_x mag_y mag_z, MagX MagY MagZ or "
                    "magnetometer_ga[0] ...",
                    name, table->column_names())};
  }
  auto frame = stated_body_frame(table->comment);
  if (!frame && field->index >= 2) frame = BodyFrame::frd;  // ArduPilot and PX4
  if (!frame) return no_frame(*table, "FLU' or '# frame=FRD");
  const auto times = times_of(*table, kSlowSensor, remarks);
  if (!times) return times.error();
  std::vector<MagneticField> samples;
  std::size_t left_out = 0;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto time = (*times)[row];
    const Vector3d value = to_flu(*frame, field->triple.at(*table, row));
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
  const bool euroc = table->column("p_rs_r_x").has_value();
  const auto position = find_triple(
      *table, euroc ? TripleNames{"p_rs_r_x", "p_rs_r_y", "p_rs_r_z"} : TripleNames{"pn", "pe", "pd"});
  const auto velocity = find_triple(
      *table, euroc ? TripleNames{"v_rs_r_x", "v_rs_r_y", "v_rs_r_z"} : TripleNames{"vn", "ve", "vd"});
  const auto scalar = table->column(euroc ? "q_rs_w" : "qw");
  const auto vector =
      find_triple(*table, euroc ? TripleNames{"q_rs_x", "q_rs_y", "q_rs_z"} : TripleNames{"qx", "qy", "qz"});
  if (!position || !velocity || !scalar || !vector) {
    return Error{fmt::format(
        "{}: found the columns {}; expected pN pE pD vN vE vD qw qx qy qz, or EuRoC's p_RS_R_x ... "
        "q_RS_w ... v_RS_R_x ...",
        name, table->column_names())};
  }
  const auto times =
      times_of(*table, {euroc ? std::optional(TimeUnit::nanoseconds) : std::nullopt, {}, 30}, remarks);
  if (!times) return times.error();
  // (1,0,0) north of NED is y of ENU; FRD and FLU differ by half a turn about x.
  const Eigen::Quaterniond R_enu_ned((Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished());
  const Eigen::Quaterniond R_frd_flu(0, 1, 0, 0);
  std::vector<TrueState> states;
  std::size_t left_out = 0;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto time = (*times)[row];
    TrueState state;
    state.T_world_body.translation = position->at(*table, row);
    state.velocity = velocity->at(*table, row);
    const Vector3d q_vector = vector->at(*table, row);
    Eigen::Quaterniond q(table->at(row, *scalar), q_vector.x(), q_vector.y(), q_vector.z());
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
