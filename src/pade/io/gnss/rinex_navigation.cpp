// RINEX 3 navigation messages.
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/io/gnss/rinex_text.hpp"
#include "pade/io/text.hpp"

namespace pade::io {

namespace rinex {

Time nearest_week(double of_week, Time near) {
  constexpr std::int64_t kWeekLength = 604800 * kNanoseconds;
  const auto wanted = static_cast<std::int64_t>(std::llround(of_week * 1e9));
  const std::int64_t week = (near.nanoseconds - wanted + kWeekLength / 2) / kWeekLength;
  return {wanted + week * kWeekLength};
}

std::string defect_of(const gnss::KeplerEphemeris& e) {
  if (!(e.sqrt_a > 2000 && e.sqrt_a < 10000))
    return fmt::format("sqrt(a) = {}, expected 2000 to 10000", e.sqrt_a);
  if (!(e.eccentricity >= 0 && e.eccentricity < 0.7)) {
    return fmt::format("e = {}, expected 0 to 0.7", e.eccentricity);
  }
  if (!(e.toe_of_week >= 0 && e.toe_of_week <= 604800)) {
    return fmt::format("toe = {}, expected 0 to 604800", e.toe_of_week);
  }
  if (!(std::abs(e.af0) < 0.1)) return fmt::format("af0 = {}, expected less than 0.1 s", e.af0);
  if (!(std::abs(e.group_delay) < 1e-6))  // the messages have room for 0.12 µs
    return fmt::format("a group delay of {} s, expected less than 1e-6", e.group_delay);
  return {};
}

}  // namespace rinex

namespace {

using namespace rinex;  // NOLINT: the file is about nothing else

constexpr std::size_t kMostValues = 40;
constexpr std::size_t kOfFirstLine = 3;  // numbers behind the date
constexpr std::size_t kOfLine = 4;       // numbers of each further line
constexpr double kNoPromise = 8192;      // accuracy of a satellite that promises nothing, m
constexpr int kBeidouBehind = 14;        // seconds of BeiDou time behind GPS time

/// One satellite's record: its first line's date and all its numbers, 0 where a column is blank.
struct Record {
  gnss::SatelliteId satellite;
  Time date;  ///< as written
  std::array<double, kMostValues> values{};
  std::size_t count = 0;  ///< up to the last column that the lines have, blank or not
  std::string bad;        ///< a column that is no number
  std::size_t line = 0;
};

void add_values(std::string_view line, std::size_t from, Record& record) {
  for (std::size_t column = from; column < line.size() && column < 80 && record.count < kMostValues;
       column += 19) {
    const std::string_view text = columns(line, column, 19);
    const auto value = number_at(line, column, 19);
    if (!value && !text.empty() && record.bad.empty()) record.bad = in_quotes(text);
    record.values.at(record.count++) = value.value_or(0);
  }
}

std::optional<Time> date_of(std::string_view line) {
  std::array<int, 6> date{};
  constexpr std::array<std::size_t, 6> kFrom{4, 9, 12, 15, 18, 21};
  for (std::size_t i = 0; i < date.size(); ++i) {
    const auto value = integer_at(line, kFrom.at(i), i == 0 ? 4 : 2);
    if (!value) return std::nullopt;
    date.at(i) = *value;
  }
  return time_of_date(date[0], date[1], date[2], date[3], date[4], date[5]);
}

/// Whether the clock is of E1 and E5b, as Galileo's I/NAV, not of E1 and E5a (F/NAV).
bool is_of_e5b(const Record& record) {
  if (record.satellite.system != gnss::System::galileo) return false;
  const auto source = static_cast<unsigned>(std::clamp(record.values[20], 0.0, 65535.0));
  return (source & 0x200U) != 0 || (source & 0x105U) == 0;
}

/// Where the group delay of the first band stands.
std::size_t place_of_delay(const Record& record) { return is_of_e5b(record) ? 26 : 25; }

/// 0 if it is not said. Galileo's -1 and an accuracy of many kilometres promise nothing.
double written_accuracy(double written) { return written >= 0 && written < 1e4 ? written : kNoPromise; }

gnss::KeplerEphemeris kepler_of(const Record& record) {
  const auto& v = record.values;
  gnss::KeplerEphemeris e;
  e.satellite = record.satellite;
  e.af0 = v[0], e.af1 = v[1], e.af2 = v[2];
  e.crs = v[4], e.delta_n = v[5], e.m0 = v[6];
  e.cuc = v[7], e.eccentricity = v[8], e.cus = v[9], e.sqrt_a = v[10];
  e.toe_of_week = v[11], e.cic = v[12], e.omega0 = v[13], e.cis = v[14];
  e.i0 = v[15], e.crc = v[16], e.omega = v[17], e.omega_dot = v[18];
  e.idot = v[19];
  e.accuracy = written_accuracy(v[23]);
  e.health = static_cast<int>(std::clamp(v[24], 0.0, 1e6));
  e.group_delay = v.at(place_of_delay(record));
  e.second_choice = record.satellite.system == gnss::System::galileo && !is_of_e5b(record);
  e.toc = record.date;
  e.toe = nearest_week(std::clamp(e.toe_of_week, 0.0, 604800.0), record.date);
  if (e.satellite.system == gnss::System::beidou) {
    e.toc.nanoseconds += kBeidouBehind * kNanoseconds;
    e.toe.nanoseconds += kBeidouBehind * kNanoseconds;
  }
  return e;
}

gnss::GlonassEphemeris glonass_of(const Record& record) {
  const auto& v = record.values;
  gnss::GlonassEphemeris e;
  e.satellite = record.satellite;
  e.toe = record.date;
  e.toe.nanoseconds += leap_seconds(record.date) * kNanoseconds;  // its dates are UTC
  e.clock = v[0];
  e.clock_rate = v[1];
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(3 + 4 * axis);
    e.position[axis] = 1e3 * v.at(at);
    e.velocity[axis] = 1e3 * v.at(at + 1);
    e.acceleration[axis] = 1e3 * v.at(at + 2);
  }
  e.health = v[6] != 0 ? 1 : 0;
  e.channel = static_cast<int>(std::clamp(v[10], -100.0, 100.0));
  return e;
}

std::string defect_of(const gnss::GlonassEphemeris& e) {
  const double radius = e.position.norm();
  if (!(radius > 2e7 && radius < 3e7))
    return fmt::format("a radius of {} km, expected 20000 to 30000", radius / 1e3);
  if (!(e.velocity.norm() < 1e4))
    return fmt::format("a speed of {} m/s, expected below 10000", e.velocity.norm());
  if (!(e.acceleration.norm() < 1e-3)) return "an acceleration of Moon and Sun above 1e-3 m/s²";
  if (e.channel < -7 || e.channel > 13) return fmt::format("the channel {}, expected -7 to 13", e.channel);
  if (!(std::abs(e.clock) < 0.1)) return fmt::format("a clock of {} s, expected less than 0.1", e.clock);
  return {};
}

/// Appends the ephemeris, or says why not.
std::string keep(const Record& record, gnss::BroadcastData& broadcast) {
  const bool glonass = record.satellite.system == gnss::System::glonass;
  const std::size_t needed = glonass ? 14 : place_of_delay(record) + 1;  // up to the last one that counts
  if (record.count < needed) return fmt::format("{} numbers, expected {}", record.count, needed);
  if (!record.bad.empty()) return record.bad + ", expected a number";
  if (glonass) {
    const auto e = glonass_of(record);
    std::string defect = defect_of(e);
    if (defect.empty()) broadcast.glonass.push_back(e);
    return defect;
  }
  const auto e = kepler_of(record);
  std::string defect = rinex::defect_of(e);
  if (defect.empty()) broadcast.kepler.push_back(e);
  return defect;
}

/// Klobuchar's numbers of GPS; those of others are of other models or for their own signals.
void read_ionosphere(std::string_view line, gnss::IonosphereModel& model, unsigned& found) {
  const std::string_view kind = columns(line, 0, 4);
  if (kind != "GPSA" && kind != "GPSB") return;
  std::array<double, 4> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto value = number_at(line, 5 + 12 * i, 12);
    if (!value) return;
    values.at(i) = *value;
  }
  (kind == "GPSA" ? model.alpha : model.beta) = values;
  found |= kind == "GPSA" ? 1U : 2U;
}

Status read_header(Lines& lines, std::string_view name, gnss::RawLog& log) {
  gnss::IonosphereModel model;
  unsigned found = 0;
  while (const auto line = lines.next()) {
    const std::string_view label = label_of(*line);
    if (label == "IONOSPHERIC CORR") read_ionosphere(*line, model, found);
    if (label != "END OF HEADER") continue;
    if (found == 3) log.broadcast.ionosphere = model;
    return {};
  }
  return Error{fmt::format("{}: found no END OF HEADER", name)};
}

}  // namespace

Status parse_rinex_navigation(std::string_view text, std::string_view name, gnss::RawLog& log) {
  Lines lines(text);
  const auto version = check_first_line(lines.next().value_or(""), 'N', at_line(name, 1));
  if (!version) return version.error();
  if (Status read = read_header(lines, name, log); !read) return read;
  Tally bad;
  std::size_t kept = 0, refused = 0;
  while (const auto line = lines.next()) {
    if (label_of(*line) == "RINEX VERSION / TYPE") {
      log.remarks.push_back(
          fmt::format("{}: a second header; all behind it is left out", at_line(name, lines.number())));
      break;
    }
    const auto satellite = satellite_at(*line);
    const bool foreign = !satellite && line->size() >= 3 && is_system_letter((*line)[0]);
    Record record;
    record.line = lines.number();
    add_values(*line, 23, record);
    std::size_t before = kOfFirstLine;
    for (auto more = lines.peek(); more && more->starts_with("    "); more = lines.peek()) {
      // Blanks at the end of the line before may be cut off; its columns are there all the same.
      record.count = std::min(kMostValues, before);
      add_values(*lines.next(), 4, record);
      before += kOfLine;
    }
    if (foreign || columns(*line, 0, line->size()).empty()) continue;
    const auto date = date_of(*line);
    std::string defect =
        !satellite || !date ? in_quotes(line->substr(0, 23)) + ", expected a satellite and a date" : "";
    if (defect.empty()) {
      record.satellite = *satellite;
      record.date = *date;
      defect = keep(record, log.broadcast);
    }
    if (defect.empty()) ++kept;
    if (defect.empty()) continue;
    ++refused;
    bad.add(fmt::format("{}: found {}; the ephemeris is left out", at_line(name, record.line), defect));
  }
  bad.report(log.remarks);
  if (kept > 0) return {};
  if (refused == 0) {  // another file may have what this one has not
    log.remarks.push_back(
        fmt::format("{}: no ephemeris of GPS, GLONASS, Galileo or BeiDou in it, left out", name));
    return {};
  }
  return Error{fmt::format("{}: found no usable ephemeris{}", name,
                           log.remarks.empty() ? "" : "; " + log.remarks.back())};
}

}  // namespace pade::io
