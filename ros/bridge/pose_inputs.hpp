// Where the camera was: by poses as they come, by transforms, or by our own filter.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <pade/core/pose.hpp>
#include <pade/core/sensors/pose_jumps.hpp>
#include <pade/core/time.hpp>

#include "bridge.hpp"
#include "node_options.hpp"

namespace pade_ros {

/// A pose of the camera, or why there is none.
struct PoseReply {
  enum class Kind : std::uint8_t {
    valid,    ///< there is one
    not_yet,  ///< it may still come
    never,    ///< it will not
  };
  Kind kind = Kind::not_yet;
  pade::Pose T_world_camera;
  pade::Pose T_world_body;  ///< of the filter, of `body_frame`
  std::string body_frame;   ///< whose pose is to be published; empty: nobody's
  std::string why;          ///< unless valid
  std::size_t jumps = 0;    ///< how often the poses have jumped: before and after do not belong together
  std::string last_jump;    ///< why they did
};

/// All functions may be called from any thread.
class PoseInput {
 public:
  PoseInput() = default;
  PoseInput(const PoseInput&) = delete;
  PoseInput& operator=(const PoseInput&) = delete;
  virtual ~PoseInput() = default;

  /// @{
  /// Messages that it does not take change nothing.
  virtual void add(const PoseMessage& /*message*/) {}
  virtual void add(const ImuMessage& /*message*/) {}
  virtual void add(const FixMessage& /*message*/) {}
  virtual void add(const VelocityMessage& /*message*/) {}
  virtual void add(const FieldMessage& /*message*/) {}
  virtual void add(const PressureMessage& /*message*/) {}
  /// @}
  virtual PoseReply at(pade::Time time, const std::string& camera_frame) = 0;
  /// Of the camera's motion between two times; empty where it is not known.
  virtual std::optional<pade::Matrix6d> covariance(pade::Time, pade::Time) { return std::nullopt; }
  /// The time has jumped back: what is much later is of before the jump.
  virtual void clear_after(pade::Time now) = 0;
  /// The world's frame; empty until it is known.
  virtual std::string world() = 0;
  /// What came, what is missing; `now` in seconds of a steady clock.
  virtual Diagnosis diagnose(double now) = 0;
};

/// @param topics  for messages
std::unique_ptr<PoseInput> make_pose_input(const NodeOptions& options, const Topics& topics,
                                           Transforms& transforms);

inline constexpr double kClockWentBack = 1;  ///< where stamps do by more, s

/// Seconds of a steady clock.
double steady_seconds();

/// "the poses jumped by 5.00 m"; @param what  "the poses"
std::string jump_text(const pade::PoseJump& jump, const std::string& what);

/// How often something comes: by the last five seconds.
class Rate {
 public:
  void tick(double now);
  [[nodiscard]] double hertz(double now) const;
  [[nodiscard]] std::size_t count() const { return count_; }
  /// Since the last one; infinite if there was none.
  [[nodiscard]] double silence(double now) const;

 private:
  std::deque<double> recent_;
  std::size_t count_ = 0;
};

inline pade::Pose pose_of(const Placement& p) {
  return {Eigen::Quaterniond(p.xyzw[3], p.xyzw[0], p.xyzw[1], p.xyzw[2]),
          {p.position[0], p.position[1], p.position[2]}};
}
inline Placement placement_of(const pade::Pose& pose) {
  const auto& q = pose.rotation;
  const auto& t = pose.translation;
  return {{t.x(), t.y(), t.z()}, {q.x(), q.y(), q.z(), q.w()}};
}
/// "base_link" of "/base_link", as old programs write it.
std::string frame_name(const std::string& name);

/// How the camera sits on a frame, at a time.
class Mounting {
 public:
  Mounting(const NodeOptions& options, Transforms& transforms);
  /// @param reply  what is missing goes there; its kind is changed only if something is
  /// Empty if it is not known.
  std::optional<pade::Pose> of(const std::string& body, const std::string& camera, pade::Time time,
                               PoseReply& reply);

 private:
  std::optional<pade::Pose> stated_;
  Transforms& transforms_;
};

}  // namespace pade_ros
