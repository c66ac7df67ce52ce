// The frames that the newest one is compared with, and where they stand to each other.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "pade/core/frame.hpp"
#include "pade/core/pose.hpp"

namespace pade {

/// A frame of the recent past, its pose refined.
struct TrackedFrame {
  Frame frame;                                         ///< grey; T_world_camera is the refined one
  Pose given;                                          ///< T_world_camera as it came
  bool corrected = false;                              ///< the two differ
  std::optional<Eigen::Vector3d> rate = std::nullopt;  ///< of turn, camera axes, rad/s; empty: not given
};

/// The last frames, newest last.
class RecentFrames {
 public:
  [[nodiscard]] bool empty() const { return frames_.empty(); }                 ///< none yet
  [[nodiscard]] int size() const { return static_cast<int>(frames_.size()); }  ///< how many there are
  [[nodiscard]] const TrackedFrame& last() const { return frames_.back(); }    ///< not if empty()
  /// @param frames  back from the one to come: 1 = last(). At most size().
  [[nodiscard]] const TrackedFrame& before(int frames) const {
    return frames_[frames_.size() - static_cast<std::size_t>(frames)];
  }
  /// Takes a frame in, and lets go of the oldest.
  /// @param frame  newer than last(). @param most  frames that are kept
  void push(TrackedFrame frame, int most);

  /// Views whose baselines double, the longest one last: how many frames each is back.
  /// @param newest  what they are views of, not yet taken in. @param count  at most so many views. @param
  /// frames  the oldest is at most so old. @param step  only each so many
  [[nodiscard]] std::vector<int> views(const Frame& newest, int count, int frames, int step = 1) const;

  /// Stretches the steps between the frames about the last one.
  /// @param factors  of the steps, oldest first. @param steps  the last so many are a baseline
  /// @return by how much this baseline is longer now.
  double stretch(const std::vector<double>& factors, int steps);

 private:
  std::deque<TrackedFrame> frames_;
};

/// Covariance of a motion over `n` steps like this one: what the images have measured is new in each, the
/// length of the baseline is not.
Matrix6d over_several(const RelativeMotion& one, int n);

}  // namespace pade
