// Navigation sensors out of a recording of ROS.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "pade/io/navigation/geodetic_fixes.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/flight/flight_names.hpp"
#include "pade/io/recording/flight/recorded_frames.hpp"
#include "pade/io/recording/flight/recorded_images.hpp"
#include "pade/io/recording/flight/topic_choice.hpp"
#include "pade/io/recording/messages/messages.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

/// Whether a frame is called as that of a vehicle, in whose axes drivers give its own velocity.
bool is_called_vehicle(std::string_view frame) {
  static constexpr std::array<std::string_view, 8> kNames = {
      "base_link", "base_footprint", "base", "base_link_frd", "body", "fcu", "imu", "imu_link"};
  return std::find(kNames.begin(), kNames.end(), frame) != kNames.end();
}

/// Whether "fix" is one of the words of "/ublox/fix_velocity".
bool has_word(std::string_view name, std::string_view word) {
  while (!name.empty()) {
    const std::size_t end = std::min(name.find_first_of("/_"), name.size());
    if (name.substr(0, end) == word) return true;
    name.remove_prefix(std::min(end + 1, name.size()));
  }
  return false;
}

/// A velocity as a message states it, with what it says of its accuracy.
struct StatedVelocity {
  Time time;
  Eigen::Vector3d velocity, variance;
};

bool is_stated(double variance) { return variance > 0 && std::isfinite(variance); }

/// Velocities whose accuracy is complete: a vertical part that nobody measures is left open, axes without an
/// accuracy get the usual one.
std::vector<GnssVelocity> complete(const std::vector<StatedVelocity>& stated, const std::string& topic,
                                   std::vector<std::string>& notes) {
  const GnssDefaults defaults;
  const Eigen::Vector3d usual =
      Eigen::Vector3d(defaults.velocity_horizontal, defaults.velocity_horizontal, defaults.velocity_vertical)
          .cwiseAbs2();
  const bool level = std::all_of(stated.begin(), stated.end(), [](const StatedVelocity& one) {
    return one.velocity.z() == 0 || !std::isfinite(one.velocity.z());
  });
  std::vector<GnssVelocity> out;
  std::size_t filled = 0, open = 0;
  for (const StatedVelocity& one : stated) {
    Eigen::Vector3d velocity = one.velocity, variance = one.variance;
    const bool horizontal = is_stated(variance.x()) && is_stated(variance.y());
    if (level || !std::isfinite(velocity.z()) || (horizontal && !is_stated(variance.z()))) {
      ++open;
      variance.z() = open_vertical_velocity * open_vertical_velocity;
      if (!std::isfinite(velocity.z())) velocity.z() = 0;
    }
    const bool whole = is_stated(variance.x()) && is_stated(variance.y()) && is_stated(variance.z());
    if (!whole) ++filled;
    for (int axis = 0; axis < 3; ++axis)
      if (!is_stated(variance[axis])) variance[axis] = usual[axis];
    out.push_back({one.time, velocity, variance.asDiagonal()});
  }
  if (level && !stated.empty()) {
    notes.push_back(fmt::format("{}: has no vertical velocity, which is left open", topic));
  } else if (open > 0) {
    notes.push_back(
        fmt::format("{}: {} of {} velocities say nothing of the accuracy of their vertical part, which is "
                    "left open",
                    topic, open, stated.size()));
  }
  if (filled > 0) {
    notes.push_back(
        fmt::format("{}: {} of {} velocities state no accuracy: {} m/s{}", topic, filled, stated.size(),
                    defaults.velocity_horizontal,
                    level ? "" : fmt::format(" and {} m/s vertically", defaults.velocity_vertical)));
  }
  return out;
}

/// Reads the sensors of one recording.
class SensorReader {
 public:
  SensorReader(const Recording& recording, std::string_view topics, bool some)
      : recording_(recording), topics_(topics), some_(some) {}

  Result<RecordedSensors> read() {
    if (Status known = topics_.check(recording_); !known) return known.error();
    log_.remarks = recording_.remarks();
    auto frames = RecordedFrames::read(recording_, report_);
    if (!frames) return frames.error();
    frames_ = std::move(*frames);
    for (const auto& step : {&SensorReader::read_imu, &SensorReader::read_fixes, &SensorReader::read_field,
                             &SensorReader::read_heights}) {
      if (Status status = std::invoke(step, this); !status) return status.error();
    }
    read_lever_arm();
    for (const Skipped& entry : report_.skipped) log_.remarks.push_back(entry.file + ": " + entry.reason);
    log_.remarks.insert(log_.remarks.end(), report_.notes.begin(), report_.notes.end());
    return RecordedSensors{std::move(log_), std::move(sources_)};
  }

 private:
  [[nodiscard]] Error missing(std::string_view what, std::string_view type) const {
    std::vector<const Topic*> all;
    for (const Topic& topic : recording_.topics()) all.push_back(&topic);
    return Error{fmt::format("{}: the {} is missing: found no topic of {} among {}",
                             recording_.file().string(), what, type, list_of(all))};
  }

  /// The topic of a sensor; null if there is none.
  Result<const Topic*> find(const std::vector<std::string_view>& types, std::string_view what) {
    return topics_.among(recording_, topics_of(recording_, types), what);
  }

  /// Of one that a flight cannot do without.
  [[nodiscard]] Status none_of(std::string_view what, std::string_view type) {
    if (!some_) return missing(what, type);
    return {};
  }

  /// Calls `take` with the bytes of each message and the time when it was measured; what it cannot read is
  /// skipped.
  Status for_each(const Topic& topic,
                  const std::function<Status(std::string_view, MessageEncoding, Time)>& take) {
    const auto stamps = stamps_of(recording_, topic, report_);
    if (!stamps) return stamps.error();
    const MessageEncoding encoding = *message_encoding(topic.encoding);
    sources_.push_back(topic.name);
    for (std::size_t i = 0; i < topic.messages.size(); ++i) {
      if (!(*stamps)[i]) continue;
      const auto bytes = recording_.read(topic.messages[i]);
      if (!bytes) return bytes.error();
      const Status taken = take(*bytes, encoding, *(*stamps)[i]);
      if (!taken) report_.skip(topic.name, fmt::format("message {}: {}", i + 1, taken.error().message));
    }
    return {};
  }

  Status read_imu() {
    const auto topic = find({"sensor_msgs/Imu"}, "IMUs");
    if (!topic) return topic.error();
    if (*topic == nullptr) return none_of("IMU", "sensor_msgs/Imu");
    std::size_t without_rate = 0, without_force = 0;
    const Status status =
        for_each(**topic, [&](std::string_view bytes, MessageEncoding encoding, Time time) -> Status {
          const auto imu = read_imu_message(bytes, encoding);
          if (!imu) return imu.error();
          if (!imu->angular_rate.allFinite() || !imu->specific_force.allFinite())
            return Error{"a value is not finite"};
          if (!imu->has_rate || !imu->has_force) {
            ++(imu->has_rate ? without_force : without_rate);
            return {};
          }
          imu_frame_ = frame_name(imu->header.frame);
          log_.imu.push_back({time, imu->angular_rate, imu->specific_force});
          return {};
        });
    if (!status) return status;
    if (const std::size_t left_out = without_rate + without_force; left_out > 0) {
      const char* const what = without_rate > 0 ? "angular rate" : "acceleration";
      if (log_.imu.empty()) {
        return Error{fmt::format(
            "{}: {} measures no {} (it is 0 and its covariance begins with -1), expected an IMU with angular "
            "rates and accelerations: name it with --topics",
            recording_.file().string(), (*topic)->name, what)};
      }
      report_.notes.push_back(
          fmt::format("{}: {} messages without {} (its covariance begins with -1) are "
                      "left out",
                      (*topic)->name, left_out, what));
    }
    if (log_.imu.empty()) return none_of("IMU", "usable sensor_msgs/Imu");
    return check_imu_units(log_.imu, fmt::format("{}: {}", recording_.file().string(), (*topic)->name),
                           false);
  }

  Status read_fixes() {
    const auto topic = find({"sensor_msgs/NavSatFix"}, "GNSS positions");
    if (!topic) return topic.error();
    if (*topic == nullptr) return none_of("GNSS", "sensor_msgs/NavSatFix");
    std::vector<GeodeticFix> fixes;
    std::size_t without = 0;
    Status status =
        for_each(**topic, [&](std::string_view bytes, MessageEncoding encoding, Time time) -> Status {
          const auto message = read_nav_sat_fix(bytes, encoding);
          if (!message) return message.error();
          antenna_frame_ = frame_name(message->header.frame);
          const bool on_earth = std::abs(message->latitude) <= 90 && std::abs(message->longitude) <= 360 &&
                                std::abs(message->height) <= 1e6;
          if (message->status < 0 || !on_earth) {
            ++without;
            return {};
          }
          GeodeticFix fix;
          fix.time = time;
          fix.latitude = message->latitude;
          fix.longitude = message->longitude;
          fix.height = message->height;
          if (message->covariance_kind != 0)
            fix.covariance = Eigen::Map<const Eigen::Matrix3d>(message->covariance.data());
          fixes.push_back(fix);
          return {};
        });
    if (!status) return status;
    if (without > 0)
      report_.notes.push_back(
          fmt::format("{}: {} messages without a fix are left out", (*topic)->name, without));
    if (fixes.empty()) return none_of("GNSS", "sensor_msgs/NavSatFix with a fix");
    log_.gnss = local_log(fixes, (*topic)->name, log_.remarks);
    return read_velocities();
  }

  /// Velocities in east, north, up of the receiver; other twists are the vehicle's.
  Status read_velocities() {
    auto candidates =
        topics_of(recording_, {"geometry_msgs/TwistWithCovarianceStamped", "geometry_msgs/TwistStamped"});
    std::erase_if(candidates,
                  [&](const Topic* topic) { return !topics_.names(*topic) && !of_receiver(*topic); });
    const auto topic = topics_.among(recording_, candidates, "GNSS velocities");
    if (!topic) return topic.error();
    if (*topic == nullptr) {
      report_.notes.emplace_back(
          "found no velocities of the GNSS (TwistStamped of the receiver's frame, or of a name with gps, "
          "gnss "
          "or the word fix): name their topic with --topics if there are any");
      return {};
    }
    if (!topics_.names(**topic) && (*topic)->name != flight_names::velocity) {
      report_.notes.push_back(
          fmt::format("{}: taken as the velocities of the GNSS (east, north, up)", (*topic)->name));
    }
    std::vector<StatedVelocity> stated;
    const Status status =
        for_each(**topic, [&](std::string_view bytes, MessageEncoding encoding, Time time) -> Status {
          const auto twist = read_twist((*topic)->type, bytes, encoding);
          if (!twist) return twist.error();
          if (!twist->vector.head<2>().allFinite()) return Error{"a value is not finite"};
          const auto& c = twist->covariance;
          stated.push_back({time, twist->vector, {c[0], c[7], c[14]}});
          return {};
        });
    if (!status) return status;
    log_.gnss.velocities = complete(stated, (*topic)->name, report_.notes);
    return {};
  }

  /// By its name, or since it is in the frame of the fixes where that is the antenna's own.
  bool of_receiver(const Topic& topic) {
    for (const std::string_view part : {"gps", "gnss"}) {
      if (topic.name.find(part) != std::string::npos) return true;
    }
    if (has_word(topic.name, "fix")) return true;
    if (antenna_frame_.empty() || antenna_frame_ == imu_frame_ || is_called_vehicle(antenna_frame_))
      return false;
    const auto bytes = recording_.read(topic.messages.front());
    if (!bytes) return false;
    const auto header = read_header(*bytes, *message_encoding(topic.encoding));
    return header && frame_name(header->frame) == antenna_frame_;
  }

  Status read_field() {
    const auto topic = find({"sensor_msgs/MagneticField"}, "magnetometers");
    if (!topic) return topic.error();
    if (*topic == nullptr) return {};
    constexpr double kSigma = 0.05;  // as parse_magnetometer has it
    constexpr double kGaussPerTesla = 1e4;
    std::string frame;
    const Status status =
        for_each(**topic, [&](std::string_view bytes, MessageEncoding encoding, Time time) -> Status {
          const auto field = read_magnetic_field(bytes, encoding);
          if (!field) return field.error();
          if (!field->vector.allFinite() || field->vector.isZero(0)) return Error{"found no field"};
          frame = frame_name(field->header.frame);
          log_.magnetometer.push_back({time, kGaussPerTesla * field->vector, kSigma});
          return {};
        });
    if (!status || frame.empty() || frame == imu_frame_ || log_.magnetometer.empty()) return status;
    const auto mounting = frames_.fixed(imu_frame_, frame);
    if (mounting) {
      for (MagneticField& sample : log_.magnetometer) sample.field = mounting->rotation * sample.field;
    } else if (!imu_frame_.empty()) {
      report_.notes.push_back(
          fmt::format("{}: is of the frame {}, and no transform says how that sits on the IMU's ({}): taken "
                      "as if its axes were the same",
                      (*topic)->name, in_quotes(frame), in_quotes(imu_frame_)));
    }
    return {};
  }

  Status read_heights() {
    const auto topic = find({"sensor_msgs/FluidPressure"}, "barometers");
    if (!topic) return topic.error();
    if (*topic == nullptr) return {};
    constexpr double kSigma = 0.3;  // m, as parse_barometer has it
    return for_each(**topic, [&](std::string_view bytes, MessageEncoding encoding, Time time) -> Status {
      const auto pressure = read_pressure(bytes, encoding);
      if (!pressure) return pressure.error();
      if (!(pressure->pascal > 1e4 && pressure->pascal < 1.2e5))
        return Error{fmt::format("found {} Pa, expected the pressure of the air", pressure->pascal)};
      log_.barometer.push_back({time, height_of_pressure(0.01 * pressure->pascal), kSigma});
      return {};
    });
  }

  /// Where the antenna sits, if a transform says so.
  void read_lever_arm() {
    if (imu_frame_ == antenna_frame_ || imu_frame_.empty()) return;
    if (const auto antenna = frames_.fixed(imu_frame_, antenna_frame_))
      log_.gnss.lever_arm = antenna->translation;
  }

  const Recording& recording_;
  TopicChoice topics_;
  bool some_;  // what is there is enough
  RecordedFrames frames_;
  std::vector<std::string> sources_;
  NavigationLog log_;
  ReadReport report_;
  std::string imu_frame_, antenna_frame_;
};

}  // namespace

Result<NavigationLog> read_recording_sensors(const std::filesystem::path& file, std::string_view topics) {
  const auto recording = Recording::open(file);
  if (!recording) return recording.error();
  auto sensors = SensorReader(*recording, topics, false).read();
  if (!sensors) return sensors.error();
  return std::move(sensors->log);
}

Result<RecordedSensors> read_some_sensors(const std::filesystem::path& file, std::string_view topics) {
  const auto recording = Recording::open(file);
  if (!recording) return recording.error();
  return SensorReader(*recording, topics, true).read();
}

}  // namespace pade::io
