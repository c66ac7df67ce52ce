#include "pade/io/navigation/navigation_table.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>

#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::io {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

/// Takes the text up to the next `separator` off the front of `rest`. Blanks separate in runs.
std::string_view take(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view head = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  if (separator == ' ') rest = trimmed(rest);
  return head;
}

std::string_view unquoted(std::string_view text) {
  text = trimmed(text);
  const bool quoted = text.size() >= 2 && text.front() == '"' && text.back() == '"';
  return quoted ? trimmed(text.substr(1, text.size() - 2)) : text;
}

/// @param decimal_comma  "0,5" is a half
double number_or_nan(std::string_view text, bool decimal_comma) {
  text = unquoted(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  std::array<char, 64> with_point{};
  if (decimal_comma && text.size() < with_point.size() && text.find(',') != std::string_view::npos) {
    std::replace_copy(text.begin(), text.end(), with_point.begin(), ',', '.');
    text = {with_point.data(), text.size()};
  }
  double value = 0;
  const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = status == std::errc{} && stop == text.data() + text.size();
  return whole ? value : std::numeric_limits<double>::quiet_NaN();
}

bool is_unit(std::string_view text) {
  static constexpr std::array<std::string_view, 34> kUnits = {
      "s",    "ms",    "us",   "ns",   "rad/s", "deg/s",   "dps", "m/s^2",  "m/s2", "m/s/s", "g",  "mg",
      "m/s",  "m",     "cm",   "mm",   "deg",   "degrees", "rad", "mrad/s", "hz",   "gauss", "ut", "seconds",
      "km/h", "knots", "cm/s", "mm/s", "ft",    "feet",    "mph", "sec",    "km",   "rpm"};
  return std::find(kUnits.begin(), kUnits.end(), text) != kUnits.end();
}

std::string without_blanks(std::string_view text) {
  std::string out;
  std::copy_if(text.begin(), text.end(), std::back_inserter(out), [](char c) { return c != ' '; });
  return out;
}

/// A heading without its remarks in parentheses, which may hold commas; units in parentheses stay, in
/// brackets.
std::string without_parentheses(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t open = text.find('(');
    result += text.substr(0, open);
    if (open == std::string_view::npos) break;
    text.remove_prefix(open + 1);
    int depth = 1;
    std::size_t end = 0;
    for (; end < text.size() && depth > 0; ++end) depth += text[end] == '(' ? 1 : text[end] == ')' ? -1 : 0;
    const std::string inside = lower(trimmed(text.substr(0, depth == 0 ? end - 1 : end)));
    if (is_unit(inside)) result += "[" + inside + "]";
    text.remove_prefix(end);
  }
  return result;
}

char separator_of(std::string_view heading) {
  for (const char c : {',', ';', '\t'}) {
    if (heading.find(c) != std::string_view::npos) return c;
  }
  return ' ';
}

std::size_t count_fields(std::string_view line, char separator) {
  std::size_t count = 0;
  do {
    const bool last = line.find(separator) == std::string_view::npos;
    take(line, separator);
    ++count;
    if (last) return count;
  } while (true);
}

/// Members of ROS messages by which the path of a topic before them is known.
constexpr std::array<std::string_view, 10> kMembers = {
    "angular_velocity", "linear_acceleration", "latitude",       "longitude",      "altitude",
    "status",           "position_covariance", "magnetic_field", "fluid_pressure", "header"};

/// "field.latitude" (rostopic echo -p) and "/gps/fix/latitude" (PlotJuggler) are both latitude.
std::string without_topic(std::string_view name) {
  std::string text(name);
  if (text.starts_with("field.")) return text.substr(6);
  if (!text.starts_with('/')) return text;
  std::replace(text.begin(), text.end(), '/', '.');
  for (const std::string_view member : kMembers) {
    const std::size_t at = text.find("." + std::string(member));
    const char after =
        at == std::string::npos || at + 1 + member.size() >= text.size() ? '.' : text[at + 1 + member.size()];
    if (at != std::string::npos && (after == '.' || after == '[')) return text.substr(at + 1);
  }
  return text;
}

/// "acc_x_mps2" and "acc_x [m/s^2]" are both acc_x in m/s².
ColumnName column_name(std::string_view field) {
  ColumnName column;
  std::string text = lower(trimmed(field));
  text = without_topic(unquoted(text));
  // [0], [1] ... are indices, anything else in brackets is a unit.
  const std::size_t open = text.find('[');
  const bool index = open != std::string::npos && open + 1 < text.size() &&
                     std::isdigit(static_cast<unsigned char>(text[open + 1])) != 0;
  if (open != std::string::npos && !index) {
    column.unit = without_blanks(std::string_view(text).substr(open + 1, text.find(']', open) - open - 1));
    text = text.substr(0, open);
  }
  column.name = trimmed(text);
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kSuffixes = {
      {{"_radps", "rad/s"},
       {"_rad_s", "rad/s"},
       {"_rads", "rad/s"},
       {"_degps", "deg/s"},
       {"_deg_s", "deg/s"},
       {"_dps", "deg/s"},
       {"_mps2", "m/s2"},
       {"_m_s2", "m/s2"},
       {"_ms2", "m/s2"},
       {"_mps", "m/s"},
       {"_g", "g"},
       {"_milligauss", "milligauss"},
       {"_m", "m"},
       {"_deg", "deg"}}};
  for (const auto& [suffix, unit] : kSuffixes) {
    if (!column.unit.empty() || !column.name.ends_with(suffix) || column.name.size() <= suffix.size())
      continue;
    column.name.resize(column.name.size() - suffix.size());
    column.unit = unit;
  }
  return column;
}

std::vector<ColumnName> split_heading(std::string_view line, char separator) {
  std::vector<ColumnName> columns;
  line = trimmed(line);
  while (true) {
    const bool last = line.find(separator) == std::string_view::npos;
    columns.push_back(column_name(take(line, separator)));
    if (last) return columns;
  }
}

/// A stamp, with a point where semicolons or tabs separate fields and a comma stands for it.
std::string_view stamp_of(NumericTable& table, std::string_view field, char separator) {
  const std::size_t comma = field.find(',');
  if ((separator != ';' && separator != '\t') || comma == std::string_view::npos) return field;
  if (!table.converted) table.converted = std::make_shared<std::deque<std::string>>();
  std::string& text = table.converted->emplace_back(field);
  text[comma] = '.';
  return text;
}

/// A plain line that names columns: its first field is a word.
bool is_heading(std::string_view first) {
  if (!first.empty() && (first.front() == '"' || first.front() == '%')) first.remove_prefix(1);
  if (first.starts_with("nan") || first.empty()) return false;
  return std::isalpha(static_cast<unsigned char>(first.front())) != 0 || first.front() == '_' ||
         first.front() == '/';
}

/// Gives the columns the units of a line below the heading; false where it is none.
bool take_units(std::vector<ColumnName>& columns, std::string_view line, char separator) {
  if (count_fields(line, separator) != columns.size()) return false;
  std::vector<std::string> units;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    std::string unit = without_blanks(lower(unquoted(take(line, separator))));
    if (unit.size() > 2 && (unit.front() == '[' || unit.front() == '('))
      unit = unit.substr(1, unit.size() - 2);
    if (!unit.empty() && unit != "-" && !is_unit(unit)) return false;
    units.push_back(unit == "-" ? "" : unit);
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (!units[i].empty()) columns[i].unit = units[i];
  }
  return true;
}

constexpr std::array<std::string_view, 17> kTimeNames = {
    "__time",  // PlotJuggler

    "t_s",     "t",       "time",   "time_s",       "times",   "timestamp",    "timestamp_s", "stamp",
    "time_ns", "time_us", "timeus", "timestamp_ns", "time_ms", "timestamp_us", "time_usec",   "%time"};

std::size_t find_stamp_column(const std::vector<ColumnName>& columns) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (std::find(kTimeNames.begin(), kTimeNames.end(), columns[i].name) != kTimeNames.end()) return i;
  }
  return 0;
}

/// The header's stamps, which tell when something was measured: of each row as text. Empty where there are
/// none, or all are 0.
std::vector<std::string_view> header_stamps(NumericTable& table, std::size_t stamp,
                                            std::optional<std::size_t> nanoseconds,
                                            const std::vector<std::string_view>& texts) {
  bool any = false;
  for (std::size_t row = 0; row < table.rows(); ++row) any = any || std::abs(table.at(row, stamp)) > 0;
  if (!any) return {};
  if (!nanoseconds) return texts;
  if (!table.converted) table.converted = std::make_shared<std::deque<std::string>>();
  std::vector<std::string_view> stamps;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const double rest = table.at(row, *nanoseconds);
    const bool whole = rest >= 0 && rest < 1e9 && texts[row].find('.') == std::string_view::npos;
    stamps.emplace_back(whole ? table.converted->emplace_back(
                                    fmt::format("{}.{:09d}", texts[row], static_cast<std::int64_t>(rest)))
                              : texts[row]);
  }
  return stamps;
}

/// Takes them instead of the times of recording.
void prefer_header_stamps(NumericTable& table, std::size_t stamp,
                          const std::vector<std::string_view>& texts) {
  const auto nanoseconds = table.column(
      {"header.stamp.nsecs", "header.stamp.nanosec", "stamp.nsecs", "stamp.nanosec", "header.stamp.nsec"});
  const bool seconds = table.columns[stamp].name != "header.stamp";
  auto stamps = header_stamps(table, stamp, seconds ? nanoseconds : std::nullopt, texts);
  if (stamps.empty()) return;
  if (table.stamp_column != stamp) table.recorded = table.stamp_column;
  table.stamps = std::move(stamps);
  table.stamp_column = stamp;
}

/// What the heading says about its stamps.
std::optional<TimeUnit> stated_unit(const ColumnName& column) {
  static constexpr std::array<std::pair<std::string_view, TimeUnit>, 23> kNames = {
      {{"header.stamp.secs", TimeUnit::seconds},
       {"header.stamp.sec", TimeUnit::seconds},
       {"stamp.secs", TimeUnit::seconds},
       {"stamp.sec", TimeUnit::seconds},
       {"t_s", TimeUnit::seconds},
       {"__time", TimeUnit::seconds},
       {"time_s", TimeUnit::seconds},
       {"times", TimeUnit::seconds},
       {"timestamp_s", TimeUnit::seconds},
       {"[s]", TimeUnit::seconds},
       {"[sec]", TimeUnit::seconds},
       {"[seconds]", TimeUnit::seconds},
       {"time_ms", TimeUnit::milliseconds},
       {"[ms]", TimeUnit::milliseconds},
       {"time_us", TimeUnit::microseconds},
       {"timeus", TimeUnit::microseconds},
       {"time_usec", TimeUnit::microseconds},
       {"timestamp_us", TimeUnit::microseconds},
       {"[us]", TimeUnit::microseconds},
       {"time_ns", TimeUnit::nanoseconds},
       {"timestamp_ns", TimeUnit::nanoseconds},
       {"%time", TimeUnit::nanoseconds},
       {"[ns]", TimeUnit::nanoseconds}}};
  for (const auto& [name, unit] : kNames) {
    if (column.name == name || "[" + column.unit + "]" == name) return unit;
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::size_t> NumericTable::column(std::string_view wanted) const {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i].name == wanted) return i;
  }
  return std::nullopt;
}

std::optional<std::size_t> NumericTable::column(std::initializer_list<std::string_view> wanted) const {
  for (const std::string_view one : wanted) {
    if (const auto found = column(one)) return found;
  }
  return std::nullopt;
}

std::string NumericTable::column_names() const {
  std::string text;
  for (const ColumnName& column : columns) {
    text += (text.empty() ? "" : ", ") + column.name;
    if (text.size() > 160) return text.substr(0, 160) + " ...";
  }
  return text;
}

std::string NumericTable::first_defect(const std::vector<std::optional<Time>>& times) const {
  if (line_numbers.empty()) return "no rows";
  const std::size_t line = line_numbers.front();
  if (!times.empty() && !times.front()) {
    return fmt::format(
        "line {}: found time {}, expected a number of seconds, milliseconds, microseconds or nanoseconds",
        line, in_quotes(stamps.front()));
  }
  return fmt::format("line {}: {}", line, in_quotes(first_row));
}

Result<std::vector<std::optional<Time>>> times_of(const NumericTable& table, const StampRule& rule,
                                                  std::vector<std::string>& remarks) {
  std::vector<std::optional<Time>> times;
  times.reserve(table.rows());
  if (rule.column) {
    const double scale = static_cast<double>(nanoseconds_per(rule.unit.value_or(TimeUnit::seconds)));
    for (std::size_t row = 0; row < table.rows(); ++row) {
      const double value = table.at(row, *rule.column) * scale;
      times.push_back(std::abs(value) < 4.6e18 ? std::optional(Time{std::llround(value)}) : std::nullopt);
    }
    return times;
  }
  const ColumnName& column = table.columns[table.stamp_column];
  const auto stated = stated_unit(column);
  const auto guessed = guess_unit(table.stamps, rule.slowest);
  const auto step_in = [&](TimeUnit unit) {
    return median_step(table.stamps) * static_cast<double>(nanoseconds_per(unit)) * 1e-9;
  };
  TimeUnit unit = stated.value_or(rule.unit.value_or(guessed.value_or(TimeUnit::seconds)));
  constexpr double kFastest = 1e-5;  // s: no sensor of a log is
  if (!stated && guessed && *guessed != unit && (step_in(unit) < kFastest || step_in(unit) > rule.slowest)) {
    remarks.push_back(
        fmt::format("{}: {} is taken as {}, from its steps, and not as the {} that such logs have",
                    table.name, column.name, name_of(*guessed), name_of(unit)));
    unit = *guessed;
  }
  const double step = step_in(unit);
  if (step > rule.slowest) {
    const std::string better =
        guessed && *guessed != unit ? fmt::format("; they fit {}", name_of(*guessed)) : std::string();
    return Error{fmt::format(
        "{}: samples are {:.3g} s apart (median of {}), expected at most {:g} s: stamps are not in "
        "{}?{}",
        table.name, step, column.name, rule.slowest, name_of(unit), better)};
  }
  if (!stated && !rule.unit && unit != TimeUnit::seconds) {
    remarks.push_back(fmt::format("{}: the heading gives no unit of time; {} is taken as {}, from its steps",
                                  table.name, column.name, name_of(unit)));
  }
  if (table.recorded) {
    remarks.push_back(fmt::format("{}: the times are those of the headers ({}), not those of recording ({})",
                                  table.name, column.name, table.columns[*table.recorded].name));
  }
  for (const std::string_view stamp : table.stamps) times.push_back(parse_stamp(stamp, unit));
  return times;
}

Result<NumericTable> parse_table(std::string_view text, std::string_view name) {
  NumericTable table;
  table.name = name;
  char separator = ',';
  std::size_t line_number = 0;
  std::string words;                        // the last comment that may name columns between blanks
  std::optional<std::size_t> header;        // column of the stamps of messages of ROS
  std::vector<std::string_view> of_header;  // of each row
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  while (!text.empty()) {
    const std::string_view whole_line = take(text, '\n');
    const std::string_view line = trimmed(whole_line);
    ++line_number;
    if (line.empty()) continue;
    if (line.front() == '#') {
      const std::string_view content = trimmed(line.substr(1));
      table.comment.append(content).push_back(' ');
      const std::string heading = without_parentheses(content);
      const char candidate = separator_of(heading);
      if (candidate != ' ' && table.rows() == 0 && count_fields(heading, candidate) >= 2 &&
          heading.find('=') == std::string::npos) {
        separator = candidate;
        table.columns = split_heading(heading, separator);
      } else if (candidate == ' ' && count_fields(heading, ' ') > 3) {
        words = heading;
      }
      continue;
    }
    if (table.rows() == 0 && table.bad_lines == 0 &&
        is_heading(line.substr(0, line.find_first_of(",; \t")))) {
      const std::string heading = without_parentheses(line);
      if (table.columns.size() > 1 && take_units(table.columns, line, separator)) continue;
      separator = separator_of(heading);
      table.columns = split_heading(heading, separator);
      continue;
    }
    if (const char by = separator_of(line); table.columns.empty() && count_fields(line, by) > 1 &&
                                            is_heading(words) &&
                                            count_fields(trimmed(words), ' ') == count_fields(line, by)) {
      table.columns = split_heading(words, ' ');
      separator = by;
    }
    if (table.columns.empty()) {
      return Error{
          fmt::format("{}:{}: found '{}', expected a heading with the names of the columns "
                      "(docs/formats.md), as \"t_s,gx,gy,gz,ax,ay,az\"",
                      name, line_number, line.substr(0, 40))};
    }
    if (table.rows() == 0) {
      table.stamp_column = find_stamp_column(table.columns);
      header =
          table.column({"header.stamp", "header.stamp.secs", "header.stamp.sec", "stamp.secs", "stamp.sec"});
      table.first_row = line;
    }
    // An empty field at the end of a line of tabs is a field.
    std::string_view rest = separator == '\t' ? whole_line.substr(0, whole_line.find('\r')) : line;
    if (count_fields(rest, separator) != table.width()) {
      if (table.bad_lines++ == 0) table.first_bad_line = line_number;
      continue;
    }
    for (std::size_t i = 0; i < table.width(); ++i) {
      const std::string_view field = trimmed(take(rest, separator));
      table.values.push_back(number_or_nan(field, separator == ';' || separator == '\t'));
      if (i == table.stamp_column) table.stamps.push_back(stamp_of(table, unquoted(field), separator));
      if (header && i == *header) of_header.push_back(stamp_of(table, unquoted(field), separator));
    }
    table.line_numbers.push_back(line_number);
  }
  if (table.columns.empty())
    return Error{fmt::format("{}: empty, expected a heading and rows of numbers", name)};
  if (table.rows() == 0 || table.bad_lines > table.rows()) {
    return Error{table.bad_lines > 0
                     ? fmt::format("{}:{}: {} of {} lines do not have {} fields", name, table.first_bad_line,
                                   table.bad_lines, table.rows() + table.bad_lines, table.width())
                     : fmt::format("{}: no rows below the heading", name)};
  }
  if (header) prefer_header_stamps(table, *header, of_header);
  return table;
}

}  // namespace pade::io
