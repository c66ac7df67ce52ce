// Navigation sensors out of a recording of ROS.
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "pade/io/navigation/geodetic_fixes.hpp"
#include "pade/io/navigation/navigation_log.hpp"
#include "pade/io/recording/flight/recorded_frames.hpp"
#include "pade/io/recording/flight/recorded_images.hpp"
#include "pade/io/recording/flight/topic_choice.hpp"
#include "pade/io/recording/messages/messages.hpp"

namespace pade::io {
namespace {

/// Reads the sensors of one recording.
class SensorReader {
 public:
  SensorReader(const Recording& recording, std::string_view topics)
      : recording_(recording), topics_(topics) {}

  Result<NavigationLog> read() {
    if (Status known = topics_.check(recording_); !known) return known.error();
    log_.remarks = recording_.remarks();
    for (const auto& step : {&SensorReader::read_imu, &SensorReader::read_fixes, &SensorReader::read_field,
                             &SensorReader::read_heights}) {
      if (Status status = std::invoke(step, this); !status) return status.error();
    }
    if (Status status = read_lever_arm(); !status) return status.error();
    for (const Skipped& entry : report_.skipped) log_.remarks.push_back(entry.file + ": " + entry.reason);
    log_.remarks.insert(log_.remarks.end(), report_.notes.begin(), report_.notes.end());
    return std::move(log_);
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

  /// Calls `take` with the bytes of each message and the time when it was measured; what it cannot read is
  /// skipped.
  Status for_each(const Topic& topic,
                  const std::function<Status(std::string_view, MessageEncoding, Time)>& take) {
    const auto stamps = stamps_of(recording_, topic, report_);
    if (!stamps) return stamps.error();
    const MessageEncoding encoding = *message_encoding(topic.encoding);
    for (std::size_t i = 0; i < topic.messages.size(); ++i) {
      const auto bytes = recording_.read(topic.messages[i]);
      if (!bytes) return bytes.error();
      const Status taken = take(*bytes, encoding, (*stamps)[i]);
      if (!taken) report_.skip(topic.name, fmt::format("message {}: {}", i + 1, taken.error().message));
    }
    return {};
  }

  Status read_imu() {
    const auto topic = find({"sensor_msgs/Imu"}, "IMUs");
    if (!topic) return topic.error();
    if (*topic == nullptr) return missing("IMU", "sensor_msgs/Imu");
    const Status status =
        for_each(**topic, [&](std::string_view bytes, MessageEncoding encoding, Time time) -> Status {
          const auto imu = read_imu_message(bytes, encoding);
          if (!imu) return imu.error();
          if (!imu->angular_rate.allFinite() || !imu->specific_force.allFinite())
            return Error{"a value is not finite"};
          imu_frame_ = frame_name(imu->header.frame);
          log_.imu.push_back({time, imu->angular_rate, imu->specific_force});
          return {};
        });
    if (!status) return status;
    return log_.imu.empty() ? Status(missing("IMU", "usable sensor_msgs/Imu")) : Status();
  }

  Status read_fixes() {
    const auto topic = find({"sensor_msgs/NavSatFix"}, "GNSS positions");
    if (!topic) return topic.error();
    if (*topic == nullptr) return missing("GNSS", "sensor_msgs/NavSatFix");
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
          if (message->covariance_kind != 0) {
            fix.horizontal = std::sqrt(0.5 * (message->covariance[0] + message->covariance[4]));
            fix.vertical = std::sqrt(message->covariance[8]);
          }
          fixes.push_back(fix);
          return {};
        });
    if (!status) return status;
    if (without > 0)
      report_.notes.push_back(
          fmt::format("{}: {} messages without a fix are left out", (*topic)->name, without));
    if (fixes.empty()) return missing("GNSS", "sensor_msgs/NavSatFix with a fix");
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
          "gnss or fix): "
          "name their topic with --topics if there are any");
      return {};
    }
    const GnssDefaults defaults;
    return for_each(**topic, [&](std::string_view bytes, MessageEncoding encoding, Time time) -> Status {
      const auto twist = read_twist((*topic)->type, bytes, encoding);
      if (!twist) return twist.error();
      if (!twist->vector.allFinite()) return Error{"a value is not finite"};
      Eigen::Vector3d variance(twist->covariance[0], twist->covariance[7], twist->covariance[14]);
      if (!(variance.minCoeff() > 0) || !variance.allFinite()) {
        variance = Eigen::Vector3d(defaults.velocity_horizontal, defaults.velocity_horizontal,
                                   defaults.velocity_vertical)
                       .cwiseAbs2();
      }
      log_.gnss.velocities.push_back({time, twist->vector, variance.asDiagonal()});
      return {};
    });
  }

  bool of_receiver(const Topic& topic) {
    for (const std::string_view part : {"gps", "gnss", "fix"}) {
      if (topic.name.find(part) != std::string::npos) return true;
    }
    const auto bytes = recording_.read(topic.messages.front());
    if (!bytes) return false;
    const auto header = read_header(*bytes, *message_encoding(topic.encoding));
    return header && !antenna_frame_.empty() && frame_name(header->frame) == antenna_frame_;
  }

  Status read_field() {
    const auto topic = find({"sensor_msgs/MagneticField"}, "magnetometers");
    if (!topic) return topic.error();
    if (*topic == nullptr) return {};
    constexpr double kSigma = 0.05;  // as parse_magnetometer has it
    constexpr double kGaussPerTesla = 1e4;
    return for_each(**topic, [&](std::string_view bytes, MessageEncoding encoding, Time time) -> Status {
      const auto field = read_magnetic_field(bytes, encoding);
      if (!field) return field.error();
      if (!field->vector.allFinite() || field->vector.isZero(0)) return Error{"found no field"};
      log_.magnetometer.push_back({time, kGaussPerTesla * field->vector, kSigma});
      return {};
    });
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
  Status read_lever_arm() {
    const auto frames = RecordedFrames::read(recording_, report_);
    if (!frames) return frames.error();
    if (imu_frame_ == antenna_frame_) return {};
    if (const auto antenna = frames->fixed(imu_frame_, antenna_frame_))
      log_.gnss.lever_arm = antenna->translation;
    return {};
  }

  const Recording& recording_;
  TopicChoice topics_;
  NavigationLog log_;
  ReadReport report_;
  std::string imu_frame_, antenna_frame_;
};

}  // namespace

Result<NavigationLog> read_recording_sensors(const std::filesystem::path& file, std::string_view topics) {
  const auto recording = Recording::open(file);
  if (!recording) return recording.error();
  return SensorReader(*recording, topics).read();
}

}  // namespace pade::io
