#include "pade/core/time.hpp"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace pade {
namespace {
constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr double kLargestSecond = 4.6e9;  // half of the range of int64, so that every difference fits
}  // namespace

Time Time::from_seconds(double seconds) { return {static_cast<std::int64_t>(std::llround(seconds * 1e9))}; }

std::string to_string(Time time) {
  const bool negative = time.nanoseconds < 0;
  const std::uint64_t magnitude = negative ? 0 - static_cast<std::uint64_t>(time.nanoseconds)
                                           : static_cast<std::uint64_t>(time.nanoseconds);
  const auto whole = static_cast<unsigned long long>(magnitude / kNanosecondsPerSecond);
  const auto fraction = static_cast<unsigned long long>(magnitude % kNanosecondsPerSecond);
  char text[48];
  if (fraction % 1000 == 0) {
    std::snprintf(text, sizeof text, "%s%llu.%06llu", negative ? "-" : "", whole, fraction / 1000);
  } else {
    std::snprintf(text, sizeof text, "%s%llu.%09llu", negative ? "-" : "", whole, fraction);
  }
  return text;
}

std::optional<Time> parse_time(std::string_view text) {
  double approximate = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, approximate);
  if (status != std::errc{} || stop != end || !(std::abs(approximate) < kLargestSecond)) return std::nullopt;
  if (text.find_first_of("eE") != std::string_view::npos) return Time::from_seconds(approximate);

  const bool negative = text.front() == '-';
  if (negative) text.remove_prefix(1);
  std::int64_t nanoseconds = 0;
  int decimals = -1;  // digits seen after the point
  for (const char c : text) {
    if (c == '.') {
      decimals = 0;
    } else if (decimals < 9) {
      nanoseconds = nanoseconds * 10 + (c - '0');
      if (decimals >= 0) ++decimals;
    }
  }
  for (int i = decimals < 0 ? 0 : decimals; i < 9; ++i) nanoseconds *= 10;
  return Time{negative ? -nanoseconds : nanoseconds};
}

}  // namespace pade
