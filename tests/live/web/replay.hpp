// A recorded flight as a camera and as an autopilot's poses, to and fro without end.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "pade/io/sequence/sequence.hpp"
#include "pade/live/camera/folder_source.hpp"
#include "pade/live/interfaces.hpp"

namespace pade::live {

/// Its frames at a steady rate, with their poses between them.
class ReplayedFlight : public FrameSource {
 public:
  ReplayedFlight(const io::Sequence& sequence, double rate) : camera_(sequence.camera()), rate_(rate) {
    for (std::size_t i = 0; i < sequence.size(); ++i) {
      const auto frame = sequence.frame(i);
      if (frame) frames_.push_back(*frame);
    }
  }
  Outcome next(LiveFrame& frame, int milliseconds) override {
    const double due = static_cast<double>(count_) / rate_;
    const double wait = std::min(due - seconds_between(start_, now_of_ours()), 1e-3 * milliseconds);
    if (wait > 0) std::this_thread::sleep_for(std::chrono::duration<double>(wait));
    if (seconds_between(start_, now_of_ours()) < due) return Outcome::nothing;
    const std::size_t i = index_of(count_++);
    if (stalled) return Outcome::nothing;
    frame = {frames_[i].image, {start_.nanoseconds + static_cast<std::int64_t>(due * 1e9)}};
    return Outcome::frame;
  }
  [[nodiscard]] const Camera& camera() const override { return camera_; }
  [[nodiscard]] cv::Mat mask() const override { return {}; }

  /// Of the camera.
  [[nodiscard]] Pose pose_at(Time time) const {
    const double at = std::max(0.0, seconds_between(start_, time) * rate_);
    const auto before = static_cast<std::size_t>(at);
    const double share = at - static_cast<double>(before);
    const Pose& a = frames_[index_of(before)].T_world_camera;
    const Pose& b = frames_[index_of(before + 1)].T_world_camera;
    Pose pose;
    pose.rotation = a.rotation.slerp(share, b.rotation);
    pose.translation = (1 - share) * a.translation + share * b.translation;
    return pose;
  }
  [[nodiscard]] Time start() const { return start_; }

  std::atomic<bool> stalled{false};

 private:
  [[nodiscard]] std::size_t index_of(std::size_t count) const {
    const std::size_t last = frames_.size() - 1;
    const std::size_t i = count % (2 * last);
    return i <= last ? i : 2 * last - i;
  }

  Camera camera_;
  double rate_;
  std::vector<Frame> frames_;
  std::size_t count_ = 0;
  Time start_ = now_of_ours();
};

}  // namespace pade::live
