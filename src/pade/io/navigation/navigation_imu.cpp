// IMU logs: their dialects, and whether the numbers can be what they claim to be.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "pade/core/compute/median.hpp"
#include "pade/io/navigation/navigation_columns.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/navigation/navigation_table.hpp"

namespace pade::io {
namespace {

using Eigen::Vector3d;

constexpr double kStandardGravity = 9.80665;
constexpr double kDegree = std::numbers::pi / 180;

/// One dialect: the names of its columns, and what it fixes.
struct Dialect {
  std::string_view name;
  TripleNames rate;
  TripleNames force;
  std::optional<BodyFrame> frame;  ///< empty: the file must say
  std::optional<TimeUnit> time;    ///< empty: the heading or the steps say
};

constexpr std::array kDialects = {
    Dialect{"ours", {"gx", "gy", "gz"}, {"ax", "ay", "az"}, {}, {}},
    Dialect{"EuRoC",
            {"w_rs_s_x", "w_rs_s_y", "w_rs_s_z"},
            {"a_rs_s_x", "a_rs_s_y", "a_rs_s_z"},
            BodyFrame::flu,  // the sensor's own axes are the body
            TimeUnit::nanoseconds},
    Dialect{"PX4 sensor_combined",
            {"gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"},
            {"accelerometer_m_s2[0]", "accelerometer_m_s2[1]", "accelerometer_m_s2[2]"},
            BodyFrame::frd,
            TimeUnit::microseconds},
    Dialect{"ArduPilot IMU", {"gyrx", "gyry", "gyrz"}, {"accx", "accy", "accz"}, BodyFrame::frd, {}},
    Dialect{"MAVLink HIGHRES_IMU", {"xgyro", "ygyro", "zgyro"}, {"xacc", "yacc", "zacc"}, BodyFrame::frd, {}},
    Dialect{"VectorNav",
            {"imu::uncompgyro::x", "imu::uncompgyro::y", "imu::uncompgyro::z"},
            {"imu::uncompaccel::x", "imu::uncompaccel::y", "imu::uncompaccel::z"},
            BodyFrame::frd,
            TimeUnit::nanoseconds},
    Dialect{"ROS Imu",
            {"angular_velocity.x", "angular_velocity.y", "angular_velocity.z"},
            {"linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"},
            BodyFrame::flu,  // REP 103
            {}},
    Dialect{"ROS Imu",
            {"angular_velocity_x", "angular_velocity_y", "angular_velocity_z"},
            {"linear_acceleration_x", "linear_acceleration_y", "linear_acceleration_z"},
            BodyFrame::flu,
            {}},
    Dialect{"rates and forces", {"wx", "wy", "wz"}, {"fx", "fy", "fz"}, {}, {}},
    Dialect{"rates and accelerations", {"wx", "wy", "wz"}, {"ax", "ay", "az"}, {}, {}},
    Dialect{"gyr and acc", {"gyr_x", "gyr_y", "gyr_z"}, {"acc_x", "acc_y", "acc_z"}, {}, {}},
    Dialect{"gyro and accel", {"gyro_x", "gyro_y", "gyro_z"}, {"accel_x", "accel_y", "accel_z"}, {}, {}},
    Dialect{"gyro and acc", {"gyro_x", "gyro_y", "gyro_z"}, {"acc_x", "acc_y", "acc_z"}, {}, {}},
    Dialect{"omega and a", {"omega_x", "omega_y", "omega_z"}, {"a_x", "a_y", "a_z"}, {}, {}},
};

std::string known_layouts() {
  std::string text;
  for (const Dialect& dialect : kDialects) {
    if (!text.empty()) text += "; ";
    text += fmt::format("{} {} {} with {} ...", dialect.rate[0], dialect.rate[1], dialect.rate[2],
                        dialect.force[0]);
  }
  return text;
}

/// Scale to SI from the unit of a heading; empty where the unit is unknown.
std::optional<double> rate_scale(const std::string& unit) {
  if (unit.empty() || unit == "rad/s" || unit == "rads^-1" || unit == "rad/sec") return 1;
  if (unit == "deg/s" || unit == "dps" || unit == "\xc2\xb0/s" || unit == "degs^-1") return kDegree;
  if (unit == "mrad/s") return 1e-3;
  return std::nullopt;
}
std::optional<double> force_scale(const std::string& unit) {
  if (unit.empty() || unit == "m/s^2" || unit == "m/s2" || unit == "ms^-2" || unit == "m/s/s" ||
      unit == "m/s\xc2\xb2") {
    return 1;
  }
  if (unit == "g") return kStandardGravity;
  if (unit == "mg") return 1e-3 * kStandardGravity;
  return std::nullopt;
}

struct Layout {
  Triple rate;
  Triple force;
  BodyFrame frame = BodyFrame::flu;
  StampRule stamps;
  std::optional<std::size_t> instance;  ///< column that numbers the IMUs of one vehicle
};

Result<Layout> layout_of(const NumericTable& table) {
  for (const Dialect& dialect : kDialects) {
    const auto rate = find_triple(table, dialect.rate);
    const auto force = find_triple(table, dialect.force);
    if (!rate || !force) continue;
    Layout layout{*rate, *force, {}, {}, {}};
    const auto stated = stated_body_frame(table.comment);
    if (!stated && !dialect.frame) return no_frame(table, "FLU' or '# frame=FRD");
    layout.frame = stated.value_or(dialect.frame.value_or(BodyFrame::flu));
    const auto to_rate = rate_scale(rate->unit);
    const auto to_force = force_scale(force->unit);
    if (!to_rate || !to_force) {
      return Error{fmt::format("{}: found unit '{}' of {}, expected rad/s or deg/s, and m/s^2 or g",
                               table.name, to_rate ? force->unit : rate->unit,
                               to_rate ? dialect.force[0] : dialect.rate[0])};
    }
    layout.rate.scale = *to_rate;
    layout.force.scale = *to_force;
    layout.stamps.unit = dialect.time;
    if (dialect.name == "VectorNav") layout.stamps.column = table.column("time::gpstow");
    if (dialect.name == "ArduPilot IMU") layout.instance = table.column({"i", "instance"});
    return layout;
  }
  return Error{
      fmt::format("{}: found the columns {}; expected three of angular rate and three of specific force "
                  "named as in one of the layouts {} (docs/formats.md)",
                  table.name, table.column_names(), known_layouts())};
}

/// Names the line where a clock was set back; smaller steps are jitter, which others look at.
void remark_step_back(const NumericTable& table, const std::vector<std::optional<Time>>& times,
                      std::vector<std::string>& remarks) {
  constexpr double kReset = 0.5;  // s
  std::optional<Time> last;
  for (std::size_t row = 0; row < times.size(); ++row) {
    if (!times[row]) continue;
    if (last && seconds_between(*last, *times[row]) < -kReset) {
      remarks.push_back(fmt::format("{}:{}: stamps go back from {} to {} s", table.name,
                                    table.line_numbers[row], to_string(*last), to_string(*times[row])));
      return;
    }
    last = times[row];
  }
}

}  // namespace

Status check_imu_units(const std::vector<ImuSample>& samples, std::string_view name, bool has_heading) {
  if (samples.empty()) return {};
  std::vector<double> force;
  std::vector<double> rate;
  for (const ImuSample& sample : samples) {
    force.push_back(sample.specific_force.norm());
    rate.push_back(sample.angular_rate.norm());
  }
  const double median_force = median(force);
  const auto remedy = [&](std::string_view heading) {
    return has_heading ? fmt::format("convert it, or write the unit into the heading ({})", heading)
                       : std::string("convert it");
  };
  const auto is_in = [&](std::string_view unit) {
    return Error{fmt::format(
        "{}: the specific force is {:.4g} (median norm), expected about {:.2f} m/s²: this is in {}; {}", name,
        median_force, kStandardGravity, unit, remedy(fmt::format("ax [{}]", unit)))};
  };
  if (median_force > 0.7 && median_force < 1.4) return is_in("g");
  if (median_force > 700 && median_force < 1400) return is_in("mg");
  if (median_force < 3 || median_force > 40) {
    return Error{
        fmt::format("{}: the specific force is {:.3g} (median norm), expected about {:.2f} m/s²: is gravity "
                    "part of it, and are the columns those of the accelerometers?",
                    name, median_force, kStandardGravity)};
  }
  const double median_rate = median(rate);
  if (median_rate > 15) {
    return Error{
        fmt::format("{}: the angular rate is {:.1f} (median norm), which no vehicle keeps up in "
                    "rad/s: this is in deg/s; {}",
                    name, median_rate, remedy("gx [deg/s]"))};
  }
  return {};
}

Result<std::vector<ImuSample>> parse_imu(std::string_view text, std::string_view name,
                                         std::vector<std::string>& remarks) {
  const auto table = parse_table(text, name);
  if (!table) return table.error();
  const auto layout = layout_of(*table);
  if (!layout) return layout.error();
  const auto times = times_of(*table, layout->stamps, remarks);
  if (!times) return times.error();
  std::vector<ImuSample> samples;
  std::size_t left_out = 0;
  std::size_t others = 0;
  const double instance = layout->instance ? table->at(0, *layout->instance) : 0;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    if (layout->instance && table->at(row, *layout->instance) != instance) {
      ++others;
      continue;
    }
    const auto time = (*times)[row];
    const Vector3d rate = layout->rate.at(*table, row);
    const Vector3d force = layout->force.at(*table, row);
    if (!time || !rate.allFinite() || !force.allFinite()) {
      ++left_out;
      continue;
    }
    samples.push_back({*time, to_flu(layout->frame, rate), to_flu(layout->frame, force)});
  }
  if (samples.empty()) {
    return Error{
        fmt::format("{}: no row with a stamp and six finite values; {}", name, table->first_defect(*times))};
  }
  remark_left_out(*table, left_out, remarks);
  remark_step_back(*table, *times, remarks);
  if (others > 0) {
    remarks.push_back(
        fmt::format("{}: {} rows of other IMUs than number {:g} were left out", name, others, instance));
  }
  const Status units = check_imu_units(samples, name, true);
  if (!units) return units.error();
  return samples;
}

}  // namespace pade::io
