// Poses from the autopilot's own estimate, at any time between its messages.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"
#include "pade/live/link/pose_source.hpp"
#include "pade/live/mavlink/frame.hpp"

namespace pade::live {

/// Keeps the last seconds of it. All times are the autopilot's, since its start.
class AutopilotPoses : public PoseSource {
 public:
  explicit AutopilotPoses(PoseMessages messages) : messages_(messages) {}

  /// Another one than before is a jump.
  void listen_to(const Autopilot& autopilot) override;
  /// A message of the autopilot; others than those of poses change nothing.
  void add(const mavlink::Frame& frame) override;
  /// Between two messages: rotation and position each on their straight way from the one before to the one
  /// after. No pose is extrapolated, and none comes from messages more than 0.25 s apart.
  [[nodiscard]] PoseAnswer at(Time time) override;
  /// How often the estimate has jumped: as it says itself (reset counter of ODOMETRY), since its clock was
  /// set back, because a step or turn is not what its own velocity and rates say, over a gap in its messages
  /// not what a vehicle can do in that time, or because there was none for two seconds: estimates are set
  /// anew in gaps. ODOMETRY has its counter for all that. Poses before are forgotten.
  [[nodiscard]] std::size_t jumps() const override { return jumps_; }
  [[nodiscard]] std::size_t count() const override { return std::min(attitudes_come_, positions_come_); }
  [[nodiscard]] std::size_t attitudes() const { return attitudes_come_; }  ///< that came
  [[nodiscard]] std::size_t positions() const { return positions_come_; }  ///< that came
  /// How far the body has turned from a time to the newest attitude, clockwise seen from above, rad; 0 where
  /// that is not known.
  [[nodiscard]] double turned_since(Time time) override;
  /// Of the newest pose that can be answered; the start of time if there is none.
  [[nodiscard]] Time newest() override;
  [[nodiscard]] std::vector<WantedMessage> wanted(double pose_rate) const override;
  /// The message that has not come, or that has stopped while the other goes on.
  [[nodiscard]] std::string missing() override;
  [[nodiscard]] std::string summary() override;

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
  std::optional<Autopilot> autopilot_;
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
