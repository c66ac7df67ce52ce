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
  Pose since;                                          ///< `given` of the first frame with this very image
  bool corrected = false;                              ///< the two differ
  std::optional<Eigen::Vector3d> rate = std::nullopt;  ///< of turn, camera axes, rad/s; empty: not given
  /// Its own motion, refined: of its partner, seen from it. Empty: it had none.
  std::optional<RelativeMotion> motion = std::nullopt;
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
  /// @param variance  of the logarithm of their lengths from now on, common to all
  /// @return by how much this baseline is longer now.
  double stretch(const std::vector<double>& factors, int steps, double variance);

  /// Covariance of the motion from before(frames) to the newest frame, over the steps between: what the
  /// images have measured is new in each, the error of their lengths is not. Each step counts with its own
  /// length and its own covariance.
  /// @param newest  not yet taken in. @param first  its motion, of before(step) seen from it. @param frames
  /// at most size(). @param step  frames of a pair
  /// @return in the axes of the newest one
  [[nodiscard]] Matrix6d covariance(const Frame& newest, const RelativeMotion& first, int frames,
                                    int step) const;

 private:
  std::deque<TrackedFrame> frames_;
};

}  // namespace pade
