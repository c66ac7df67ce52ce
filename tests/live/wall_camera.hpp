// A camera that flies past a wall, in real time.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include <opencv2/imgproc.hpp>

#include "pade/live/camera/folder_source.hpp"
#include "pade/live/interfaces.hpp"

namespace pade::live {

inline constexpr double kSpeed = 0.6;  // m/s to the right

inline Camera small_camera() {
  Camera camera;
  camera.width = 96;
  camera.height = 64;
  camera.fx = camera.fy = 60;
  camera.cx = 47.5;
  camera.cy = 31.5;
  return camera;
}

inline cv::Mat textured_wall() {
  cv::Mat noise(64, 2000, CV_8UC1);
  cv::RNG random(4);
  random.fill(noise, cv::RNG::UNIFORM, 0, 255);
  cv::Mat wall;
  cv::GaussianBlur(noise, wall, {0, 0}, 1.5);
  cv::normalize(wall, wall, 0, 255, cv::NORM_MINMAX);
  return wall;
}

/// What small_camera() sees of it after so many seconds.
inline cv::Mat image_of_wall(const cv::Mat& wall, double seconds) {
  const double moved = 60 * kSpeed * seconds / 3;  // px
  const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, moved, 0, 1, 0);
  cv::Mat image;
  cv::warpAffine(wall, image, shift, {96, 64}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  return image;
}

/// A textured wall 3 m ahead, past which the camera flies to the right.
class WallCamera : public FrameSource {
 public:
  explicit WallCamera(double rate) : rate_(rate) {}
  Outcome next(LiveFrame& frame, int milliseconds) override {
    const auto due = start_ + std::chrono::duration<double>(count_ / rate_);
    const auto longest = std::chrono::steady_clock::now() + std::chrono::milliseconds(milliseconds);
    std::this_thread::sleep_until(
        std::min(longest, std::chrono::time_point_cast<std::chrono::steady_clock::duration>(due)));
    if (std::chrono::steady_clock::now() < due || stalled) return Outcome::nothing;
    ++count_;
    frame.time = now_of_ours();
    frame.image = image_of_wall(wall_, seconds_between(zero, frame.time));
    frame.time.nanoseconds -= static_cast<std::int64_t>(lag * 1e9);
    ++delivered;
    return Outcome::frame;
  }
  [[nodiscard]] const Camera& camera() const override { return camera_; }
  [[nodiscard]] cv::Mat mask() const override { return {}; }
  [[nodiscard]] double behind() const override { return lag; }
  [[nodiscard]] std::string remark() const override { return stalled ? "somebody stands before it" : ""; }

  std::atomic<bool> stalled{false};
  std::atomic<double> lag{0};  ///< of its times behind ours, s
  std::atomic<std::size_t> delivered{0};
  Time zero = now_of_ours();

 private:
  Camera camera_ = small_camera();
  double rate_;
  int count_ = 0;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  cv::Mat wall_ = textured_wall();
};

}  // namespace pade::live
