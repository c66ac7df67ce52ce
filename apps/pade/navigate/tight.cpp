#include "tight.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/navigation/tight/raw_observer.hpp"

namespace pade::cli {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kWeek = 604800 * kSecond;
constexpr std::int64_t kGpsOfUnix =
    315964800 * kSecond;  // Unix time of the start of GPS time, less leap seconds

struct Scale {
  const char* name;
  Time zero;  ///< GPS time at its zero
};

struct Span {
  std::int64_t first;
  std::int64_t last;
};

/// Common part of the two, negative if they lie apart.
std::int64_t overlap(const Span& imu, const Span& raw, Time zero) {
  return std::min(imu.last + zero.nanoseconds, raw.last) - std::max(imu.first + zero.nanoseconds, raw.first);
}

Span span_of(const std::vector<ImuSample>& imu) {
  const auto [first, last] = std::minmax_element(
      imu.begin(), imu.end(), [](const ImuSample& a, const ImuSample& b) { return a.time < b.time; });
  return {first->time.nanoseconds, last->time.nanoseconds};
}

}  // namespace

Result<RawInput> read_raw_input(const std::filesystem::path& path, const std::vector<ImuSample>& imu,
                                const gnss::PositioningOptions& options) {
  auto log = io::read_raw_gnss(path);
  if (!log) return log.error();
  if (log->epochs.empty()) {
    return Error{
        fmt::format("{}: found ranges without Doppler, expected RINEX 3 observations or UBX", path.string())};
  }
  if (imu.empty()) return Error{fmt::format("{}: found no IMU samples beside it", path.string())};
  const Span raw{log->epochs.front().time.nanoseconds, log->epochs.back().time.nanoseconds};
  const Time first{raw.first};
  const std::array scales{Scale{"GPS time", Time{0}},
                          Scale{"seconds of the GPS week", Time{raw.first - raw.first % kWeek}},
                          Scale{"Unix time", Time{io::leap_seconds(first) * kSecond - kGpsOfUnix}}};
  const Span samples = span_of(imu);
  const auto best = std::max_element(scales.begin(), scales.end(), [&](const Scale& a, const Scale& b) {
    return overlap(samples, raw, a.zero) < overlap(samples, raw, b.zero);
  });
  if (overlap(samples, raw, best->zero) <= 0) {
    return Error{
        fmt::format("{}: found IMU stamps from {} to {} s and raw GNSS from {} to {} s of GPS time, expected "
                    "that they overlap in GPS "
                    "time, seconds of the GPS week, or Unix time",
                    path.string(), to_string(imu.front().time), to_string(imu.back().time), to_string(first),
                    to_string(Time{raw.last}))};
  }
  RawInput input;
  input.log = std::move(*log);
  input.remark = fmt::format("the stamps of the IMU are {}", best->name);
  navigation::RawObserver observer(input.log.broadcast, options, {}, best->zero);
  for (const gnss::Epoch& epoch : input.log.epochs) {
    if (auto made = observer.observe(epoch)) input.epochs.push_back(std::move(made));
  }
  if (!observer.frame()) {
    return Error{fmt::format("{}: no epoch has enough satellites for a position", path.string())};
  }
  constexpr double kDegree = std::numbers::pi / 180;
  const gnss::Geodetic& place = observer.frame()->place;
  input.origin = {place.latitude / kDegree, place.longitude / kDegree, place.height};
  return input;
}

}  // namespace pade::cli
