#include "pade/io/gnss/rinex_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

/// Days from 1980-01-06; of the Gregorian calendar.
std::int64_t day_number(int year, int month, int day) {
  const std::int64_t y = month > 2 ? year : year - 1;
  const std::int64_t m = month > 2 ? month - 3 : month + 9;  // from March
  return 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + day - 723126;
}

}  // namespace

std::optional<Time> time_of_date(int year, int month, int day, int hour, int minute, double second) {
  constexpr std::array<int, 12> kDays{31, 29, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  if (year < 1980 || year > 2099 || month < 1 || month > 12 || day < 1 ||
      day > kDays.at(static_cast<std::size_t>(month - 1)) || hour < 0 || hour > 24 || minute < 0 ||
      minute > 59 || !(second >= 0) || second >= 61) {
    return std::nullopt;
  }
  const std::int64_t whole = day_number(year, month, day) * 86400 + hour * 3600 + minute * 60;
  return Time{whole * rinex::kNanoseconds + static_cast<std::int64_t>(std::llround(second * 1e9))};
}

int leap_seconds(Time time) {
  struct Step {
    int year, month;
  };
  // The first days on which UTC was one second further behind.
  constexpr std::array<Step, 18> kSteps{{{1981, 7},
                                         {1982, 7},
                                         {1983, 7},
                                         {1985, 7},
                                         {1988, 1},
                                         {1990, 1},
                                         {1991, 1},
                                         {1992, 7},
                                         {1993, 7},
                                         {1994, 7},
                                         {1996, 1},
                                         {1997, 7},
                                         {1999, 1},
                                         {2006, 1},
                                         {2009, 1},
                                         {2012, 7},
                                         {2015, 7},
                                         {2017, 1}}};
  int seconds = 0;
  for (const Step& step : kSteps) {
    if (time.nanoseconds >= day_number(step.year, step.month, 1) * 86400 * rinex::kNanoseconds) ++seconds;
  }
  return seconds;
}

namespace rinex {

std::optional<std::string_view> Lines::peek() const {
  if (rest_.empty()) return std::nullopt;
  std::string_view line = rest_.substr(0, rest_.find('\n'));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::optional<std::string_view> Lines::next() {
  const auto line = peek();
  if (!line) return line;
  rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size() - 1) + 1);
  ++number_;
  return line;
}

std::string_view columns(std::string_view line, std::size_t from, std::size_t width) {
  if (from >= line.size()) return {};
  std::string_view text = line.substr(from, width);
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

std::optional<double> number_at(std::string_view line, std::size_t from, std::size_t width) {
  std::array<char, 32> copy{};
  const std::string_view text = columns(line, from, width);
  if (text.empty() || text.size() > copy.size()) return std::nullopt;
  std::transform(text.begin(), text.end(), copy.begin(),
                 [](char c) { return c == 'D' || c == 'd' ? 'e' : c; });
  const auto value = parse_number({copy.data(), text.size()});
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<int> integer_at(std::string_view line, std::size_t from, std::size_t width) {
  const auto value = number_at(line, from, width);
  if (!value || std::abs(*value) > 999'999'999 || *value != std::floor(*value)) return std::nullopt;
  return static_cast<int>(*value);
}

bool is_system_letter(char letter) {
  return std::string_view("GRECJSI").find(letter) != std::string_view::npos;
}

std::optional<gnss::SatelliteId> satellite_at(std::string_view line) {
  if (line.size() < 3) return std::nullopt;
  const auto letter = std::find(gnss::kSystemLetters.begin(), gnss::kSystemLetters.end(), line[0]);
  const auto number = integer_at(line, 1, 2);
  if (letter == gnss::kSystemLetters.end() || !number || *number < 1 || *number > 63) return std::nullopt;
  return gnss::SatelliteId{static_cast<gnss::System>(letter - gnss::kSystemLetters.begin()),
                           static_cast<std::uint8_t>(*number)};
}

std::string_view label_of(std::string_view line) { return columns(line, 60, 20); }

Result<double> check_first_line(std::string_view line, char type, const std::string& where) {
  if (label_of(line) != "RINEX VERSION / TYPE") {
    return Error{fmt::format("{}: found {}, expected RINEX VERSION / TYPE in columns 61 to 80", where,
                             in_quotes(line))};
  }
  const auto version = number_at(line, 0, 9);
  if (!version || *version < 3 || *version >= 3.995) {
    return Error{fmt::format("{}: found RINEX version {}, expected 3.00 to 3.05", where,
                             in_quotes(columns(line, 0, 9)))};
  }
  if (line[20] != type) {
    return Error{fmt::format("{}: found a RINEX file of type {}, expected {} ({})", where,
                             in_quotes(line.substr(20, 1)), type,
                             type == 'O' ? "observations" : "navigation messages")};
  }
  return *version;
}

std::string at_line(std::string_view name, std::size_t line) {
  return fmt::format("{}: line {}", name, line);
}

void Tally::report(std::vector<std::string>& remarks) const {
  if (count_ == 0) return;
  remarks.push_back(count_ == 1 ? first_ : fmt::format("{}, and {} more of the kind", first_, count_ - 1));
}

}  // namespace rinex
}  // namespace pade::io
