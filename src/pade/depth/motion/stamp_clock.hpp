// Time between the stamps of images and those of poses, from rotations alone (docs/method.md, "Stamps").
#pragma once

#include <deque>
#include <optional>

#include <Eigen/Core>

#include "pade/core/health.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/time.hpp"

namespace pade::depth {

/// Compares how far poses and images disagree about the rotation between frames with how fast that rotation
/// changes. If the images' stamps want t added to them, the rotation R from one frame to the next, as the
/// poses have it at the stamps, lacks exp(-t (w' - R w)), with w and w' the rates of turn at its ends: a
/// camera that turns evenly shows nothing, one that starts or stops to turn shows t. Rates are central
/// differences of the poses. Robust over the last pairs: a mover that fills the view, or a wrong match, does
/// not count.
class StampClock {
 public:
  /// Whether the camera turns unevenly up to this frame, so that what the images say of it is worth to find
  /// out.
  [[nodiscard]] bool is_telling(Time stamp, const Pose& T_world_camera,
                                const std::optional<Eigen::Vector3d>& rate) const;

  /// The next frame.
  /// @param stamp  later than that of the last one. @param T_world_camera  as given for it
  /// @param rate  of turn at the stamp, camera axes, rad/s; empty = central differences of the poses, which
  /// flatten what changes faster
  /// @param turn  RefinedMotion::turn of the motion from the last frame, this one as reference. @param gain
  /// RefinedMotion::turn_gain; zero if nothing is known
  void add(Time stamp, const Pose& T_world_camera, const std::optional<Eigen::Vector3d>& rate,
           const Eigen::Vector3d& turn, const Eigen::Matrix3d& gain);

  /// Nothing before counts any more: frames are missing, or their stamps are corrected from now on.
  void clear();

  /// Empty if the camera has not turned unevenly enough to tell 0.01 s.
  [[nodiscard]] std::optional<StampOffset> found() const;

 private:
  struct Turned {
    Time stamp;
    Eigen::Quaterniond R_world_camera;
    std::optional<Eigen::Vector3d> rate;
    Eigen::Vector3d turn;
    Eigen::Matrix3d gain;
  };
  /// One component of the turn of one pair: what the images ask for, and what a second would explain.
  struct Sample {
    double asked, per_second;
  };
  std::deque<Turned> frames_;   // the last four
  std::deque<Sample> samples_;  // three a pair
};

}  // namespace pade::depth
