// Poses from the autopilot's own estimate, at any time between its messages.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string_view>
#include <utility>

#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"
#include "pade/live/mavlink/frame.hpp"

namespace pade::live {

/// Which of its messages say where the vehicle is.
enum class PoseMessages : std::uint8_t {
  estimate,  ///< ATTITUDE_QUATERNION (else ATTITUDE) and LOCAL_POSITION_NED
  odometry,  ///< ODOMETRY in the frame LOCAL_NED
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

/// Keeps the last seconds of it. All times are the autopilot's, since its start.
class AutopilotPoses {
 public:
  explicit AutopilotPoses(PoseMessages messages) : messages_(messages) {}

  /// A message of the autopilot; others than those of poses change nothing.
  void add(const mavlink::Frame& frame);
  /// Between two messages: rotation and position each on their straight way from the one before to the one
  /// after. No pose is extrapolated, and none comes from messages more than 0.25 s apart.
  [[nodiscard]] PoseAnswer at(Time time) const;
  /// How often the estimate has jumped: as it says itself (reset counter of ODOMETRY), since its clock was
  /// set back, or because a step or turn is not what its own velocity and rates say. Poses before are
  /// forgotten.
  [[nodiscard]] std::size_t jumps() const { return jumps_; }
  [[nodiscard]] std::size_t attitudes() const { return attitudes_come_; }  ///< that came
  [[nodiscard]] std::size_t positions() const { return positions_come_; }  ///< that came
  /// How far the body has turned from a time to the newest attitude, clockwise seen from above, rad; 0 where
  /// that is not known.
  [[nodiscard]] double turned_since(Time time) const;
  /// Of the newest pose that can be answered; the start of time if there is none.
  [[nodiscard]] Time newest() const;

 private:
  template <class Value>
  struct Sample {
    Time time;
    Value value;
  };
  using Attitudes = std::deque<Sample<Eigen::Quaterniond>>;
  using Positions = std::deque<Sample<Eigen::Vector3d>>;

  template <class Samples, class Value>
  bool push(Samples& samples, Time time, const Value& value);
  void add_attitude(Time time, const Eigen::Quaterniond& q_ned_frd, double rate);
  void add_position(Time time, const Eigen::Vector3d& ned, const Eigen::Vector3d& velocity_ned);
  void add_odometry(const mavlink::Frame& frame);
  void jump();

  PoseMessages messages_;
  Attitudes attitudes_;
  Positions positions_;
  bool quaternions_ = false;                            // came: the angles are not needed
  int reset_counter_ = -1;                              // of ODOMETRY; -1: none yet
  double rate_ = 0;                                     // of the newest attitude, rad/s; NaN: not known
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();  // of the newest position, ENU, m/s; NaN: not known
  std::size_t jumps_ = 0;
  std::size_t attitudes_come_ = 0;
  std::size_t positions_come_ = 0;
};

}  // namespace pade::live

template <>
struct pade::EnumNames<pade::live::PoseMessages> {
  static constexpr std::array names = {
      std::pair{pade::live::PoseMessages::estimate, std::string_view("estimate")},
      std::pair{pade::live::PoseMessages::odometry, std::string_view("odometry")}};
};
