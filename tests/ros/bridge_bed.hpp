// A camera that slides along a textured wall, for a bridge without ROS.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "bridge.hpp"

namespace pade_ros {

inline constexpr int kWidth = 160, kHeight = 120;
inline constexpr double kFocal = 160, kDistance = 2;
inline constexpr Stamp kPeriod = 100'000'000;
inline constexpr Stamp kStart = 1'000'000'000'000;

/// No transforms but those that a test sets.
class NoTransforms : public Transforms {
 public:
  Answer find(const std::string& target, const std::string& source, Stamp stamp, Placement& out,
              std::string& why) override {
    const std::lock_guard lock(mutex);
    if (known && target == "base_link" && source == "camera") {
      out = *known;
      return Answer::valid;
    }
    if (const auto found = others.find({target, source}); found != others.end()) {
      out = found->second(stamp);
      return Answer::valid;
    }
    why = "no transform from " + source + " to " + target;
    return Answer::not_yet;
  }
  void clear() override { ++cleared; }
  void set(const std::string& target, const std::string& source, const Placement& placement) {
    const std::lock_guard lock(mutex);
    others[{target, source}] = [placement](Stamp) { return placement; };
  }
  std::mutex mutex;
  std::optional<Placement> known;
  std::map<std::pair<std::string, std::string>, std::function<Placement(Stamp)>> others;  ///< target, source
  std::atomic<int> cleared{0};
};

/// Keeps what comes.
class Kept : public Sink {
 public:
  Wanted wanted() override { return {true, true, true, true, true, true}; }
  void frame(const FrameResult& result) override {
    const std::lock_guard lock(mutex);
    ++frames;
    last = result;
    middle = result.depth[(kHeight / 2) * kWidth + kWidth / 2];
    path = *result.path;
  }
  void map(const MapResult& result) override {
    const std::lock_guard lock(mutex);
    ++maps;
    newest = result;
  }
  void log(Diagnosis::Level, const std::string& text) override {
    const std::lock_guard lock(mutex);
    said.push_back(text);
  }
  std::mutex mutex;
  int frames = 0, maps = 0;
  float middle = 0;
  FrameResult last;
  std::vector<PathPose> path;
  MapResult newest;
  std::vector<std::string> said;
};

inline cv::Mat wall() {
  cv::RNG chance(7);
  cv::Mat image(kHeight, 2000, CV_8U);
  chance.fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {}, 1.5);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  return image;
}

class RosBridge : public ::testing::Test {
 protected:
  void start(Parameters parameters = {}) {
    Parameters all = {{"velocity_sigma", "0"},      {"rotation_sigma", "0"}, {"max_latency", "0"},
                      {"max_wait_for_pose", "0.2"}, {"map_rate", "20"},      {"mapper.views.count", "0"}};
    all.insert(all.end(), parameters.begin(), parameters.end());
    std::string error;
    bridge_ =
        Bridge::create(all, {"/image", "/camera_info", "/odom", "/imu", "/fix"}, sink_, transforms_, error);
    ASSERT_NE(bridge_, nullptr) << error;
  }
  void calibrate(int width = kWidth, int height = kHeight) {
    CameraInfo info;
    info.width = static_cast<std::uint32_t>(width);
    info.height = static_cast<std::uint32_t>(height);
    info.model = "plumb_bob";
    info.d = {0, 0, 0, 0, 0};
    info.k = {kFocal, 0, 79.5, 0, kFocal, 59.5, 0, 0, 1};
    bridge_->add(info);
  }
  [[nodiscard]] static Stamp stamp(int k) { return kStart + k * kPeriod; }
  void show(int k, const std::string& encoding = "mono8") { show(k, k, encoding); }
  /// @param place  of the camera along the wall, in steps of 5 cm
  void show(int k, int place, const std::string& encoding = "mono8") {
    static const cv::Mat all = wall();
    // 5 cm to the right move what is 2 m away by 4 pixels to the left.
    auto pixels = std::make_shared<cv::Mat>(all(cv::Rect(4 * place, 0, kWidth, kHeight)).clone());
    Image image;
    image.stamp = stamp(k);
    image.frame = "camera";
    image.width = image.step = kWidth;
    image.height = kHeight;
    image.encoding = encoding;
    image.data = pixels->data;
    image.size = kWidth * kHeight;
    image.owner = pixels;
    bridge_->add(image);
  }
  void place(double k, const std::string& child = "camera") {
    PoseMessage message;
    message.stamp = kStart + static_cast<Stamp>(k * static_cast<double>(kPeriod));
    message.frame = "odom";
    message.child = child;
    message.pose.position = {0.05 * k, 0, 0};
    bridge_->add(message);
  }
  /// @param yaw  about the vertical
  void place_at(double k, const std::array<double, 3>& place, double yaw = 0,
                const std::string& frame = "odom") {
    PoseMessage message;
    message.stamp = kStart + static_cast<Stamp>(k * static_cast<double>(kPeriod));
    message.frame = frame;
    message.child = "camera";
    message.pose.position = place;
    message.pose.xyzw = {0, 0, std::sin(yaw / 2), std::cos(yaw / 2)};
    bridge_->add(message);
  }
  void fly(int from, int to) {
    for (int k = from; k < to; ++k) {
      place(k);
      show(k);
    }
  }
  [[nodiscard]] std::string value(const std::string& part, const std::string& key) {
    for (const Diagnosis& one : bridge_->diagnose()) {
      if (one.name != part) continue;
      for (const auto& [name, text] : one.values)
        if (name == key) return text;
    }
    return "";
  }
  [[nodiscard]] std::string message(const std::string& part) {
    for (const Diagnosis& one : bridge_->diagnose())
      if (one.name == part) return one.message;
    return "";
  }
  /// For a condition, with a generous limit.
  static bool comes(const std::function<bool()>& condition) {
    for (int i = 0; i < 6000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  bool counts(const std::string& key, const std::string& count) {
    return comes([&] { return value("camera", key) == count; });
  }

  NoTransforms transforms_;
  Kept sink_;
  std::unique_ptr<Bridge> bridge_;
};

}  // namespace pade_ros
