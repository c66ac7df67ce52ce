// The way of a vehicle in at most a thousand poses, however long it is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pade/io/recording/messages/display_messages.hpp"

namespace pade::live {

/// One thread.
class ThinnedPath {
 public:
  /// Kept if it is far enough from the last one that was.
  void add(const io::PathPose& pose) {
    if (!poses_.empty() && (pose.pose.translation - poses_.back().pose.translation).norm() < spacing_) return;
    poses_.push_back(pose);
    ++version_;
    if (poses_.size() < kMost) return;
    spacing_ *= 2;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < poses_.size(); i += 2) poses_[kept++] = poses_[i];
    poses_.resize(kept);
  }
  void begin_anew() {
    poses_.clear();
    spacing_ = kSpacing;
    ++version_;
  }
  [[nodiscard]] const std::vector<io::PathPose>& poses() const { return poses_; }
  /// Goes up with each change.
  [[nodiscard]] std::uint64_t version() const { return version_; }

 private:
  static constexpr std::size_t kMost = 1000;
  static constexpr double kSpacing = 0.1;  // m, at first
  std::vector<io::PathPose> poses_;
  double spacing_ = kSpacing;
  std::uint64_t version_ = 0;
};

}  // namespace pade::live
