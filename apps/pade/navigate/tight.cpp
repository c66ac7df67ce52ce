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

/// How many epochs lie within the samples.
std::size_t epochs_within(const Span& imu, const std::vector<gnss::Epoch>& epochs, Time zero) {
  return static_cast<std::size_t>(std::count_if(epochs.begin(), epochs.end(), [&](const gnss::Epoch& epoch) {
    const std::int64_t time = epoch.time.nanoseconds - zero.nanoseconds;
    return time >= imu.first && time <= imu.last;
  }));
}

/// From the first to the last sample, without the hundredth at either end, among which stamps may be wrong.
Span span_of(const std::vector<ImuSample>& imu) {
  std::vector<std::int64_t> times;
  times.reserve(imu.size());
  for (const ImuSample& sample : imu) times.push_back(sample.time.nanoseconds);
  std::sort(times.begin(), times.end());
  const std::size_t left_out = times.size() / 100;
  return {times[left_out], times[times.size() - 1 - left_out]};
}

/// Leaves out the epochs behind the last sample: the receiver was switched off later than the IMU.
void leave_out_later(const std::vector<ImuSample>& imu, RawInput& input) {
  constexpr std::int64_t kSlack = kSecond;
  const auto last = std::max_element(imu.begin(), imu.end(),
                                     [](const ImuSample& a, const ImuSample& b) { return a.time < b.time; });
  const auto count = std::erase_if(input.epochs, [&](const auto& epoch) {
    return epoch->time.nanoseconds > last->time.nanoseconds + kSlack;
  });
  if (count > 0) {
    input.log.remarks.push_back(
        fmt::format("{} epochs of raw GNSS lie behind the last sample of the IMU and are not used", count));
  }
}

bool has(const gnss::RawLog& log, std::optional<double> gnss::Signal::*measurement) {
  return std::any_of(log.epochs.begin(), log.epochs.end(), [&](const gnss::Epoch& epoch) {
    return std::any_of(epoch.signals.begin(), epoch.signals.end(),
                       [&](const gnss::Signal& signal) { return (signal.*measurement).has_value(); });
  });
}

/// What was left out and why, behind a message.
std::string with_remarks(const std::vector<std::string>& remarks) {
  std::string text;
  for (const std::string& remark : remarks) text += "\n  " + remark;
  return text;
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
  // Of the middle epoch: a receiver that does not know the date yet stamps its first ones by another.
  const Time middle = log->epochs[log->epochs.size() / 2].time;
  const Time week{middle.nanoseconds - middle.nanoseconds % kWeek};
  const std::array scales{Scale{"GPS time", Time{0}}, Scale{"seconds of the GPS week", week},
                          Scale{"seconds of the GPS week", Time{week.nanoseconds - kWeek}},
                          Scale{"Unix time", Time{io::leap_seconds(middle) * kSecond - kGpsOfUnix}}};
  const Span samples = span_of(imu);
  const auto best = std::max_element(scales.begin(), scales.end(), [&](const Scale& a, const Scale& b) {
    return epochs_within(samples, log->epochs, a.zero) < epochs_within(samples, log->epochs, b.zero);
  });
  if (epochs_within(samples, log->epochs, best->zero) == 0) {
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
    return Error{fmt::format("{}: no epoch has enough satellites for a position{}", path.string(),
                             with_remarks(input.log.remarks))};
  }
  leave_out_later(imu, input);
  if (!has(input.log, &gnss::Signal::doppler)) {
    input.log.remarks.emplace_back(has(input.log, &gnss::Signal::carrier)
                                       ? "the raw GNSS has no Doppler: phases alone hold the velocity, and "
                                         "before the alignment nothing does"
                                       : "the raw GNSS has neither Doppler nor phases: nothing tells when "
                                         "the velocity is wrong, and motions "
                                         "may be said to be valid that are not");
  }
  for (std::string& remark : gnss::remarks_on(observer.noise(), options)) {
    input.log.remarks.push_back(std::move(remark));
  }
  constexpr double kDegree = std::numbers::pi / 180;
  const gnss::Geodetic& place = observer.frame()->place;
  input.origin = {place.latitude / kDegree, place.longitude / kDegree, place.height};
  return input;
}

}  // namespace pade::cli
