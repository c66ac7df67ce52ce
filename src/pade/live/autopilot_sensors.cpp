#include "pade/live/autopilot_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "pade/live/mavlink/codec.hpp"
#include "pade/live/mavlink/estimate_messages.hpp"
#include "pade/live/mavlink/link_messages.hpp"
#include "pade/live/mavlink/sensor_messages.hpp"

namespace pade::live {
namespace {

using Eigen::Vector3d;
using mavlink::Frame;
using mavlink::unpack;

constexpr double kMilliG = 9.80665e-3;
constexpr double kMilli = 1e-3;
constexpr double kDegree = std::numbers::pi / 180;
constexpr std::uint64_t kLastDate = 4'600'000'000'000'000;  // the year 2115, µs
constexpr double kFieldSigma = 0.05;                        // as io::parse_magnetometer has it
constexpr double kHeightSigma = 0.3;                        // m, as io::parse_barometer has it

Vector3d flu_from_frd(const Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }

Time from_milliseconds(std::uint32_t ms) { return {static_cast<std::int64_t>(ms) * 1'000'000}; }

/// By the median step, Hz; 0 if there are not two.
double rate_of(const std::vector<ImuSample>& samples) {
  if (samples.size() < 2) return 0;
  std::vector<double> steps;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    steps.push_back(seconds_between(samples[i - 1].time, samples[i].time));
  }
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle > 0 ? 1 / *middle : 0;
}

template <class Channels>
const auto& longest(const Channels& sources) {
  return std::max_element(sources.begin(), sources.end(),
                          [](const auto& a, const auto& b) { return a.samples.size() < b.samples.size(); })
      ->samples;
}

/// Of the first source that still comes; nothing stays of the others.
template <class Channels>
auto take_first(Channels& sources) {
  constexpr double kSilent = 1;  // s, after which another source takes over
  std::optional<Time> newest;
  for (const auto& source : sources) {
    if (source.last && (!newest || *newest < *source.last)) newest = source.last;
  }
  decltype(sources[0].samples) taken;
  bool found = false;
  for (auto& source : sources) {
    if (!found && source.last && seconds_between(*source.last, *newest) < kSilent) {
      found = true;
      taken = std::move(source.samples);
    }
    source.samples.clear();
  }
  return taken;
}

}  // namespace

std::string name_of(const Autopilot& autopilot) {
  if (autopilot.kind == ardupilot_kind) return "ArduPilot";
  if (autopilot.kind == px4_kind) return "PX4";
  return fmt::format("autopilot {}", autopilot.kind);
}

void BootClock::learn(const Frame& frame) {
  const auto time = unpack<mavlink::SystemTime>(frame);
  if (!time || time->time_unix_usec == 0 || time->time_unix_usec > kLastDate) return;
  boot_since_1970_ =
      static_cast<std::int64_t>(time->time_unix_usec) - 1000 * static_cast<std::int64_t>(time->time_boot_ms);
}

std::optional<Time> BootClock::time_of(std::uint64_t microseconds) const {
  constexpr std::uint64_t kFirstDate = 100'000'000'000'000;  // three years
  if (microseconds < kFirstDate) return Time{static_cast<std::int64_t>(microseconds) * 1000};
  if (!boot_since_1970_ || microseconds > kLastDate) return std::nullopt;
  return Time{(static_cast<std::int64_t>(microseconds) - *boot_since_1970_) * 1000};
}

void SensorGatherer::add(const Frame& frame) {
  if (frame.system != autopilot_.system || frame.component != autopilot_.component) return;
  clock_.learn(frame);
  switch (frame.id) {
    case mavlink::HighresImu::kId:
      return add_highres(frame);
    case mavlink::GpsRawInt::kId:
      return add_fix(frame);
    case mavlink::ScaledImu::kId: {
      const auto message = unpack<mavlink::ScaledImu>(frame);
      return add_integers(*message, from_milliseconds(message->time_boot_ms), scaled);
    }
    case mavlink::RawImu::kId: {
      if (autopilot_.kind != ardupilot_kind) {
        ++unitless_;
        return;
      }
      const auto message = unpack<mavlink::RawImu>(frame);
      if (const auto time = clock_.time_of(message->time_usec)) add_integers(*message, *time, raw);
      return;
    }
    case mavlink::ScaledPressure::kId: {
      const auto message = unpack<mavlink::ScaledPressure>(frame);
      return add_pressure(from_milliseconds(message->time_boot_ms), static_cast<double>(message->press_abs),
                          scaled);
    }
    default:
      return;
  }
}

template <class Message>
void SensorGatherer::add_integers(const Message& message, Time time, Source source) {
  auto& channel = imu_[source];
  if (!channel.is_new(time)) return;
  channel.samples.push_back({time,
                             flu_from_frd(kMilli * Vector3d(message.xgyro, message.ygyro, message.zgyro)),
                             flu_from_frd(kMilliG * Vector3d(message.xacc, message.yacc, message.zacc))});
  add_field(time, kMilli * Vector3d(message.xmag, message.ymag, message.zmag), source);
}

void SensorGatherer::add_highres(const Frame& frame) {
  const auto m = unpack<mavlink::HighresImu>(frame);
  const auto time = clock_.time_of(m->time_usec);
  if (!time || m->id != 0) return;
  const auto updated = [&](unsigned bits) { return (m->fields_updated & bits) != 0; };
  constexpr unsigned kInertial = 0x3f, kMagnetic = 0x1c0, kPressure = 0x200;
  const Vector3d rate = Eigen::Vector3f(m->xgyro, m->ygyro, m->zgyro).cast<double>();
  const Vector3d force = Eigen::Vector3f(m->xacc, m->yacc, m->zacc).cast<double>();
  if (updated(kInertial) && rate.allFinite() && force.allFinite() && imu_[highres].is_new(*time)) {
    imu_[highres].samples.push_back({*time, flu_from_frd(rate), flu_from_frd(force)});
  }
  if (updated(kMagnetic)) {
    add_field(*time, Eigen::Vector3f(m->xmag, m->ymag, m->zmag).cast<double>(), highres);
  }
  if (updated(kPressure)) add_pressure(time, static_cast<double>(m->abs_pressure), highres);
}

void SensorGatherer::add_field(Time time, const Vector3d& frd, Source source) {
  auto& channel = fields_[source];
  if (!frd.allFinite() || frd.isZero(0) || !channel.is_new(time)) return;
  channel.samples.push_back({time, flu_from_frd(frd), kFieldSigma});
}

void SensorGatherer::add_pressure(std::optional<Time> time, double hectopascal, Source source) {
  auto& channel = heights_[source];
  if (!time || !(hectopascal > 100 && hectopascal < 1200) || !channel.is_new(*time)) return;
  channel.samples.push_back({*time, io::height_of_pressure(hectopascal), kHeightSigma});
}

void SensorGatherer::add_fix(const Frame& frame) {
  constexpr std::uint8_t kThreeDimensions = 3;
  constexpr std::uint16_t kUnknown = 65535;
  const auto m = unpack<mavlink::GpsRawInt>(frame);
  const auto time = clock_.time_of(m->time_usec);
  if (m->fix_type < kThreeDimensions) {
    ++without_fix_;
    return;
  }
  const bool on_earth =
      std::abs(static_cast<double>(m->lat)) <= 9e8 && std::abs(static_cast<double>(m->lon)) <= 1.8e9;
  if (!time || !on_earth || !fixes_.is_new(*time)) return;
  io::GeodeticFix fix{
      *time, 1e-7 * m->lat,       1e-7 * m->lon, kMilli * m->alt, kMilli * m->h_acc, kMilli * m->v_acc,
      {},    kMilli * m->vel_acc, false};
  if (m->vel != kUnknown && m->cog != kUnknown) {
    const double course = 0.01 * m->cog * kDegree;
    fix.velocity = 0.01 * m->vel * Vector3d(std::sin(course), std::cos(course), 0);
  }
  fixes_.samples.push_back(fix);
}

NewSamples SensorGatherer::take() {
  return {take_first(imu_), take_first(fields_), take_first(heights_), std::exchange(fixes_.samples, {})};
}

Result<NavigationLog> SensorGatherer::log(const std::string& name, SensorNeed need) const {
  NavigationLog log;
  log.imu = longest(imu_);
  const std::string who = name_of(autopilot_);
  if (log.imu.empty() && unitless_ > 0) {
    return Error{fmt::format(
        "{}: the IMU is missing: found {} RAW_IMU of {}, whose units are its own, expected HIGHRES_IMU or "
        "SCALED_IMU",
        name, unitless_, who)};
  }
  if (log.imu.empty()) {
    return Error{fmt::format(
        "{}: the IMU is missing: found no HIGHRES_IMU, SCALED_IMU or ArduPilot's RAW_IMU of {}", name, who)};
  }
  if (fixes_.samples.empty()) {
    std::string missing = fmt::format(
        "{}: the GNSS is missing: found no GPS_RAW_INT with a fix in three dimensions, {} without", name,
        without_fix_);
    if (need == SensorNeed::imu_and_gnss) return Error{missing};
    log.remarks.push_back(std::move(missing));
  }
  if (const double rate = rate_of(log.imu); rate < slowest_imu) {
    return Error{fmt::format(
        "{}: the IMU is missing at a usable rate: found {} samples at {:.3g} Hz, expected {} Hz or more "
        "(ask for the message by MAV_CMD_SET_MESSAGE_INTERVAL, or raise SRx_RAW_SENS of ArduPilot)",
        name, log.imu.size(), rate, slowest_imu)};
  }
  log.magnetometer = longest(fields_);
  log.barometer = longest(heights_);
  if (!fixes_.samples.empty()) log.gnss = io::local_log(fixes_.samples, "GPS_RAW_INT", log.remarks);
  return log;
}

}  // namespace pade::live
