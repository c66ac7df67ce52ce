// Which files of a folder belong to a recording of raw GNSS, and libRSF's format.
#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/io/gnss/rinex_text.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

namespace fs = std::filesystem;

/// Numbers of a line behind its first word; empty if one is none.
std::optional<std::vector<double>> numbers_of(const std::vector<std::string_view>& fields) {
  std::vector<double> numbers;
  for (std::size_t i = 1; i < fields.size(); ++i) {
    const auto number = parse_number(fields[i]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

/// libRSF numbers smartLoc's satellites in hundreds: GPS from 0, Galileo from 200, GLONASS from 300.
std::optional<gnss::SatelliteId> numbered_satellite(double number) {
  constexpr std::array<gnss::System, 4> kHundreds{gnss::System::gps, gnss::System::beidou,
                                                  gnss::System::galileo, gnss::System::glonass};
  if (!(number >= 0 && number < 400) || number != std::floor(number)) return std::nullopt;
  const auto whole = static_cast<std::size_t>(number);
  if (whole % 100 > 63 || whole % 100 == 0) return std::nullopt;
  return gnss::SatelliteId{kHundreds.at(whole / 100), static_cast<std::uint8_t>(whole % 100)};
}

/// "pseudorange3 t range variance x y z satellite system elevation C/N0".
bool add_range(const std::vector<double>& v, gnss::RawLog& log) {
  if (v.size() < 7 || !(v[2] > 0) || std::abs(v[0]) > 4e9) return false;
  const auto satellite = numbered_satellite(v[6]);
  const Eigen::Vector3d position(v[3], v[4], v[5]);
  if (!satellite || position.norm() < 7e6 || position.norm() > 1e8 || std::abs(v[1]) > 1e9) return false;
  const Time time = Time::from_seconds(v[0]);
  if (log.known_ranges.empty() || log.known_ranges.back().time != time) {
    if (!log.known_ranges.empty() && time < log.known_ranges.back().time) return false;
    log.known_ranges.push_back({time, {}});
  }
  auto& ranges = log.known_ranges.back().ranges;
  const auto same = [&](const gnss::KnownRange& r) { return r.satellite == *satellite; };
  if (std::any_of(ranges.begin(), ranges.end(), same)) return false;
  gnss::KnownRange range{*satellite, position, v[1], std::sqrt(v[2]), {}};
  if (v.size() >= 10) range.cn0 = v[9];
  ranges.push_back(range);
  return true;
}

bool add_truth(const std::vector<double>& v, gnss::RawLog& log) {
  if (v.size() < 4 || std::abs(v[0]) > 4e9) return false;
  const gnss::TruePosition point{Time::from_seconds(v[0]), {v[1], v[2], v[3]}};
  if (!log.truth.empty() && point.time <= log.truth.back().time) return false;
  log.truth.push_back(point);
  return true;
}

/// "odom3 t vx vy vz wx wy wz", then the six variances. The motion in the plane alone is taken.
bool add_odometry(const std::vector<double>& v, gnss::RawLog& log) {
  if (v.size() < 13 || std::abs(v[0]) > 4e9 || !(v[7] > 0) || !(v[12] > 0)) return false;
  if (std::abs(v[1]) > 1e3 || std::abs(v[6]) > 1e3) return false;
  const PlanarOdometry sample{Time::from_seconds(v[0]), v[1], v[6], std::sqrt(v[7]), std::sqrt(v[12])};
  if (!log.odometry.empty() && sample.time <= log.odometry.back().time) return false;
  log.odometry.push_back(sample);
  return true;
}

/// Reads the numbers of a line by its first word; nothing where the word is another.
struct LineKind {
  std::string_view word;
  bool (*add)(const std::vector<double>& numbers, gnss::RawLog& log);
  const char* expected;
};
constexpr std::array kLineKinds{
    LineKind{"pseudorange3", add_range,
             "pseudorange3, time, range, variance, ECEF x y z and satellite, rising in time and each "
             "satellite once"},
    LineKind{"odom3", add_odometry,
             "odom3, time, velocity x y z, angular rate x y z and their six variances, rising in time"},
    LineKind{"point3", add_truth, "point3, time and ECEF x y z, rising in time"}};

struct Files {
  std::vector<fs::path> observations;  ///< RINEX or UBX
  std::vector<fs::path> navigation, ranges;
};

std::optional<RawGnssKind> kind_of(const fs::path& path) {
  std::error_code failure;
  if (!fs::is_regular_file(path, failure) || fs::file_size(path, failure) > (std::uintmax_t{1} << 30))
    return {};
  const auto text = read_file(path);
  return text ? raw_gnss_kind(*text) : std::nullopt;
}

/// Whether a UBX message of raw measurements (RXM-RAWX) with the right checksum lies in the text.
bool has_raw_ubx(std::string_view text) {
  constexpr std::string_view kStart("\xB5\x62\x02\x15", 4);
  const auto byte = [&](std::size_t at) {
    return static_cast<unsigned>(static_cast<unsigned char>(text[at]));
  };
  for (std::size_t at = text.find(kStart); at != std::string_view::npos; at = text.find(kStart, at + 1)) {
    if (text.size() - at < 8) return false;
    const std::size_t end = at + 6 + (byte(at + 4) | byte(at + 5) << 8U);
    if (end + 2 > text.size()) continue;
    unsigned a = 0, b = 0;
    for (std::size_t i = at + 2; i < end; ++i) {
      a = (a + byte(i)) & 0xFFU;
      b = (b + a) & 0xFFU;
    }
    if (byte(end) == a && byte(end + 1) == b) return true;
  }
  return false;
}

/// A recording of another kind, which may have messages of a receiver in it.
bool is_recording(std::string_view text) {
  return text.starts_with("#ROSBAG") || text.starts_with("\x89MCAP") || text.starts_with("ULog") ||
         text.starts_with("SQLite format");
}

Files files_in(const fs::path& folder) {
  std::vector<fs::path> all;
  std::error_code failure;
  for (fs::directory_iterator it(folder, failure), end; !failure && it != end; it.increment(failure)) {
    all.push_back(it->path());
  }
  std::sort(all.begin(), all.end());
  Files files;
  for (const fs::path& path : all) {
    const auto kind = kind_of(path);
    if (kind == RawGnssKind::observations || kind == RawGnssKind::ubx) files.observations.push_back(path);
    if (kind == RawGnssKind::navigation) files.navigation.push_back(path);
    if (kind == RawGnssKind::known_ranges) files.ranges.push_back(path);
  }
  return files;
}

/// One that gives nothing is named: another beside it may have what is needed.
void read_navigation(const std::vector<fs::path>& files, gnss::RawLog& log) {
  for (const fs::path& file : files) {
    const auto text = read_file(file);
    const Status parsed = text ? parse_rinex_navigation(*text, file.string(), log) : Status(text.error());
    if (!parsed) log.remarks.push_back(parsed.error().message + "; the file is left out");
  }
}

/// What has been said, behind a message.
std::string with_remarks(const std::vector<std::string>& remarks) {
  constexpr std::size_t kMost = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(remarks.size(), kMost); ++i) text += "; " + remarks[i];
  if (remarks.size() > kMost) text += fmt::format("; and {} more remarks", remarks.size() - kMost);
  return text;
}

template <class Parse>
Status read_all(const std::vector<fs::path>& files, Parse parse, gnss::RawLog& log) {
  for (const fs::path& file : files) {
    const auto text = read_file(file);
    if (!text) return text.error();
    if (Status parsed = parse(*text, file.string(), log); !parsed) return parsed;
  }
  return {};
}

Status parse_observations(std::string_view text, std::string_view name, gnss::RawLog& log) {
  return raw_gnss_kind(text) == RawGnssKind::ubx ? parse_ubx(text, name, log)
                                                 : parse_rinex_observations(text, name, log);
}

}  // namespace

std::optional<RawGnssKind> raw_gnss_kind(std::string_view text) {
  const std::string_view line = text.substr(0, std::min(text.find('\n'), std::size_t{200}));
  if (line.size() > 20 && rinex::label_of(line).starts_with("RINEX VERSION / TYPE")) {
    if (line[20] == 'O') return RawGnssKind::observations;
    if (line[20] == 'N') return RawGnssKind::navigation;
    return std::nullopt;
  }
  if (text.starts_with("\xB5\x62")) return RawGnssKind::ubx;
  if (!is_recording(text) && has_raw_ubx(text.substr(0, kRawGnssStart))) return RawGnssKind::ubx;
  const auto fields = split_fields(line);
  if (fields.size() < 4) return std::nullopt;
  const auto begins = [&](const LineKind& kind) { return kind.word == fields.front(); };
  if (std::any_of(kLineKinds.begin(), kLineKinds.end(), begins)) return RawGnssKind::known_ranges;
  return std::nullopt;
}

Status parse_known_ranges(std::string_view text, std::string_view name, gnss::RawLog& log) {
  rinex::Tally bad;
  std::size_t good = 0, refused = 0;
  for (const Line& line : data_lines(text)) {
    const auto fields = split_fields(line.text);
    const auto kind = std::find_if(kLineKinds.begin(), kLineKinds.end(),
                                   [&](const LineKind& k) { return k.word == fields.front(); });
    if (kind == kLineKinds.end()) continue;
    const auto numbers = numbers_of(fields);
    if (numbers && kind->add(*numbers, log)) {
      ++good;
      continue;
    }
    ++refused;
    bad.add(fmt::format("{}: found {}, expected {}; it is left out", rinex::at_line(name, line.number),
                        in_quotes(line.text), kind->expected));
  }
  bad.report(log.remarks);
  if (good > refused) return {};
  return Error{fmt::format("{}: found {} usable lines of pseudorange3, odom3 or point3 and {} others{}", name,
                           good, refused,
                           refused > 0 ? "; " + log.remarks.back() : ", expected at least one")};
}

Result<gnss::RawLog> read_raw_gnss(const std::filesystem::path& path) {
  std::error_code failure;
  const bool folder = fs::is_directory(path, failure);
  if (!folder && !path_exists(path)) return Error{fmt::format("{}: no such file or folder", path.string())};
  Files files = files_in(folder ? path : absolute_path(path).parent_path());
  if (!folder) {
    const auto kind = kind_of(path);
    if (!kind || kind == RawGnssKind::navigation) {
      return Error{fmt::format("{}: expected RINEX 3 observations, UBX, or libRSF's pseudorange3 lines",
                               path.string())};
    }
    files.observations.clear();
    if (kind != RawGnssKind::known_ranges) {
      files.observations = {path};
      files.ranges.clear();
    }
  }
  if (files.observations.size() > 1) {
    return Error{fmt::format("{}: {} observation files, name the one that is meant: {}", path.string(),
                             files.observations.size(), files.observations.front().string())};
  }
  gnss::RawLog log;
  read_navigation(files.navigation, log);
  for (const Status& read : {read_all(files.observations, parse_observations, log),
                             read_all(files.ranges, parse_known_ranges, log)}) {
    if (!read) return read.error();
  }
  if (log.epochs.empty() && log.known_ranges.empty()) {
    return Error{fmt::format(
        "{}: found no raw GNSS, expected RINEX 3 observations, UBX, or libRSF's pseudorange3 lines",
        path.string())};
  }
  if (!log.epochs.empty() && log.broadcast.kepler.empty() && log.broadcast.glonass.empty()) {
    return Error{fmt::format(
        "{}: found observations but no ephemeris: no RINEX 3 navigation file beside them that gives one{}",
        path.string(), with_remarks(log.remarks))};
  }
  if (!log.epochs.empty() && !log.broadcast.ionosphere) {
    log.remarks.push_back(
        "no model of the ionosphere (GPSA and GPSB of a navigation file, or page 18 of GPS's message, which "
        "comes every 12.5 minutes): a delay of 5 m in the zenith is assumed, and taken to be wrong by as "
        "much");
  }
  return log;
}

}  // namespace pade::io
