// Poses from our own filter, fed with what the autopilot says of its sensors.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"
#include "pade/live/autopilot_sensors.hpp"
#include "pade/live/link/pose_source.hpp"
#include "pade/navigation/navigator.hpp"

namespace pade::live {

/// Why there is no pose yet of a vehicle at rest without a magnetometer: only motion shows where its nose
/// points.
inline constexpr std::string_view heading_unknown = "the heading is not known yet";

/// The GPS/INS filter on IMU, GNSS, magnetometer and barometer of an autopilot's messages (SensorGatherer
/// says which). The world is east, north, up of the first fix. All times are the autopilot's, since its
/// start.
class FilteredPoses : public PoseSource {
 public:
  /// @param options  that check() accepts
  explicit FilteredPoses(const navigation::NavigatorOptions& options)
      : options_(options), navigator_(options) {}

  /// Whose messages are to come. Another one than before begins anew.
  void listen_to(const Autopilot& autopilot) override;
  /// A message of the autopilot. Where its clock goes back by more than a second, or the filter starts anew,
  /// all begins anew and counts as a jump.
  void add(const mavlink::Frame& frame) override;

  /// By the filter's smooth pose, which no correction makes jump.
  [[nodiscard]] PoseAnswer at(Time time) override;
  [[nodiscard]] std::optional<Matrix6d> motion_covariance(Time t1, Time t2,
                                                          const Pose& T_body_camera) override;
  [[nodiscard]] std::size_t jumps() const override { return jumps_; }
  [[nodiscard]] Time newest() override;
  [[nodiscard]] double turned_since(Time time) override;
  [[nodiscard]] std::vector<WantedMessage> wanted(double pose_rate) const override;
  [[nodiscard]] std::size_t count() const override { return imu_samples_; }
  [[nodiscard]] std::size_t fixes() const { return fixes_; }
  /// By the last two seconds, Hz.
  [[nodiscard]] double imu_rate() const;
  /// "no IMU message", "the IMU is slower than 20 Hz", "no GNSS fix", "the filter is starting",
  /// `heading_unknown`, "the filter is lost".
  [[nodiscard]] std::string missing() override;
  [[nodiscard]] std::string summary() override;
  [[nodiscard]] navigation::Health health() { return navigator_.health(); }
  /// What had to be assumed of the sensors, one sentence each.
  [[nodiscard]] const std::vector<std::string>& remarks() const { return remarks_; }

 private:
  void begin_anew();
  void add_fixes(std::vector<io::GeodeticFix> fixes);

  navigation::NavigatorOptions options_;
  navigation::Navigator navigator_;
  std::optional<Autopilot> autopilot_;
  std::optional<SensorGatherer> sensors_;
  std::optional<io::GeodeticFix> origin_;
  std::vector<Time> recent_;  // IMU samples of the last two seconds
  std::vector<std::string> remarks_;
  std::size_t imu_samples_ = 0;
  std::size_t fixes_ = 0;
  std::size_t heights_ = 0;
  std::size_t jumps_ = 0;
  std::uint64_t restarts_ = 0;  // of the filter, that have counted as jumps
};

}  // namespace pade::live
