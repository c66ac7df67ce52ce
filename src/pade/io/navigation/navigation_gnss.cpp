// GNSS logs: their dialects, each position and velocity in local east, north, up.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <GeographicLib/LocalCartesian.hpp>
#include <fmt/format.h>

#include "pade/io/navigation/geodetic_fixes.hpp"
#include "pade/io/navigation/navigation_columns.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/navigation/navigation_table.hpp"

namespace pade::io {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

enum class Axes { as_stated, enu, ned, geodetic };

struct Names {
  TripleNames names;
  Axes axes;
};

constexpr std::array kPositions = {
    Names{{"gnss1::poslla::latitude", "gnss1::poslla::longitude", "gnss1::poslla::altitude"}, Axes::geodetic},
    Names{{"pn", "pe", "pd"}, Axes::ned},
    Names{{"pe", "pn", "pu"}, Axes::enu},
    Names{{"n", "e", "d"}, Axes::ned},
    Names{{"e", "n", "u"}, Axes::enu},
    Names{{"north", "east", "down"}, Axes::ned},
    Names{{"east", "north", "up"}, Axes::enu},
    Names{{"px", "py", "pz"}, Axes::as_stated},
    Names{{"x", "y", "z"}, Axes::as_stated},
    Names{{"lat", "lon", "h"}, Axes::geodetic},
    Names{{"lat", "lon", "alt"}, Axes::geodetic},
    Names{{"lat", "lng", "alt"}, Axes::geodetic},
    Names{{"lat", "lon", "height"}, Axes::geodetic},
    Names{{"latitude", "longitude", "altitude"}, Axes::geodetic},
    Names{{"latitude", "longitude", "height"}, Axes::geodetic},
    Names{{"latitude", "longitude", "altitude_msl"}, Axes::geodetic},
};
constexpr std::array kVelocities = {
    Names{{"gnss1::velned::n", "gnss1::velned::e", "gnss1::velned::d"}, Axes::ned},
    Names{{"vn", "ve", "vd"}, Axes::ned},
    Names{{"ve", "vn", "vu"}, Axes::enu},
    Names{{"vel_n_m_s", "vel_e_m_s", "vel_d_m_s"}, Axes::ned},
    Names{{"vel_n", "vel_e", "vel_d"}, Axes::ned},
    Names{{"vx", "vy", "vz"}, Axes::as_stated},
};
constexpr std::array kPositionSigmas = {TripleNames{"gnss1::posu::n", "gnss1::posu::e", "gnss1::posu::d"},
                                        TripleNames{"sn", "se", "sd"}, TripleNames{"se", "sn", "su"},
                                        TripleNames{"sigma_px", "sigma_py", "sigma_pz"},
                                        TripleNames{"sx", "sy", "sz"}};
constexpr std::array kVelocitySigmas = {TripleNames{"gnss1::velu", "gnss1::velu", "gnss1::velu"},
                                        TripleNames{"svn", "sve", "svd"}, TripleNames{"sve", "svn", "svu"},
                                        TripleNames{"sigma_vx", "sigma_vy", "sigma_vz"},
                                        TripleNames{"svx", "svy", "svz"}};

constexpr std::array kRosVariances = {
    TripleNames{"position_covariance0", "position_covariance4", "position_covariance8"},
    TripleNames{"position_covariance[0]", "position_covariance[4]", "position_covariance[8]"},
    TripleNames{"position_covariance.0", "position_covariance.4", "position_covariance.8"}};

/// Where a value of a row comes from, and how it turns into east, north, up.
struct Source {
  Triple triple;
  Axes axes = Axes::enu;
};

struct Layout {
  Source position;
  std::optional<Source> velocity;
  std::optional<Triple> speed_course_down;  ///< ArduPilot: ground speed, course (degrees), speed downwards
  std::optional<Triple> position_sigma;     ///< in the axes of the position
  std::optional<Triple> velocity_sigma;
  std::optional<std::size_t> instance, status;  ///< ArduPilot: number of the receiver, kind of the fix
  double least_status = 0;
  bool variances = false;   ///< the sigmas of the position are squared, and those of east, north, up (ROS)
  double height_scale = 1;  ///< of a geodetic position, to metres
  bool scaled_integers = false;  ///< 1e-7 degrees and millimetres, as PX4 and MAVLink have them
  StampRule stamps{{}, {}, 30};
};

std::optional<Source> find_source(const NumericTable& table, std::span<const Names> candidates) {
  for (const Names& candidate : candidates) {
    if (const auto triple = find_triple(table, candidate.names)) return Source{*triple, candidate.axes};
  }
  return std::nullopt;
}

std::string names_of(std::span<const Names> candidates) {
  std::string text;
  for (const Names& one : candidates) {
    text += fmt::format("{}{} {} {}", text.empty() ? "" : ", ", one.names[0], one.names[1], one.names[2]);
  }
  return text;
}

/// Converts what is in another unit than metres, metres per second and degrees, by the heading.
Status settle_units(Layout& layout, const NumericTable& table) {
  constexpr std::string_view kLengths = "m, km, cm, mm or ft";
  constexpr std::string_view kSpeeds = "m/s, km/h, cm/s, mm/s, knots, mph or ft/s";
  const auto unit_of = [&](const Triple& triple, std::size_t i) -> std::string_view {
    return table.columns[triple.column[i]].unit;
  };
  const auto settle = [&](Triple& triple, const auto& scale_of, std::string_view expected) -> Status {
    const auto scale = scale_of(unit_of(triple, 0));
    if (!scale) return unknown_unit(table, triple.column[0], expected);
    triple.scale = *scale;
    return {};
  };
  if (layout.position.axes == Axes::geodetic) {
    for (const std::size_t i : {0, 1}) {
      const std::string_view unit = unit_of(layout.position.triple, i);
      const bool known = unit.empty() || unit.starts_with("deg") || unit == "\xc2\xb0" || unit == "1e-7deg";
      if (!known) return unknown_unit(table, layout.position.triple.column[i], "degrees");
    }
    const auto height = length_scale(unit_of(layout.position.triple, 2));
    if (!height) return unknown_unit(table, layout.position.triple.column[2], kLengths);
    layout.height_scale = *height;
  } else if (const Status s = settle(layout.position.triple, length_scale, kLengths); !s) {
    return s;
  }
  if (layout.velocity) {
    if (const Status s = settle(layout.velocity->triple, speed_scale, kSpeeds); !s) return s;
  }
  if (layout.position_sigma) {
    if (const Status s = settle(*layout.position_sigma, length_scale, kLengths); !s) return s;
  }
  if (layout.velocity_sigma) {
    if (const Status s = settle(*layout.velocity_sigma, speed_scale, kSpeeds); !s) return s;
  }
  return {};
}

/// What the comment says of x, y, z.
std::optional<Axes> stated_axes(const NumericTable& table) {
  const bool enu = table.comment.find("frame=ENU") != std::string::npos;
  const bool ned = table.comment.find("frame=NED") != std::string::npos;
  if (enu == ned) return std::nullopt;
  return enu ? Axes::enu : Axes::ned;
}

/// Names without axes mean what the comment states; names with axes must not contradict it.
Status settle_axes(Source& source, const NumericTable& table, std::string_view what) {
  const auto stated = stated_axes(table);
  if (source.axes == Axes::geodetic) return {};
  if (source.axes == Axes::as_stated) {
    if (!stated) return no_frame(table, "ENU origin=lat,lon,h' or '# frame=NED origin=lat,lon,h");
    source.axes = *stated;
  } else if (stated && *stated != source.axes) {
    return Error{fmt::format(
        "{}: the comment says frame={} but the columns of the {} are named {} {} {}", table.name,
        *stated == Axes::enu ? "ENU" : "NED", what, table.columns[source.triple.column[0]].name,
        table.columns[source.triple.column[1]].name, table.columns[source.triple.column[2]].name)};
  }
  return {};
}

/// A latitude beyond any is an integer in 1e-7 degrees. Refused if it can be neither that nor degrees.
Result<bool> has_scaled_integers(const NumericTable& table, const Triple& geodetic) {
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double latitude = table.at(row, geodetic.column[0]);
    if (!std::isfinite(latitude) || latitude == 0) continue;
    constexpr double kPole = 90, kLargestInMinutes = 1e4;
    if (std::abs(latitude) <= kPole || std::abs(latitude) > kLargestInMinutes)
      return std::abs(latitude) > kPole;
    return Error{
        fmt::format("{}: line {}: found latitude {}, expected degrees from -90 to 90: degrees and minutes "
                    "(ddmm.mmmm), as NMEA has "
                    "them, must be converted; or latitude and longitude have changed places",
                    table.name, table.line_numbers[row], latitude)};
  }
  return false;
}

Result<Layout> layout_of(const NumericTable& table) {
  Layout layout;
  const auto position = find_source(table, kPositions);
  if (!position) {
    const bool has_frame = stated_axes(table).has_value();
    return Error{fmt::format("{}: found the columns {}; expected a position as {} (docs/formats.md){}",
                             table.name, table.column_names(), names_of(kPositions),
                             has_frame ? "" : " and, for x y z, a line '# frame=ENU origin=lat,lon,h'")};
  }
  layout.position = *position;
  if (const Status status = settle_axes(layout.position, table, "position"); !status.ok())
    return status.error();
  layout.velocity = find_source(table, kVelocities);
  if (layout.velocity) {
    if (const Status status = settle_axes(*layout.velocity, table, "velocity"); !status.ok())
      return status.error();
  }
  layout.speed_course_down = find_triple(table, {"spd", "gcrs", "vz"});
  if (layout.speed_course_down) layout.velocity.reset();
  const auto sigma = find_triple(table, kPositionSigmas);
  const auto velocity_sigma = find_triple(table, kVelocitySigmas);
  if (sigma) layout.position_sigma = sigma->triple;
  if (velocity_sigma) layout.velocity_sigma = velocity_sigma->triple;
  layout.instance = table.column("i");
  if (layout.speed_course_down) {
    layout.status = table.column("status");
    layout.least_status = 3;
  } else if ((layout.status = table.column("fix_type"))) {
    layout.least_status = 3;
    layout.stamps.unit = TimeUnit::microseconds;  // PX4 vehicle_gps_position
  }
  if (const auto tow = table.column("gnss1::tow")) {
    layout.stamps.column = tow;
    layout.stamps.unit = TimeUnit::nanoseconds;
  }
  if (const auto variances = find_triple(table, kRosVariances)) {
    layout.position_sigma = variances->triple;
    layout.variances = true;
  }
  if (const auto status = table.column("status.status")) {
    layout.status = status;  // ROS NavSatFix: -1 is no fix
    layout.least_status = 0;
  }
  if (const Status status = settle_units(layout, table); !status) return status.error();
  if (layout.position.axes == Axes::geodetic) {
    const auto scaled = has_scaled_integers(table, layout.position.triple);
    if (!scaled) return scaled.error();
    layout.scaled_integers = *scaled;
  }
  return layout;
}

Vector3d to_enu(Axes axes, const Vector3d& v) { return axes == Axes::ned ? enu_from_ned(v) : v; }

std::optional<Vector3d> velocity_at(const NumericTable& table, const Layout& layout, std::size_t row) {
  if (layout.speed_course_down) {
    const Vector3d v = layout.speed_course_down->at(table, row);
    return Vector3d(v[0] * std::sin(v[1] * kDegree), v[0] * std::cos(v[1] * kDegree), -v[2]);
  }
  if (!layout.velocity) return std::nullopt;
  return to_enu(layout.velocity->axes, layout.velocity->triple.at(table, row));
}

/// Standard deviations of one row as a diagonal covariance in ENU. A sigma of 0 says nothing, and never that
/// the receiver is infinitely good.
Matrix3d covariance_at(const NumericTable& table, std::size_t row, const std::optional<Triple>& columns,
                       Axes axes, const Vector3d& fallback, std::size_t& unknown) {
  if (!columns) return fallback.cwiseAbs2().asDiagonal();
  // The sigmas of geodetic positions are those of north, east, down (VectorNav).
  Vector3d sigma = columns->at(table, row);
  if (axes != Axes::enu) sigma = enu_from_ned(sigma).cwiseAbs();
  if ((sigma.array() <= 0).any()) {
    ++unknown;
    for (int axis = 0; axis < 3; ++axis) sigma[axis] = sigma[axis] > 0 ? sigma[axis] : fallback[axis];
  }
  return sigma.cwiseAbs2().asDiagonal();
}

/// Geodetic positions to east, north, up at the first of them.
class LocalFrame {
 public:
  Vector3d operator()(const Vector3d& geodetic, std::optional<GeodeticOrigin>& origin) {
    if (!local_) {
      origin = {geodetic[0], geodetic[1], geodetic[2]};
      local_.emplace(geodetic[0], geodetic[1], geodetic[2]);
    }
    Vector3d enu;
    local_->Forward(geodetic[0], geodetic[1], geodetic[2], enu[0], enu[1], enu[2]);
    return enu;
  }

 private:
  std::optional<GeographicLib::LocalCartesian> local_;
};

/// Many vertical velocities of exactly 0, whose accuracy nobody states, are none: they are left open.
void leave_level_open(GnssLog& log, std::string_view name, std::vector<std::string>& remarks) {
  constexpr std::size_t kMany = 10;
  const bool level =
      log.velocities.size() >= kMany && std::all_of(log.velocities.begin(), log.velocities.end(),
                                                    [](const auto& one) { return one.velocity.z() == 0; });
  if (!level) return;
  for (GnssVelocity& one : log.velocities)
    one.covariance(2, 2) = open_vertical_velocity * open_vertical_velocity;
  remarks.push_back(
      fmt::format("{}: has no vertical velocity (it is 0 in all rows), which is left open", name));
}

/// A log at the rate of another sensor repeats each epoch.
void drop_repeats(GnssLog& log) {
  const auto same_stamp = [](const auto& a, const auto& b) { return a.time == b.time; };
  log.fixes.erase(std::unique(log.fixes.begin(), log.fixes.end(), same_stamp), log.fixes.end());
  log.velocities.erase(std::unique(log.velocities.begin(), log.velocities.end(), same_stamp),
                       log.velocities.end());
}

/// "vu beside ve, vn is missing", where two of three are there.
std::string part_of_a_velocity(const NumericTable& table) {
  for (const Names& one : kVelocities) {
    std::string missing;
    int there = 0;
    for (const std::string_view name : one.names) {
      if (table.column(name)) {
        ++there;
      } else {
        missing = name;
      }
    }
    if (there == 2)
      return fmt::format("of {} {} {} there is no {}", one.names[0], one.names[1], one.names[2], missing);
  }
  return {};
}

void remark_sigmas(const NumericTable& table, const Layout& layout, const GnssDefaults& defaults,
                   std::size_t unknown, std::vector<std::string>& remarks) {
  const std::string taken =
      fmt::format("taken as {}/{} m and {}/{} m/s (horizontal/vertical)", defaults.position_horizontal,
                  defaults.position_vertical, defaults.velocity_horizontal, defaults.velocity_vertical);
  const bool velocity = layout.velocity || layout.speed_course_down;
  if (!layout.position_sigma || (velocity && !layout.velocity_sigma)) {
    remarks.push_back(fmt::format("{}: no sigmas; {}", table.name, taken));
  }
  if (unknown > 0) {
    remarks.push_back(fmt::format("{}: {} sigmas are 0 or negative, which is taken as unknown; {}",
                                  table.name, unknown, taken));
  }
  if (!velocity) {
    const std::string part = part_of_a_velocity(table);
    remarks.push_back(
        fmt::format("{}: no columns of velocity ({}): the yaw must come from a heading (--heading) or "
                    "mag.csv, and the scale of short motions is doubtful",
                    table.name, part.empty() ? names_of(kVelocities) : part));
  }
}

}  // namespace

Result<GnssLog> parse_gnss(std::string_view text, std::string_view name, const GnssDefaults& defaults,
                           std::vector<std::string>& remarks) {
  const auto table = parse_table(text, name);
  if (!table) return table.error();
  const auto layout = layout_of(*table);
  if (!layout) return layout.error();
  const auto times = times_of(*table, layout->stamps, remarks);
  if (!times) return times.error();
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
  const bool geodetic = layout->position.axes == Axes::geodetic;
  const double instance = layout->instance ? table->at(0, *layout->instance) : 0;
  LocalFrame local;
  std::size_t left_out = 0;
  std::size_t others = 0;
  std::size_t without_fix = 0;
  std::size_t unknown = 0;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    const auto time = (*times)[row];
    const bool other = layout->instance && table->at(row, *layout->instance) != instance;
    const bool no_fix = layout->status && !(table->at(row, *layout->status) >= layout->least_status);
    Vector3d position = layout->position.triple.at(*table, row);
    if (geodetic) position[2] *= layout->height_scale;
    if (layout->scaled_integers) position = position.cwiseProduct(Vector3d(1e-7, 1e-7, 1e-3));
    const auto velocity = velocity_at(*table, *layout, row);
    const Axes velocity_axes = layout->velocity ? layout->velocity->axes : Axes::ned;
    Matrix3d position_covariance = covariance_at(
        *table, row, layout->position_sigma, layout->variances ? Axes::enu : layout->position.axes,
        layout->variances ? position_sigma.cwiseAbs2().eval() : position_sigma, unknown);
    if (layout->variances) position_covariance = position_covariance.cwiseSqrt().eval();
    const Matrix3d velocity_covariance =
        covariance_at(*table, row, layout->velocity_sigma, velocity_axes, velocity_sigma, unknown);
    const bool on_earth = !geodetic || (std::abs(position[0]) <= 90 && std::abs(position[1]) <= 540);
    const bool has_fix = position.allFinite() && on_earth && position_covariance.allFinite();
    const bool has_velocity = velocity && velocity->allFinite() && velocity_covariance.allFinite();
    if (other || no_fix || !time || (!has_fix && !has_velocity)) {
      ++(other ? others : no_fix ? without_fix : left_out);
      continue;
    }
    if (has_fix) {
      const Vector3d enu = geodetic ? local(position, log.origin) : to_enu(layout->position.axes, position);
      log.fixes.push_back({*time, enu, position_covariance});
    }
    if (has_velocity) log.velocities.push_back({*time, *velocity, velocity_covariance});
  }
  drop_repeats(log);
  if (!layout->velocity_sigma) leave_level_open(log, name, remarks);
  if (log.fixes.empty() && log.velocities.empty())
    return Error{fmt::format("{}: no row with a stamp, a fix and a finite position or velocity; {}", name,
                             table->first_defect(*times))};
  remark_sigmas(*table, *layout, defaults, unknown, remarks);
  remark_left_out(*table, left_out, remarks);
  if (without_fix > 0)
    remarks.push_back(fmt::format("{}: {} rows without a fix were left out", name, without_fix));
  if (others > 0) {
    remarks.push_back(
        fmt::format("{}: {} rows of other receivers than number {:g} were left out", name, others, instance));
  }
  return log;
}

}  // namespace pade::io
