// RINEX 3 observations.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "pade/io/gnss/epoch_order.hpp"
#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/io/gnss/rinex_text.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

using namespace rinex;  // NOLINT: the file is about nothing else

constexpr std::size_t kMostSatellites = 999;  // of one epoch, as the format counts

/// What a header says that is needed to read the body.
struct Header {
  std::map<char, std::vector<std::string>> types;  ///< "C1C", ... by system
  std::int64_t ahead_of_gps = 0;                   ///< of the time system, s; what is to be subtracted
  bool utc = false;                                ///< the times are UTC (GLONASS)
  double version = 3.04;
};

Status set_time_system(std::string_view name, Header& header) {
  if (name.empty() || name == "GPS" || name == "GAL" || name == "QZS" || name == "IRN") {
    header.utc = false;
    header.ahead_of_gps = 0;
  } else if (name == "BDT") {
    header.ahead_of_gps = -14;
  } else if (name == "GLO" || name == "UTC") {
    header.utc = true;
  } else {
    return Error{fmt::format("found the time system {}, expected GPS, GAL, GLO or BDT", in_quotes(name))};
  }
  return {};
}

/// BeiDou's B1I is 2I since RINEX 3.03, and 1I in 3.02 (so are Q and both together, X). From 3.04 on 1X is
/// B1C.
std::string type_of(std::string_view written, char system, double version) {
  std::string type(written);
  const bool first = system == 'C' && type[1] == '1';
  const bool of_b1i = type[2] == 'I' || type[2] == 'Q' || (type[2] == 'X' && version < 3.035);
  if (first && of_b1i) type[1] = '2';
  return type;
}

/// One line of "SYS / # / OBS TYPES"; those that continue have a blank in place of the system.
Status add_types(std::string_view line, char& system, Header& header) {
  if (line[0] != ' ') {
    system = line[0];
    const auto count = integer_at(line, 3, 3);
    if (!is_system_letter(system) || !count || *count < 1 || *count > 400) {
      return Error{fmt::format("found {}, expected a system and the number of its observation types",
                               in_quotes(line.substr(0, 6)))};
    }
    header.types[system].clear();
  }
  for (std::size_t i = 0; i < 13 && system != ' '; ++i) {
    const std::string_view type = columns(line, 7 + 4 * i, 3);
    if (type.size() == 3) header.types[system].push_back(type_of(type, system, header.version));
  }
  return {};
}

/// One line of a header, also of one within the body.
Status read_header_line(std::string_view line, char& system, Header& header) {
  const std::string_view label = label_of(line);
  if (label == "SYS / # / OBS TYPES") return add_types(line, system, header);
  if (label == "TIME OF FIRST OBS") return set_time_system(columns(line, 48, 3), header);
  if (label == "SYS / SCALE FACTOR") {
    const auto factor = integer_at(line, 2, 4);
    if (factor && *factor != 1) {
      return Error{
          fmt::format("found a SYS / SCALE FACTOR of {}, expected values that are not scaled", *factor)};
    }
  }
  return {};
}

Status read_header(Lines& lines, std::string_view name, Header& header) {
  char system = ' ';
  while (const auto line = lines.next()) {
    if (label_of(*line) == "END OF HEADER") {
      if (!header.types.empty()) return {};
      return Error{fmt::format("{}: found no SYS / # / OBS TYPES in the header", name)};
    }
    if (const Status read = read_header_line(*line, system, header); !read) {
      return Error{fmt::format("{}: {}", at_line(name, lines.number()), read.error().message)};
    }
  }
  return Error{fmt::format("{}: found no END OF HEADER", name)};
}

struct EpochLine {
  Time time;
  int flag = 0;
  std::size_t count = 0;
};

std::optional<EpochLine> parse_epoch_line(std::string_view line, const Header& header) {
  const auto flag = integer_at(line, 31, 1);
  const auto count = integer_at(line, 32, 3);
  if (!flag || !count || *count < 0) return std::nullopt;
  EpochLine epoch{{}, *flag, static_cast<std::size_t>(*count)};
  if (*flag > 1) return epoch;  // an event needs no time
  std::array<int, 5> date{};
  constexpr std::array<std::pair<std::size_t, std::size_t>, 5> kPlaces{
      {{2, 4}, {7, 2}, {10, 2}, {13, 2}, {16, 2}}};
  for (std::size_t i = 0; i < date.size(); ++i) {
    const auto value = integer_at(line, kPlaces.at(i).first, kPlaces.at(i).second);
    if (!value) return std::nullopt;
    date.at(i) = *value;
  }
  const auto second = number_at(line, 18, 11);
  if (!second) return std::nullopt;
  const auto time = time_of_date(date[0], date[1], date[2], date[3], date[4], *second);
  if (!time) return std::nullopt;
  epoch.time = *time;
  epoch.time.nanoseconds -= header.ahead_of_gps * kNanoseconds;
  if (header.utc) {
    // Of the minute's start: 23:59:60 is still of the day that the leap second ends.
    const Time minute{time->nanoseconds - static_cast<std::int64_t>(*second * 1e9)};
    epoch.time.nanoseconds += leap_seconds(minute) * kNanoseconds;
  }
  return epoch;
}

/// One value of a line, with its flags.
struct Value {
  std::optional<double> number;
  int loss_of_lock = 0;
};

Value value_at(std::string_view line, std::size_t index) {
  const std::size_t from = 3 + 16 * index;
  Value value{number_at(line, from, 14), integer_at(line, from + 14, 1).value_or(0)};
  if (value.number && *value.number == 0) value.number.reset();  // both say that there is none
  return value;
}

void set(const Value& value, char kind, gnss::Signal& signal) {
  if (kind == 'C') signal.pseudorange = value.number;
  if (kind == 'D') signal.doppler = value.number;
  if (kind == 'S') signal.cn0 = value.number;
  if (kind != 'L') return;
  signal.carrier = value.number;
  signal.lost_lock = (value.loss_of_lock & 1) != 0;
  signal.half_cycle = (value.loss_of_lock & 2) != 0;
}

/// The signals of a satellite's line, appended.
void add_signals(std::string_view line, gnss::SatelliteId satellite, const std::vector<std::string>& types,
                 gnss::Epoch& epoch) {
  const std::size_t first = epoch.signals.size();
  for (std::size_t i = 0; i < types.size(); ++i) {
    const Value value = value_at(line, i);
    if (!value.number) continue;
    const std::array<char, 2> code{types[i][1], types[i][2]};
    const auto begin = epoch.signals.begin() + static_cast<std::ptrdiff_t>(first);
    auto signal = std::find_if(begin, epoch.signals.end(), [&](const auto& s) { return s.code == code; });
    if (signal == epoch.signals.end()) {
      epoch.signals.push_back({});
      signal = epoch.signals.end() - 1;
      signal->satellite = satellite;
      signal->code = code;
    }
    set(value, types[i][0], *signal);
  }
}

/// Reads the body into the log.
class Body {
 public:
  Body(std::string_view name, Header header, gnss::RawLog& log)
      : name_(name), header_(std::move(header)), log_(log), order_(name, "line", log) {}

  void read(Lines& lines) {
    while (const auto line = lines.next()) {
      if (line->starts_with('>')) {
        if (!read_epoch(*line, lines)) break;
      } else if (label_of(*line) == "RINEX VERSION / TYPE") {
        if (!read_second_header(*line, lines)) break;
      } else if (!columns(*line, 0, line->size()).empty()) {
        bad_lines_.add(fmt::format("{}: found {}, expected an epoch (>), left out",
                                   at_line(name_, lines.number()), in_quotes(*line)));
      }
    }
    bad_lines_.report(log_.remarks);
    order_.finish();
    bad_satellites_.report(log_.remarks);
    cut_off_.report(log_.remarks);
  }

 private:
  /// False if the rest cannot be read.
  bool read_second_header(std::string_view line, Lines& lines) {
    const std::string where = at_line(name_, lines.number());
    const auto version = check_first_line(line, 'O', where);
    Header next;
    next.version = version ? *version : next.version;
    const Status read = version ? read_header(lines, name_, next) : Status(version.error());
    if (read) {
      header_ = next;
      return true;
    }
    log_.remarks.push_back(fmt::format("{}: a second header that cannot be used; all behind it is left out",
                                       read.error().message));
    return false;
  }

  bool read_epoch(std::string_view line, Lines& lines) {
    const auto epoch = parse_epoch_line(line, header_);
    const std::size_t number = lines.number();
    const std::string where = at_line(name_, number);
    if (!epoch) {
      bad_lines_.add(
          fmt::format("{}: found {}, expected > date, flag and number of satellites; the epoch is left out",
                      where, in_quotes(line)));
      skip_to_epoch(lines);
      return true;
    }
    if (epoch->flag > 1) return pass_event(epoch->count, lines);
    gnss::Epoch data;
    data.time = epoch->time;
    for (std::size_t i = 0; i < std::min(epoch->count, kMostSatellites); ++i) {
      const auto next = lines.peek();
      if (!next || next->starts_with('>')) {
        cut_off_.add(
            fmt::format("{}: found {} of {} satellites, the epoch is left out", where, i, epoch->count));
        return true;
      }
      add_satellite(*lines.next(), lines.number(), data);
    }
    // A power failure between the epochs: no phase goes on.
    if (epoch->flag == 1)
      std::for_each(data.signals.begin(), data.signals.end(), [](auto& s) { s.lost_lock = true; });
    order_.add(std::move(data), number);
    return true;
  }

  void add_satellite(std::string_view line, std::size_t number, gnss::Epoch& data) {
    const auto satellite = satellite_at(line);
    if (!satellite) {
      if (line.size() < 3 || !is_system_letter(line[0]) || !integer_at(line, 1, 2)) {
        bad_satellites_.add(fmt::format("{}: found {}, expected a satellite (\"G08\"); it is left out",
                                        at_line(name_, number), in_quotes(line.substr(0, 3))));
      }
      return;
    }
    const auto same = [&](const gnss::Signal& s) { return s.satellite == *satellite; };
    const auto types = header_.types.find(line[0]);
    if (types == header_.types.end() || std::any_of(data.signals.begin(), data.signals.end(), same)) {
      bad_satellites_.add(fmt::format(
          "{}: {} {}, left out", at_line(name_, number), to_string(*satellite),
          types == header_.types.end() ? "has no observation types in the header" : "is twice in its epoch"));
      return;
    }
    add_signals(line, *satellite, types->second, data);
  }

  /// Lines of an event; flag 4 has lines of a header.
  bool pass_event(std::size_t count, Lines& lines) {
    char system = ' ';
    for (std::size_t i = 0; i < count; ++i) {
      const auto line = lines.peek();
      if (!line || line->starts_with('>')) return true;
      lines.next();
      if (const Status read = read_header_line(*line, system, header_); !read) {
        log_.remarks.push_back(fmt::format("{}: {}; all behind it is left out",
                                           at_line(name_, lines.number()), read.error().message));
        return false;
      }
    }
    return true;
  }

  static void skip_to_epoch(Lines& lines) {
    for (auto line = lines.peek();
         line && !line->starts_with('>') && label_of(*line) != "RINEX VERSION / TYPE"; line = lines.peek()) {
      lines.next();
    }
  }

  std::string_view name_;
  Header header_;
  gnss::RawLog& log_;
  EpochOrder order_;
  Tally bad_lines_, bad_satellites_, cut_off_;
};

}  // namespace

Status parse_rinex_observations(std::string_view text, std::string_view name, gnss::RawLog& log) {
  Lines lines(text);
  const auto first = check_first_line(lines.next().value_or(""), 'O', at_line(name, 1));
  if (!first) return first.error();
  Header header;
  header.version = *first;
  if (Status read = read_header(lines, name, header); !read) return read;
  const std::size_t before = log.epochs.size();
  Body(name, std::move(header), log).read(lines);
  if (log.epochs.size() > before) return {};
  std::string remark = log.remarks.empty() ? "" : "; " + log.remarks.back();
  return Error{fmt::format("{}: found no usable epoch{}", name, remark)};
}

}  // namespace pade::io
