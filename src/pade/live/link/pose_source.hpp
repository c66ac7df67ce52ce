// Where poses come from: the autopilot's own estimate, or our filter on its sensors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"
#include "pade/live/autopilot_sensors.hpp"
#include "pade/live/mavlink/frame.hpp"

namespace pade::live {

/// Which of the autopilot's messages say where the vehicle is.
enum class PoseMessages : std::uint8_t {
  estimate,  ///< ATTITUDE_QUATERNION (else ATTITUDE) and LOCAL_POSITION_NED
  odometry,  ///< ODOMETRY in the frame LOCAL_NED
  sensors,   ///< IMU, GNSS, magnetometer and barometer, in our own filter
  dds,       ///< none: a topic of ROS 2 does (DdsPoses)
};

/// A pose, or why there is none.
struct PoseAnswer {
  enum class Kind : std::uint8_t {
    valid,    ///< there is one
    not_yet,  ///< the messages that it lies between have not come
    never,    ///< they will not come any more
  };
  Kind kind = Kind::not_yet;
  Pose T_world_body;      ///< ENU of the autopilot's origin, body FLU; if valid
  std::string_view why;   ///< if never
  std::size_t jumps = 0;  ///< how often poses have jumped: what is before and after does not belong together
};

/// A message that is wanted, and how often it has come.
struct WantedMessage {
  std::uint32_t id = 0;
  double rate = 0;  ///< that is wanted, Hz
  std::size_t come = 0;
};

/// Takes an autopilot's messages, answers with poses. All times are the autopilot's, since its start, unless
/// the poses come from elsewhere.
class PoseSource {
 public:
  PoseSource() = default;
  PoseSource(const PoseSource&) = delete;
  PoseSource& operator=(const PoseSource&) = delete;
  virtual ~PoseSource() = default;

  /// Whether all times are those of our monotonic clock instead.
  [[nodiscard]] virtual bool in_our_time() const { return false; }
  /// How far the newest of those lie behind it nevertheless: MessageClock::behind().
  [[nodiscard]] virtual double behind() const { return 0; }
  /// Whose messages are to come.
  virtual void listen_to(const Autopilot& /*autopilot*/) {}
  /// Messages that say nothing of the pose change nothing.
  virtual void add(const mavlink::Frame& frame) = 0;
  [[nodiscard]] virtual PoseAnswer at(Time time) = 0;
  /// Covariance of the camera's motion between two times, as Frame::motion_covariance has it. Empty where the
  /// source does not know it.
  [[nodiscard]] virtual std::optional<Matrix6d> motion_covariance(Time /*t1*/, Time /*t2*/,
                                                                  const Pose& /*T_body_camera*/) {
    return std::nullopt;
  }
  /// How often poses have jumped: what is before and after does not belong together.
  [[nodiscard]] virtual std::size_t jumps() const = 0;
  /// Of the newest pose that can be answered; the start of time if there is none.
  [[nodiscard]] virtual Time newest() = 0;
  /// How many have come: of the rarest message that each needs, or of the filter's IMU samples.
  [[nodiscard]] virtual std::size_t count() const = 0;
  /// How far the body has turned from a time to now, clockwise seen from above, rad; 0 where that is not
  /// known.
  [[nodiscard]] virtual double turned_since(Time time) = 0;
  /// What the autopilot should send.
  /// @param pose_rate  of poses that it makes itself, Hz
  [[nodiscard]] virtual std::vector<WantedMessage> wanted(double pose_rate) const = 0;
  /// Why there are no poses, in at most 34 characters: "no ATTITUDE"; empty if nothing is missing.
  [[nodiscard]] virtual std::string missing() = 0;
  /// For --check: what has come so far.
  [[nodiscard]] virtual std::string summary() = 0;
};

}  // namespace pade::live

template <>
struct pade::EnumNames<pade::live::PoseMessages> {
  static constexpr std::array names = {
      std::pair{pade::live::PoseMessages::estimate, std::string_view("estimate")},
      std::pair{pade::live::PoseMessages::odometry, std::string_view("odometry")},
      std::pair{pade::live::PoseMessages::sensors, std::string_view("sensors")},
      std::pair{pade::live::PoseMessages::dds, std::string_view("dds")}};
};
