#include "pade/io/stamps.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <vector>

#include "pade/core/compute/median.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

constexpr double kLargest = 4.6e18;  // nanoseconds, as parse_time: every difference fits

double number_of(std::string_view text) {
  return parse_number(text).value_or(std::numeric_limits<double>::quiet_NaN());
}

}  // namespace

std::int64_t nanoseconds_per(TimeUnit unit) {
  switch (unit) {
    case TimeUnit::seconds:
      return 1'000'000'000;
    case TimeUnit::milliseconds:
      return 1'000'000;
    case TimeUnit::microseconds:
      return 1'000;
    case TimeUnit::nanoseconds:
      return 1;
  }
  return 1;
}

double median_step(std::span<const std::string_view> stamps) {
  std::vector<double> steps;
  double last = std::numeric_limits<double>::quiet_NaN();
  for (const std::string_view stamp : stamps) {
    const double value = number_of(stamp);
    const double step = std::abs(value - last);
    if (std::isfinite(step) && step > 0) steps.push_back(step);
    last = value;
  }
  return median(steps);
}

std::string_view name_of(TimeUnit unit) {
  static constexpr std::array<std::string_view, 4> kNames = {"seconds", "milliseconds", "microseconds",
                                                             "nanoseconds"};
  return kNames[static_cast<std::size_t>(unit)];
}

std::optional<TimeUnit> guess_unit(std::span<const std::string_view> stamps, double slowest) {
  const double step = median_step(stamps);
  constexpr double kFastest = 0.0004;  // s: 2.5 kHz
  for (const TimeUnit unit :
       {TimeUnit::seconds, TimeUnit::milliseconds, TimeUnit::microseconds, TimeUnit::nanoseconds}) {
    const double seconds = step * static_cast<double>(nanoseconds_per(unit)) * 1e-9;
    if (seconds >= kFastest && seconds <= slowest) return unit;
  }
  return std::nullopt;
}

std::optional<Time> parse_stamp(std::string_view text, TimeUnit unit) {
  if (unit == TimeUnit::seconds) return parse_time(text);
  const auto scale = nanoseconds_per(unit);
  std::int64_t count = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, count);
  if (status == std::errc{} && stop == end) {
    if (std::abs(static_cast<double>(count)) * static_cast<double>(scale) > kLargest) return std::nullopt;
    return Time{count * scale};
  }
  const double value = number_of(text) * static_cast<double>(scale);
  if (!(std::abs(value) < kLargest)) return std::nullopt;
  return Time{std::llround(value)};
}

TimeUnit unit_of_frames(std::span<const std::string_view> stamps) {
  constexpr double kThousand = 1000;
  constexpr double kSlowest = 10;                           // s
  constexpr double kYear1998 = 0.9e12, kYear2100 = 4.1e12;  // ms since 1970, as neither s nor us count
  const double first = stamps.empty() ? 0 : number_of(stamps[stamps.size() / 2]);
  const double step = median_step(stamps);
  if (first > kYear1998 && first < kYear2100 && step >= 1 && step <= kThousand * kSlowest)
    return TimeUnit::milliseconds;
  if (!(step >= kThousand)) return TimeUnit::seconds;
  const auto unit = guess_unit(stamps, kSlowest);
  return unit.value_or(TimeUnit::seconds) == TimeUnit::milliseconds ? TimeUnit::microseconds
                                                                    : unit.value_or(TimeUnit::seconds);
}

}  // namespace pade::io
