// What became of the frames, and how fast.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <string>

#include "pose_inputs.hpp"

namespace pade_ros {

/// Medians and such of the last values.
class Recent {
 public:
  void add(double value) {
    constexpr std::size_t kMost = 200;
    values_.push_back(value);
    if (values_.size() > kMost) values_.pop_front();
  }
  /// NaN if there is none.
  [[nodiscard]] double quantile(double share) const;

 private:
  std::deque<double> values_;
};

/// Each frame that came counts once: mapped, skipped, dropped, or it still waits.
struct Counts {
  Rate images, infos;
  Rate mapped;                                 ///< with the first of a map, which gives no depth yet
  std::size_t skipped = 0;                     ///< without a pose, or unusable
  std::size_t dropped = 0;                     ///< for newer ones
  std::map<std::string, std::size_t> reasons;  ///< of those skipped
  std::size_t restarts = 0;                    ///< maps begun anew
  std::string last_restart;                    ///< why
  double depth_share = 0;                      ///< of the pixels of the last frame
  double last_depth = -1;                      ///< when a frame gave enough of it, steady seconds
  Recent latency, work;                        ///< s
  std::size_t outside = 0;                     ///< points beyond what a map can hold, which no map has
  std::size_t outside_now = 0;                 ///< of these, of the newest frame
  std::string origin = "0 0 0";                ///< of the map in the world of the poses, m
  std::string stamps;  ///< what the images say of their stamps; empty: nothing is wrong
};

}  // namespace pade_ros
