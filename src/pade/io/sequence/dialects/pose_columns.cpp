#include "pade/io/sequence/dialects/pose_columns.hpp"

#include <algorithm>
#include <cctype>
#include <span>

#include <fmt/format.h>

namespace pade::io {
namespace {

using Names = std::vector<std::string>;

/// "q_RS_w []" is qrsw, "field.pose.position.x" positionx, "timestamp(s)" timestamp, "q[0]" q0.
std::string plain(std::string_view name) {
  const std::size_t first = name.find_first_not_of(" \t\"#%");
  name.remove_prefix(std::min(first, name.size()));
  const std::size_t bracket = name.find_first_of("[(");
  const bool index = bracket != std::string_view::npos && bracket + 2 < name.size() &&
                     std::isdigit(static_cast<unsigned char>(name[bracket + 1])) != 0;
  if (!index) name = name.substr(0, bracket);
  // Of a path the last two parts say it.
  std::size_t begin = name.find_last_of("./");
  if (begin != std::string_view::npos && begin > 0) begin = name.find_last_of("./", begin - 1);
  if (begin != std::string_view::npos) name.remove_prefix(begin + 1);
  std::string out;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return out;
}

/// The parts of a heading: between commas or semicolons, since names may hold blanks; else between blanks.
Fields parts_of(std::string_view heading) {
  while (!heading.empty() && (heading.front() == '#' || heading.front() == ' ')) heading.remove_prefix(1);
  const char separator = heading.find(';') != std::string_view::npos    ? ';'
                         : heading.find(',') != std::string_view::npos  ? ','
                         : heading.find('\t') != std::string_view::npos ? '\t'
                                                                        : ' ';
  Fields parts;
  if (separator == ' ') {
    parts = split_fields(heading);
    std::erase_if(parts, [](std::string_view part) { return part.front() == '[' || part.front() == '('; });
    return parts;
  }
  while (!heading.empty()) {
    const std::size_t end = std::min(heading.find(separator), heading.size());
    parts.push_back(heading.substr(0, end));
    heading.remove_prefix(std::min(end + 1, heading.size()));
  }
  return parts;
}

std::optional<std::size_t> column_of(const Names& names, std::span<const std::string_view> wanted) {
  for (const std::string_view one : wanted) {
    const auto found = std::find(names.begin(), names.end(), one);
    if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  }
  return std::nullopt;
}
std::optional<std::size_t> column_of(const Names& names, std::initializer_list<std::string_view> wanted) {
  return column_of(names, std::span(wanted.begin(), wanted.size()));
}

std::optional<TimeUnit> unit_in(std::string_view part) {
  std::string text;
  for (const char c : part) text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const auto& [ending, unit] : {std::pair{"ns", TimeUnit::nanoseconds},
                                     {"us", TimeUnit::microseconds},
                                     {"ms", TimeUnit::milliseconds}}) {
    for (const char* form : {"[{}]", "({})", "_{}"}) {
      if (text.find(fmt::format(fmt::runtime(form), ending)) != std::string::npos) return unit;
    }
  }
  return std::nullopt;
}

/// What columns of time are called, as plain() leaves it.
constexpr std::array<std::string_view, 16> kTimes = {
    "timestamp",   "time",   "ts",          "times",  "t",          "stamp", "timestampns", "timens",
    "timestampus", "timeus", "timestampms", "timems", "timestamps", "tsec",  "secs",        "sec"};
/// Of the header of a message of ROS: when it was measured. The others are when it was recorded.
constexpr std::array<std::string_view, 3> kStamps = {"headerstamp", "stampsecs", "stampsec"};

void find_time(const Fields& parts, const Names& names, PoseColumns& columns) {
  columns.time = column_of(names, kTimes);
  if (const auto stamp = column_of(names, kStamps)) {
    columns.recorded = columns.time;
    columns.time = stamp;
  }
  if (!columns.time) return;
  columns.unit = unit_in(parts[*columns.time]);
  const std::string& name = names[*columns.time];
  if (name.ends_with("secs") || name.ends_with("sec"))
    columns.nanoseconds = column_of(names, {"stampnsecs", "stampnanosec", "nsecs", "nsec", "nanosec"});
}

/// A list of three or four names with one ending each.
template <std::size_t kCount>
std::array<std::optional<std::size_t>, kCount> find_group(const Names& names, std::string_view endings,
                                                          std::initializer_list<std::string_view> stems) {
  std::array<std::optional<std::size_t>, kCount> found{};
  for (const std::string_view stem : stems) {
    for (std::size_t i = 0; i < kCount; ++i) found[i] = column_of(names, {std::string(stem) + endings[i]});
    if (std::all_of(found.begin(), found.end(), [](const auto& c) { return c.has_value(); })) return found;
  }
  return {};
}

/// The columns of a heading; empty where it names no pose.
std::optional<PoseColumns> columns_named(const Fields& parts) {
  Names names;
  for (const std::string_view part : parts) names.push_back(plain(part));
  PoseColumns columns;
  const auto position =
      find_group<3>(names, "xyz", {"t", "", "p", "prsr", "position", "pos", "translation", "pose"});
  auto xyzw =
      find_group<4>(names, "xyzw", {"q", "qrs", "orientation", "rot", "rotation", "quaternion", "quat"});
  if (!xyzw[0]) xyzw = find_group<4>(names, "1230", {"q"});  // PX4
  if (!position[0] || !xyzw[0]) return std::nullopt;
  for (std::size_t i = 0; i < 3; ++i) columns.position[i] = *position[i];
  for (std::size_t i = 0; i < 4; ++i) columns.xyzw[i] = *xyzw[i];
  find_time(parts, names, columns);
  columns.least = names.size();
  return columns;
}

/// What to do about names that hold no pose.
std::string advice(const Names& names) {
  const auto has = [&](std::initializer_list<std::string_view> some) {
    return column_of(names, some).has_value();
  };
  if (has({"imageid", "cameraid"})) {
    return "this is COLMAP's images.txt, whose poses map the world to the camera and have no time: write the "
           "inverse of each, with the time of its image";
  }
  if (has({"lat", "latitude", "latitudedeg"}))
    return "positions must be in metres; a log of GNSS goes into gnss.csv (docs/formats.md)";
  if (has({"roll", "yaw", "omega", "heading"})) return "angles must be made quaternions";
  return "rename the columns";
}

Error refused(const std::string& file, std::size_t line, const Fields& parts, const std::string& what) {
  Names names;
  std::string shown;
  for (const std::string_view part : parts) {
    names.push_back(plain(part));
    shown +=
        (shown.empty() ? "" : ", ") + std::string(part.substr(0, std::min<std::size_t>(part.size(), 30)));
    constexpr std::size_t kLongest = 160;
    if (shown.size() > kLongest) break;
  }
  for (char& c : shown) c = c >= ' ' && c <= '~' ? c : '?';
  return Error{
      fmt::format("{}: line {}: found columns {}, {}; expected time, x y z (or tx, px, pos_x, position.x "
                  "...) and qx qy qz "
                  "qw (or q_x, orientation.x ...): {}",
                  file, line, shown, what, advice(names))};
}

bool is_heading(const Fields& parts) {
  return parts.size() >= 3 && std::all_of(parts.begin(), parts.end(), [](std::string_view part) {
           const std::size_t first = part.find_first_not_of(" \t\"");
           return first == std::string_view::npos || is_word(part.substr(first));
         });
}

}  // namespace

Fields pose_fields(std::string_view line) {
  Fields fields;
  if (line.find(';') == std::string_view::npos) {
    fields = split_fields(line);
  } else {
    for (bool more = true; more;) {
      const std::size_t end = line.find(';');
      const auto part = split_fields(line.substr(0, end));
      fields.push_back(part.empty() ? std::string_view() : part.front());
      more = end != std::string_view::npos;
      if (more) line.remove_prefix(end + 1);
    }
  }
  if (fields.size() > 1 && fields.back().empty()) fields.pop_back();
  return fields;
}

bool is_word(std::string_view text) {
  if (text.empty()) return false;
  const auto first = static_cast<unsigned char>(text.front());
  const bool letter =
      std::isalpha(first) != 0 || first == '%' || first == '_' || first == '/' || first >= 0x80;
  return letter && !parse_number(text.substr(0, text.find_first_of(" \t,;")));
}

Result<std::optional<PoseColumns>> named_columns(std::string_view text, std::size_t fields,
                                                 const std::string& file) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::optional<PoseColumns> columns;
  std::optional<Error> refusal;
  for (std::size_t number = 1; number < 100 && !text.empty(); ++number) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(text.find('\n'), text.size()));
    if (!text.empty()) text.remove_prefix(1);
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) continue;
    line.remove_prefix(first);
    const bool comment = line.front() == '#';
    if (!comment && !is_word(line) && line.front() != '"') break;
    const Fields parts = parts_of(line);
    if (auto found = columns_named(parts)) {
      columns = found;
      refusal.reset();
      const bool bare = parts.size() == 7 || column_of({plain(parts.front())}, {"x", "tx", "px"});
      if (!found->time && !bare) refusal = refused(file, number, parts, "none of them a time");
    } else if (is_heading(parts) &&
               (!comment || (parts.size() == fields && (column_of({plain(parts.front())}, kTimes) ||
                                                        column_of({plain(parts.front())}, kStamps))))) {
      columns.reset();
      refusal = refused(file, number, parts, "which are no pose that is understood");
    }
  }
  if (refusal) return *refusal;
  return columns;
}

}  // namespace pade::io
